#include "render/math/color_matching.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace lucerna {
namespace {

// A bell with different widths on its two sides.
double Lobe(double nm, double peak_nm, double width_below_nm, double width_above_nm) {
  const double t = (nm - peak_nm) / (nm < peak_nm ? width_below_nm : width_above_nm);
  return std::exp(-0.5 * t * t);
}

// D65, relative, every 10 nm from 380 nm to 780 nm.
constexpr std::array<double, 41> kD65 = {
    49.98,  54.65,  82.75,  91.49,  93.43,  86.68,  104.86, 117.01, 117.81, 114.86, 115.92,
    108.81, 109.35, 107.80, 104.79, 107.69, 104.41, 104.05, 100.00, 96.33,  95.79,  88.69,
    90.01,  89.60,  87.70,  83.29,  83.70,  80.03,  80.21,  82.28,  78.28,  69.72,  71.61,
    74.35,  61.60,  69.89,  75.09,  63.59,  46.42,  66.81,  63.38};

}  // namespace

Xyz ColorMatching(double nm) {
  return {1.056 * Lobe(nm, 599.8, 37.9, 31.0) + 0.362 * Lobe(nm, 442.0, 16.0, 26.7) -
              0.065 * Lobe(nm, 501.1, 20.4, 26.2),
          0.821 * Lobe(nm, 568.8, 46.9, 40.5) + 0.286 * Lobe(nm, 530.9, 16.3, 31.1),
          1.217 * Lobe(nm, 437.0, 11.8, 36.0) + 0.681 * Lobe(nm, 459.0, 26.0, 13.8)};
}

double D65At(double nm) {
  const double t = (nm - 380) / 10;
  if (!(t >= 0) || t > 40) return 0;
  const auto i = std::min<std::size_t>(static_cast<std::size_t>(t), 39);
  const double f = t - static_cast<double>(i);
  return kD65[i] * (1 - f) + kD65[i + 1] * f;
}

std::array<double, 3> Rec709(const Xyz& color) {
  return {3.2404542 * color[0] - 1.5371385 * color[1] - 0.4985314 * color[2],
          -0.9692660 * color[0] + 1.8760108 * color[1] + 0.0415560 * color[2],
          0.0556434 * color[0] - 0.2040259 * color[1] + 1.0572252 * color[2]};
}

}  // namespace lucerna
