// From what a pixel's photons were, how large is its next radius?
//
// A controller is a pure rule, applied to every pixel that had a hitpoint after each pass, in
// pass order. Radii are in units that the pass fixes per hitpoint (see EyePass::unit_radii).
#pragma once

#include <cstdint>
#include <memory>

#include "render/scene/render_settings.h"

namespace lucerna {

// What is shared by all hitpoints that a pixel ever had (Hachisuka & Jensen 2009, "Stochastic
// Progressive Photon Mapping").
struct PixelRadius {
  float radius = 0;   // in unit radii
  float photons = 0;  // N, photons counted as kept so far
};

// What one pass brought to one pixel.
struct PassEvidence {
  double photons = 0;  // M, gathered with the radius below
  float radius = 0;    // in unit radii; at least PixelRadius::radius, since radii lag by a pass
};

class RadiusController {
 public:
  virtual ~RadiusController() = default;
  // The state after `pass` (from 0) brought `evidence`. A radius never grows.
  [[nodiscard]] virtual PixelRadius Next(const PixelRadius& now, const PassEvidence& evidence,
                                         std::uint64_t pass) const = 0;
};

[[nodiscard]] std::unique_ptr<RadiusController> MakeRadiusController(
    const RenderSettings& settings);

}  // namespace lucerna
