// What may be missing must be what the rule of three and Poisson's limits say, and must add to an
// error exactly as much as the worst place for it would.
#include "render/estimate/missing_light.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "gtest/gtest.h"

#include "render/estimate/error_estimate.h"

namespace lucerna {
namespace {

LightPhotons Light(double power_w, std::uint64_t sent, std::uint64_t caustic, std::uint64_t other) {
  return {.power_w = power_w, .tally = {.sent = sent, .in_view = {caustic, other}}};
}

TEST(MissingPhotonsTest, WithNoneFoundItIsTheRuleOfThree) {
  EXPECT_NEAR(MissingPhotons(0), -std::log(0.05), 1e-9);
}

// Upper limits of Poisson's means at 95 %, from tables: 4.744, 6.296, 7.754, 16.962.
TEST(MissingPhotonsTest, WithFewFoundItIsPoissonsLimitLessTheFound) {
  EXPECT_NEAR(MissingPhotons(1), 4.7439 - 1, 1e-4);
  EXPECT_NEAR(MissingPhotons(2), 6.2958 - 2, 1e-4);
  EXPECT_NEAR(MissingPhotons(3), 7.7537 - 3, 1e-4);
  EXPECT_NEAR(MissingPhotons(10), 16.9622 - 10, 1e-4);
  EXPECT_EQ(MissingPhotons(kEnoughPhotons), 0);
  EXPECT_EQ(MissingPhotons(1'000'000'000), 0);
}

// The chance that the true mean is above the limit is 5 % at most, whatever the mean.
TEST(MissingPhotonsTest, HoldsTheTruthInNineteenOfTwenty) {
  std::mt19937_64 random(5);
  for (const double mean : {0.5, 2.0, 3.1, 8.0, 40.0}) {
    std::poisson_distribution<std::uint64_t> found(mean);
    int held = 0;
    constexpr int kTrials = 4000;
    for (int i = 0; i < kTrials; ++i) {
      const std::uint64_t k = found(random);
      held += mean <= static_cast<double>(k) + MissingPhotons(k) ? 1 : 0;
    }
    // Four deviations of a share of 95 %.
    EXPECT_GT(held, kTrials * 0.95 - 4 * std::sqrt(kTrials * 0.95 * 0.05)) << mean;
  }
}

TEST(LargestErrorTest, NoPlaceIsWorse) {
  for (const double share : {1e-6, 1e-3, 0.02, 0.7, 3.0, 1e6}) {
    double relative = 0;
    double absolute = 0;
    // Light on every part of the pixels, evenly in steps of a thousandth of its logarithm.
    for (double part = kTrimmedShare; part <= 1; part *= 1.001) {
      const double error = share / part;
      const double counted = part - kTrimmedShare;
      relative = std::max(relative, counted * std::pow(error / (1 + error), 2));
      absolute = std::max(absolute, counted * error * error);
    }
    EXPECT_LE(relative, LargestRelativeError(share) * (1 + 1e-9)) << share;
    EXPECT_GE(relative, LargestRelativeError(share) * 0.999) << share;
    EXPECT_LE(absolute, LargestAbsoluteError(share) * (1 + 1e-9)) << share;
    EXPECT_GE(absolute, LargestAbsoluteError(share) * 0.999) << share;
  }
  EXPECT_EQ(LargestRelativeError(0), 0);
  EXPECT_EQ(LargestRelativeError(HUGE_VAL), 1 - kTrimmedShare);
}

TEST(MissingSharesTest, ALightThatIsNotFoundCountsThreePhotons) {
  // A watt in view brings 0.2: the first light's 10 W × 5000 / 100,000 = 0.5 W made 0.1.
  const PhotonView view = {
      .has_caustics = false, .photon_radiance = 0.1, .radiance_per_watt = 99, .brightness = 0.5};
  const std::vector<LightPhotons> lights = {Light(10, 100'000, 0, 5000), Light(1000, 6000, 0, 0)};
  const std::vector<double> shares = MissingShares(lights, view);
  EXPECT_EQ(shares[0], 0);
  EXPECT_NEAR(shares[1], 1000 * (-std::log(0.05) / 6000) * 0.2 / 0.5, 1e-9);
}

TEST(MissingSharesTest, FallsAsPhotonsGoOn) {
  const PhotonView view = {
      .has_caustics = false, .photon_radiance = 0.1, .radiance_per_watt = 0, .brightness = 0.5};
  const auto share = [&](std::uint64_t n) {
    return MissingShares(std::vector{Light(10, n, 0, n / 2), Light(10, n, 0, 0)}, view)[1];
  };
  EXPECT_NEAR(share(1'000'000) / share(1000), 1e-3, 1e-9);
}

TEST(MissingSharesTest, CausticsCountWhereThereAreSmoothSurfaces) {
  PhotonView view = {.photon_radiance = 0.1, .radiance_per_watt = 0, .brightness = 0.5};
  const std::vector<LightPhotons> lights = {Light(10, 1000, 0, 500)};
  EXPECT_GT(MissingShares(lights, view)[0], 0);
  view.has_caustics = false;
  EXPECT_EQ(MissingShares(lights, view)[0], 0);
}

TEST(MissingSharesTest, WithoutPhotonsInViewTheVisibleSurfacesTell) {
  const PhotonView view = {
      .has_caustics = false, .photon_radiance = 0, .radiance_per_watt = 2, .brightness = 0.5};
  EXPECT_NEAR(MissingShares(std::vector{Light(10, 3000, 0, 0)}, view)[0],
              10 * -std::log(0.05) / 3000 * 2 / 0.5, 1e-9);
}

TEST(MissingSharesTest, AtTheEnds) {
  PhotonView view = {.photon_radiance = 0, .radiance_per_watt = 2, .brightness = 0};
  EXPECT_EQ(MissingShares(std::vector{Light(10, 3000, 0, 0)}, view)[0], HUGE_VAL) << "black";
  view.takes_photons = false;
  EXPECT_EQ(MissingShares(std::vector{Light(10, 3000, 0, 0)}, view)[0], 0) << "no surface";
  view = {.photon_radiance = 0, .radiance_per_watt = 2, .brightness = 1};
  EXPECT_EQ(MissingShares(std::vector{Light(10, 0, 0, 0)}, view)[0], 20) << "all its power";
  EXPECT_TRUE(MissingShares({}, view).empty());
}

}  // namespace
}  // namespace lucerna
