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

#include "render/base/status.h"
#include "render/estimate/accumulation.h"
#include "render/estimate/hitpoint_block.h"
#include "render/scene/render_settings.h"
#include "render/scene/scene.h"

namespace lucerna {

class BatchTracer {
 public:
  // Keeps `scene`. threads = 0: all the machine has. Errors: as JobEstimator::Create.
  [[nodiscard]] static StatusOr<std::unique_ptr<BatchTracer>> Create(Scene scene, int threads);
  ~BatchTracer();

  // Traces photons [first, last) of `pass`. One call at a time.
  // Errors: INVALID_ARGUMENT when block and radii do not fit each other or the scene, CANCELLED
  // soon (milliseconds) after `stop` becomes true.
  [[nodiscard]] StatusOr<Accumulation> Run(const RenderSettings& settings, std::uint64_t pass,
                                           std::uint64_t first, std::uint64_t last,
                                           const HitpointBlock& block, const RadiusColumn& radii,
                                           const std::atomic<bool>& stop);

 private:
  struct State;
  explicit BatchTracer(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace lucerna
