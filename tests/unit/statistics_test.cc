// Keeping the density of each pass is the same number as Hachisuka's rescaled flux.
#include "render/estimate/statistics.h"

#include <cmath>
#include <numbers>

#include "gtest/gtest.h"

#include "render/estimate/evidence.h"
#include "render/math/rng.h"

namespace lucerna {
namespace {

// One pixel, one hitpoint a pass, PPM with immediate radii: tau' = (tau + Phi) r'^2 / r^2 and
// L = tau / (pi r^2 P passes), as in Hachisuka et al. 2008, against the sum that is kept here.
TEST(PixelStatisticsTest, EqualsTheRescaledFluxOfProgressivePhotonMapping) {
  RenderSettings settings;
  settings.radius_controller = RadiusControllerKind::kPpm;
  settings.alpha = 0.7;
  const auto ppm = MakeRadiusController(settings, 1);
  const Kernel kernel{KernelKind::kConstant};
  const FluxScale scale = FluxScale::ForPower({3, 5, 0.1F});
  constexpr std::int64_t kPhotons = 1000;
  PixelStatistics statistics(1, 0.25F);
  const std::vector<std::uint32_t> pixels = {0};
  const std::vector<Rgb> weights = {{1, 1, 1}};
  const std::vector<float> units = {1};
  const HitpointRows rows = {pixels, weights, units};
  std::vector<RgbSum> radiance(1);
  std::vector<double> bias(1);
  KeyedRng rng(5);
  double tau = 0;
  double r = 0.25;
  double n = 0;
  for (int pass = 0; pass < 300; ++pass) {
    Accumulation accumulation;
    const std::uint32_t m = static_cast<std::uint32_t>(rng.Bits() % 20);
    const auto quanta = static_cast<std::int64_t>(rng.Bits() % 5000000);
    if (m > 0) {
      accumulation.hitpoints = {0};
      accumulation.counts = {m};
      for (auto& channel : accumulation.flux)
        channel = {quanta};
    }
    accumulation.evidence.assign(kCommonColumns, std::vector<std::int64_t>(accumulation.size()));
    PassSums sums(1, kCommonColumns);
    ASSERT_TRUE(sums.Add(accumulation).ok());
    const RadiusColumn radii = statistics.Radii(rows, static_cast<std::uint64_t>(pass + 1));
    statistics.AddPhotons(rows, radii, sums, scale, kernel, kPhotons, *ppm, radiance, bias);
    if (m == 0) continue;
    tau += static_cast<double>(quanta) * static_cast<double>(scale.watts_per_quantum.g);
    const double ratio = (n + settings.alpha * m) / (n + m);
    tau *= ratio;
    r *= std::sqrt(ratio);
    n += settings.alpha * m;
  }
  const double hachisuka = tau / (std::numbers::pi * r * r * kPhotons);
  EXPECT_NEAR(statistics.radiance_sum()[0][1] / hachisuka, 1, 1e-6 * std::sqrt(300.0));
  EXPECT_NEAR(static_cast<double>(statistics.Radii(rows, 301)[0]) / r, 1, 1e-5);
}

// 1e12 photons a pass that all reach one hitpoint, each with its 2^18 quanta. Integers of 58 bits
// become doubles, whose rounding is all that may be seen.
TEST(PixelStatisticsTest, KeepsItsDigitsWithATrillionPhotonsAPass) {
  RenderSettings settings;
  settings.radius_controller = RadiusControllerKind::kPppm;
  const auto controller = MakeRadiusController(settings, 1);
  const Kernel kernel{KernelKind::kConstant};
  const FluxScale scale = FluxScale::ForPower(Gray(1));
  constexpr std::int64_t kPhotons = 1'000'000'000'000;
  constexpr int kPasses = 16;
  PixelStatistics statistics(1, 0.25F);
  const std::vector<std::uint32_t> pixels = {0};
  const std::vector<Rgb> weights = {{1, 1, 1}};
  const std::vector<float> units = {1};
  const HitpointRows rows = {pixels, weights, units};
  std::vector<RgbSum> radiance(1);
  std::vector<double> bias(1);
  long double expected = 0;
  for (int pass = 0; pass < kPasses; ++pass) {
    PassSums sums(1, kCommonColumns);
    Accumulation batch;
    batch.hitpoints = {0};
    batch.counts = {4'000'000'000};
    for (auto& channel : batch.flux)
      channel = {std::int64_t{4'000'000'000} << kFluxBits};
    batch.evidence.assign(kCommonColumns, {0});
    for (int i = 0; i < 250; ++i)
      ASSERT_TRUE(sums.Add(batch).ok());
    const RadiusColumn radii = statistics.Radii(rows, static_cast<std::uint64_t>(pass));
    const long double radius = static_cast<long double>(radii[0]);
    expected += 1 / (std::numbers::pi_v<long double> * radius * radius);
    statistics.AddPhotons(rows, radii, sums, scale, kernel, kPhotons, *controller, radiance, bias);
  }
  EXPECT_EQ(statistics.photon_count()[0], std::uint64_t{kPasses} * kPhotons);
  // A few roundings of 2^-53 for each term and each addition.
  EXPECT_NEAR(statistics.radiance_sum()[0][1] / static_cast<double>(expected), 1,
              10 * kPasses * 0x1p-53);
  EXPECT_LE(static_cast<double>(statistics.Radii(rows, kPasses)[0]), 0.25);
}

TEST(PixelStatisticsTest, CountsAPassWithoutHitpointAsDark) {
  PixelStatistics statistics(2, 1);
  RenderSettings settings;
  settings.radius_controller = RadiusControllerKind::kPpm;
  const auto ppm = MakeRadiusController(settings, 1);
  const std::vector<std::uint32_t> pixels = {1};
  const std::vector<Rgb> weights = {{2, 0, -1}};
  const std::vector<float> units = {0.5F};
  const HitpointRows rows = {pixels, weights, units};
  PassSums sums(1, kCommonColumns);
  Accumulation accumulation;
  accumulation.hitpoints = {0};
  accumulation.counts = {3};
  for (auto& channel : accumulation.flux)
    channel = {8};
  accumulation.evidence = {{4}};
  ASSERT_TRUE(sums.Add(accumulation).ok());
  const RadiusColumn radii = statistics.Radii(rows, 0);
  ASSERT_EQ(radii[0], 0.5F);
  const FluxScale scale = {Gray(1), Gray(1)};
  std::vector<RgbSum> radiance(2, RgbSum{1, 1, 1});
  std::vector<double> bias(2);
  statistics.AddPhotons(rows, radii, sums, scale, Kernel{KernelKind::kEpanechnikov}, 4, *ppm,
                        radiance, bias);
  statistics.AddPhotons({}, {}, PassSums(0, kCommonColumns), scale, Kernel{}, 4, *ppm, radiance,
                        bias);
  EXPECT_EQ(statistics.passes(), 2);
  EXPECT_EQ(statistics.radiance_sum()[0][0], 0);
  // weight × flux × 2/(π r²) / photons
  const double density = 8 * 2 / (std::numbers::pi * 0.25) / 4;
  EXPECT_NEAR(statistics.radiance_sum()[1][0], 2 * density, 1e-12);
  EXPECT_EQ(statistics.radiance_sum()[1][1], 0);
  EXPECT_NEAR(statistics.radiance_sum()[1][2], -density, 1e-12);
  EXPECT_NEAR(radiance[1][0], 1 + 2 * density, 1e-12);
  EXPECT_EQ(radiance[0][0], 1);
  // Half the flux is outside the inner kernel's share: (4/8) density, over what that kernel leaves.
  const double luminance = 2 * 0.2126 - 0.0722;
  EXPECT_NEAR(bias[1], luminance * density / 2 / (1 - 1.0 / 9), 1e-6);
  EXPECT_EQ(statistics.photon_count()[1], 3U);
  EXPECT_EQ(statistics.last_radius()[1], 0.5F);
}

TEST(PassSumsTest, AddsUpAndRefusesWhatBreaksItsPromises) {
  Accumulation a;
  a.hitpoints = {0, 2};
  a.counts = {1, 2};
  for (auto& channel : a.flux)
    channel = {5, -7};
  a.tally.pairs = 3;
  PassSums sums(3);
  ASSERT_TRUE(sums.Add(a).ok());
  ASSERT_TRUE(sums.Add(a).ok());
  EXPECT_EQ(sums.flux(1), (std::vector<std::int64_t>{10, 0, -14}));

  sums = PassSums(3);
  Accumulation bad = a;
  bad.hitpoints = {2, 0};
  EXPECT_EQ(sums.Add(bad).code(), absl::StatusCode::kInvalidArgument);
  bad.hitpoints = {0, 3};
  EXPECT_EQ(sums.Add(bad).code(), absl::StatusCode::kInvalidArgument);
  bad = a;
  bad.counts = {1, 0};
  EXPECT_EQ(sums.Add(bad).code(), absl::StatusCode::kInvalidArgument);
  bad = a;
  bad.flux[2].pop_back();
  EXPECT_EQ(sums.Add(bad).code(), absl::StatusCode::kInvalidArgument);
  // The second row overflows: the first must not have been added.
  Accumulation large = a;
  large.flux[0] = {1, INT64_MAX};
  ASSERT_TRUE(sums.Add(large).ok());
  EXPECT_EQ(sums.Add(large).code(), absl::StatusCode::kOutOfRange);
  EXPECT_EQ(sums.flux(0), (std::vector<std::int64_t>{1, 0, INT64_MAX}));
}

}  // namespace
}  // namespace lucerna
