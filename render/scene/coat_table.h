// What passes a dielectric coat, averaged over where it goes inside: computed once for a material
// (transport/coat.h).
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

namespace lucerna {

struct CoatTable {
  // Cosines of directions outside, (i / (kCosines - 1))².
  static constexpr int kCosines = 49;

  // Azimuths of the rows, from 0 to a quarter of a turn; one row where all are alike.
  int rows = 1;
  // [rows × kCosines] share of flux that comes down to the base, of rough coats; those of smooth
  // ones are computed where they are needed.
  std::vector<float> entering;
  float inner = 0;    // share of what the base scatters that comes back to it
  float leaving = 0;  // share of what the base scatters that leaves the coat

  // Over a metal: what the closed form of light that meets the metal once leaves out, that is
  // almost all of it light that meets the metal more often. Shares of the flux that falls in, as
  // if the metal reflected everything.
  static constexpr int kHits = 24;
  std::vector<float> residual;            // [kCosines], averaged over azimuths
  float mean_residual = 0;                // over directions, with density cosine / pi
  std::array<float, kHits> by_hits = {};  // its shares after 1, 2, ... meetings; the last: or more
};

// The tables of a coated material with a texture of its roughness, of widths of facets between two:
// those of the coat's surface, or of the metal under it.
struct CoatFamily {
  bool is_of_base = false;
  float narrowest = 0, widest = 0;
  std::vector<CoatTable> tables;  // at least 2, evenly spaced from the narrowest width

  // The tables below and above a width, and the share of the second.
  struct Place {
    std::size_t below;
    float share;
  };
  [[nodiscard]] Place PlaceOf(float width) const {
    const auto last = static_cast<float>(tables.size() - 1);
    const float place =
        std::min(std::max((width - narrowest) / (widest - narrowest) * last, 0.0F), last);
    const auto below = std::min(static_cast<std::size_t>(place), tables.size() - 2);
    return {below, place - static_cast<float>(below)};
  }
};

}  // namespace lucerna
