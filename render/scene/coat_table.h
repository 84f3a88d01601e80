// What passes a dielectric coat, averaged over where it goes inside: computed once for a material
// (transport/coat_tables.h), read by transport/coat.h.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace lucerna {

struct CoatTable {
  // Cosines of directions outside, (i / (kCosines - 1))².
  static constexpr int kCosines = 49;
  [[nodiscard]] static float CosineOf(int node) {
    const float place = static_cast<float>(node) / (kCosines - 1);
    return place * place;
  }
  // The node below a cosine, and the share of the next one.
  struct Place {
    std::size_t below;
    float share;
  };
  [[nodiscard]] static Place PlaceOf(float cosine) {
    constexpr int kLast = kCosines - 1;
    const float node = std::sqrt(std::clamp(cosine, 0.0F, 1.0F)) * kLast;
    const int below = std::min(static_cast<int>(node), kLast - 1);
    return {static_cast<std::size_t>(below), node - static_cast<float>(below)};
  }

  // Azimuths of the rows, from 0 to a quarter of a turn; one row where all are alike.
  int rows = 1;
  // [rows × kCosines] share of flux that comes down to the base, of rough coats; those of smooth
  // ones are computed where they are needed.
  std::vector<float> entering;
  float inner = 0;    // share of what the base scatters that comes back to it
  float leaving = 0;  // share of what the base scatters that leaves the coat
  // Of a coat that loses no light (Material::coat_passes_rest): the factor of `entering` with which
  // a white base reflects all light that enters. 1 for others.
  float passing = 1;

  // Of a layer that scatters: what light that it scattered adds to these, for some albedos of one
  // scattering, and what leaves the coat again without having met the base.
  static constexpr int kAlbedos = 9;
  // The albedo of a row, denser next to 1, where light is scattered most often.
  [[nodiscard]] static float AlbedoOf(int row) {
    const float rest = 1 - static_cast<float>(row) / (kAlbedos - 1);
    return 1 - rest * rest;
  }
  struct Scattering {
    std::vector<float> entering, back;  // [kAlbedos × kCosines] averaged over azimuths
    std::array<float, kAlbedos> inner = {};
    std::array<float, kAlbedos> mean_back = {};  // over directions, with density cosine / pi
  };
  Scattering scattering;  // without rows where the layer does not scatter

  // Over a metal: what the closed form of light that meets the metal once leaves out, that is
  // almost all of it light that meets the metal more often. Shares of the flux that falls in, as
  // if the metal reflected everything.
  // Of a layer that scatters also light that never met the metal.
  static constexpr int kHits = 24;
  // By how much the coat's facets widen the metal's as light sees them that meets the metal once
  // (BaseWidthSeen).
  float widening = 0.5F;
  // Its shares after 0, 1, 2, ... meetings; the last: or more.
  using ByHits = std::array<float, kHits + 1>;
  // For one albedo, 0, or for kAlbedos of them.
  std::vector<float> residual;       // [albedos × kCosines], averaged over azimuths
  std::vector<float> mean_residual;  // [albedos] over directions, with density cosine / pi
  std::vector<ByHits> by_hits;       // [albedos]
  // Of a layer that does not scatter: the factor of each direction with which a lobe of wider
  // facets has the flux of `residual`, [kCosines], and how often light in it has met the metal
  // again on average.
  std::vector<float> again;
  float meetings_again = 0;
  // What a metal makes of the residual of each direction, [kCosines], of the same layers: the share
  // that has met it once, and the share of the rest that meets it once more each time.
  std::vector<float> met_once, goes_on;

  // A metal's reflectance over the cosines of its facets is followed by the polynomial of degree 4
  // through its values at these (Chebyshev's) and at 0, where it is 1. So its mean over any
  // distribution of cosines is a sum of the values, with weights that are means of Lagrange's
  // polynomials, the same for all metals.
  static constexpr std::array<float, 4> kMetalCosines = {1.0F, 0.8535534F, 0.5F, 0.1464466F};
  using CosineWeights = std::array<float, kMetalCosines.size()>;
  // [kCosines] over the meetings of light that meets the metal more than once, of each direction.
  std::vector<CosineWeights> residual_cosines;
  // [kCosines], or empty under a smooth coat: what the facets of a rough one add to the weights of
  // light that meets the metal once, from each of its two directions.
  std::vector<CosineWeights> once_cosines;
};

// The tables of a coated material with a texture of its roughness or thickness. They differ in one
// number: width / (1 + width), of the facets of the coat's surface or of the metal under it, or the
// share of light that one crossing of the layer at right angles takes, 1 - exp(-thickness).
struct CoatFamily {
  static constexpr int kTables = 9;
  enum class Differing : std::uint8_t { kSurface, kBase, kThickness };
  Differing differing = Differing::kSurface;
  float least = 0, largest = 0;
  std::vector<CoatTable> tables;  // kTables, evenly spaced from the least number

  // The number of a width, and the width of a number. Nearly the width where facets are flat, and
  // below 1 for all: a texture that is very rough in one place leaves the tables of others dense.
  [[nodiscard]] static float SpacingOf(float width) { return width / (1 + width); }
  [[nodiscard]] static float WidthAt(float spacing) { return spacing / (1 - spacing); }

  // The tables below and above a number, and the share of the second.
  struct Place {
    std::size_t below;
    float share;
  };
  [[nodiscard]] Place PlaceOf(float number) const {
    const auto last = static_cast<float>(tables.size() - 1);
    const float place = std::min(std::max((number - least) / (largest - least) * last, 0.0F), last);
    const auto below = std::min(static_cast<std::size_t>(place), tables.size() - 2);
    return {below, place - static_cast<float>(below)};
  }
};

}  // namespace lucerna
