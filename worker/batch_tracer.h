// What do these photons bring to those hitpoints?
//
// The worker's side of the estimator, without any knowledge of the wire. Of a pass that is split it
// traces a range of photon paths, sorts where they land, lets the hitpoints gather, and returns the
// accumulation. Of a slice of passes it traces the eye paths too, and returns what they brought to
// every pixel. The result depends on the arguments alone, never on threads; two ranges side by side
// give results that make that of the whole range.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

#include "render/analysis/needs.h"
#include "render/base/parallel.h"
#include "render/base/status.h"
#include "render/estimate/accumulation.h"
#include "render/estimate/hitpoint_block.h"
#include "render/estimate/slice_sums.h"
#include "render/scene/render_settings.h"
#include "render/scene/scene.h"
#include "render/tracing/pass_slice.h"

namespace lucerna {

class BatchTracer {
 public:
  // threads = 0: all the machine has.
  BatchTracer(Scene scene, int threads);
  ~BatchTracer();

  // Traces photons [first, last) of `pass`, which has `photons_per_pass` (0: as in `settings`),
  // drawn by `guide` (nullptr: evenly).
  // `needs` are those of the scene and these settings; what they need is made with the first
  // batch of a job. One call at a time. Errors: INVALID_ARGUMENT when block and radii do not fit
  // each other or the scene, CANCELLED soon (milliseconds) after `stop` becomes true,
  // RESOURCE_EXHAUSTED when memory runs out, INTERNAL when Embree refuses the scene.
  [[nodiscard]] StatusOr<Accumulation> Run(const RenderSettings& settings, const SceneNeeds& needs,
                                           std::uint64_t pass, std::uint64_t first,
                                           std::uint64_t last, const HitpointBlock& block,
                                           const RadiusColumn& radii, const std::atomic<bool>& stop,
                                           std::uint64_t photons_per_pass = 0,
                                           const PhotonGuide* guide = nullptr);

  // Traces the passes of a slice, all photons of each. Otherwise as Run.
  // Errors: also OUT_OF_RANGE when sums would not fit.
  [[nodiscard]] StatusOr<SliceSums> RunSlice(const RenderSettings& settings,
                                             const SceneNeeds& needs, const PassRange& passes,
                                             const RoundPlan& plan, const std::atomic<bool>& stop);

  // That does all of it.
  [[nodiscard]] ThreadTeam& team();

 private:
  // Photons of a pass, drawn by `guide` (nullptr: evenly).
  struct PhotonRange {
    std::uint64_t pass, first, last;
    std::uint64_t photons_per_pass;  // 0: as in the settings
    const PhotonGuide* guide;
  };
  // What the hitpoints gather of these photons. Adds the names of the first that were dropped.
  // Requires hitpoints, photons and radii that fit, and a scene prepared for the pass.
  StatusOr<PassSums> GatherPhotons(const RenderSettings& settings, const SceneNeeds& needs,
                                   const PhotonRange& range, const HitpointBlock& block,
                                   const RadiusColumn& radii, const std::atomic<bool>& stop,
                                   std::vector<std::uint64_t>& dropped_photons);
  StatusOr<SliceSums> RunPass(const RenderSettings& settings, const SceneNeeds& needs,
                              std::uint64_t pass, const RoundPlan& plan,
                              const std::atomic<bool>& stop);

  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lucerna
