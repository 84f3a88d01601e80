// Where does light that goes below a surface come out again?
//
// Of the light that meets a surface from a direction wi at one point, this much leaves towards wo
// at another, at a distance d:
//
//     S(wo, wi, d) = E(wo) · R(d) · E(wi) / (π · Ē)
//
// E is the flux that the surface lets through (CoatEntering), Ē its mean over directions, and R
// what comes out per area of a flux of 1 that enters a half space: on a flat surface all of R
// together is the material's reflectance. So the second part of such a material is a separable
// BSDF whose light is gathered, or leaves, somewhere else. Seen from both sides S is the same, and
// photons go below as eye paths do.
//
// Sources: Habel et al. 2013, "Photon Beam Diffusion: A Hybrid Monte Carlo Method for Subsurface
// Scattering" (R, with its boundary and its correction near the beam); d'Eon & Irving 2011, "A
// Quantized-Diffusion Model for Rendering Translucent Materials" (the diffusion coefficient, the
// boundary); King et al. 2013, "BSSRDF Importance Sampling" (points by probes along three axes).
#pragma once

#include <vector>

#include "render/geometry/intersector.h"
#include "render/math/rgb.h"
#include "render/scene/scene.h"
#include "render/scene/subsurface_table.h"

namespace lucerna {

// Gives materials that scatter below their surface their tables, and those that are given by
// coefficients the reflectance that follows. Materials of equal index and phase function share a
// table, which takes some 0.04 s; threads as in ThreadTeam, with the same tables for any number.
// Requires a scene in the working space.
void PrepareSubsurface(std::vector<Material>& materials, int threads = 1);

// The table of R for an index of refraction >= 1 and a phase function of mean cosine g (Henyey &
// Greenstein 1941).
[[nodiscard]] SubsurfaceTable MakeSubsurfaceTable(float ior, float g);

// Where a path that went below a surface leaves it.
struct LeftBelow {
  SurfacePoint surface;
  Vec3 up;  // its shading normal, on the side that the path came from
  // Of what enters per reflectance, over the density of the choice; its mean is 1 for all channels
  // on a plane.
  Rgb weight;
};

// Draws the point where a path leaves that went below `surface`, whose material is `material`
// (MaterialAt), on the side of `wo`. False where the draw meets no surface of that material.
// u_axis, u_radius, u_turn, u_choice in [0, 1). `rays` counts what was traced.
[[nodiscard]] bool SampleBelow(const Scene& scene, const Intersector& intersector,
                               const Material& material, const SurfacePoint& surface, Vec3 wo,
                               float u_axis, float u_radius, float u_turn, float u_choice,
                               LeftBelow& left, int& rays);

}  // namespace lucerna
