#include "render/formats/wavelength_color.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace lucerna {
namespace {

using Xyz = std::array<double, 3>;

constexpr double kFirstNm = 360, kLastNm = 830;

// A bell with different widths on its two sides.
double Lobe(double nm, double peak_nm, double width_below_nm, double width_above_nm) {
  const double t = (nm - peak_nm) / (nm < peak_nm ? width_below_nm : width_above_nm);
  return std::exp(-0.5 * t * t);
}

// Wyman et al. 2013, the multi-lobe fit of the 2° observer.
Xyz ColorMatching(double nm) {
  return {1.056 * Lobe(nm, 599.8, 37.9, 31.0) + 0.362 * Lobe(nm, 442.0, 16.0, 26.7) -
              0.065 * Lobe(nm, 501.1, 20.4, 26.2),
          0.821 * Lobe(nm, 568.8, 46.9, 40.5) + 0.286 * Lobe(nm, 530.9, 16.3, 31.1),
          1.217 * Lobe(nm, 437.0, 11.8, 36.0) + 0.681 * Lobe(nm, 459.0, 26.0, 13.8)};
}

// D65, relative, every 10 nm from 380 nm to 780 nm.
constexpr std::array<double, 41> kD65 = {
    49.98,  54.65,  82.75,  91.49,  93.43,  86.68,  104.86, 117.01, 117.81, 114.86, 115.92,
    108.81, 109.35, 107.80, 104.79, 107.69, 104.41, 104.05, 100.00, 96.33,  95.79,  88.69,
    90.01,  89.60,  87.70,  83.29,  83.70,  80.03,  80.21,  82.28,  78.28,  69.72,  71.61,
    74.35,  61.60,  69.89,  75.09,  63.59,  46.42,  66.81,  63.38};

double D65At(double nm) {
  const double t = (nm - 380) / 10;
  if (!(t >= 0) || t > 40) return 0;
  const auto i = std::min<std::size_t>(static_cast<std::size_t>(t), 39);
  const double f = t - static_cast<double>(i);
  return kD65[i] * (1 - f) + kD65[i + 1] * f;
}

// IEC 61966-2-1: CIE XYZ to linear Rec. 709.
std::array<double, 3> Rec709(const Xyz& c) {
  return {3.2404542 * c[0] - 1.5371385 * c[1] - 0.4985314 * c[2],
          -0.9692660 * c[0] + 1.8760108 * c[1] + 0.0415560 * c[2],
          0.0556434 * c[0] - 0.2040259 * c[1] + 1.0572252 * c[2]};
}

template <typename Curve>
Xyz Observe(const Curve& curve) {
  Xyz sum = {0, 0, 0};
  for (double nm = kFirstNm; nm <= kLastNm; nm += 1) {
    const double value = curve(nm);
    const Xyz matching = ColorMatching(nm);
    for (std::size_t i = 0; i < 3; ++i)
      sum[i] += value * matching[i];
  }
  return sum;
}

// Cut off at zero first and scaled after, so that the luminance is 1 for saturated colours too.
Rgb WithUnitLuminance(const Xyz& xyz) {
  std::array<double, 3> rgb = Rec709(xyz);
  for (double& channel : rgb)
    channel = std::max(channel, 0.0);
  const double luminance = 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
  if (!(luminance > 0) || !std::isfinite(luminance)) return {};
  return {static_cast<float>(rgb[0] / luminance), static_cast<float>(rgb[1] / luminance),
          static_cast<float>(rgb[2] / luminance)};
}

}  // namespace

double WavelengthCurve::At(double nm) const {
  if (wavelength_nm.empty() || nm < wavelength_nm.front() || nm > wavelength_nm.back()) return 0;
  return AtClamped(nm);
}

double WavelengthCurve::AtClamped(double nm) const {
  const auto above = std::upper_bound(wavelength_nm.begin(), wavelength_nm.end(), nm);
  if (above == wavelength_nm.begin()) return value.front();
  if (above == wavelength_nm.end()) return value.back();
  const auto i = static_cast<std::size_t>(above - wavelength_nm.begin());
  const double t = (nm - wavelength_nm[i - 1]) / (wavelength_nm[i] - wavelength_nm[i - 1]);
  return value[i - 1] * (1 - t) + value[i] * t;
}

Rgb EmissionColor(const WavelengthCurve& curve) {
  return WithUnitLuminance(Observe([&curve](double nm) { return curve.At(nm); }));
}

Rgb BlackbodyColor(double temperature_k) {
  // Planck's law up to a factor; the second radiation constant is 1.438777e7 nm·K.
  return WithUnitLuminance(Observe([temperature_k](double nm) {
    return 1 / (std::pow(nm / 560, 5) * std::expm1(1.438777e7 / (nm * temperature_k)));
  }));
}

Rgb ReflectanceColor(const WavelengthCurve& curve) {
  const auto lit = Rec709(Observe([&curve](double nm) { return curve.At(nm) * D65At(nm); }));
  const auto white = Rec709(Observe(D65At));
  const auto channel = [&](std::size_t i) {
    return static_cast<float>(std::clamp(lit[i] / white[i], 0.0, 1.0));
  };
  return {channel(0), channel(1), channel(2)};
}

}  // namespace lucerna
