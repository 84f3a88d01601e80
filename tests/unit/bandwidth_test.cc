// A radius follows from a trace as the bias bound says, and photons are kept as the rules say.
#include "render/frequency/bandwidth.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include "gtest/gtest.h"

#include "render/math/rng.h"

namespace lucerna {
namespace {

constexpr KernelMoments kCone = {3.0 / 20, 3 / (2 * std::numbers::pi)};

TEST(RadiusForTest, MeetsItsVectors) {  // U16
  EXPECT_NEAR(RadiusFor(0.02, 6, ConstantKernel::kMoments), 0.163299316, 1e-7);
  EXPECT_NEAR(RadiusFor(0.02, 6, EpanechnikovKernel::kMoments), 0.2, 1e-7);
  EXPECT_NEAR(RadiusFor(0.02, 6, kCone), 0.210818511, 1e-7);
  EXPECT_NEAR(RadiusFor(0.02, 6, BiweightKernel::kMoments), 0.230940108, 1e-7);
}

TEST(RadiusForTest, IsTheInverseOfTraceForAndMeetsTheBound) {
  const double trace = TraceFor(0.03, 0.2, GaussianKernel::kMoments);
  EXPECT_NEAR(RadiusFor(0.03, trace, GaussianKernel::kMoments), 0.2, 1e-12);
  EXPECT_NEAR(RelativeBiasBound(trace, 0.2, GaussianKernel::kMoments), 0.03, 1e-12);
}

// The moments, by the midpoint rule over the unit disc: error below 1e-6 for smooth kernels.
TEST(KernelMomentsTest, AreThoseOfTheKernels) {
  struct Case {
    KernelMoments moments;
    std::function<double(double)> shape;  // of t², not normalised
  };
  const std::array cases = {
      Case{ConstantKernel::kMoments, [](double) { return 1.0; }},
      Case{EpanechnikovKernel::kMoments, [](double t2) { return 1 - t2; }},
      Case{BiweightKernel::kMoments, [](double t2) { return (1 - t2) * (1 - t2); }},
      Case{GaussianKernel::kMoments, [](double t2) { return std::exp(-4.5 * t2); }},
  };
  for (const Case& one : cases) {
    double sum = 0;
    double sum2 = 0;
    double second = 0;
    constexpr int kSteps = 20000;
    for (int i = 0; i < kSteps; ++i) {
      // In rings of equal area, t² uniform.
      const double t2 = (i + 0.5) / kSteps;
      const double area = std::numbers::pi / kSteps;
      const double k = one.shape(t2);
      sum += k * area;
      sum2 += k * k * area;
      second += k * t2 / 2 * area;
    }
    EXPECT_NEAR(one.moments.mu2, second / sum, 1e-7);
    EXPECT_NEAR(one.moments.roughness, sum2 / (sum * sum), 1e-7);
  }
}

// At a Gaussian peak the constant kernel's bias is exactly 1 - (1 - e^-y)/y, y = s r²/2: the
// quadratic bound holds, and is 1.7 % of the radius off at 5 %.
TEST(RadiusForTest, IsNeverTooLargeAtAPeakAndHardlyTooSmall) {
  for (const double bias : {0.01, 0.02, 0.05}) {
    const double s = 7;
    const double r = RadiusFor(bias, 2 * s, ConstantKernel::kMoments);
    const double y = s * r * r / 2;
    const double exact = 1 - (1 - std::exp(-y)) / y;
    EXPECT_LE(exact, bias);
    EXPECT_GT(exact, bias * (1 - 0.04));
  }
}

FrequencySums Sums(std::initializer_list<std::pair<double, double>> weights_and_traces) {
  FrequencySums sums;
  for (const auto& [w, tr] : weights_and_traces) {
    sums = sums + FrequencySums{w, w * w, w * tr, w * tr * tr, 1};
  }
  return sums;
}

const RadiusRange kWide = {1e-6, 1e6};

TEST(PredictTraceTest, IsTheWeightedMeanPlusOneStandardError) {
  const FrequencySums sums = Sums({{1, 2}, {1, 2}, {1, 2}, {1, 2}, {1, 6}, {1, 6}, {1, 6}, {1, 6}});
  const auto prediction = PredictTrace(sums, kWide, 0.02, ConstantKernel::kMoments);
  ASSERT_TRUE(prediction);
  EXPECT_NEAR(prediction->effective_photons, 8, 1e-12);
  EXPECT_NEAR(prediction->trace, 4 + std::sqrt(4.0 / 8), 1e-12);
  // Flux is what counts, not the number of photons.
  const FrequencySums uneven =
      Sums({{3, 2}, {3, 2}, {3, 2}, {3, 2}, {1, 6}, {1, 6}, {1, 6}, {1, 6}});
  EXPECT_NEAR(PredictTrace(uneven, kWide, 0.02, ConstantKernel::kMoments)->trace,
              3 + std::sqrt(3.0 / (256.0 / 40)), 1e-12);
}

// Equal traces, of which rounding makes a variance below zero.
TEST(PredictTraceTest, TakesANegativeVarianceForNone) {
  const double below = 8 * 9 * (1 - 1e-15);
  EXPECT_NEAR(PredictTrace({8, 8, 24, below, 8}, kWide, 0.02, ConstantKernel::kMoments)->trace, 3,
              1e-12);
}

TEST(PredictTraceTest, SaysNothingFromTooFewPhotons) {
  FrequencySums sums = Sums({{1, 2}, {1, 2}, {1, 2}, {1, 2}, {1, 2}, {1, 2}, {1, 2}});
  EXPECT_FALSE(PredictTrace({}, kWide, 0.02, ConstantKernel::kMoments));
  EXPECT_FALSE(PredictTrace(sums, kWide, 0.02, ConstantKernel::kMoments));
  sums = sums + Sums({{1, 2}});
  EXPECT_TRUE(PredictTrace(sums, kWide, 0.02, ConstantKernel::kMoments));
  // Eight photons, one of which carries all the flux.
  EXPECT_FALSE(PredictTrace(sums + Sums({{1000, 2}}), kWide, 0.02, ConstantKernel::kMoments));
  EXPECT_FALSE(PredictTrace({0, 0, 0, 0, 100}, kWide, 0.02, ConstantKernel::kMoments));
}

TEST(PredictTraceTest, StaysInTheRangeOfRadii) {
  const RadiusRange range = {0.01, 0.5};
  const FrequencySums even = Sums({{1, 0}, {1, 0}, {1, 0}, {1, 0}, {1, 0}, {1, 0}, {1, 0}, {1, 0}});
  const double widest = PredictTrace(even, range, 0.02, ConstantKernel::kMoments)->trace;
  EXPECT_NEAR(RadiusFor(0.02, widest, ConstantKernel::kMoments), 0.5, 1e-12);
  FrequencySums sharp = even;
  sharp.weighted_trace = 1e20;
  sharp.weighted_trace2 = 1e40;
  const double finest = PredictTrace(sharp, range, 0.02, ConstantKernel::kMoments)->trace;
  EXPECT_NEAR(RadiusFor(0.02, finest, ConstantKernel::kMoments), 0.01, 1e-12);
  sharp.weighted_trace = sharp.weighted_trace2 = std::numeric_limits<double>::max();
  EXPECT_NEAR(PredictTrace(sharp, range, 0.02, ConstantKernel::kMoments)->trace, finest,
              finest * 1e-12);
}

TEST(PredictTraceTest, FadesWithTheRadius) {
  const FrequencySums old = Sums({{1, 2}, {1, 2}, {1, 2}, {1, 2}, {1, 2}, {1, 2}, {1, 2}, {1, 2}});
  const FrequencySums fresh =
      Sums({{1, 6}, {1, 6}, {1, 6}, {1, 6}, {1, 6}, {1, 6}, {1, 6}, {1, 6}});
  const FrequencySums mixed = old.Faded(0.25) + fresh;
  EXPECT_NEAR(mixed.weighted_trace / mixed.weight, (0.25 * 2 + 6) / 1.25, 1e-12);
  // The older photons' shares of both sums fade alike, and so does their number's worth.
  EXPECT_NEAR(EffectivePhotons(old.Faded(0.25).weight, old.Faded(0.25).weight2), 2, 1e-12);
}

TEST(ShrinkToPredictionTest, MeetsItsVectors) {
  constexpr double kAlpha = 2.0 / 3;
  const RadiusStep ppm = ShrinkToPrediction(100, 50, 1, 0.5, kAlpha, 1);  // U23
  EXPECT_NEAR(ppm.kept_share, 0.888889, 1e-6);
  EXPECT_NEAR(ppm.photons, 133.333, 133.333 * 1e-5);
  EXPECT_NEAR(ppm.radius, 0.942809, 1e-6);
  const RadiusStep arrives = ShrinkToPrediction(100, 50, 1, 0.97, kAlpha, 1);  // U24
  EXPECT_NEAR(arrives.kept_share, 0.9409, 1e-6);
  EXPECT_NEAR(arrives.photons, 141.135, 1e-3);
  EXPECT_EQ(arrives.radius, 0.97);
  const RadiusStep keeps = ShrinkToPrediction(100, 50, 1, 1.2, kAlpha, 1);  // U25
  EXPECT_EQ(keeps.kept_share, 1);
  EXPECT_EQ(keeps.photons, 150);
  EXPECT_EQ(keeps.radius, 1);
}

TEST(ShrinkToPredictionTest, StopsAtThePredictionAndKeepsEveryPhotonThere) {
  RadiusStep state = {1, 0, 1};
  double all_since = 0;
  double photons_at_arrival = 0;
  for (int pass = 0; pass < 2000; ++pass) {
    const bool arrived = state.radius == 0.5;
    const double before = state.photons;
    state = ShrinkToPrediction(state.photons, 20, state.radius, 0.5, 0.7, 1);
    ASSERT_GE(state.radius, 0.5);
    if (arrived) {
      if (all_since == 0) photons_at_arrival = before;
      all_since += 20;
      ASSERT_NEAR(state.photons, photons_at_arrival + all_since, 1e-6);
    }
  }
  EXPECT_EQ(state.radius, 0.5);
  EXPECT_GT(all_since, 0);
}

// r² ~ n^(alpha_below - 1), so between 1e3 and 1e5 passes it falls by 100^(alpha_below - 1); and
// n r² grows without bound.
TEST(ShrinkToPredictionTest, TheConsistentVariantGoesOnSlowly) {
  constexpr double kBelow = 0.9;
  RadiusStep state = {1, 0, 1};
  double early = 0;
  for (int pass = 1; pass <= 100000; ++pass) {
    // Photons per pass follow the disc's area.
    state = ShrinkToPrediction(state.photons, 50 * state.radius * state.radius, state.radius, 0.8,
                               0.7, kBelow);
    if (pass == 1000) early = state.radius;
  }
  EXPECT_NEAR(state.radius * state.radius / (early * early), std::pow(100, kBelow - 1), 0.005);
}

TEST(ShrinkToPredictionTest, DoesNothingWithoutPhotonsAndNeverGrows) {
  EXPECT_EQ(ShrinkToPrediction(0, 0, 0.3, 0.1, 0.7, 1).radius, 0.3);
  EXPECT_EQ(ShrinkToPrediction(12, 0, 0.3, 0.1, 0.7, 1).photons, 12);
  KeyedRng rng(4);
  for (int i = 0; i < 10000; ++i) {
    const auto any = [&] { return static_cast<double>(rng.Uniform()) * 10; };
    const double r = any() + 1e-3;
    const RadiusStep next = ShrinkToPrediction(any(), any(), r, any(), 0.7, 0.9);
    ASSERT_LE(next.radius, r);
    ASSERT_GT(next.radius, 0);
  }
}

// A minimum: the error is larger on both sides of it.
TEST(LeastErrorRadiusTest, MinimisesNoisePlusSquaredBias) {
  for (const double density : {10.0, 1e6}) {
    for (const double trace : {1e-3, 5.0, 1e7}) {
      const auto error = [&](double r) {
        const double bias = RelativeBiasBound(trace, r, BiweightKernel::kMoments);
        return BiweightKernel::kMoments.roughness / (density * r * r) + bias * bias;
      };
      const double best = LeastErrorRadius(density, trace, BiweightKernel::kMoments);
      EXPECT_LT(error(best), error(best * 1.01));
      EXPECT_LT(error(best), error(best * 0.99));
      // To first order nothing changes there.
      EXPECT_NEAR(error(best * 1.001) / error(best), error(best * 0.999) / error(best), 1e-7);
    }
  }
}

TEST(StepToLeastErrorTest, GoesDownInStepsAndStopsAtTheLarger) {
  EXPECT_EQ(StepToLeastError(1, 0.1, 0.2), 0.7);
  EXPECT_EQ(StepToLeastError(1, 0.1, 0.8), 0.8);
  EXPECT_EQ(StepToLeastError(1, 0.9, 0.8), 0.9);
  EXPECT_EQ(StepToLeastError(1, 1.5, 0.8), 1);
}

TEST(BandwidthTest, IsFiniteForAnyFiniteNumbers) {
  constexpr double kMax = std::numeric_limits<double>::max();
  const std::array odd = {0.0, 1e-308, -1.0, 1.0, 0.02, 1e160, kMax, -kMax};
  for (const double a : odd) {
    for (const double b : odd) {
      EXPECT_TRUE(std::isfinite(RadiusFor(a, b, ConstantKernel::kMoments)));
      EXPECT_TRUE(std::isfinite(TraceFor(a, b, ConstantKernel::kMoments)));
      EXPECT_TRUE(std::isfinite(RelativeBiasBound(a, b, ConstantKernel::kMoments)));
      EXPECT_TRUE(std::isfinite(LeastErrorRadius(a, b, ConstantKernel::kMoments)));
      for (const double c : odd) {
        const auto prediction =
            PredictTrace({1, 0.01, a, b, 100}, {c, a}, 0.02, ConstantKernel::kMoments);
        ASSERT_TRUE(prediction);
        EXPECT_TRUE(std::isfinite(prediction->trace));
      }
    }
  }
}

}  // namespace
}  // namespace lucerna
