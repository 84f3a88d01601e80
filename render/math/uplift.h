// Which spectrum has a colour that is given as three numbers?
//
// The smooth one of Jakob and Hanika 2019, "A Low-Dimensional Function Space for Efficient Spectral
// Upsampling": a sigmoid of a quadratic polynomial of the wavelength, between 0 and 1 everywhere,
// whose colour in daylight D65 is the given one. As in pbrt-v4, what may exceed 1 is twice its
// largest channel times the reflectance that is left, and light is that times daylight. Grey is the
// same at all wavelengths, exactly.
//
// Colours are linear Rec. 709.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "render/math/pass_wavelengths.h"
#include "render/math/rgb.h"

namespace lucerna {

struct SigmoidPolynomial {
  float c0 = 0, c1 = 0, c2 = 0;  // c0 + c1 x + c2 x², x from -1 to 1 over what is observed

  [[nodiscard]] float At(float x) const {
    const float p = c0 + x * (c1 + x * c2);
    return 0.5F + 0.5F * p / std::sqrt(1 + p * p);
  }
};

// The wavelength as the polynomial takes it.
[[nodiscard]] double PolynomialPlace(double nm);

// Of a colour in [0, 1]; not of grey, of which the spectrum needs none. Saturated colours that no
// reflectance has get the spectrum that looks most like them.
[[nodiscard]] SigmoidPolynomial FitReflectance(Rgb color);

// Whether a colour is grey, but for rounding.
[[nodiscard]] inline bool IsGray(Rgb c) {
  const float largest = std::max(std::abs(c.r), std::max(std::abs(c.g), std::abs(c.b)));
  constexpr float kRounding = 1e-6F;
  return std::abs(c.r - c.g) <= kRounding * largest && std::abs(c.b - c.g) <= kRounding * largest;
}

// Values at a pass's wavelengths, of many colours: polynomials come from a table, which the first
// colour in a process that is not grey makes, in about a second. Threads: any.
class Uplift {
 public:
  explicit Uplift(const PassWavelengths& wavelengths);

  [[nodiscard]] const PassWavelengths& wavelengths() const { return wavelengths_; }
  // Of a colour in [0, 1].
  [[nodiscard]] Rgb Reflectance(Rgb color) const;
  // Of light, relative to daylight, or of another quantity that may exceed 1. Channels >= 0.
  [[nodiscard]] Rgb Unbounded(Rgb color) const;

 private:
  class Table;
  static const Table& TheTable();

  PassWavelengths wavelengths_;
  std::array<float, 3> x_{};  // the wavelengths as polynomials take them
};

}  // namespace lucerna
