// What passes a dielectric coat over a base, and what the base gets back from it.
//
// The coat is a surface, smooth or of GGX facets, of index `ior`, over a layer that absorbs
// exp(-thickness / cos) of what crosses it once at that angle, as pbrt-v4's LayeredBxDF with
// default albedo. A diffuse base forgets directions, so that what it scatters
// out of the coat is a product:
//
//     f(wo, wi) = E(wo) · E(wi) / ior² · ρ/π · (1 + ρK + (ρK)² + ...)
//
// with E the flux that comes down to the base of what falls in from a direction, K the share of
// the base's light that comes back to it, and ρ the base's reflectance. No approximation is in it
// but the tables: E and K of rough coats are averages over facets, computed once for a material.
//
// Sources: Walter et al. 2007 (as in transport/microfacet.h); Weidlich & Wilkie 2007, "Arbitrarily
// Layered Micro-Facet Surfaces"; Saunderson 1942, "Calculation of the Color of Pigmented Plastics"
// (the sum).
#pragma once

#include <memory>

#include "render/math/vector.h"
#include "render/scene/coat_table.h"
#include "render/scene/scene.h"

namespace lucerna {

// Gives coated materials their tables. Materials with equal coats share one.
void PrepareCoats(std::vector<Material>& materials);

// E(w), in [0, 1]: of a direction on the outside, w.z > 0, in flux. Requires a prepared material.
[[nodiscard]] float CoatEntering(const Material& material, Vec3 w);

// K and the flux that leaves the coat of what the base scatters, both in [0, 1], of a prepared
// material.
[[nodiscard]] float CoatInner(const Material& material);
[[nodiscard]] float CoatLeaving(const Material& material);

}  // namespace lucerna
