// Does a job's image fit into the coordinator's memory?
//
// Asked before anything is allocated: a coordinator that the system ends for want of memory takes
// the other jobs with it.
#pragma once

#include <cstdint>

#include "render/analysis/needs.h"
#include "render/base/status.h"
#include "render/scene/render_settings.h"

namespace lucerna {

// Errors: RESOURCE_EXHAUSTED that names the image, what it takes, and what to do about it.
[[nodiscard]] Status CheckMemory(const SceneNeeds& needs, const RenderSettings& settings,
                                 std::uint64_t available_bytes);

}  // namespace lucerna
