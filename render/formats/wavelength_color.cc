#include "render/formats/wavelength_color.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "render/math/color_matching.h"

namespace lucerna {
namespace {

template <typename Curve>
Xyz Observe(const Curve& curve) {
  constexpr double kFirstNm = 360, kLastNm = 830;
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
