// Radii shrink as the papers' formulas say, computed here by hand.
#include "render/estimate/radius_controller.h"

#include <cmath>

#include "gtest/gtest.h"

namespace lucerna {
namespace {

std::unique_ptr<RadiusController> Make(RadiusControllerKind kind, double alpha) {
  RenderSettings settings;
  settings.radius_controller = kind;
  settings.alpha = alpha;
  return MakeRadiusController(settings);
}

// Hachisuka et al. 2008: N' = N + αM, r' = r sqrt((N + αM) / (N + M)).
TEST(PpmTest, KeepsAShareOfThePhotons) {
  const auto ppm = Make(RadiusControllerKind::kPpm, 2.0 / 3);
  const PixelRadius first = ppm->Next({1, 0}, {100, 1}, 0);
  EXPECT_NEAR(first.photons, 66.66667, 1e-4);
  EXPECT_NEAR(first.radius, 0.8164966, 1e-6);
  const PixelRadius next = ppm->Next({1, 100}, {50, 1}, 1);
  EXPECT_NEAR(next.photons, 133.33333, 1e-4);
  EXPECT_NEAR(next.radius, 0.942809, 1e-6);
}

TEST(PpmTest, KeepsItsRadiusWithoutPhotons) {
  const auto ppm = Make(RadiusControllerKind::kPpm, 0.7);
  const PixelRadius still = ppm->Next({0.3F, 12}, {0, 0.4F}, 3);
  EXPECT_EQ(still.radius, 0.3F);
  EXPECT_EQ(still.photons, 12);
}

// Gathered in a disc of twice the radius, a quarter of the photons belong to today's.
TEST(PpmTest, CountsOnlyWhatTodaysDiscWouldHaveHeld) {
  const auto ppm = Make(RadiusControllerKind::kPpm, 2.0 / 3);
  const PixelRadius lagging = ppm->Next({1, 100}, {200, 2}, 4);
  const PixelRadius direct = ppm->Next({1, 100}, {50, 1}, 4);
  EXPECT_FLOAT_EQ(lagging.radius, direct.radius);
  EXPECT_FLOAT_EQ(lagging.photons, direct.photons);
}

// With M photons in every first disc, M r² of them in a disc of radius r, N + αM must keep the
// density: N_k / r_k² grows by M every pass.
TEST(PpmTest, KeepsTheDensityOverManyPasses) {
  const auto ppm = Make(RadiusControllerKind::kPpm, 0.8);
  PixelRadius pixel = {1, 0};
  for (std::uint64_t pass = 0; pass < 1000; ++pass) {
    const float r = pixel.radius;
    pixel = ppm->Next(pixel, {100.0 * static_cast<double>(r) * static_cast<double>(r), r}, pass);
    ASSERT_LT(pixel.radius, r);
    const double density = static_cast<double>(pixel.photons) /
                           (static_cast<double>(pixel.radius) * static_cast<double>(pixel.radius));
    ASSERT_NEAR(density / (100.0 * static_cast<double>(pass + 1)), 1, 1e-4) << pass;
  }
}

// Knaus & Zwicker 2011: r_n² = r_1² Π_{i=1}^{n-1} (i + α) / (i + 1).
TEST(PppmTest, FollowsTheProductWhateverThePhotons) {
  const auto pppm = Make(RadiusControllerKind::kPppm, 0.6);
  PixelRadius pixel = {2, 0};
  double squared = 4;
  for (std::uint64_t pass = 0; pass < 200; ++pass) {
    pixel = pppm->Next(pixel, {pass % 3 == 0 ? 0.0 : 7.0, pixel.radius}, pass);
    const auto i = static_cast<double>(pass + 1);
    squared *= (i + 0.6) / (i + 1);
    ASSERT_NEAR(pixel.radius / std::sqrt(squared), 1, 1e-5) << pass;
  }
}

}  // namespace
}  // namespace lucerna
