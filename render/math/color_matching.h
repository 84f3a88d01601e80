// What does the eye see of light of one wavelength?
//
// Source: CIE 15:2004, table T.4 (colour-matching functions of the 1931 observer of 2 degrees, 5
// nm) and the daylight illuminant D65; IEC 61966-2-1 for Rec. 709.
#pragma once

#include <array>

namespace lucerna {

using Xyz = std::array<double, 3>;

// What lies outside has less than 1e-4 of daylight's luminance.
inline constexpr double kFirstObservedNm = 380, kLastObservedNm = 780;

// CIE XYZ of light of that wavelength; zero outside.
[[nodiscard]] Xyz CieObserver(double nm);

// D65, relative: 100 at 560 nm, zero outside 380 to 780 nm.
[[nodiscard]] double D65At(double nm);

// CIE XYZ to linear Rec. 709, below zero for colours outside.
[[nodiscard]] std::array<double, 3> Rec709(const Xyz& color);

}  // namespace lucerna
