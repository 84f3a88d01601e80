// Into which directions should photons be scattered more often where they first land?
//
// Pilot paths (tracing/pilot_paths.h) say from where light beside a light goes on to the image.
// Space is halved until a cell has few such reports, and in each cell a tree of directions is
// grown. Where photons that the BSDF scatters with the density p into a box of directions of the
// solid angle V are found with the mass m (as in guide_learning.h: how many, times the square of
// what each adds to the relative error), a box with the share s adds p V m / s to the variance: the
// shares are in proportion to sqrt(p V m). A cell keeps its tree where that promises much.
#pragma once

#include <span>

#include "render/math/vector.h"
#include "render/transport/scatter_guide.h"

namespace lucerna {

// A scattering beside a light, of a path from the light into the image.
struct ScatterReport {
  Vec3 position;      // [scene units]
  Vec3 direction;     // in which the photon goes on
  float density = 0;  // of the BSDF there [1/sr], above 0
  double mass = 0;    // at least 0, in any unit
};

// The same on every machine, for the same reports in the same order.
[[nodiscard]] ScatterGuide LearnScatterGuide(std::span<const ScatterReport> reports);

}  // namespace lucerna
