// In which primaries is light multiplied?
//
// Scenes and images are in linear Rec. 709. Light transport multiplies colours, and a product of
// Rec. 709 colours is further from the colour of the product of their spectra than it need be:
// its primaries are broad mixtures. Sharper ones multiply better (Ward & Eydelberg-Vileshin 2002,
// "Picture Perfect RGB Rendering Using Spectral Prefiltering and Sharp Color Primaries"). Of the
// common sets, P3 with the white of Rec. 709 comes closest to spectral renders (measured in
// ARCHITECTURE); grey stays grey, and no Rec. 709 colour becomes negative in it.
#pragma once

#include <array>
#include <cstddef>

#include "render/math/rgb.h"

namespace lucerna {

// For linear colours, [row][column].
using ColorMatrix = std::array<std::array<double, 3>, 3>;

// Rows sum to 1, so that grey is exact up to rounding. From the chromaticities of ITU-R BT.709 and
// SMPTE EG 432-1, both with white D65.
inline constexpr ColorMatrix kWorkingFrom709 = {{
    {0.8224619687, 0.1775380313, 0.0},
    {0.0331941989, 0.9668058011, 0.0},
    {0.0170826307, 0.0723974407, 0.9105199286},
}};
inline constexpr ColorMatrix kRec709FromWorking = {{
    {1.2249401763, -0.2249401763, 0.0},
    {-0.0420569547, 1.0420569547, 0.0},
    {-0.0196375546, -0.0786360456, 1.0982736001},
}};

// Rec. 709 to the space that transport works in.
[[nodiscard]] constexpr Rgb ToWorking(Rgb c) {
  const auto row = [&](std::size_t i) {
    return static_cast<float>(kWorkingFrom709[i][0]) * c.r +
           static_cast<float>(kWorkingFrom709[i][1]) * c.g +
           static_cast<float>(kWorkingFrom709[i][2]) * c.b;
  };
  return {row(0), row(1), row(2)};
}

[[nodiscard]] constexpr std::array<double, 3> Transformed(const ColorMatrix& matrix,
                                                          const std::array<double, 3>& c) {
  std::array<double, 3> out{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t k = 0; k < 3; ++k)
      out[i] += matrix[i][k] * c[k];
  }
  return out;
}

[[nodiscard]] constexpr ColorMatrix Product(const ColorMatrix& a, const ColorMatrix& b) {
  ColorMatrix out{};
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t column = 0; column < 3; ++column) {
      for (std::size_t k = 0; k < 3; ++k)
        out[row][column] += a[row][k] * b[k][column];
    }
  }
  return out;
}

// Back to Rec. 709.
[[nodiscard]] constexpr std::array<double, 3> ToRec709(const std::array<double, 3>& c) {
  return Transformed(kRec709FromWorking, c);
}

}  // namespace lucerna
