// With which random numbers is the emission of a photon drawn?
#pragma once

#include <array>
#include <cstddef>

namespace lucerna {

inline constexpr std::size_t kEmissionDimensions = 5;
// In [0, 1): two for the place, two for the direction, then the choice of the emitter.
using PrimaryNumbers = std::array<double, kEmissionDimensions>;

// So far below 1 that a number stays within its box wherever that is, when guides warp it.
inline constexpr double kBelowOneInBox = 1 - 0x1p-32;

}  // namespace lucerna
