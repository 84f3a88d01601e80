#include "render/analysis/expected_cost.h"

#include <cstdint>

#include "render/estimate/evidence.h"
#include "render/estimate/radius_controller.h"

namespace lucerna {
namespace {

// Bytes a pixel, measured (docs/numerics.md, docs/measurements.md): of the coordinator for a job
// without evidence, and of a worker.
constexpr double kCoordinator = 640;
constexpr double kWorker = 311;
// Bytes a hitpoint: compressed, with and without what glossy ones need, and as workers keep it.
constexpr double kBlock = 6.5;
constexpr double kGlossyBlock = 14;
constexpr double kKeptBlock = 16;
constexpr double kFirstHit = 4;
constexpr double kRadius = 2.5;
constexpr double kOpenPasses = 2;
// Of the coordinator, by the columns of a second set of statistics, rows and sums; and of a worker.
constexpr double kCausticHitpoint = 370;
constexpr double kCausticOfWorker = 100;

}  // namespace

ExpectedCost ExpectedCostOf(const SceneNeeds& needs, const RenderSettings& settings) {
  const double pixels = static_cast<double>(settings.crop_width()) * settings.crop_height();
  const auto columns =
      static_cast<double>(EvidenceColumns(EvidenceOf(settings.radius_controller, 0)));
  const auto numbers = static_cast<double>(MakeRadiusController(settings, 1)->MemoryPerPixel());
  const double block = needs.Uses(Part::kGlossy) ? kGlossyBlock : kBlock;
  const double sets = needs.eye_sample_sets();
  const double caustic_rows = needs.Uses(Part::kCausticHitpoints) ? 1 : 0;
  ExpectedCost cost;
  cost.coordinator = pixels * (kCoordinator + caustic_rows * kCausticHitpoint +
                               sizeof(std::int64_t) * kOpenPasses * columns +
                               sizeof(double) * numbers + sets * (block + kFirstHit));
  cost.worker = pixels * (kWorker + caustic_rows * kCausticOfWorker + sets * kKeptBlock);
  cost.first_pass_sent = pixels * (block + kRadius + caustic_rows * (kGlossyBlock + kRadius));
  cost.pass_sent = sets > 0 ? pixels * kRadius : cost.first_pass_sent;
  return cost;
}

}  // namespace lucerna
