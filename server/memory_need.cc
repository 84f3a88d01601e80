#include "server/memory_need.h"

#include <cmath>

#include "absl/strings/str_format.h"

#include "render/estimate/evidence.h"
#include "render/estimate/radius_controller.h"

namespace lucerna {
namespace {

// A pixel of a job without evidence. Measured: docs/numerics.md.
constexpr std::uint64_t kBytesPerPixel = 640;
constexpr std::uint64_t kOpenPasses = 2;

}  // namespace

std::uint64_t MemoryNeeded(const RenderSettings& settings) {
  const auto pixels = static_cast<std::uint64_t>(settings.crop_width()) *
                      static_cast<std::uint64_t>(settings.crop_height());
  const std::uint64_t columns = EvidenceColumns(EvidenceOf(settings.radius_controller, 0));
  const std::uint64_t numbers = MakeRadiusController(settings, 1)->MemoryPerPixel();
  return pixels *
         (kBytesPerPixel + sizeof(std::int64_t) * kOpenPasses * columns + sizeof(double) * numbers);
}

Status CheckMemory(const RenderSettings& settings, std::uint64_t available_bytes) {
  const std::uint64_t needed = MemoryNeeded(settings);
  if (needed <= available_bytes) return absl::OkStatus();
  constexpr double kGigabyte = 1e9;
  return absl::ResourceExhaustedError(absl::StrFormat(
      "an image of %dx%d pixels takes %.1f GB of the coordinator's memory, of which %.1f GB are "
      "free for one job; make it smaller, or render it in parts with the film's cropwindow",
      settings.crop_width(), settings.crop_height(), static_cast<double>(needed) / kGigabyte,
      static_cast<double>(available_bytes) / kGigabyte));
}

}  // namespace lucerna
