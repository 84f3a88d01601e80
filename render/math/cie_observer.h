// What does the CIE 1931 observer see of light of one wavelength, as tabulated?
//
// For jobs that carry wavelengths. math/color_matching.h has a fit of the same curves, within 1 %,
// by which files' spectra become the three colours of all other jobs.
//
// Source: CIE 15:2004, table T.4 (colour-matching functions of the 2 degree observer, 5 nm).
#pragma once

#include "render/math/color_matching.h"

namespace lucerna {

// What lies outside has less than 1e-4 of daylight's luminance.
inline constexpr double kFirstObservedNm = 380, kLastObservedNm = 780;

// CIE XYZ; zero outside.
[[nodiscard]] Xyz CieObserver(double nm);

}  // namespace lucerna
