// Random numbers that belong to a place in the computation, not to a moment.
//
// Every number is a function of a key (job seed, pass, photon or pixel) and a dimension. Whoever
// computes it, whenever, gets the same bits. There is no other source of chance in the house.
#pragma once

#include <cstdint>

namespace lucerna {

// A bijective mixer of 64 bits. Source: Steele et al. 2014, "Fast Splittable Pseudorandom Number
// Generators" (the finaliser of SplitMix64, variant 13 of Stafford).
[[nodiscard]] constexpr std::uint64_t Mix64(std::uint64_t x) {
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9ULL;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBULL;
  return x ^ (x >> 31);
}

// A key that depends on both, in order.
[[nodiscard]] constexpr std::uint64_t CombineKeys(std::uint64_t a, std::uint64_t b) {
  return Mix64(Mix64(a + 0x9E3779B97F4A7C15ULL) ^ (b + 0xD1B54A32D192ED03ULL));
}

// In [0, 1), 24 bits.
[[nodiscard]] constexpr float UnitFloat(std::uint32_t bits) {
  return static_cast<float>(bits >> 8) * 0x1p-24F;
}

// In [0, 1) with 48 bits: `coarse`, refined by another number.
[[nodiscard]] constexpr double FineChoice(float coarse, float fine) {
  return static_cast<double>(coarse) + 0x1p-24 * static_cast<double>(fine);
}

// A stream of independent numbers under one key.
class KeyedRng {
 public:
  explicit constexpr KeyedRng(std::uint64_t key) : state_(key) {}

  [[nodiscard]] constexpr std::uint64_t Bits() {
    state_ += 0x9E3779B97F4A7C15ULL;
    return Mix64(state_);
  }
  // In [0, 1).
  [[nodiscard]] constexpr float Uniform() {
    return UnitFloat(static_cast<std::uint32_t>(Bits() >> 32));
  }

 private:
  std::uint64_t state_;
};

}  // namespace lucerna
