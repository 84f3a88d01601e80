// Reference radiance by forward path tracing, for tests of the estimator.
//
// Paths start at the camera and are continued by BSDF sampling alone: no next-event estimation, no
// photons, no multiple importance sampling. Camera rays, BSDFs, Fresnel terms and emission are
// written anew here; only the geometry (Intersector), the Scene value with its textures, and the
// working space are shared with the estimator. The estimate is unbiased for the scene it is given,
// except for point, spot and distant lights, which BSDF sampling cannot hit:
//   point, spot, goniometric, projection
//                 a sphere of radius r at the light with radiance I(direction) / (π r²): the same
//                 intensity in every direction, from a place up to r off.
//   distant       a cone of directions of half angle a with radiance E / (π sin² a): the same
//                 irradiance on every plane that the whole cone is in front of.
// These emitters block nothing, and are invisible on paths from the camera that have met only
// smooth surfaces, as the lights that they replace. Their size blurs: relative error of order
// (r / distance)² or a², times the curvature of the BSDF lobe over it. Means over blocks of pixels
// that hold a whole highlight keep its energy; a test that uses them shows two sizes.
//
// Sources: Walter et al. 2007, "Microfacet Models for Refraction through Rough Surfaces" (normals
// drawn by D(m)·cosθ and weights of its eq. 41, where the estimator draws visible normals); Heitz
// 2014, "Understanding the Masking-Shadowing Function" (height-correlated Smith term).
#pragma once

#include <cstdint>
#include <vector>

#include "render/scene/scene.h"
#include "tests/support/chi_square.h"

namespace lucerna {

struct PathTracerSettings {
  int width = 8, height = 8;  // [pixels], under a box filter
  // As RenderSettings::max_depth: scattering events up to and with the first surface that gathers
  // photons, and from there to the light one less than that again.
  int max_depth = 40;
  std::uint64_t key = 1;  // of all random numbers
  // Independent estimates of the whole image, from whose spread standard errors are taken, and the
  // paths of each.
  int replicas = 24;
  int paths_per_replica = 10000;
  // Of what stands for point, spot and distant lights.
  float delta_radius = 0.05F;     // [scene units]
  float delta_angle_rad = 0.04F;  // half angle
  int threads = 0;                // 0: as many as the machine has
};

// Pixels [x0, x1) × [y0, y1).
struct PixelBlock {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
};

class TracedImage {
 public:
  TracedImage(int width, int height, int replicas);

  // Of a channel (0 to 2, linear Rec. 709) over a block, with its standard error.
  [[nodiscard]] MeasuredMean MeanOver(const PixelBlock& block, int channel) const;

 private:
  friend class PathTracer;
  int width_, height_, replicas_;
  std::vector<double> radiance_;  // [replicas × pixels × 3] means
};

// Requires a pinhole camera. Aborts when Embree refuses the scene.
[[nodiscard]] TracedImage TracePaths(const Scene& scene, const PathTracerSettings& settings);

}  // namespace lucerna
