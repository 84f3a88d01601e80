// Does a job's image fit into the coordinator's memory?
//
// Asked before anything is allocated: a coordinator that the system ends for want of memory takes
// the other jobs with it.
#pragma once

#include <cstdint>

#include "render/base/status.h"
#include "render/scene/render_settings.h"

namespace lucerna {

// What the coordinator takes for a job at its largest [bytes], without the scene: statistics, three
// passes on their way, their hitpoints as bytes, and the image as pixels and as a file.
[[nodiscard]] std::uint64_t MemoryNeeded(const RenderSettings& settings);

// Errors: RESOURCE_EXHAUSTED that names the image, what it takes, and what to do about it.
[[nodiscard]] Status CheckMemory(const RenderSettings& settings, std::uint64_t available_bytes);

}  // namespace lucerna
