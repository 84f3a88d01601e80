// How is a photon's contribution rounded to an integer?
//
// A contribution is counted in quanta. The quantum of a channel is a power of two, about 2^-18 of
// the power that the whole scene emits in it: a photon carries about that power, so its
// contribution has 18 bits and a sum has room for 2^44 of them. What FluxScale has no room for is
// left out and counted, so that no sum of kMostTerms wraps.
//
// Rounding is up or down at random with the odds that make it exact on average, by random bits
// that belong to the (photon, hitpoint) pair. So a channel in which a photon carries far less
// than a quantum still adds up right, and no sum is biased, however many terms it has.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "render/math/rgb.h"

namespace lucerna {

inline constexpr int kFluxBits = 18;
// [quanta], before the kernel: 2^15 times what the whole scene emits.
inline constexpr float kLargestContribution = 0x1p33F;
// So many contributions of at most eight times that size fit in 63 bits.
inline constexpr std::uint64_t kMostTerms = std::uint64_t{1} << 26;

// 2^-kFluxBits times the smallest power of two that is >= `power` [W]; for no power at all, 1.
// At the ends of the float range the exponent is held where the quantum and its inverse are both
// normal numbers.
[[nodiscard]] inline float QuantumFor(float power_w) {
  if (!(power_w > 0)) return 1;
  int exponent = 0;
  const float mantissa = std::frexp(std::min(power_w, 0x1.fffffep127F), &exponent);  // in [0.5, 1)
  const int wanted = (mantissa == 0.5F ? exponent - 1 : exponent) - kFluxBits;
  return std::ldexp(1.0F, std::clamp(wanted, -126, 126));
}

// Quanta per watt, and back, per channel. Both are exact powers of two.
struct FluxScale {
  Rgb quanta_per_watt;
  Rgb watts_per_quantum;

  // Whether `flux_w` is at most kLargestContribution; false when it is not a number.
  [[nodiscard]] bool HasRoomFor(Rgb flux_w) const {
    const Rgb quanta = flux_w * quanta_per_watt;
    return quanta.r + quanta.g + quanta.b <= kLargestContribution;
  }

  [[nodiscard]] static FluxScale ForPower(Rgb power_w) {
    // A channel without power has the quantum of the strongest one.
    const float most = MaxChannel(power_w);
    const auto quantum_of = [most](float power) { return QuantumFor(power > 0 ? power : most); };
    const Rgb quantum = {quantum_of(power_w.r), quantum_of(power_w.g), quantum_of(power_w.b)};
    return {{1 / quantum.r, 1 / quantum.g, 1 / quantum.b}, quantum};
  }
};

// `value` (in quanta, >= 0, <= kLargestContribution) rounded with 21 random bits `dither` in [0,
// 2^21).
[[nodiscard]] inline std::int64_t RoundDithered(float value, std::uint32_t dither) {
  // value + dither can lose the dither's bits when value is large: rounding is then to nearest,
  // a relative error of 2^-24.
  const float offset = static_cast<float>(dither) * 0x1p-21F;
  return static_cast<std::int64_t>(value + offset);
}

}  // namespace lucerna
