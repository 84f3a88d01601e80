// Does the number of photons follow from the variance that is there?
#include "render/estimate/photon_steps.h"

#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "render/base/parallel.h"
#include "render/math/rng.h"
#include "tests/support/local_render.h"

namespace lucerna {
namespace {

constexpr std::size_t kManyPixels = 10'000;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// What a pass brings to a pixel, as luminances.
struct Gathered {
  double photons = 0, direct = 0, count = 0;
};
using GatherRule = std::function<Gathered(KeyedRng& rng, std::uint64_t pass, std::size_t pixel)>;

// Passes added one by one.
struct AddedPasses {
  explicit AddedPasses(std::size_t pixels) : sums(pixels), variance(pixels) {}

  [[nodiscard]] PassVariance::Parts Split(double kernel_noise) const {
    return variance.Split(sums, kernel_noise);
  }
  [[nodiscard]] double BestPhotons(double kernel_noise) const {
    return variance.BestPhotons(sums, kernel_noise);
  }
  [[nodiscard]] PassVariance::Costs CostsSoFar() const { return PassVariance::CostsOf(sums); }

  ImageSums sums;
  PassVariance variance;
};

// A pass has `photons_of` photons a pixel.
AddedPasses VarianceOf(
    std::uint64_t passes, const GatherRule& gather, std::size_t pixels = kManyPixels,
    const std::function<std::uint64_t(std::uint64_t pass)>& photons_of = [](auto) { return 1; }) {
  AddedPasses added(pixels);
  ThreadTeam team(1);
  for (std::uint64_t pass = 0; pass < passes; ++pass) {
    const std::uint64_t photons = pixels * photons_of(pass);
    added.variance.Discount(added.sums.WeighBy(photons));
    SliceSums slice = EmptySlice({pass, pass + 1}, pixels, 0);
    for (std::size_t i = 0; i < pixels; ++i) {
      KeyedRng rng(CombineKeys(CombineKeys(3, pass), i));
      const Gathered gathered = gather(rng, pass, i);
      for (std::size_t c = 0; c < 3; ++c) {
        slice.columns[kPhotonRadiance + c].Set(i, static_cast<float>(gathered.photons));
        slice.columns[kDirectRadiance + c].Set(i, static_cast<float>(gathered.direct));
      }
      slice.columns[kPhotonCount].Set(i, static_cast<float>(gathered.count));
    }
    // An eye path costs 3 + 4 * 0.75 = 6 photon rays, and a photon 1.5 + 5 * 0.1 = 2.
    slice.eye_rays = 4 * pixels;
    slice.tally.photons = photons;
    slice.tally.rays = photons * 3 / 2;
    slice.tally.pairs = 5 * photons;
    added.variance.Add(slice, added.sums);
    added.sums.Add(slice, team);
  }
  return added;
}

double Uniform(KeyedRng& rng) {
  return static_cast<double>(rng.Uniform());
}

// Poisson with a small mean, by Knuth's product of uniforms.
double Poisson(KeyedRng& rng, double mean) {
  double product = Uniform(rng);
  double count = 0;
  for (; product > std::exp(-mean); ++count)
    product *= Uniform(rng);
  return count;
}

// Relative standard deviation of a mean over pixels of their sample variances, for numbers whose
// fourth moment is at most twice that of a normal distribution.
double DeviationOfVariance(std::uint64_t passes) {
  return std::sqrt(4.0 / (static_cast<double>(passes) - 1) / static_cast<double>(kManyPixels));
}

// Ten photons of 0.05 and direct light of 0.5 give a mean of 1; the floor is a hundredth of that.
constexpr double kRelative = 1 / 1.01;

TEST(PassVarianceTest, PartsPhotonsFromDirectLight) {
  // Uniform in [0.2, 0.8]: variance 0.36 / 12.
  const AddedPasses variance = VarianceOf(8, [](KeyedRng& rng, std::uint64_t, std::size_t) {
    const double count = Poisson(rng, 10);
    return Gathered{.photons = 0.05 * count, .direct = 0.2 + 0.6 * Uniform(rng), .count = count};
  });
  const PassVariance::Parts parts = variance.Split(1);
  // Weights that follow from the noisy mean of eight passes are off by its variance, up to
  // 3 * 0.055 / 8 of them.
  const double weights = 0.02;
  EXPECT_NEAR(parts.photons, 0.025 * kRelative, 0.025 * (weights + 5 * DeviationOfVariance(8)));
  // Of halves there is one deviation a pixel, and twice the product of the two parts varies too.
  EXPECT_NEAR(parts.eye_paths, 0.03 * kRelative,
              0.03 * (weights + 5 * DeviationOfVariance(2)) +
                  5 * 2 * std::sqrt(0.025 * 0.03 / static_cast<double>(kManyPixels)));
}

// Passes of fewer photons vary more, and weigh less; eye paths vary alike in all.
TEST(PassVarianceTest, PartsPassesOfUnlikeNumbersOfPhotons) {
  constexpr std::array<std::uint64_t, 8> kNumbers = {1, 1, 1, 2, 2, 4, 4, 4};
  const auto photons_of = [&](std::uint64_t pass) { return kNumbers[pass]; };
  // Of weights w = 1/4, 1/4, 1/4, 1/2, 1/2, 1, 1, 1.
  constexpr double kWeight = 4.75;
  const AddedPasses variance = VarianceOf(
      8,
      [&](KeyedRng& rng, std::uint64_t pass, std::size_t) {
        const auto photons = static_cast<double>(kNumbers[pass]);
        const double count = Poisson(rng, 2.5 * photons);
        return Gathered{
            .photons = 0.2 / photons * count, .direct = 0.2 + 0.6 * Uniform(rng), .count = count};
      },
      kManyPixels, photons_of);
  EXPECT_EQ(variance.sums.weights().all(), kWeight);
  const PassVariance::Parts parts = variance.Split(1);
  // Of a pass of four photons a pixel: ten are found, which bring 0.05 each.
  const double weights = 3 * 0.055 / kWeight;
  EXPECT_NEAR(parts.photons, 0.025 * kRelative, 0.025 * (weights + 5 * DeviationOfVariance(8)));
  EXPECT_NEAR(parts.eye_paths, 0.03 * kRelative,
              0.03 * (weights + 5 * DeviationOfVariance(2)) +
                  5 * 2 * std::sqrt(0.025 * 0.03 / static_cast<double>(kManyPixels)));
  EXPECT_FALSE(parts.is_evenly_spaced);
  // Eight passes of eye paths cost 6 a pixel each, a photon 2.
  const double best = variance.BestPhotons(1) / static_cast<double>(kManyPixels);
  EXPECT_NEAR(best, 4 * std::sqrt(parts.photons * 6 / (parts.eye_paths * 4 * 2)), 1e-9 * best);
}

// Eye paths through a texture multiply what photons bring, in passes of many photons and of few.
TEST(PassVarianceTest, TexturesVaryAlikeInPassesOfFewPhotons) {
  constexpr std::array<std::uint64_t, 8> kNumbers = {1, 1, 1, 2, 2, 8, 8, 8};
  const AddedPasses variance = VarianceOf(
      8,
      [&](KeyedRng& rng, std::uint64_t pass, std::size_t) {
        const auto photons = static_cast<double>(kNumbers[pass]);
        const double count = Poisson(rng, 20 * photons);
        return Gathered{.photons = (Uniform(rng) < 0.5 ? 0.025 : 0.075) / photons * count,
                        .count = count};
      },
      kManyPixels, [&](std::uint64_t pass) { return kNumbers[pass]; });
  const PassVariance::Parts parts = variance.Split(1);
  // Of a pass of eight photons a pixel E[a²] - 1 = 0.25 are of textures, and a 160th of photons; a
  // quarter of that more is where both are multiplied, in passes of a 20th and of a 160th.
  EXPECT_NEAR(parts.photons, kRelative / 160, 0.1 / 160);
  EXPECT_NEAR(parts.eye_paths, 0.25 * kRelative, 0.25 * (3 * 0.25 / 4 + 0.05));
}

// Textures and edges make the photon part vary as well, and more photons would not help.
TEST(PassVarianceTest, LeavesToEyePathsWhatTheyMultiplyPhotonsBy) {
  // Every pass sees the photons through an albedo of 0.5 or 1.5.
  const AddedPasses variance = VarianceOf(16, [](KeyedRng& rng, std::uint64_t, std::size_t) {
    const double count = Poisson(rng, 10);
    return Gathered{.photons = (Uniform(rng) < 0.5 ? 0.05 : 0.15) * count, .count = count};
  });
  const PassVariance::Parts parts = variance.Split(1);
  // E[a²] E[n²] - 1 = 1.25 * 1.1 - 1 in all; a tenth from photons that are equals.
  const double all = 0.375;
  EXPECT_NEAR(parts.photons + parts.eye_paths, all * kRelative,
              all * (3 * all / 16 + 5 * DeviationOfVariance(16)));
  EXPECT_NEAR(parts.photons, 0.1 * kRelative, 0.1 * 0.05);
}

// Kernels weigh photons, and count some beyond their disc: then one photon brings more variance.
TEST(PassVarianceTest, ReckonsWithTheKernel) {
  // Half of the photons counted are within the disc, and count twice or not at all there.
  const AddedPasses variance = VarianceOf(16, [](KeyedRng& rng, std::uint64_t, std::size_t) {
    const double count = Poisson(rng, 20);
    double photons = 0;
    for (double i = 0; i < count; ++i)
      photons += Uniform(rng) < 0.25 ? 0.2 : 0;
    return Gathered{.photons = photons, .count = count};
  });
  const PassVariance::Parts parts = variance.Split(4);
  EXPECT_NEAR(parts.photons, 0.2 * kRelative, 0.2 * (3 * 0.2 / 16 + 5 * DeviationOfVariance(16)));
  EXPECT_LT(parts.eye_paths, 0.02);
}

// Where one pixel in ten has met a photon, deviations say nothing of photons, and much of the noise
// of direct light: more photons all the same, unless they bring next to nothing.
TEST(PassVarianceTest, WhereHardlyAnyPhotonIsFoundMoreAreNeeded) {
  const auto with = [](double count_per_pass, double direct) {
    return VarianceOf(2, [=](KeyedRng& rng, std::uint64_t, std::size_t) {
      const double count = Poisson(rng, count_per_pass);
      return Gathered{.photons = count, .direct = direct * Uniform(rng), .count = count};
    });
  };
  EXPECT_EQ(with(0.05, 0.4).BestPhotons(3), kInfinity);
  EXPECT_LT(with(0.05, 4).BestPhotons(3), kManyPixels) << "a fortieth of the light";
  EXPECT_LT(with(0, 0.4).BestPhotons(3), kManyPixels) << "none at all";
  EXPECT_LE(with(2, 40).BestPhotons(3), kManyPixels) << "many";
}

// One photon in twenty passes, taken for the whole truth, explains more than there is.
TEST(PassVarianceTest, NeverFindsMoreOfPhotonsThanThereIs) {
  const AddedPasses variance = VarianceOf(4, [](KeyedRng& rng, std::uint64_t, std::size_t) {
    const double count = Poisson(rng, 0.05);
    return Gathered{.photons = count, .direct = 0.015, .count = count};
  });
  const PassVariance::Parts few = variance.Split(3);
  const PassVariance::Parts all = variance.Split(1e6);
  EXPECT_GT(few.photons, 0);
  EXPECT_EQ(few.photons, all.photons);
  EXPECT_LT(few.eye_paths, 1e-4 * few.photons);
}

// The means of even and of odd passes agree better than independent ones.
TEST(PassVarianceTest, CountsLowDiscrepancyOfDirectLight) {
  const auto with = [](const std::array<double, 4>& direct) {
    return VarianceOf(8,
                      [&](KeyedRng&, std::uint64_t pass, std::size_t) {
                        return Gathered{.photons = 0.5, .direct = direct[pass % 4], .count = 10};
                      })
        .Split(1)
        .eye_paths;
  };
  // Numbers that a slice holds as they are.
  EXPECT_NEAR(with({0.25, 0.25, 0.75, 0.75}), 0, 1e-6);
  // Means of halves differ by 0.5; 8 / 4 of its square is what one pass varies by.
  EXPECT_NEAR(with({0.25, 0.75, 0.25, 0.75}), 2 * 0.25 * kRelative, 1e-5);
}

TEST(PassVarianceTest, LeavesOutThePixelsThatVaryMost) {
  const auto with = [](double glint) {
    return VarianceOf(4,
                      [&](KeyedRng& rng, std::uint64_t pass, std::size_t pixel) {
                        const double count = Poisson(rng, 10);
                        const bool is_glint = pixel % 1000 == 0 && pass % 2 == 1;
                        return Gathered{.photons = 0.1 * count,
                                        .direct = is_glint ? glint : 0.5,
                                        .count = count};
                      })
        .Split(1);
  };
  EXPECT_EQ(with(1000).photons, with(2000).photons);
  EXPECT_LT(with(1000).eye_paths, 0.01);
}

TEST(PassVarianceTest, HoldsTheBrightestLight) {
  const AddedPasses variance = VarianceOf(4, [](KeyedRng& rng, std::uint64_t, std::size_t pixel) {
    const double huge = pixel % 2 == 0 ? 3e38 : 1e-38;
    return Gathered{.photons = huge * Uniform(rng), .direct = huge * Uniform(rng), .count = 1};
  });
  const PassVariance::Parts parts = variance.Split(3);
  EXPECT_TRUE(std::isfinite(parts.photons) && std::isfinite(parts.eye_paths));
  EXPECT_FALSE(std::isnan(variance.BestPhotons(3)));
}

TEST(PassVarianceTest, OfABlackImageIsNone) {
  const AddedPasses variance =
      VarianceOf(2, [](KeyedRng&, std::uint64_t, std::size_t) { return Gathered(); });
  EXPECT_EQ(variance.Split(3).photons, 0);
  EXPECT_EQ(variance.Split(3).eye_paths, 0);
  EXPECT_EQ(variance.BestPhotons(3), 0);
}

TEST(PassVarianceTest, TheBestNumberFollowsFromVariancesAndCosts) {
  const GatherRule gather = [](KeyedRng& rng, std::uint64_t pass, std::size_t) {
    const double count = Poisson(rng, 10);
    return Gathered{.photons = 0.05 * count, .direct = pass % 2 == 0 ? 0.45 : 0.55, .count = count};
  };
  const AddedPasses variance = VarianceOf(4, gather);
  const PassVariance::Parts parts = variance.Split(1);
  EXPECT_DOUBLE_EQ(variance.CostsSoFar().eye_paths, 4.0 * 6 * kManyPixels);
  EXPECT_DOUBLE_EQ(variance.CostsSoFar().photons, 4.0 * 2 * kManyPixels);
  // Such passes have a photon a pixel. With n times as many, variance times time is
  // (eye + photons / n) (6 + 2 n).
  const double best = variance.BestPhotons(1) / static_cast<double>(kManyPixels);
  const auto spent = [&](double n) { return (parts.eye_paths + parts.photons / n) * (6 + 2 * n); };
  EXPECT_GT(best, 1);
  EXPECT_LT(spent(best), spent(0.98 * best));
  EXPECT_LT(spent(best), spent(1.02 * best));
}

TEST(PassVarianceTest, WhereAllVarianceIsOfPhotonsMoreAreAlwaysBetter) {
  const AddedPasses variance = VarianceOf(2, [](KeyedRng& rng, std::uint64_t, std::size_t) {
    const double count = Poisson(rng, 0.1);
    return Gathered{.photons = count, .count = count};
  });
  EXPECT_EQ(variance.BestPhotons(3), kInfinity);
}

// Water under the sun: a sequence of low discrepancy is not left.
TEST(PassVarianceTest, EvenlySpacedPhotonsKeepTheirNumber) {
  // 9, 10 or 11 photons, where 10 independent ones vary by 3.
  const AddedPasses even = VarianceOf(4, [](KeyedRng& rng, std::uint64_t, std::size_t) {
    const double count = 9 + std::floor(3 * Uniform(rng));
    return Gathered{.photons = 0.1 * count, .count = count};
  });
  EXPECT_TRUE(even.Split(1).is_evenly_spaced);
  EXPECT_EQ(even.BestPhotons(1), kManyPixels);
  // Independent ones, many or few, are not taken for such.
  for (const double mean : {10.0, 0.2}) {
    const AddedPasses random = VarianceOf(4, [&](KeyedRng& rng, std::uint64_t, std::size_t) {
      const double count = Poisson(rng, mean);
      return Gathered{.photons = count / mean, .count = count};
    });
    EXPECT_FALSE(random.Split(1).is_evenly_spaced) << mean;
    EXPECT_GT(random.BestPhotons(1), 2.0 * kManyPixels) << mean;
  }
}

TEST(NextPhotonsTest, IsThePowerOfTwoThatComesClosest) {
  EXPECT_EQ(NextPhotons(100, 800, 0), 100U);
  EXPECT_EQ(NextPhotons(100, 800, 141), 100U);
  EXPECT_EQ(NextPhotons(100, 800, 142), 200U);
  EXPECT_EQ(NextPhotons(100, 800, 282), 200U);
  EXPECT_EQ(NextPhotons(100, 800, 283), 400U);
  EXPECT_EQ(NextPhotons(100, 800, kInfinity), 800U);
  EXPECT_EQ(NextPhotons(100, 200, kInfinity), 200U);
  EXPECT_EQ(NextPhotons(400, 800, 100), 400U);  // never fewer
  EXPECT_EQ(NextPhotons(400, 200, kInfinity), 400U);
}

TEST(PhotonStepsTest, HoldFromTheirFirstPassOn) {
  const PhotonSteps steps = {{0, 10}, {3, 20}, {5, 80}};
  EXPECT_EQ(PhotonsOf(steps, 2), 10U);
  EXPECT_EQ(PhotonsOf(steps, 3), 20U);
  EXPECT_EQ(PhotonsOf(steps, 4), 20U);
  EXPECT_EQ(PhotonsOf(steps, 1000), 80U);
  EXPECT_EQ(PassesFor(steps, 30), 3U);
  EXPECT_EQ(PassesFor(steps, 31), 4U);
  EXPECT_EQ(PassesFor(steps, 70), 5U);
  EXPECT_EQ(PassesFor(steps, 151), 7U);
}

// Photons over pixels, of each pass.
std::vector<double> NumbersIn(const char* file, int passes) {
  const Scene scene = LoadScene(file);
  RenderOverrides overrides;
  overrides.width = 32;
  overrides.height = 32;
  overrides.photons_per_pass = 32 * 32;
  overrides.adaptive_photons = true;
  LocalRender render(scene, SettingsFor(scene, overrides), 1);
  std::vector<double> numbers;
  std::uint64_t before = 0;
  for (int pass = 0; pass < passes; ++pass) {
    render.AddPass();
    numbers.push_back(static_cast<double>(render.tally().photons - before) / (32 * 32));
    before = render.tally().photons;
  }
  return numbers;
}

// No direct light, and a smooth image: all noise is of photons. What two and four passes show,
// passes 3 and 5 follow.
TEST(PhotonsOfAJobTest, RiseWhereTheNoiseIsOfPhotons) {
  EXPECT_EQ(NumbersIn("water-lamp.pbrt", 7), (std::vector<double>{1, 1, 1, 2, 2, 4, 4}));
}

// Texture and direct light.
TEST(PhotonsOfAJobTest, StayWhereTheNoiseIsOfEyePaths) {
  EXPECT_EQ(NumbersIn("textured.pbrt", 20), std::vector<double>(20, 1));
}

}  // namespace
}  // namespace lucerna
