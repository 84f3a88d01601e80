// What colour is light, or a surface, that is described by wavelength?
//
// Through the CIE 1931 observer (math/color_matching.h) to linear Rec. 709. Colours outside Rec.
// 709 are cut off at zero.
#pragma once

#include <optional>
#include <string_view>

#include "render/math/rgb.h"
#include "render/math/wavelength_curve.h"

namespace lucerna {

// The wavelengths that stand for red, green and blue where a quantity is sampled, not seen: the
// optical constants of metals.
inline constexpr double kRedNm = 630, kGreenNm = 532, kBlueNm = 465;

// Light with this curve, scaled to luminance 1, as pbrt-v4 scales every light; black when the
// curve holds no visible light.
[[nodiscard]] Rgb EmissionColor(const WavelengthCurve& curve);

// A black body [K], scaled to luminance 1. Requires kMinBlackbodyK <= temperature_k <=
// kMaxBlackbodyK: outside, single precision has no room for the curve.
inline constexpr double kMinBlackbodyK = 500, kMaxBlackbodyK = 1e6;
[[nodiscard]] Rgb BlackbodyColor(double temperature_k);
// The same up to a factor, where the eye sees.
[[nodiscard]] WavelengthCurve BlackbodyCurve(double temperature_k);
// That factor: the radiance of a black body [W·m⁻²·sr⁻¹·nm⁻¹] is this times the curve.
inline constexpr double kBlackbodyUnit = 2.162654e6;

// CIE xy.
struct Chromaticity {
  double x, y;
};
// Of daylight, CIE 15:2018, section 4.1.2. Requires 4000 <= temperature_k <= 25000, a correlated
// colour temperature [K] by the present constant of Planck's law.
[[nodiscard]] Chromaticity DaylightChromaticity(double temperature_k);
// Its curve, where the eye sees, 100 at 560 nm.
[[nodiscard]] WavelengthCurve DaylightCurve(double temperature_k);
// A standard illuminant by pbrt's name: stdillum-A, stdillum-D50, illum-acesD60.
[[nodiscard]] std::optional<WavelengthCurve> IlluminantNamed(std::string_view name);

// The luminance of light with this curve, where light of value 1 at all wavelengths has 1.
[[nodiscard]] double LuminanceOf(const WavelengthCurve& curve);
// The largest value of BlackbodyCurve's law at any wavelength, by Wien's displacement law.
[[nodiscard]] double BlackbodyPeak(double temperature_k);

// A surface that reflects by this curve, in daylight D65; a curve that is 1 everywhere is white.
// Every channel is in [0, 1].
[[nodiscard]] Rgb ReflectanceColor(const WavelengthCurve& curve);

}  // namespace lucerna
