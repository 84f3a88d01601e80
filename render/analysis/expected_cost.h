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
  // At its largest: statistics, three passes on their way, their hitpoints as bytes, and the image
  // as pixels and as a file.
  double coordinator = 0;
  double worker = 0;           // with as many photons in a batch as there are pixels
  double first_pass_sent = 0;  // to each worker, while eye paths are new
  double pass_sent = 0;        // to each worker, later
};
[[nodiscard]] ExpectedCost ExpectedCostOf(const SceneNeeds& needs, const RenderSettings& settings);

}  // namespace lucerna
