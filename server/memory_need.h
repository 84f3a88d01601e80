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

// What a job holds of the coordinator's memory while it can go on [bytes]: its image's sums, the
// copies that error estimates and checkpoints are made from, and the scene of `scene_bytes` as
// files.
[[nodiscard]] std::uint64_t MemoryNeedOf(const SceneNeeds& needs, const RenderSettings& settings,
                                         std::uint64_t scene_bytes, bool keeps_checkpoints);
// About how large the checkpoint of a job of so many pixels is [bytes].
[[nodiscard]] std::uint64_t CheckpointBytes(std::uint64_t pixels);
// Of a scene of so many bytes as files, with the tree over its shapes [bytes].
[[nodiscard]] std::uint64_t SceneMemory(std::uint64_t scene_bytes);

// Errors: RESOURCE_EXHAUSTED that names the image, what it takes, and what to do about it.
[[nodiscard]] Status CheckMemory(const SceneNeeds& needs, const RenderSettings& settings,
                                 std::uint64_t available_bytes);

}  // namespace lucerna
