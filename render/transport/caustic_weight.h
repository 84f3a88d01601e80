// Light that smooth surfaces throw on a narrow rough surface: which share is for photons?
//
// On surfaces where eye paths go on (GathersCaustics), light that comes from an emitter by way of
// smooth surfaces alone is found in two ways: by caustic photons, which have met only smooth
// surfaces, gathered there; and by scattered rays that follow the smooth surfaces back to the
// emitter. The first is the only one for points, spots and distant lights and the better one for
// small bright emitters; the second is better for large ones and narrow lobes. Both are used, each
// path weighed by the power heuristic of the densities with which the two find it (Veach & Guibas
// 1995, "Optimally Combining Sampling Techniques for Monte Carlo Rendering"), as in vertex merging
// (Georgiev, Křivánek, Davidovič & Slusallek 2012, "Light Transport Simulation with Vertex
// Connection and Merging").
//
// Photons are conserved along smooth surfaces, and so is étendue, so that their density over area
// and projected solid angle at the receiver is that at the emitter (Emission::density) times the
// probability of the reflections and refractions on the way, which is the same for rays and
// cancels. The change of étendue between media is left out of both, and the area over which photons
// are gathered is a nominal one, the same for all hitpoints and passes: shares need only add up to
// 1, and must not depend on radii, which are known later than eye paths.
#pragma once

#include <cmath>

#include "render/math/vector.h"
#include "render/scene/render_settings.h"
#include "render/scene/scene.h"

namespace lucerna {

class CausticWeight {
 public:
  // `bounds` of all shapes.
  CausticWeight(const Scene& scene, const RenderSettings& settings, const Bounds& bounds);

  // The share of photons, in [0, 1]. emission_density: Emission::density; cosine: between the
  // shading normal of the receiver and the direction to the light; scatter_pdf: with which the
  // receiver's BSDF draws that direction [sr⁻¹].
  [[nodiscard]] float OfPhotons(float emission_density, float cosine, float scatter_pdf) const {
    if (!(emission_density < HUGE_VALF)) return 1;
    const double photons = photon_area_ * static_cast<double>(emission_density) *
                           static_cast<double>(std::abs(cosine));
    if (!(photons > 0)) return 0;
    const double ratio = static_cast<double>(scatter_pdf) / photons;
    return static_cast<float>(1 / (1 + ratio * ratio));
  }
  // The share of scattered rays.
  [[nodiscard]] float OfRays(float emission_density, float cosine, float scatter_pdf) const {
    return 1 - OfPhotons(emission_density, cosine, scatter_pdf);
  }

 private:
  double photon_area_ = 0;  // photons of a pass times the nominal area of a disc [scene units²]
};

}  // namespace lucerna
