// A whole render in one process, without the wire: what the coordinator and a worker compute,
// called in turn. For tests and benchmarks of the estimator.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "render/base/status.h"
#include "render/estimate/slice_tree.h"
#include "render/image/image.h"
#include "render/scene/render_settings.h"
#include "render/scene/scene.h"
#include "server/job_estimator.h"
#include "worker/batch_tracer.h"

namespace lucerna {

class LocalRender {
 public:
  // Aborts when the scene cannot be prepared.
  LocalRender(const Scene& scene, const RenderSettings& settings, int threads = 0);

  // Adds one pass, its photons in `batches` ranges, or all of it as a worker traces a slice (0).
  void AddPass(int batches = 1);
  [[nodiscard]] const JobEstimator& estimator() const { return *estimator_; }
  [[nodiscard]] Image MakeImage() const { return estimator_->MakeImage(); }
  [[nodiscard]] ErrorEstimate EstimateError(int look) const {
    const EstimatorSnapshot snapshot = estimator_->Snapshot();
    return estimator_->EstimateError(snapshot, estimator_->FindMissingLight(snapshot), look);
  }
  [[nodiscard]] MissingLight FindMissingLight() const {
    return estimator_->FindMissingLight(estimator_->Snapshot());
  }
  // A checkpoint of the whole rounds, and going on from one in a render without passes.
  [[nodiscard]] std::string Save() const;
  [[nodiscard]] Status Restore(std::string_view bytes);
  [[nodiscard]] EmissionCheck emission_check() const { return estimator_->emission_check(); }
  // Over all passes.
  [[nodiscard]] const BatchTally& tally() const { return tally_; }

 private:
  RenderSettings settings_;
  SceneNeeds needs_;
  std::unique_ptr<JobEstimator> estimator_;
  std::unique_ptr<BatchTracer> tracer_;
  std::uint64_t pass_ = 0;
  std::optional<RoundPlan> plan_;   // of the pass's round
  std::optional<SliceTree> round_;  // its passes so far
  BatchTally tally_;
};

// Renders `passes` passes.
[[nodiscard]] Image RenderLocally(const Scene& scene, const RenderSettings& settings, int passes,
                                  int threads = 0);

// Parses a scene of tests/scenes or an absolute path; aborts with its errors.
[[nodiscard]] Scene LoadScene(const std::string& path);

// Settings of a scene with `overrides`; aborts when they are wrong.
[[nodiscard]] RenderSettings SettingsFor(const Scene& scene, const RenderOverrides& overrides = {});

}  // namespace lucerna
