#include "render/analysis/expected_cost.h"

#include <algorithm>
#include <cstdint>

#include "render/estimate/evidence.h"
#include "render/estimate/hitpoint_block.h"
#include "render/estimate/radius_controller.h"

namespace lucerna {
namespace {

// Bytes a pixel, measured (docs/numerics.md, docs/measurements.md): of the coordinator for a job
// without evidence whose first passes are split between several workers, and of a worker.
constexpr double kCoordinator = 560;
constexpr double kWorker = 320;
// Of a coordinator, while it makes a denoised image, beyond what it has let go of by then.
constexpr double kDenoising = 120;
// Of both, for each hitpoint of eye paths beside the first ones of their pixels.
constexpr double kMoreHitpoint = 110;
// Of both, for each column of evidence of the slices that they hold.
constexpr double kEvidenceColumn = 16;
// Bytes a hitpoint: compressed, with and without what glossy ones need.
constexpr double kPlainBlock = 6.5;
constexpr double kGlossyBlock = 14;
constexpr double kRadius = 2.5;
// Of hitpoints for caustic photons and of segments in media, wherever a pass is traced, and of what
// several workers return of them.
constexpr double kCausticHitpoint = 420;

}  // namespace

ExpectedCost ExpectedCostOf(const SceneNeeds& needs, const RenderSettings& settings) {
  const double pixels = static_cast<double>(settings.crop_width()) * settings.crop_height();
  const auto columns =
      static_cast<double>(EvidenceColumns(EvidenceOf(settings.radius_controller, 0)));
  const auto numbers = static_cast<double>(MakeRadiusController(settings, 1)->MemoryPerPixel());
  const double block = needs.Uses(Part::kGlossy) ? kGlossyBlock : kPlainBlock;
  const auto first_hits = static_cast<double>(
      kFirstHitBytes * KeptSets(needs.eye_sample_sets(), static_cast<std::size_t>(pixels)));
  const double rows_beside =
      (needs.Uses(Part::kCausticHitpoints) ? 1 : 0) + (needs.Uses(Part::kMedia) ? 1 : 0);
  // At most two for each pixel (estimate/eye_path_counts.h).
  const bool has_more = !settings.unguided && pixels <= static_cast<double>(kMostPixelsWithMore);
  const double more =
      has_more ? kMoreHitpoint * std::min(2 * pixels, static_cast<double>(kMostMoreEyePaths)) : 0;
  ExpectedCost cost;
  cost.coordinator = pixels * (kCoordinator + (settings.denoise ? kDenoising : 0) +
                               rows_beside * kCausticHitpoint + kEvidenceColumn * columns +
                               sizeof(double) * numbers) +
                     more;
  cost.worker =
      pixels * (kWorker + rows_beside * kCausticHitpoint + kEvidenceColumn * columns + first_hits) +
      more;
  cost.first_pass_sent = pixels * (block + kRadius + rows_beside * (kGlossyBlock + kRadius));
  cost.pass_sent = pixels * kRadius;
  return cost;
}

}  // namespace lucerna
