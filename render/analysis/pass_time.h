// At what time does a pass see a scene that moves?
//
// Eye paths, photons and what they bring to hitpoints are of one time, so that a photon lands on
// the surface on which the hitpoint is that finds it. The times of a job's passes are spread over
// the time of the shutter as the places of a pixel's eye paths are over its filter
// (tracing/pixel_sampler.h): even passes take those of one low-discrepancy sequence, odd passes
// those of another, in an order of their own, so that times go together with no place.
#pragma once

#include <cstdint>

#include "render/scene/motion.h"

namespace lucerna {

// When the shutter opens, where nothing moves. Follows from the arguments alone.
[[nodiscard]] double TimeOfPass(const SceneMotion& motion, std::uint64_t seed, std::uint64_t pass);

}  // namespace lucerna
