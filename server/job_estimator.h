// What is the image, given the photons so far?
//
// The coordinator's side of the estimator for one job, without any knowledge of workers: it
// traces the eye paths of a pass, says which radii its hitpoints use, takes in the pass's merged
// sums, and turns statistics into an image.
//
// Order of calls for pass p (passes count from 0)
//   1. TraceEyePaths(p): any time, also ahead of other passes; depends on p alone.
//   2. Radii(pass): after Apply of pass p-2 and before Apply of pass p, and the same whether before
//   or
//      after that of pass p-1. So workers trace p while stragglers finish p-1, a job can go on
//      after its end, and the result does not depend on when anything happens.
//   3. Apply(pass, radii, sums): in pass order, each pass once, with the radii that 2 gave.
//
// Threads: one caller at a time, except that TraceEyePaths may run beside the others.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "render/analysis/needs.h"
#include "render/base/status.h"
#include "render/estimate/accumulation.h"
#include "render/estimate/error_estimate.h"
#include "render/estimate/hitpoint_block.h"
#include "render/image/image.h"
#include "render/scene/render_settings.h"
#include "render/scene/scene.h"
#include "render/tracing/hitpoint_pass.h"
#include "server/reference_image.h"

namespace lucerna {

// A light that sends photons, and how many of them have come into view.
struct LightFinding {
  std::string name;        // "light 2 (a point light at (0, 1, 2))"
  double power_share = 0;  // of the power of all lights
  LightTally photons;
  // What may be missing because too few photons have found the way, as a share of the image's
  // brightness (estimate/missing_light.h); infinite while the image is black.
  double missing_share = 0;
};

// Light that may not have been found yet.
struct MissingLight {
  std::vector<LightFinding> lights;
  double share = 0;  // the sum of those of the lights
  // What it adds to the upper ends of the intervals of the squared errors.
  double relative = 0, absolute = 0;
  // Lights send photons or are sampled, and the image is black.
  bool nothing_found = false;
};

class JobEstimator {
 public:
  // Keeps `scene`. `needs` are those of scene and settings. Builds what eye paths need; may take
  // seconds for big scenes. threads = 0: all the machine has.
  // Errors: RESOURCE_EXHAUSTED when memory runs out, INTERNAL when Embree refuses the scene.
  [[nodiscard]] static StatusOr<std::unique_ptr<JobEstimator>> Create(Scene scene,
                                                                      RenderSettings settings,
                                                                      SceneNeeds needs,
                                                                      int threads);
  ~JobEstimator();

  [[nodiscard]] EyePass TraceEyePaths(std::uint64_t pass) const;
  [[nodiscard]] RadiusColumn Radii(const EyePass& pass) const;
  // Requires radii and sums of pass.block.size() rows, and pass.pass == passes_applied().
  void Apply(const EyePass& pass, const RadiusColumn& radii, const PassSums& sums);

  [[nodiscard]] std::int64_t passes_applied() const;
  // Rays traced for the passes applied so far.
  [[nodiscard]] std::uint64_t eye_rays() const;
  // The image of the passes applied so far, without metadata. Requires passes_applied() > 0. Layers
  // `noise` (standard deviation of each pixel's luminance) and `bias` from the second pass on.
  [[nodiscard]] Image MakeImage() const;
  // `look` counts the looks at this job, from 1. The upper ends of its intervals hold what may be
  // missing; they are infinite while nothing is found. Requires passes_applied() >= 2.
  [[nodiscard]] ErrorEstimate EstimateError(int look) const;
  // Requires passes_applied() > 0.
  [[nodiscard]] MissingLight FindMissingLight() const;
  // Whether all pixels are black. Requires passes_applied() > 0.
  [[nodiscard]] bool IsBlack() const;
  [[nodiscard]] const SceneNeeds& needs() const;
  // See LightSet.
  [[nodiscard]] std::size_t faint_lights() const;
  // Requires passes_applied() > 0 and a reference as large as the image.
  [[nodiscard]] TrueError ErrorAgainst(const ReferenceImage& reference) const;

 private:
  struct State;
  explicit JobEstimator(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace lucerna
