// What will a job use of the machine, what is left out, and why?
#pragma once

#include <string>

#include "client/output_options.h"
#include "client/scene_reading.h"
#include "render/base/status.h"
#include "render/scene/render_settings.h"

namespace lucerna {

// Reads the scene and prints its plan; nothing is rendered.
// Errors: as ReadSceneOfJobs.
[[nodiscard]] Status PrintPlan(const SceneSource& source, const RenderOverrides& overrides,
                               const OutputOptions& output_options);

}  // namespace lucerna
