// LightSource "infinite": constant light, or an environment map; either may come through a portal.
#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string_view>
#include <utility>

#include "render/base/text.h"
#include "render/formats/pbrt/light_readers.h"
#include "render/formats/pbrt/shapes.h"
#include "render/formats/wavelength_color.h"
#include "render/math/double3.h"
#include "render/math/equal_area_square.h"
#include "render/math/warp.h"

namespace lucerna {
namespace {

// What pbrt-v4 takes for the illuminance [W·m⁻², luminance] of a plane that looks along z of the
// map: it weighs each pixel by half its solid angle, so that a map is twice as bright as a constant
// light of the same "illuminance". Files are made to look right with it.
double IlluminanceOf(const Picture& map) {
  // A pixel of a small map is large, and the horizon runs through some.
  constexpr int kFineSide = 512;
  const int parts = std::max(1, kFineSide / map.width);
  const int side = map.width * parts;
  double sum = 0;
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const Vec3 direction =
          EqualAreaDirection({(static_cast<float>(x) + 0.5F) / static_cast<float>(side),
                              (static_cast<float>(y) + 0.5F) / static_cast<float>(side)});
      if (!(direction.z > 0)) continue;
      sum += static_cast<double>(Luminance(map.At(x / parts, y / parts)) * direction.z);
    }
  }
  return sum * 2 * kPi64 / (static_cast<double>(side) * side);
}

// The rectangle that four points in a row are, in the world and not in the light's own space.
std::optional<Portal> ReadPortal(ParameterList& parameters) {
  static constexpr std::string_view kTypes[] = {"point3", "point"};
  const std::span<const double> numbers = parameters.Numbers("portal", kTypes, 3);
  if (numbers.empty()) return std::nullopt;
  if (numbers.size() != 12) {
    parameters.Error("portal", "needs four points: the corners of a rectangle, one after another");
    return std::nullopt;
  }
  std::array<Double3, 4> corners;
  for (std::size_t i = 0; i < 4; ++i)
    corners[i] = {numbers[3 * i], numbers[3 * i + 1], numbers[3 * i + 2]};
  // As far as pbrt-v4 has it.
  constexpr double kTolerance = 0.001;
  const auto unit = [](Double3 v) { return v * (1 / Length(v)); };
  const Double3 x = corners[3] - corners[0];
  const Double3 y = corners[1] - corners[0];
  const Double3 x_beyond = unit(corners[2] - corners[1]);
  const Double3 y_beyond = unit(corners[2] - corners[3]);
  // Not so for sides without length.
  const bool is_rectangle = Dot(unit(x), x_beyond) > 1 - kTolerance &&
                            Dot(unit(y), y_beyond) > 1 - kTolerance &&
                            std::abs(Dot(unit(x), unit(y))) < kTolerance;
  const Double3 across = y - x * (Dot(x, y) / Dot(x, x));
  const Portal portal = {ToFloat(corners[0]), ToFloat(x), ToFloat(across)};
  const bool has_size = LengthSquared(portal.along_x) > 0 && LengthSquared(portal.along_y) > 0 &&
                        std::isfinite(LengthSquared(portal.along_x)) &&
                        std::isfinite(LengthSquared(portal.along_y));
  if (!is_rectangle || !has_size || !IsFinite(portal.corner)) {
    parameters.Error("portal", "is no rectangle; give its four corners one after another");
    return std::nullopt;
  }
  return portal;
}

// Of a light with a portal pbrt-v4 makes a picture of one pixel, which it does not scale to
// luminance 1: its curve has the unit of the file, and a black body is 1 at its peak.
double LuminanceInPicture(ParameterList& parameters, const GivenSpectrum& spectrum) {
  const Parameter* const emission = parameters.FindWhole("L");
  // Those with a name have luminance 1.
  if (emission == nullptr || !spectrum.is_given() || !emission->strings.empty()) return 1;
  const double luminance = LuminanceOf(*spectrum.curve);
  return emission->type == "blackbody" ? luminance / BlackbodyPeak(emission->numbers[0])
                                       : luminance;
}

void ReadEnvironment(const LightInput& input, double scale, double illuminance,
                     const std::optional<Portal>& portal) {
  ParameterList& parameters = input.parameters;
  if (parameters.Has("L")) {
    parameters.Error("L", "and filename exclude each other; give one or the other");
    parameters.Ignore("L");
  }
  const std::optional<std::string> file = parameters.FindString("filename");
  if (!file.has_value()) return;
  StatusOr<std::shared_ptr<const Picture>> map = input.assets.ReadPicture(*file, {});
  if (!map.ok()) {
    parameters.Error("filename", Concat("cannot be read: ", map.status().message()));
    return;
  }
  if ((*map)->width != (*map)->height) {
    parameters.Error("filename", Concat("has ", (*map)->width, " x ", (*map)->height,
                                        " pixels; an environment is an equal-area map, which is "
                                        "square (pbrt-v4 converts others: imgtool makeequiarea)"));
    return;
  }
  const StatusOr<ShapeAxes> axes = AxesOf(input.to_world);
  if (!axes.ok()) {
    parameters.Error("is stretched by its transform, which is not supported; scale all axes alike");
    return;
  }
  if (illuminance > 0) {
    const double given = IlluminanceOf(**map);
    if (!(given > 0)) {
      parameters.Error("illuminance", "cannot be reached: the upper half of the map is black");
      return;
    }
    scale *= illuminance / given;
  }
  InfiniteLight light;
  light.kind = InfiniteLight::Kind::kEnvironment;
  light.radiance = Gray(static_cast<float>(scale));
  light.axes = *axes;
  // Summed over all pixels in single precision.
  if (!(scale * static_cast<double>((*map)->Largest()) < 1e30)) {
    parameters.Error("is too bright for single precision");
    return;
  }
  light.map = *std::move(map);
  light.portal = portal;
  if (portal) light.kind = InfiniteLight::Kind::kPortal;
  input.scene.infinite_lights.push_back(std::move(light));
}

}  // namespace

void ReadInfiniteLight(const LightInput& input) {
  ParameterList& parameters = input.parameters;
  const std::optional<Portal> portal = ReadPortal(parameters);
  double scale = parameters.Float("scale", 1, kZeroOrMore);
  const double illuminance = parameters.Float("illuminance", -1);
  if (parameters.HasText("filename")) {
    ReadEnvironment(input, scale, illuminance, portal);
    return;
  }
  GivenSpectrum spectrum;
  const Rgb color = parameters.FindEmission("L", &spectrum).value_or(Gray(1));
  // A surface that sees constant radiance L over its hemisphere receives pi L. A light with a
  // portal is a picture of one pixel to pbrt-v4, whose luminance counts, whatever its unit is:
  // above.
  if (illuminance > 0 && portal.has_value()) {
    scale *= illuminance / (2 * kPi64);
    if (Luminance(color) > 0) scale /= static_cast<double>(Luminance(color));
  } else if (illuminance > 0) {
    scale *= illuminance / kPi64;
  } else if (portal.has_value()) {
    scale *= LuminanceInPicture(parameters, spectrum);
  }
  InfiniteLight light;
  light.radiance = ScaledEmission(parameters, color, scale);
  light.portal = portal;
  if (portal) light.kind = InfiniteLight::Kind::kPortal;
  light.spectrum = std::move(spectrum);
  input.scene.infinite_lights.push_back(light);
  WarnIfBlack(parameters, light.radiance);
}

}  // namespace lucerna
