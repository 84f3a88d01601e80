#include "server/memory_need.h"

#include "absl/strings/str_format.h"

#include "render/analysis/expected_cost.h"

namespace lucerna {

Status CheckMemory(const SceneNeeds& needs, const RenderSettings& settings,
                   std::uint64_t available_bytes) {
  const double needed = ExpectedCostOf(needs, settings).coordinator;
  const auto available = static_cast<double>(available_bytes);
  if (needed <= available) return absl::OkStatus();
  constexpr double kGigabyte = 1e9;
  return absl::ResourceExhaustedError(absl::StrFormat(
      "an image of %dx%d pixels takes %.1f GB of the coordinator's memory, of which %.1f GB are "
      "free for one job; make it smaller, or render it in parts with the film's cropwindow",
      settings.crop_width(), settings.crop_height(), needed / kGigabyte, available / kGigabyte));
}

}  // namespace lucerna
