#include "render/transport/coat.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>
#include <vector>

#include "render/base/status.h"
#include "render/transport/bsdf.h"
#include "render/transport/microfacet.h"

namespace lucerna {
namespace {

// Strata of each of the two numbers that choose a facet, and of the angle at the base.
constexpr int kFacets = 24;
constexpr int kAngles = 32;
// Where the coat is smooth, one number is all that is averaged over.
constexpr int kSmoothAngles = 4096;
// Azimuths of an anisotropic coat, over a quarter of a turn, both ends among them.
constexpr int kAzimuths = 9;

float Crossing(float thickness, float cosine) {
  return thickness > 0 ? std::exp(-thickness / std::max(cosine, 1e-6F)) : 1.0F;
}

Vec3 DirectionAt(float cosine, float azimuth) {
  const float sine = std::sqrt(std::max(0.0F, 1 - cosine * cosine));
  return {sine * std::cos(azimuth), sine * std::sin(azimuth), cosine};
}

// Averages over the facets that are seen from `w`: visit(m) for each.
template <typename Visit>
float MeanOverFacets(const Ggx& ggx, Vec3 w, const Visit& visit) {
  double sum = 0;
  for (int i = 0; i < kFacets; ++i) {
    for (int j = 0; j < kFacets; ++j) {
      const float u1 = (static_cast<float>(i) + 0.5F) / kFacets;
      const float u2 = (static_cast<float>(j) + 0.5F) / kFacets;
      const Vec3 m = ggx.SampleVisible(w, u1, u2);
      if (Dot(w, m) > 0) sum += static_cast<double>(visit(m));
    }
  }
  return static_cast<float>(sum / (kFacets * kFacets));
}

float SmoothEntering(float cosine, float ior, float thickness) {
  float cos_t = 0;
  const float reflected = FresnelDielectric(cosine, ior, cos_t);
  return reflected < 1 ? (1 - reflected) * Crossing(thickness, cos_t) : 0.0F;
}

float RoughEntering(const Ggx& ggx, Vec3 w, float ior, float thickness) {
  const float visible = ggx.G1(w);
  return MeanOverFacets(ggx, w, [&](Vec3 m) {
    const float cos_m = Dot(w, m);
    float cos_t = 0;
    const float reflected = FresnelDielectric(cos_m, ior, cos_t);
    const Vec3 inside = w * (-1 / ior) + m * (cos_m / ior - cos_t);
    if (!(reflected < 1) || !(inside.z < 0)) return 0.0F;
    return (1 - reflected) * ggx.G2(w, -inside) / visible * Crossing(thickness, -inside.z);
  });
}

// Of light that goes up from the base: the share that the coat's surface sends down to it.
float RoughReturned(const Ggx& ggx, Vec3 w, float ior, float thickness) {
  const float visible = ggx.G1(w);
  return Crossing(thickness, w.z) * MeanOverFacets(ggx, w, [&](Vec3 m) {
           float cos_t = 0;
           const float reflected = FresnelDielectric(Dot(w, m), 1 / ior, cos_t);
           const Vec3 down = ReflectAt(w, m);
           if (!(down.z > 0)) return 0.0F;
           return reflected * ggx.G2(w, down) / visible * Crossing(thickness, down.z);
         });
}

// Means over directions that leave a diffuse surface: of(cosine), whose density is 2 cosine.
template <typename Function>
float MeanOverBase(int angles, const Function& of) {
  double sum = 0;
  for (int i = 0; i < angles; ++i) {
    sum += static_cast<double>(
        of(std::sqrt((static_cast<float>(i) + 0.5F) / static_cast<float>(angles))));
  }
  return static_cast<float>(sum / angles);
}

std::shared_ptr<const CoatTable> MakeTable(const MaterialNumbers& material) {
  const auto table = std::make_shared<CoatTable>();
  const float ior = material.ior;
  const float thickness = material.thickness;
  if (HasNoFacets(material)) {
    table->inner = MeanOverBase(kSmoothAngles, [&](float cosine) {
      float cos_t = 0;
      return FresnelDielectric(cosine, 1 / ior, cos_t) * Square(Crossing(thickness, cosine));
    });
    // By reciprocity, what leaves is what enters over the square of the index.
    table->leaving =
        MeanOverBase(kSmoothAngles,
                     [&](float cosine) { return SmoothEntering(cosine, ior, thickness); }) /
        Square(ior);
    return table;
  }
  const Ggx ggx(material);
  table->rows = material.alpha_u == material.alpha_v ? 1 : kAzimuths;
  float sum_of_weights = 0;
  for (int row = 0; row < table->rows; ++row) {
    const float azimuth =
        table->rows == 1 ? 0
                         : 0.5F * kPi * static_cast<float>(row) / static_cast<float>(kAzimuths - 1);
    for (int i = 0; i < CoatTable::kCosines; ++i) {
      const float cosine = Square(static_cast<float>(i) / (CoatTable::kCosines - 1));
      const Vec3 w = DirectionAt(cosine, azimuth);
      table->entering.push_back(i == 0 ? 0.0F
                                       : std::min(1.0F, RoughEntering(ggx, w, ior, thickness)));
    }
    // The trapezoidal rule, exact for the first harmonics.
    const bool is_end = table->rows > 1 && (row == 0 || row == table->rows - 1);
    const float weight = is_end ? 0.5F : 1.0F;
    sum_of_weights += weight;
    table->inner += weight * MeanOverBase(kAngles, [&](float cosine) {
                      return RoughReturned(ggx, DirectionAt(cosine, azimuth), ior, thickness);
                    });
    table->leaving += weight * MeanOverBase(kAngles, [&](float cosine) {
                        return RoughEntering(ggx, DirectionAt(cosine, azimuth), ior, thickness);
                      });
  }
  table->inner /= sum_of_weights;
  table->leaving /= sum_of_weights * Square(ior);
  return table;
}

}  // namespace

void PrepareCoats(std::vector<Material>& materials) {
  std::map<std::tuple<float, float, float, float>, std::shared_ptr<const CoatTable>> tables;
  for (Material& material : materials) {
    if (material.kind != Material::Kind::kCoatedDiffuse) continue;
    auto& table = tables[{material.ior, material.thickness, material.alpha_u, material.alpha_v}];
    if (table == nullptr) table = MakeTable(material);
    material.owned_coat = table;
    material.coat = table.get();
  }
}

float CoatEntering(const Material& material, Vec3 w) {
  if (HasNoFacets(material)) return SmoothEntering(w.z, material.ior, material.thickness);
  LUCERNA_CHECK(material.coat != nullptr);
  const CoatTable& table = *material.coat;
  constexpr int kLast = CoatTable::kCosines - 1;
  const float node = std::sqrt(std::clamp(w.z, 0.0F, 1.0F)) * kLast;
  const int below = std::min(static_cast<int>(node), kLast - 1);
  const float share = node - static_cast<float>(below);
  const auto at = [&](int row) {
    const std::size_t i =
        static_cast<std::size_t>(row) * CoatTable::kCosines + static_cast<std::size_t>(below);
    return table.entering[i] * (1 - share) + table.entering[i + 1] * share;
  };
  if (table.rows == 1) return at(0);
  const float azimuth = std::atan2(std::abs(w.y), std::abs(w.x));
  const float place = azimuth / (0.5F * kPi) * static_cast<float>(table.rows - 1);
  const int row = std::min(static_cast<int>(place), table.rows - 2);
  const float next = place - static_cast<float>(row);
  return at(row) * (1 - next) + at(row + 1) * next;
}

float CoatInner(const Material& material) {
  LUCERNA_CHECK(material.coat != nullptr);
  return material.coat->inner;
}

float CoatLeaving(const Material& material) {
  LUCERNA_CHECK(material.coat != nullptr);
  return material.coat->leaving;
}

}  // namespace lucerna
