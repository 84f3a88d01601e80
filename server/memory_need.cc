#include "server/memory_need.h"

#include "absl/strings/str_format.h"

#include "render/analysis/expected_cost.h"

namespace lucerna {
namespace {

// Bytes a pixel: of a checkpoint as a file (sums, and the photons that were reported), and, beside
// what ExpectedCostOf counts, of an error estimate at its highest and of the first passes' squared
// deviations.
constexpr std::uint64_t kCheckpoint = 227 + 2 * 14;
constexpr std::uint64_t kEstimate = 64;
constexpr std::uint64_t kPassVariance = 12;
// Memory for a byte of a file: binary meshes become as much again with the tree over their
// triangles three times; text becomes less.
constexpr std::uint64_t kPerSceneByte = 4;
constexpr double kGigabyte = 1e9;

}  // namespace

std::uint64_t GuessSceneMemory(std::uint64_t scene_bytes) {
  return kPerSceneByte * scene_bytes;
}

std::uint64_t CheckpointBytes(std::uint64_t pixels) {
  return kCheckpoint * pixels;
}

std::uint64_t MemoryNeedOf(const SceneNeeds& needs, const RenderSettings& settings,
                           std::uint64_t scene_memory) {
  const auto pixels = static_cast<std::uint64_t>(settings.crop_width()) *
                      static_cast<std::uint64_t>(settings.crop_height());
  return static_cast<std::uint64_t>(ExpectedCostOf(needs, settings).coordinator) +
         pixels * (kEstimate + kPassVariance) + scene_memory;
}

Status CheckSceneMemory(const SceneMemory& scene, std::uint64_t available_bytes) {
  const double needed = scene.PeakOfCoordinator();
  const auto available = static_cast<double>(available_bytes);
  if (needed <= available) return absl::OkStatus();
  return absl::ResourceExhaustedError(
      absl::StrFormat("the scene takes %.2f GB of the coordinator's memory (meshes %.2f, images "
                      "%.2f), of which %.2f "
                      "GB are free for one job; use fewer triangles or smaller images, or start "
                      "the coordinator with "
                      "a larger --max-job-bytes",
                      needed / kGigabyte, (needed - scene.textures) / kGigabyte,
                      scene.textures / kGigabyte, available / kGigabyte));
}

Status CheckMemory(const SceneNeeds& needs, const RenderSettings& settings,
                   const SceneMemory& scene, std::uint64_t available_bytes) {
  LUCERNA_RETURN_IF_ERROR(CheckSceneMemory(scene, available_bytes));
  const double image = ExpectedCostOf(needs, settings).coordinator;
  const double of_scene = scene.KeptByCoordinator() + scene.building_trees;
  const auto available = static_cast<double>(available_bytes);
  if (image + of_scene <= available) return absl::OkStatus();
  return absl::ResourceExhaustedError(absl::StrFormat(
      "an image of %dx%d pixels takes %.1f GB of the coordinator's memory and its scene %.1f GB, "
      "and "
      "%.1f GB are free for one job; make it smaller, or render it in parts with the film's "
      "cropwindow",
      settings.crop_width(), settings.crop_height(), image / kGigabyte, of_scene / kGigabyte,
      available / kGigabyte));
}

}  // namespace lucerna
