// What do these photons bring to those hitpoints?
//
// The worker's side of the estimator, without any knowledge of the wire: traces a range of photon
// paths of one pass, sorts where they land, lets the hitpoints gather, and returns the
// accumulation. The result depends on the arguments alone, never on threads; two ranges side by
// side give accumulations whose sum is that of the whole range.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>

#include "render/analysis/needs.h"
#include "render/base/status.h"
#include "render/estimate/accumulation.h"
#include "render/estimate/hitpoint_block.h"
#include "render/scene/render_settings.h"
#include "render/scene/scene.h"

namespace lucerna {

class BatchTracer {
 public:
  // threads = 0: all the machine has.
  BatchTracer(Scene scene, int threads);
  ~BatchTracer();

  // Traces photons [first, last) of `pass`. `needs` are those of the scene and these settings; what
  // they ask for is made with the first batch of a job. One call at a time.
  // Errors: INVALID_ARGUMENT when block and radii do not fit each other or the scene, CANCELLED
  // soon (milliseconds) after `stop` becomes true, RESOURCE_EXHAUSTED when memory runs out,
  // INTERNAL when Embree refuses the scene.
  [[nodiscard]] StatusOr<Accumulation> Run(const RenderSettings& settings, const SceneNeeds& needs,
                                           std::uint64_t pass, std::uint64_t first,
                                           std::uint64_t last, const HitpointBlock& block,
                                           const RadiusColumn& radii,
                                           const std::atomic<bool>& stop);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lucerna
