// Do a job's image and scene fit into the coordinator's memory?
//
// Asked before anything is allocated: a coordinator that the system ends for want of memory takes
// the other jobs with it.
#pragma once

#include <cstdint>

#include "render/analysis/needs.h"
#include "render/analysis/scene_memory.h"
#include "render/base/status.h"
#include "render/scene/render_settings.h"

namespace lucerna {

// What a job holds of the coordinator's memory while it can go on [bytes]: its image's sums, what
// error estimates are made from, and `scene_memory` of the scene. A checkpoint is written from
// where the sums lie; reading one takes less than the rounds that are open later.
[[nodiscard]] std::uint64_t MemoryNeedOf(const SceneNeeds& needs, const RenderSettings& settings,
                                         std::uint64_t scene_memory);
// What a job holds of its scene, with what building it takes for a while [bytes].
[[nodiscard]] inline std::uint64_t HeldOfScene(const SceneMemory& memory) {
  return static_cast<std::uint64_t>(memory.KeptByCoordinator() + memory.building_trees);
}
// About how large the checkpoint of a job of so many pixels is [bytes].
[[nodiscard]] std::uint64_t CheckpointBytes(std::uint64_t pixels);
// A guess of what a scene of so many bytes as files takes, before it has been read [bytes].
[[nodiscard]] std::uint64_t GuessSceneMemory(std::uint64_t scene_bytes);

// For a scene that has been read, before what a job needs is found. Errors: RESOURCE_EXHAUSTED that
// says what the scene takes, and what to do about it.
[[nodiscard]] Status CheckSceneMemory(const SceneMemory& scene, std::uint64_t available_bytes);
// Errors: RESOURCE_EXHAUSTED that names the image, what it and its scene take, and what to do about
// it.
[[nodiscard]] Status CheckMemory(const SceneNeeds& needs, const RenderSettings& settings,
                                 const SceneMemory& scene, std::uint64_t available_bytes);

}  // namespace lucerna
