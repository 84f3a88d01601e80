#include "tests/support/measured_file.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <utility>

#include "render/transport/microfacet.h"

namespace lucerna {
namespace {

Vec3 DirectionAt(float theta, float phi) {
  return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

// Of a place in the unit square.
float ThetaAt(float x) {
  return x * x * (kPi / 2);
}
float PhiAt(float y) {
  return (2 * y - 1) * kPi;
}

// Calls value(x, y) for the knots, row by row.
template <typename Value>
void AppendGrid(std::size_t knots, std::vector<float>& grid, const Value& value) {
  const auto last = static_cast<float>(knots - 1);
  for (std::size_t y = 0; y < knots; ++y) {
    for (std::size_t x = 0; x < knots; ++x)
      grid.push_back(value(static_cast<float>(x) / last, static_cast<float>(y) / last));
  }
}

}  // namespace

MeasuredData MeasureMetal(const MetalToMeasure& metal) {
  const Ggx ggx(metal.alpha_u, metal.alpha_v);
  MeasuredData data;
  data.wavelength_nm = metal.wavelength_nm;
  for (std::size_t i = 0; i < metal.phis; ++i) {
    const float share =
        metal.phis > 1 ? static_cast<float>(i) / static_cast<float>(metal.phis - 1) : 0.5F;
    data.phi_rad.push_back(-kPi + 2 * kPi * metal.turn * share);
  }
  // As seen from exactly along the surface, nothing is.
  constexpr float kFlattest = 1.5F;
  for (std::size_t i = 0; i < metal.thetas; ++i) {
    data.theta_rad.push_back(kFlattest * static_cast<float>(i) /
                             static_cast<float>(std::max<std::size_t>(metal.thetas - 1, 1)));
  }
  const GridSize size = {metal.knots, metal.knots};
  data.facets_size = data.projected_size = data.visible_size = data.values_size = size;
  const bool is_isotropic = metal.phis <= 2;
  AppendGrid(metal.knots, data.facets,
             [&](float x, float y) { return ggx.D(DirectionAt(ThetaAt(x), PhiAt(y))); });
  AppendGrid(metal.knots, data.projected, [&](float x, float y) {
    const Vec3 w = DirectionAt(ThetaAt(x), PhiAt(y));
    return 0.5F * (w.z + std::sqrt(w.z * w.z + Square(ggx.au * w.x) + Square(ggx.av * w.y)));
  });
  for (const float phi : data.phi_rad) {
    const float turned = is_isotropic ? phi : 0;
    for (const float theta : data.theta_rad) {
      const Vec3 wo = DirectionAt(theta, phi);
      std::vector<float> visible;
      AppendGrid(metal.knots, visible, [&](float x, float y) {
        const Vec3 m = DirectionAt(ThetaAt(x), PhiAt(y) + turned);
        return ggx.PdfVisible(wo, m) * 2 * kPi * kPi * x * std::sin(ThetaAt(x));
      });
      data.visible.insert(data.visible.end(), visible.begin(), visible.end());
      const BilinearDensities warp(size, visible);
      constexpr GridMixture kOnly = {{0, 0, 0, 0}, {1, 0, 0, 0}};
      std::vector<float> values;
      AppendGrid(metal.knots, values, [&](float x, float y) {
        const Vec2 place = warp.Sample(kOnly, {x, y}).at;
        const Vec3 m = DirectionAt(ThetaAt(place.x), PhiAt(place.y) + turned);
        const Vec3 wi = ReflectAt(wo, m);
        return wi.z > 0 ? ggx.G2(wo, wi) / ggx.G1(wo) : 0.0F;
      });
      data.luminance.insert(data.luminance.end(), values.begin(), values.end());
      for (const float reflectance : metal.reflectance) {
        for (const float value : values)
          data.values.push_back(reflectance * value);
      }
    }
  }
  return data;
}

std::string MeasuredFile(const MeasuredData& data) {
  struct Array {
    std::string name;
    std::uint8_t type;
    std::vector<std::uint64_t> sizes;
    std::string bytes;
  };
  const auto floats = [](std::string name, std::vector<std::uint64_t> sizes,
                         const std::vector<float>& numbers) {
    constexpr std::uint8_t kFloats = 10;
    return Array{
        std::move(name), kFloats, std::move(sizes),
        std::string(reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(float))};
  };
  constexpr std::uint8_t kBytes = 1;
  const std::uint64_t phis = data.phi_rad.size();
  const std::uint64_t thetas = data.theta_rad.size();
  const std::uint64_t wavelengths = data.wavelength_nm.size();
  const GridSize& values = data.values_size;
  const std::vector<Array> arrays = {
      {"description", kBytes, {4}, "GGX."},
      floats("phi_i", {phis}, data.phi_rad),
      floats("theta_i", {thetas}, data.theta_rad),
      floats("ndf", {data.facets_size.height, data.facets_size.width}, data.facets),
      floats("sigma", {data.projected_size.height, data.projected_size.width}, data.projected),
      floats("vndf", {phis, thetas, data.visible_size.height, data.visible_size.width},
             data.visible),
      floats("luminance", {phis, thetas, values.height, values.width}, data.luminance),
      floats("wavelengths", {wavelengths}, data.wavelength_nm),
      floats("spectra", {phis, thetas, wavelengths, values.height, values.width}, data.values),
      {"jacobian", kBytes, {1}, std::string(1, data.is_over_facets ? '\1' : '\0')}};
  const auto put = [](std::string& bytes, auto number) {
    bytes.append(reinterpret_cast<const char*>(&number), sizeof(number));
  };
  std::string bytes("tensor_file\0\1\0", 14);
  put(bytes, static_cast<std::uint32_t>(arrays.size()));
  std::uint64_t offset = bytes.size();
  for (const Array& array : arrays)
    offset += 2 + array.name.size() + 2 + 1 + 8 + 8 * array.sizes.size();
  for (const Array& array : arrays) {
    put(bytes, static_cast<std::uint16_t>(array.name.size()));
    bytes += array.name;
    put(bytes, static_cast<std::uint16_t>(array.sizes.size()));
    put(bytes, array.type);
    put(bytes, offset);
    for (const std::uint64_t size : array.sizes)
      put(bytes, size);
    offset += array.bytes.size();
  }
  for (const Array& array : arrays)
    bytes += array.bytes;
  return bytes;
}

Material MeasuredMaterial(MeasuredData data) {
  Material material;
  material.kind = Material::Kind::kMeasured;
  material.owned_measured = std::make_shared<const MeasuredTable>(std::move(data));
  material.measured = material.owned_measured.get();
  material.measured_planes = material.measured->WorkingSpace();
  material.is_measured_with_direction = material.measured->is_anisotropic();
  return material;
}

}  // namespace lucerna
