// Where do the eye paths of one pass end, and what light do they bring without photons?
//
// One eye path per pixel and pass goes from the camera through smooth surfaces until it meets one
// where photons can be gathered; that is its hitpoint. Emission seen on the way and direct light
// at the hitpoint are added here; photons later bring the rest.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "render/base/parallel.h"
#include "render/estimate/hitpoint_block.h"
#include "render/math/rgb.h"
#include "render/math/vector.h"
#include "render/tracing/eye_path.h"
#include "render/tracing/film_spread.h"
#include "render/tracing/first_hits.h"

namespace lucerna {

struct EyePass {
  std::uint64_t pass = 0;
  bool is_whole = true;  // else it was given up, and what is below is of no use
  HitpointBlock block;
  // Per hitpoint, in the block's order. The rows of a pixel lie side by side among the ordinary
  // rows, among the caustic ones and among the segments: each of its paths has at most one there.
  std::vector<std::uint32_t> pixels;  // row-major in the crop window
  std::vector<Rgb> weights;           // from gathered flux density to the pixel's radiance
  std::vector<float> unit_radii;      // length of a radius of 1 [scene units]
  // In passes that compare eye paths (ComparesEyePaths): which path of its pixel a hitpoint belongs
  // to; else empty.
  std::vector<std::uint8_t> paths;
  // Per pixel of the crop window.
  std::vector<Rgb> direct;
  // Where two paths are compared: that of the first less that of the second, else black or empty.
  std::vector<Rgb> direct_difference;
  std::vector<EyeFeatures> features;  // empty in passes whose slices have none (HasFeatures)
  std::uint64_t rays = 0;
};

// Traces the eye paths of every pixel, as many as `counts` has (nullptr: one each): a pixel is the
// mean of its paths. Depends on the tracer's job, `pass` and `counts` alone; `known` (or nullptr),
// what the camera's rays of first paths meet, is used or filled and saves time alone. `spread` is
// of the same tracer. `shall_stop` may be empty; it is asked before every 256 pixels, by several
// threads, and once it is true the pass is given up.
[[nodiscard]] EyePass TraceHitpointPass(const EyePathTracer& tracer, std::uint64_t pass,
                                        FirstHitsOfSet* known, FilmSpread& spread, ThreadTeam& team,
                                        const std::function<bool()>& shall_stop = nullptr,
                                        const EyePathCounts* counts = nullptr);

// Where the hitpoints of the first pass are, and how many pixels have one.
struct HitpointExtent {
  Bounds bounds;
  float widest_unit_radius = 0;
  double rows_per_pixel = 0;
};

// Of at most about 16,384 evenly spaced pixels, or of all where these have no hitpoint.
[[nodiscard]] HitpointExtent SampleExtent(const EyePathTracer& tracer);

}  // namespace lucerna
