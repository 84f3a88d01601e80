// What does the eye see of light of one wavelength?
//
// Source: Wyman, Sloan and Shirley 2013, "Simple Analytic Approximations to the CIE XYZ Color
// Matching Functions" (the multi-lobe fit, within about 1 % of the CIE 1931 observer); CIE 15 for
// the daylight illuminant D65; IEC 61966-2-1 for Rec. 709.
#pragma once

#include <array>

namespace lucerna {

using Xyz = std::array<double, 3>;

// CIE XYZ of light of that wavelength.
[[nodiscard]] Xyz ColorMatching(double nm);

// D65, relative: 100 at 560 nm, zero outside 380 to 780 nm.
[[nodiscard]] double D65At(double nm);

// CIE XYZ to linear Rec. 709, below zero for colours outside.
[[nodiscard]] std::array<double, 3> Rec709(const Xyz& color);

}  // namespace lucerna
