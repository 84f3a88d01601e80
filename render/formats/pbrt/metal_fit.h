// Which three optical constants stand for a metal that is given by wavelength?
#pragma once

#include "render/formats/pbrt/optical_constants.h"
#include "render/math/wavelength_curve.h"

namespace lucerna {

// For each channel of Rec. 709 the constants with which the metal has the colour that it has in
// daylight D65, at all angles and under a coat, by least squares; a colour outside of Rec. 709, as
// that of gold, as nearly as a reflectance of at most 1 can. The search begins at `first`.
//
// The three wavelengths of the primaries, or means of the constants themselves, do not do that:
// copper and gold differ by up to a tenth between the two, and from what is seen by half of that.
[[nodiscard]] MetalConstants FitMetal(const WavelengthCurve& eta, const WavelengthCurve& k,
                                      const MetalConstants& first);

}  // namespace lucerna
