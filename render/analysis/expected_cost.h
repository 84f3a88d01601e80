// How much memory and traffic a job needs.
//
// From measured figures, roughly; enough to refuse a job that does not fit, and to tell users
// before they start one.
#pragma once

#include "render/analysis/needs.h"
#include "render/scene/render_settings.h"

namespace lucerna {

// In bytes, memory beside the scene itself.
struct ExpectedCost {
  // At its largest: sums over passes, a few slices on their way, and the image as pixels and as a
  // file.
  double coordinator = 0;
  double worker = 0;           // with four photons a pixel and pass
  double first_pass_sent = 0;  // to each worker, as of all passes that are split
  double pass_sent = 0;        // to each worker, once a round of passes
};
[[nodiscard]] ExpectedCost ExpectedCostOf(const SceneNeeds& needs, const RenderSettings& settings);

}  // namespace lucerna
