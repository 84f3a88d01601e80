#include "render/transport/coat.h"

#include <algorithm>
#include <cmath>

#include "render/base/status.h"
#include "render/transport/bsdf.h"

namespace lucerna {
namespace {

// Of facets by which light is thrown about as by a diffuse surface.
constexpr float kWidestAgain = 2;

// What is read from the table of a coat, or from the two between which it lies.
template <typename Read>
float ReadTable(const Material& material, const Read& read) {
  LUCERNA_CHECK(material.coat != nullptr);
  const float below = read(*material.coat);
  if (material.coat_above == nullptr) return below;
  return below * (1 - material.coat_above_share) +
         read(*material.coat_above) * material.coat_above_share;
}

// The same for each channel, of rows for albedos: read(table, row).
template <typename Read>
Rgb ReadRows(const Material& material, const Read& read) {
  const auto channel = [&](float albedo) {
    return ReadTable(material, [&](const CoatTable& table) {
      if (!material.HasHaze()) return read(table, 0);
      constexpr int kLast = CoatTable::kAlbedos - 1;
      const float place = (1 - std::sqrt(1 - std::clamp(albedo, 0.0F, 1.0F))) * kLast;
      const int below = std::min(static_cast<int>(place), kLast - 1);
      const float share = place - static_cast<float>(below);
      const auto row = static_cast<std::size_t>(below);
      return read(table, row) * (1 - share) + read(table, row + 1) * share;
    });
  };
  const Rgb& albedo = material.coat_albedo;
  const float first = channel(albedo.r);
  if (albedo.g == albedo.r && albedo.b == albedo.r) return Gray(first);
  return {first, channel(albedo.g), channel(albedo.b)};
}

float AtCosine(const std::vector<float>& table, std::size_t row, float cosine) {
  const auto [below, share] = CoatTable::PlaceOf(cosine);
  const float* node = &table[row * CoatTable::kCosines + below];
  return node[0] * (1 - share) + node[1] * share;
}

CoatTable::CosineWeights ReadWeights(const Material& material,
                                     std::vector<CoatTable::CosineWeights> CoatTable::*column,
                                     float cosine) {
  const auto [below, share] = CoatTable::PlaceOf(cosine);
  CoatTable::CosineWeights weights = {};
  for (std::size_t i = 0; i < weights.size(); ++i) {
    weights[i] = ReadTable(material, [&, below = below, share = share](const CoatTable& table) {
      if ((table.*column).empty()) return 0.0F;
      const CoatTable::CosineWeights* const node = &(table.*column)[below];
      return node[0][i] * (1 - share) + node[1][i] * share;
    });
  }
  return weights;
}

float EnteringIn(const CoatTable& table, Vec3 w) {
  const auto [below, share] = CoatTable::PlaceOf(w.z);
  const auto at = [&, below = below, share = share](int row) {
    const std::size_t i = static_cast<std::size_t>(row) * CoatTable::kCosines + below;
    return table.entering[i] * (1 - share) + table.entering[i + 1] * share;
  };
  if (table.rows == 1) return at(0);
  const float azimuth = std::atan2(std::abs(w.y), std::abs(w.x));
  const float place = azimuth / (0.5F * kPi) * static_cast<float>(table.rows - 1);
  const int row = std::min(static_cast<int>(place), table.rows - 2);
  const float next = place - static_cast<float>(row);
  return at(row) * (1 - next) + at(row + 1) * next;
}

}  // namespace

void FitCoat(MaterialNumbers& material) {
  if (material.coats == nullptr) return;
  const CoatFamily& family = *material.coats;
  const auto number = [&] {
    switch (family.differing) {
      // Of a surface that is stretched one way, as of a round one with facets as steep on average.
      case CoatFamily::Differing::kSurface:
        return CoatFamily::SpacingOf(std::sqrt(material.alpha_u * material.alpha_v));
      case CoatFamily::Differing::kBase:
        return CoatFamily::SpacingOf(std::sqrt(material.base_alpha_u * material.base_alpha_v));
      case CoatFamily::Differing::kThickness:
        return -std::expm1(-material.thickness);
    }
    return 0.0F;
  };
  const CoatFamily::Place place = family.PlaceOf(number());
  material.coat = &family.tables[place.below];
  material.coat_above = &family.tables[place.below + 1];
  material.coat_above_share = place.share;
}

float CoatEntering(const Material& material, Vec3 w) {
  const float entering =
      HasNoFacets(material)
          ? SmoothCoatEntering(material, w.z)
          : ReadTable(material, [&](const CoatTable& table) { return EnteringIn(table, w); });
  if (!material.coat_passes_rest) return entering;
  return entering * ReadTable(material, [](const CoatTable& table) { return table.passing; });
}

float CoatInner(const Material& material) {
  return ReadTable(material, [](const CoatTable& table) { return table.inner; });
}

float CoatLeaving(const Material& material) {
  return ReadTable(material, [](const CoatTable& table) { return table.leaving; });
}

Rgb CoatResidual(const Material& material, float cosine) {
  return ReadRows(material, [&](const CoatTable& table, std::size_t row) {
    return AtCosine(table.residual, row, cosine);
  });
}

float CoatAgain(const Material& material, float cosine) {
  return ReadTable(material,
                   [&](const CoatTable& table) { return AtCosine(table.again, 0, cosine); });
}

CoatMeetings CoatMeetingsOf(const Material& material, float cosine) {
  const auto at = [&](std::vector<float> CoatTable::*column) {
    return ReadTable(material,
                     [&](const CoatTable& table) { return AtCosine(table.*column, 0, cosine); });
  };
  return {at(&CoatTable::met_once), at(&CoatTable::goes_on)};
}

CoatTable::CosineWeights CoatResidualCosines(const Material& material, float cosine) {
  return ReadWeights(material, &CoatTable::residual_cosines, cosine);
}

CoatTable::CosineWeights CoatOnceCosines(const Material& material, float cosine) {
  return ReadWeights(material, &CoatTable::once_cosines, cosine);
}

float CoatWidening(const Material& material) {
  return ReadTable(material, [](const CoatTable& table) { return table.widening; });
}

float CoatMeetingsAgain(const Material& material) {
  return ReadTable(material, [](const CoatTable& table) { return table.meetings_again; });
}

Ggx BaseFacets(const Material& material) {
  const float widening = CoatWidening(material);
  return {BaseWidthSeen(material.base_alpha_u, material.alpha_u, material.ior, widening),
          BaseWidthSeen(material.base_alpha_v, material.alpha_v, material.ior, widening)};
}

Ggx AgainFacets(const Material& material) {
  // A meeting of the coat's surface from below turns light as one of a metal of its facets does.
  const float meetings = CoatMeetingsAgain(material);
  const float widening = CoatWidening(material);
  const auto width = [&](float base, float coat) {
    const float once = BaseWidthSeen(base, coat, material.ior, widening);
    return std::min(std::sqrt(once * once + meetings * (base * base + coat * coat)), kWidestAgain);
  };
  return {width(material.base_alpha_u, material.alpha_u),
          width(material.base_alpha_v, material.alpha_v)};
}

Rgb CoatMeanResidual(const Material& material) {
  return ReadRows(material,
                  [](const CoatTable& table, std::size_t row) { return table.mean_residual[row]; });
}

Rgb CoatShareOfHits(const Material& material, std::size_t hits) {
  return ReadRows(
      material, [&](const CoatTable& table, std::size_t row) { return table.by_hits[row][hits]; });
}

Rgb HazeEntering(const Material& material, Vec3 w) {
  return Gray(CoatEntering(material, w)) +
         ReadRows(material, [&](const CoatTable& table, std::size_t row) {
           return AtCosine(table.scattering.entering, row, w.z);
         });
}

Rgb HazeInner(const Material& material) {
  return Gray(CoatInner(material)) +
         ReadRows(material, [](const CoatTable& table, std::size_t row) {
           return table.scattering.inner[row];
         });
}

Rgb HazeBack(const Material& material, float cosine) {
  return ReadRows(material, [&](const CoatTable& table, std::size_t row) {
    return AtCosine(table.scattering.back, row, cosine);
  });
}

Rgb HazeMeanBack(const Material& material) {
  return ReadRows(material, [](const CoatTable& table, std::size_t row) {
    return table.scattering.mean_back[row];
  });
}

float CoatCrossing(const MaterialNumbers& material, float cosine) {
  return material.thickness > 0 ? std::exp(-material.thickness / std::max(cosine, 1e-6F)) : 1.0F;
}

float SmoothCoatEntering(const MaterialNumbers& material, float cosine) {
  float cos_t = 0;
  const float reflected = FresnelDielectric(cosine, material.ior, cos_t);
  return reflected < 1 ? (1 - reflected) * CoatCrossing(material, cos_t) : 0.0F;
}

bool CoatRefracted(const Material& material, Vec3 w, Vec3& inside) {
  const float x = w.x / material.ior;
  const float y = w.y / material.ior;
  const float squared = 1 - x * x - y * y;
  if (!(squared > 0)) return false;
  inside = {x, y, std::sqrt(squared)};
  return true;
}

}  // namespace lucerna
