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

// The mean of daylight and how it varies, 10 nm apart from 380 nm on: CIE 15:2004, table T.2.
struct DaylightParts {
  double mean, first, second;
};
constexpr double kFirstPartsNm = 380, kPartsStepNm = 10;
constexpr std::array<DaylightParts, 41> kDaylightParts = {{
    {63.4, 38.5, 3.0},   {65.8, 35.0, 1.2},   {94.8, 43.4, -1.1},  {104.8, 46.3, -0.5},
    {105.9, 43.9, -0.7}, {96.8, 37.1, -1.2},  {113.9, 36.7, -2.6}, {125.6, 35.9, -2.9},
    {125.5, 32.6, -2.8}, {121.3, 27.9, -2.6}, {121.3, 24.3, -2.6}, {113.5, 20.1, -1.8},
    {113.1, 16.2, -1.5}, {110.8, 13.2, -1.3}, {106.5, 8.6, -1.2},  {108.8, 6.1, -1.0},
    {105.3, 4.2, -0.5},  {104.4, 1.9, -0.3},  {100.0, 0.0, 0.0},   {96.0, -1.6, 0.2},
    {95.1, -3.5, 0.5},   {89.1, -3.5, 2.1},   {90.5, -5.8, 3.2},   {90.3, -7.2, 4.1},
    {88.4, -8.6, 4.7},   {84.0, -9.5, 5.1},   {85.1, -10.9, 6.7},  {81.9, -10.7, 7.3},
    {82.6, -12.0, 8.6},  {84.9, -14.0, 9.8},  {81.3, -13.6, 10.2}, {71.9, -12.0, 8.3},
    {74.3, -13.3, 9.6},  {76.4, -12.9, 8.5},  {63.3, -10.6, 7.0},  {71.7, -11.6, 7.6},
    {77.0, -12.2, 8.0},  {65.2, -10.2, 6.7},  {47.7, -7.8, 5.2},   {68.6, -11.2, 7.4},
    {65.0, -10.4, 6.8},
}};

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

Chromaticity DaylightChromaticity(double temperature_k) {
  // Since the series was measured, the constant of Planck's law has changed.
  const double t = temperature_k * 1.4388 / 1.4380;
  const double x = t <= 7000
                       ? -4.6070e9 / (t * t * t) + 2.9678e6 / (t * t) + 0.09911e3 / t + 0.244063
                       : -2.0064e9 / (t * t * t) + 1.9018e6 / (t * t) + 0.24748e3 / t + 0.237040;
  return {x, -3 * x * x + 2.870 * x - 0.275};
}

WavelengthCurve DaylightCurve(double temperature_k) {
  const auto [x, y] = DaylightChromaticity(temperature_k);
  const double share = 0.0241 + 0.2562 * x - 0.7341 * y;
  const double first = (-1.3515 - 1.7703 * x + 5.9114 * y) / share;
  const double second = (0.0300 - 31.4424 * x + 30.0717 * y) / share;
  WavelengthCurve curve;
  double nm = kFirstPartsNm;
  for (const DaylightParts& parts : kDaylightParts) {
    curve.wavelength_nm.push_back(nm);
    curve.value.push_back(parts.mean + first * parts.first + second * parts.second);
    nm += kPartsStepNm;
  }
  return curve;
}

std::optional<WavelengthCurve> IlluminantNamed(std::string_view name) {
  // CIE 15:2018: 2848 K with the constant of Planck's law that was in use in 1931.
  if (name == "stdillum-A") return BlackbodyCurve(2848.0 * 1.438777 / 1.4350);
  if (name == "stdillum-D50") return DaylightCurve(5000);
  if (name == "illum-acesD60") return DaylightCurve(6000);
  return std::nullopt;
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
