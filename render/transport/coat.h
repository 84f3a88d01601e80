// What passes a dielectric coat over a base, and what the base gets back from it.
//
// The coat is a surface, smooth or of GGX facets, of index `ior`, over a layer that absorbs
// exp(-thickness / cos) of what crosses it once at that angle, or scatters a part of it, as
// pbrt-v4's LayeredBxDF. A diffuse base forgets directions, so that what it scatters
// out of the coat is a product:
//
//     f(wo, wi) = E(wo) · E(wi) / ior² · ρ/π · (1 + ρK + (ρK)² + ...)
//
// with E the flux that comes down to the base of what falls in from a direction, K the share of
// the base's light that comes back to it, and ρ the base's reflectance. No approximation is in it
// but the tables: E and K of rough coats are averages over facets, computed once for a material.
//
// A metal remembers directions. Of light that meets it once the same product is taken with the
// metal's own BSDF f_m in place of ρ/π, of the directions wo', wi' refracted at the mean surface:
//
//     f(wo, wi) = E(wo) · E(wi) / ior² · f_m(wo', wi') + C · A(wo) · A(wi) / ior² · f_a(wo', wi')
//
// Under a smooth coat the first term is exact, and under a rough one its facets widen f_m
// (BaseWidthSeen), by as much as a fit to a random walk says. Light that its facets turn meets the
// metal more slanted than light that is refracted at the mean surface; what such a metal reflects
// more is added to its reflectance at the half vector, a sum of a number of each direction. The
// second is light that meets the metal more than once: f_a is of facets that are wider by as many
// more meetings of metal and coat, squares of widths added up. C is a sum of powers of the metal's
// reflectance, the mean of one of either direction, and A makes the flux M, which is what the first
// term leaves out of that of a random walk through coat and metal, for a metal that reflects all:
// the flux is that of the walk, the directions are about those.
//
// Where the layer scatters (haze), E and K contain what was scattered and came to the base, and a
// third term B(wo) · B(wi) / (π · B̄) is what leaves without having met it; over a metal M contains
// all that, and the second term is C · M(wo) · M(wi) / (π · M̄). These are of random walks too: the
// flux is right, the directions are those of even scattering.
//
// Sources: Walter et al. 2007 (as in transport/microfacet.h); Weidlich & Wilkie 2007, "Arbitrarily
// Layered Micro-Facet Surfaces"; Saunderson 1942, "Calculation of the Color of Pigmented Plastics"
// (the sum); Kulla & Conty 2017, "Revisiting Physically Based Shading at Imageworks" (the second
// term for metals).
#pragma once

#include <memory>

#include "render/math/vector.h"
#include "render/scene/coat_table.h"
#include "render/scene/scene.h"
#include "render/transport/microfacet.h"

namespace lucerna {

// Of a prepared material whose widths a texture has changed: the tables that suit them. Does
// nothing for other materials.
void FitCoat(MaterialNumbers& material);

// Both sides of a coat are alike: `w` or its opposite, with w.z >= 0.
[[nodiscard]] inline Vec3 Up(Vec3 w) {
  return w.z < 0 ? -w : w;
}

// E(w), in [0, 1]: of a direction on the outside, w.z > 0, in flux. Requires a prepared material.
[[nodiscard]] float CoatEntering(const Material& material, Vec3 w);

// Of a layer that scatters, per channel of its albedo: E with what was scattered, B and B̄.
[[nodiscard]] Rgb HazeEntering(const Material& material, Vec3 w);
[[nodiscard]] Rgb HazeInner(const Material& material);
[[nodiscard]] Rgb HazeBack(const Material& material, float cosine);
[[nodiscard]] Rgb HazeMeanBack(const Material& material);

// K and the flux that leaves the coat of what the base scatters, both in [0, 1], of a prepared
// material.
[[nodiscard]] float CoatInner(const Material& material);
[[nodiscard]] float CoatLeaving(const Material& material);

// Over a metal, of a prepared material: M for a direction at `cosine` outside, in [0, 1].
[[nodiscard]] Rgb CoatResidual(const Material& material, float cosine);
// A for a direction at `cosine` outside, and how often light of that term has met metal and coat
// again on average, of a layer that does not scatter.
[[nodiscard]] float CoatAgain(const Material& material, float cosine);
[[nodiscard]] float CoatMeetingsAgain(const Material& material);
// What a metal makes of that term, of light from a direction at `cosine` outside: CoatTable.
struct CoatMeetings {
  float once = 0, goes_on = 0;
};
[[nodiscard]] CoatMeetings CoatMeetingsOf(const Material& material, float cosine);
// CoatTable::residual_cosines, of a layer that does not scatter.
[[nodiscard]] CoatTable::CosineWeights CoatResidualCosines(const Material& material, float cosine);
// CoatTable::once_cosines, zeros under a smooth coat.
[[nodiscard]] CoatTable::CosineWeights CoatOnceCosines(const Material& material, float cosine);
// CoatTable::widening, of a prepared material.
[[nodiscard]] float CoatWidening(const Material& material);
// Facets of f_m, and of f_a.
[[nodiscard]] Ggx BaseFacets(const Material& material);
[[nodiscard]] Ggx AgainFacets(const Material& material);
// The mean of M over directions with density cosine / π, and the shares of M after 0, 1, 2, ...
// meetings with the metal, hits in [0, CoatTable::kHits].
[[nodiscard]] Rgb CoatMeanResidual(const Material& material);
[[nodiscard]] Rgb CoatShareOfHits(const Material& material, std::size_t hits);
// The share of light that is left after crossing the layer once at `cosine` inside.
[[nodiscard]] float CoatCrossing(const MaterialNumbers& material, float cosine);
// E of a smooth coat for a direction at `cosine` outside, of any coated material.
[[nodiscard]] float SmoothCoatEntering(const MaterialNumbers& material, float cosine);
// w, w.z > 0, as refracted at the mean surface, again away from it: away from the metal. False with
// total reflection.
[[nodiscard]] bool CoatRefracted(const Material& material, Vec3 w, Vec3& inside);

}  // namespace lucerna
