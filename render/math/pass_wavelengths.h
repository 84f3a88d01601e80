// Which three wavelengths does a pass carry, and what colour are values at them?
//
// Of a job that carries wavelengths, everything that is an Rgb in other jobs (flux, weights,
// radiance) holds values at three wavelengths of the pass, the longest one first. Radiance is
// relative to daylight D65, so that white light is (1, 1, 1).
//
// The visible range is cut into three, and each wavelength moves through its part as a number t
// goes from 0 to 1, in such a way that the three together have brought the share t of all of
// daylight's X, of its Y and of its Z. That is three equations for three wavelengths. So the
// weights with which values at them become a colour follow from dλ/dt, and
//
//   P1  the mean over t of the colour of values f(λ1), f(λ2), f(λ3) is the colour of the spectrum
//       f(λ)·D65(λ), whatever f is: each weight is the observer's curve times dλ/dt, and so the
//       integral over t one over λ;
//   P2  a value that is the same at all wavelengths has the same colour in every pass, and white is
//       white: what is grey has no noise of colour.
//
// Independent wavelengths (hero wavelengths: Wilkie et al. 2014, "Hero Wavelength Spectral
// Sampling") have P1 alone.
#pragma once

#include <array>
#include <cstdint>

#include "render/math/rgb.h"

namespace lucerna {

// The lower ends of the second and the third part. Nearby ones leave some t without a solution, or
// with a negative weight.
inline constexpr double kSecondPartNm = 487, kThirdPartNm = 575;

struct PassWavelengths {
  std::array<double, 3> nm{};  // falling
  // From values at them to the working space (math/color_space.h). Rows sum to 1; single
  // wavelengths lie outside of it, so that some are below zero.
  std::array<std::array<double, 3>, 3> to_working{};

  [[nodiscard]] std::array<double, 3> ToWorking(const std::array<double, 3>& values) const {
    std::array<double, 3> color{};
    for (std::size_t row = 0; row < 3; ++row) {
      for (std::size_t i = 0; i < 3; ++i)
        color[row] += to_working[row][i] * values[i];
    }
    return color;
  }
};

// For t in [0, 1].
[[nodiscard]] PassWavelengths WavelengthsAt(double t);

// Those of a pass. Even passes alone, odd passes alone, and any 2^k consecutive ones of either,
// have values of t that are evenly spread.
[[nodiscard]] PassWavelengths WavelengthsOfPass(std::uint64_t seed, std::uint64_t pass);

}  // namespace lucerna
