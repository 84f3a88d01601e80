// How much light reaches a point straight from the lights?
//
// One sample of the lights and one of the BSDF, weighted by the power heuristic (Veach 1997,
// section 9.2.4). The same integral that photons arriving straight from a light would estimate;
// those are therefore never kept.
#pragma once

#include "render/geometry/intersector.h"
#include "render/math/rgb.h"
#include "render/math/sobol.h"
#include "render/tracing/facet_sides.h"
#include "render/transport/bsdf.h"
#include "render/transport/light.h"
#include "render/transport/media.h"

namespace lucerna {

// A point where direct light is estimated.
struct ShadingPoint {
  const SurfacePoint& surface;
  const Material& material;
  const Frame& frame;               // around the shading normal, on the outside
  Vec3 wo;                          // towards the eye, world
  const Media* media = nullptr;     // nullptr: there are none
  std::int32_t medium = kNoMedium;  // on the eye's side
  // Of a material with two parts, which are sampled apart: the probability of the first one. Below
  // 0: of any other material.
  float share_of_first = -1;
  FacetSides sides = {};  // of the path from the eye
};

// Where light arrives for which lights are drawn: of a material through which none passes, light
// from behind does not count.
[[nodiscard]] LitPoint LitPointOf(const SurfacePoint& surface, const Material& material, Vec3 wo);

// The weight of a sample drawn with density `drawn` beside one that could have been drawn with
// `other`. Densities are divided by the larger one first, so that squares neither overflow nor
// vanish.
[[nodiscard]] float PowerHeuristic(float drawn, float other);

// From a surface to a light that was drawn there. Both ends are clear of their surfaces, so nothing
// but a third surface can be met.
[[nodiscard]] Ray ShadowRay(const SurfacePoint& surface, const LightSample& light);

// Radiance towards wo of light drawn from the lights: BSDF × light × MIS weight × what media leave,
// zero when something is in the way. `rays` counts what was traced.
[[nodiscard]] Rgb LightSampledRadiance(const Intersector& intersector, const LightSet& lights,
                                       const ShadingPoint& point, const SobolPoint& u, int& rays);

}  // namespace lucerna
