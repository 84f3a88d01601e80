// What is counted while some consecutive hitpoints gather, and the random bits of their pairs with
// photons.
#pragma once

#include <cstddef>
#include <cstdint>

#include "render/math/packed_integers.h"

namespace lucerna {

// By one thread: so many share memory where they are summed.
inline constexpr std::size_t kRowsPerPiece = PackedIntegers::kTileSize;

struct GatherPiece {
  std::uint64_t pairs = 0;
  std::uint64_t excess = 0;
  bool fits = true;  // whether all sums did
};

// 64 random bits that belong to a (photon, hitpoint) pair.
[[nodiscard]] inline std::uint64_t PairBits(std::uint32_t photon_key, std::uint32_t hitpoint) {
  std::uint64_t x =
      (static_cast<std::uint64_t>(photon_key) << 32 | hitpoint) * 0x9E3779B97F4A7C15ULL;
  x = (x ^ (x >> 32)) * 0xD6E8FEB86659FD93ULL;
  return x ^ (x >> 32);
}
// Of these, 21 for each channel (RoundDithered).
[[nodiscard]] inline std::uint32_t DitherOf(std::uint64_t pair_bits, int channel) {
  constexpr std::uint64_t kMask = (1U << 21) - 1;
  return static_cast<std::uint32_t>((pair_bits >> (21 * channel)) & kMask);
}

}  // namespace lucerna
