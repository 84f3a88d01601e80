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
    const Xyz matching = CieObserver(nm);
    for (std::size_t i = 0; i < 3; ++i)
      sum[i] += value * matching[i];
  }
  return sum;
}

// Planck's law up to a factor; the second radiation constant is 1.438777e7 nm·K.
double Planck(double nm, double temperature_k) {
  return 1 / (std::pow(nm / 560, 5) * std::expm1(1.438777e7 / (nm * temperature_k)));
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

Rgb EmissionColor(const WavelengthCurve& curve) {
  return WithUnitLuminance(Observe([&curve](double nm) { return curve.At(nm); }));
}

Rgb BlackbodyColor(double temperature_k) {
  return WithUnitLuminance(
      Observe([temperature_k](double nm) { return Planck(nm, temperature_k); }));
}

WavelengthCurve BlackbodyCurve(double temperature_k) {
  // Fine enough for a line between two values to be Planck's law within 1e-3 at 1000 K.
  constexpr double kFirstNm = 360, kLastNm = 830, kStepNm = 5;
  WavelengthCurve curve;
  for (double nm = kFirstNm; nm <= kLastNm; nm += kStepNm) {
    curve.wavelength_nm.push_back(nm);
    curve.value.push_back(Planck(nm, temperature_k));
  }
  return curve;
}

double LuminanceOf(const WavelengthCurve& curve) {
  return Observe([&curve](double nm) { return curve.At(nm); })[1] /
         Observe([](double /*nm*/) { return 1.0; })[1];
}

double BlackbodyPeak(double temperature_k) {
  constexpr double kWienNmK = 2.897772e6;
  return Planck(kWienNmK / temperature_k, temperature_k);
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
