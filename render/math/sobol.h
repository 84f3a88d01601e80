// Points that fill the unit cube more evenly than chance.
//
// An eight-dimensional Sobol' sequence (direction numbers of Joe & Kuo 2008), randomised by
// hash-based Owen scrambling (Laine & Karras 2011; Burley 2020, "Practical Hash-based Owen
// Scrambling"): every point is uniform, any run of 2^k points is stratified, and different keys
// are independent of each other.
#pragma once

#include <array>
#include <cstdint>

namespace lucerna {

inline constexpr int kSobolDimensions = 8;

// Each in [0, 1).
using SobolPoint = std::array<float, kSobolDimensions>;

// Point number `index` of the sequence that belongs to `key`. Points of one key with consecutive
// indices are stratified together in all eight dimensions; after 2^32 points a sequence goes on
// with a new scrambling.
[[nodiscard]] SobolPoint OwenSobol(std::uint64_t index, std::uint64_t key);

// The same points in an order that belongs to the key. To pad several of them into one sample of
// more than eight dimensions, all but one must be shuffled: otherwise two of them would stay a
// fixed function of each other however many points are drawn.
[[nodiscard]] SobolPoint ShuffledOwenSobol(std::uint64_t index, std::uint64_t key);

// The same point before it is scrambled, of one dimension: 32 binary digits behind the point. For
// numbers that all pixels share and that go with no dimension that they use.
[[nodiscard]] std::uint32_t SobolDigits(std::uint32_t index, int dimension);

}  // namespace lucerna
