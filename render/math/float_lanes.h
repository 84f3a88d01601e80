// Eight floats at a time.
//
// A __m256 has the operators of a float, also with a float on the other side; comparisons make
// lanes of bits that are all set or all clear.
#pragma once

#include <array>
#include <bit>

#include <immintrin.h>

namespace lucerna {

// Requires alignment to 32 bytes.
[[nodiscard]] inline __m256 LoadLanes(const std::array<float, 8>& of) {
  return _mm256_load_ps(of.data());
}

// A bit for each lane of a comparison.
template <typename Comparison>
[[nodiscard]] unsigned int LaneBits(Comparison lanes) {
  return static_cast<unsigned int>(_mm256_movemask_ps(std::bit_cast<__m256>(lanes)));
}

}  // namespace lucerna
