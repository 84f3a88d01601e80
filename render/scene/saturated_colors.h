// Are there colours of which three channels make something else than wavelengths do?
#pragma once

#include "render/scene/scene.h"

namespace lucerna {

// A colour is saturated when its smallest channel is less than this share of its largest. Products
// of such colours differ by per cents from those of their spectra, and those of paler ones by less
// than one (docs/decisions/spectra.md).
inline constexpr float kSaturatedShare = 0.25F;
// The same of metals that are given by wavelength: gold has more red than Rec. 709 can show, and
// three reflectances are 2 % off from it at best.
inline constexpr float kSaturatedMetal = 0.5F;

// Whether a material or a light of the scene has a saturated colour, or glass of it sends each
// wavelength into another direction. Pictures and media are not looked at.
[[nodiscard]] bool HasSaturatedColors(const Scene& scene);

}  // namespace lucerna
