// What passes a dielectric coat, averaged over where it goes inside: computed once for a material
// (transport/coat.h).
#pragma once

#include <array>
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

}  // namespace lucerna
