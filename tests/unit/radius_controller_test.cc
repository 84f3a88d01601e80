// Radii shrink as the papers' formulas say, computed here by hand.
#include "render/estimate/radius_controller.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>
#include <vector>

#include "gtest/gtest.h"

#include "render/estimate/evidence.h"
#include "render/math/rng.h"

namespace lucerna {
namespace {

std::unique_ptr<RadiusController> Make(RadiusControllerKind kind, double alpha) {
  RenderSettings settings;
  settings.radius_controller = kind;
  settings.alpha = alpha;
  return MakeRadiusController(settings, 1);
}

// The round of one pass.
PassRange OnePass(std::uint64_t pass) {
  return {pass, pass + 1};
}

// Hachisuka et al. 2008: N' = N + αM, r' = r sqrt((N + αM) / (N + M)).
TEST(PpmTest, KeepsAShareOfThePhotons) {
  const auto ppm = Make(RadiusControllerKind::kPpm, 2.0 / 3);
  const PixelRadius first = ppm->Next({1, 0}, {100, 1, {}}, OnePass(0), {});
  EXPECT_NEAR(first.photons, 66.66667, 1e-4);
  EXPECT_NEAR(first.radius, 0.8164966, 1e-6);
  const PixelRadius next = ppm->Next({1, 100}, {50, 1, {}}, OnePass(1), {});
  EXPECT_NEAR(next.photons, 133.33333, 1e-4);
  EXPECT_NEAR(next.radius, 0.942809, 1e-6);
}

TEST(PpmTest, KeepsItsRadiusWithoutPhotons) {
  const auto ppm = Make(RadiusControllerKind::kPpm, 0.7);
  const PixelRadius still = ppm->Next({0.3F, 12}, {0, 0.4F, {}}, OnePass(3), {});
  EXPECT_EQ(still.radius, 0.3F);
  EXPECT_EQ(still.photons, 12);
}

// Gathered in a disc of twice the radius, a quarter of the photons belong to today's.
TEST(PpmTest, CountsOnlyWhatTodaysDiscWouldHaveHeld) {
  const auto ppm = Make(RadiusControllerKind::kPpm, 2.0 / 3);
  const PixelRadius lagging = ppm->Next({1, 100}, {200, 2, {}}, OnePass(4), {});
  const PixelRadius direct = ppm->Next({1, 100}, {50, 1, {}}, OnePass(4), {});
  EXPECT_DOUBLE_EQ(lagging.radius, direct.radius);
  EXPECT_DOUBLE_EQ(lagging.photons, direct.photons);
}

// With M photons in every first disc, M r² of them in a disc of radius r, N + αM must keep the
// density: N_k / r_k² grows by M every pass.
TEST(PpmTest, KeepsTheDensityOverManyPasses) {
  const auto ppm = Make(RadiusControllerKind::kPpm, 0.8);
  PixelRadius pixel = {1, 0};
  for (std::uint64_t pass = 0; pass < 1000; ++pass) {
    const double r = pixel.radius;
    pixel = ppm->Next(pixel, {100.0 * static_cast<double>(r) * static_cast<double>(r), r, {}},
                      OnePass(pass), {});
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
    pixel = pppm->Next(pixel, {pass % 3 == 0 ? 0.0 : 7.0, pixel.radius, {}}, OnePass(pass), {});
    const auto i = static_cast<double>(pass + 1);
    squared *= (i + 0.6) / (i + 1);
    ASSERT_NEAR(pixel.radius / std::sqrt(squared), 1, 1e-5) << pass;
  }
}

// A round of eight passes shrinks the radius as eight rounds of one pass do.
TEST(PppmTest, ARoundShrinksAsItsPassesDo) {
  const auto pppm = Make(RadiusControllerKind::kPppm, 0.6);
  PixelRadius one_by_one = {2, 0};
  for (std::uint64_t pass = 64; pass < 72; ++pass)
    one_by_one = pppm->Next(one_by_one, {7, 2, {}}, OnePass(pass), {});
  const PixelRadius at_once = pppm->Next({2, 0}, {56, 2, {}}, {64, 72}, {});
  EXPECT_NEAR(at_once.radius / one_by_one.radius, 1, 16 * 0x1p-53);
  EXPECT_EQ(at_once.photons, one_by_one.photons);
}

TEST(FixedTest, NeverChanges) {
  const auto fixed = Make(RadiusControllerKind::kFixed, 0.5);
  const PixelRadius next = fixed->Next({2, 5}, {100, 2, {}}, OnePass(7), {});
  EXPECT_EQ(next.radius, 2);
  EXPECT_EQ(next.photons, 105);
}

// In even light of `density` photons a pass and unit radius, the disc holds 28 n^(2/3) of the
// photons of n passes, as soon as that is less than the first radius does.
TEST(NearestTest, HoldsTheNearestOfAllPhotons) {
  const auto nearest = Make(RadiusControllerKind::kNearest, 0.5);
  for (const double density : {40.0, 3000.0}) {
    std::vector<double> memory(nearest->MemoryPerPixel());
    PixelRadius pixel = {1, 0};
    for (std::uint64_t pass = 0; pass < 1000; ++pass) {
      const double used = pixel.radius;
      pixel = nearest->Next(pixel, {density * used * used, used, {}}, OnePass(pass), memory);
      const auto n = static_cast<double>(pass + 1);
      const double held = n * density * pixel.radius * pixel.radius;
      ASSERT_NEAR(held, std::min(n * density, 28 * std::pow(n, 2.0 / 3)), 1e-6 * held) << pass;
      ASSERT_LE(pixel.radius, used);
    }
  }
}

TEST(NearestTest, KeepsItsRadiusWithoutPhotons) {
  const auto nearest = Make(RadiusControllerKind::kNearest, 0.5);
  std::vector<double> memory(nearest->MemoryPerPixel());
  EXPECT_EQ(nearest->Next({0.5, 0}, {0, 0.5, {}}, OnePass(0), memory).radius, 0.5);
}

// Twelve cells of equal counts keep the radius; a slope across them, or a peak in the middle, does
// not, and what was counted is forgotten after each test.
TEST(CppmTest, ShrinksOnlyWhereCountsAreUneven) {
  RenderSettings settings;
  settings.radius_controller = RadiusControllerKind::kCppm;
  const auto cppm = MakeRadiusController(settings, 1);
  std::vector<double> memory(cppm->MemoryPerPixel());
  const auto next = [&](const std::array<double, 12>& counts) {
    return cppm->Next({1, 0}, {120, 1, counts}, OnePass(0), memory).radius;
  };
  EXPECT_EQ(next({10, 10, 10, 10, 10, 10, 10, 10, 10, 10, 10, 10}), 1);
  EXPECT_DOUBLE_EQ(next({30, 25, 10, 0, 5, 10, 15, 10, 5, 5, 0, 5}), std::sqrt(0.8));
  std::fill(memory.begin(), memory.end(), 0);
  EXPECT_DOUBLE_EQ(next({20, 20, 20, 20, 20, 20, 0, 0, 0, 0, 0, 0}), std::sqrt(0.5));
  // Too few to say anything.
  std::fill(memory.begin(), memory.end(), 0);
  EXPECT_EQ(next({20, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}), 1);
}

// What `photons` of weight 1 a unit of area, thinned by 1 - bend·|x|², add up to within the reach
// of a hitpoint of this radius, in expectation: the Laplacian of the density is -4·bend.
std::array<double, kCurvatureColumns> ExpectedCurvature(double photons, double bend,
                                                        double radius) {
  const double h2 = std::pow(static_cast<double>(kCurvatureReach) * radius, 2);
  const double pi = std::numbers::pi;
  return {std::rint(-4 * bend * photons * pi * h2 * h2 / 24 / kWeightUnit),
          std::rint(photons * pi * h2 * (1 - bend * h2 / 2) / kWeight2Unit)};
}

// Kaplanyan & Dachsbacher 2013: the least of R2 E/(n ν r²) + (mu2 L r²/2)².
TEST(AppmTest, TakesTheRadiusOfLeastErrorForTheLaplacianItSees) {
  constexpr double kPhotons = 400;
  constexpr double kBend = 0.2;
  RenderSettings settings;
  settings.radius_controller = RadiusControllerKind::kAppm;
  const auto appm = MakeRadiusController(settings, 1);
  std::vector<double> memory(appm->MemoryPerPixel());
  PixelRadius pixel = {1, 0};
  int pass = 0;
  for (; pass < 4000; ++pass) {
    const auto r = static_cast<double>(pixel.radius);
    const auto columns = ExpectedCurvature(kPhotons, kBend, r);
    pixel = appm->Next(pixel, {100, pixel.radius, columns},
                       OnePass(static_cast<std::uint64_t>(pass)), memory);
  }
  // Epanechnikov: R2 = 4/(3π), mu2 = 1/6. The density in the middle is 400; the wider disc sees a
  // few percent less of it, of which the sixth root is taken, and the Laplacian's own noise.
  const double laplacian = 4 * kBend * kPhotons;
  const double expected = std::pow(
      2 * 4 / (3 * std::numbers::pi) * kPhotons / (pass * laplacian * laplacian / 36), 1.0 / 6);
  EXPECT_NEAR(static_cast<double>(pixel.radius) / expected, 1, 0.02);
}

// What one photon of weight 1 adds to the blur that the default kernel has in a disc of `radius`;
// `u` as in kCurvatureLaplacian.
double BlurOf(double u, double radius) {
  const double t2 = u * static_cast<double>(kCurvatureReach * kCurvatureReach);
  const double inner = static_cast<double>(kInnerShare * kInnerShare);
  const double whole = std::max(0.0, 1 - t2) - std::max(0.0, 1 - t2 / inner) / inner;
  return 2 / std::numbers::pi * whole / (1 - inner) / (radius * radius);
}

// Photons thrown at random on even light: noise alone must not shrink the radius, though every
// pass has a Laplacian and a blur of its own.
TEST(AppmTest, KeepsItsRadiusInEvenLight) {
  RenderSettings settings;
  settings.radius_controller = RadiusControllerKind::kAppm;
  const auto appm = MakeRadiusController(settings, 1);
  int shrunk = 0;
  for (std::uint64_t trial = 0; trial < 100; ++trial) {
    KeyedRng rng(CombineKeys(77, trial));
    std::vector<double> memory(appm->MemoryPerPixel());
    PixelRadius pixel = {1, 0};
    for (std::uint64_t pass = 0; pass < 200; ++pass) {
      // 20 photons in the disc of the reach at radius 1, and as densely in that at radius 2.
      double laplacian = 0;
      double weight2 = 0;
      double blur = 0;
      for (int photon = 0; photon < 80; ++photon) {
        const double u = 4 * static_cast<double>(rng.Uniform()) /
                         (static_cast<double>(pixel.radius) * static_cast<double>(pixel.radius));
        if (u >= 1) continue;
        laplacian += 2 * u - 1;
        weight2 += 1;
        blur += BlurOf(u, pixel.radius);
      }
      const std::array<double, kCurvatureColumns> columns = {std::rint(laplacian / kWeightUnit),
                                                             std::rint(weight2 / kWeight2Unit)};
      pixel = appm->Next(pixel, {weight2, pixel.radius, columns, blur, pass + 1}, OnePass(pass),
                         memory);
    }
    if (pixel.radius < 0.9F) ++shrunk;
  }
  // With a Laplacian from the kernel's own disc (kCurvatureReach = 1) most would have shrunk.
  EXPECT_LE(shrunk, 5);
}

// A hitpoint in the dark beside a spot of 20 photons a pass, where the Laplacian's disc happens to
// add up to zero: half of the photons in the middle of its ring and half at its outer end. What the
// kernel itself takes from the spot shows the bias, and the radius shrinks
// until hardly any of the spot is left in it.
TEST(AppmTest, ShrinksOnTheRimOfASpotWhereTheLaplacianIsZero) {
  RenderSettings settings;
  settings.radius_controller = RadiusControllerKind::kAppm;
  const auto appm = MakeRadiusController(settings, 1);
  std::vector<double> memory(appm->MemoryPerPixel());
  PixelRadius pixel = {1, 0};
  KeyedRng rng(91);
  constexpr double kSpot = 0.3;  // its nearest place, in first radii
  for (std::uint64_t pass = 0; pass < 100; ++pass) {
    double blur = 0;
    for (int photon = 0; photon < 20; ++photon) {
      const double distance = (kSpot + 0.2 * static_cast<double>(rng.Uniform())) / pixel.radius;
      blur += BlurOf(distance * distance / static_cast<double>(kCurvatureReach * kCurvatureReach),
                     pixel.radius);
    }
    const std::array<double, kCurvatureColumns> columns = {0, std::rint(20 / kWeight2Unit)};
    pixel = appm->Next(pixel, {20, pixel.radius, columns, blur, pass + 1}, OnePass(pass), memory);
  }
  EXPECT_LT(pixel.radius, 1.05 * kSpot);
}

// An edge that one hitpoint in five meets, in even light of 400 photons a pass. After 120 passes
// its mean blur is 5.5 of its standard deviations: enough to shrink the radius, and not yet for
// good. Where later passes show that it was chance, the radius comes back.
TEST(AppmTest, ShrinksWhereSomeHitpointsMeetAnEdgeAndComesBackWhereTheyDoNot) {
  RenderSettings settings;
  settings.radius_controller = RadiusControllerKind::kAppm;
  const auto appm = MakeRadiusController(settings, 1);
  std::vector<double> memory(appm->MemoryPerPixel());
  PixelRadius pixel = {1, 0};
  const auto step = [&](std::uint64_t pass, double blur) {
    const double r = pixel.radius;
    const auto columns = ExpectedCurvature(400, 0, r);
    pixel = appm->Next(pixel, {400 * r * r, r, columns, blur, pass + 1}, OnePass(pass), memory);
  };
  double before = 1;
  for (std::uint64_t pass = 0; pass < 120; ++pass) {
    const double r = pixel.radius;
    step(pass, pass % 5 == 0 ? 100 : 0);
    ASSERT_GE(pixel.radius, 0.6 * r) << pass;
    if (pass == 40) before = pixel.radius;
  }
  EXPECT_EQ(before, 1);
  // Where squared bias, (20 r²)² as it was seen, is half of the noise: 400 · 4/(3π) · 2 / (120 r²).
  EXPECT_LT(pixel.radius, 0.7);
  for (std::uint64_t pass = 120; pass < 400; ++pass) {
    const double r = pixel.radius;
    step(pass, pass % 2 == 0 ? 100 : -100);
    ASSERT_LE(pixel.radius, 1.15 * r * (1 + 1e-12)) << pass;
  }
  EXPECT_EQ(pixel.radius, 1);
}

// Light of so many photons in the first disc a pass, with a bend as in ExpectedCurvature and blur
// of so large a share of it.
struct Growth {
  double largest = 0, last = 0;
  double photons = 0;  // in a pass, in the mean of all
};
Growth Grow(double photons, double bend, double noise_share, double blur_share, int passes = 200) {
  RenderSettings settings;
  settings.radius_controller = RadiusControllerKind::kAppm;
  const auto appm = MakeRadiusController(settings, 1);
  std::vector<double> memory(appm->MemoryPerPixel());
  PixelRadius pixel = {1, 0};
  Growth growth;
  for (std::uint64_t pass = 0; pass < static_cast<std::uint64_t>(passes); ++pass) {
    const double r = pixel.radius;
    const auto columns = ExpectedCurvature(photons / std::numbers::pi, bend, r);
    // Of one sign, so that no chance hides it.
    const double blur = blur_share * photons * r * r;
    const RoundEvidence evidence = {.photons = photons * r * r,
                                    .radius = r,
                                    .columns = columns,
                                    .blur = blur,
                                    .rounds = pass + 1,
                                    .noise_share = noise_share};
    pixel = appm->Next(pixel, evidence, OnePass(pass), memory);
    EXPECT_TRUE(pass >= 8 || pixel.radius <= 1) << pass;
    EXPECT_LE(pixel.radius, 1.15 * r * (1 + 1e-12)) << pass;
    growth.largest = std::max(growth.largest, pixel.radius);
    growth.photons += photons * r * r / passes;
  }
  growth.last = pixel.radius;
  return growth;
}

TEST(AppmTest, GrowsInEvenLightToTwiceTheFirstRadiusAtMost) {
  EXPECT_DOUBLE_EQ(Grow(10, 0, 1, 0).last, 2);
}

TEST(AppmTest, GrowsToSixtyPhotonsInTheMeanOfThePasses) {
  EXPECT_NEAR(Grow(40, 0, 1, 0).photons, 60, 2);
  EXPECT_EQ(Grow(80, 0, 1, 0).largest, 1);
}

// Noise that the halves do not show is no reason to grow.
TEST(AppmTest, DoesNotGrowAgainstNoiseThatIsNotThere) {
  EXPECT_LT(Grow(10, 0, 0.15, 0).largest, 1.01);
  EXPECT_GT(Grow(10, 0, 0.5, 0).largest, 1.2);
}

// As sure blur shows up and noise falls, the radius comes back.
TEST(AppmTest, ComesBackToTheFirstRadiusWhereLightIsBent) {
  const Growth growth = Grow(10, 0.05, 1, 0, 2000);
  EXPECT_GT(growth.largest, 1.1);
  EXPECT_LT(growth.last, 1);
  EXPECT_EQ(Grow(10, 0, 1, 0.2).largest, 1);
}

// Even light of 10 photons a pass, with blur of `blur_share` of it in every fifth pass and a factor
// for the whole image from the first pass on.
struct ScaledRun {
  PixelRadius pixel;
  std::optional<ScaledRadius> scaled;
};
ScaledRun RunScaled(double scale, double blur_share, double then = 1, std::uint64_t until = 200) {
  RenderSettings settings;
  settings.radius_controller = RadiusControllerKind::kAppm;
  const auto appm = MakeRadiusController(settings, 1);
  std::vector<double> memory(appm->MemoryPerPixel());
  ScaledRun run = {.pixel = {1, 0}, .scaled = std::nullopt};
  for (std::uint64_t pass = 0; pass < 400; ++pass) {
    const double r = run.pixel.radius;
    const double photons = 10 * r * r;
    const auto columns = ExpectedCurvature(10 / std::numbers::pi, 0, r);
    run.pixel = appm->Next(run.pixel,
                           {.photons = photons,
                            .radius = r,
                            .columns = columns,
                            .blur = pass % 5 == 0 ? blur_share * 10 * r * r : 0,
                            .rounds = pass + 1,
                            .noise_share = 0.1,
                            .scale = pass < until ? scale : then,
                            .even_bias = pass % 2 == 0 ? 0.02 * r * r : 0,
                            .odd_bias = pass % 2 == 0 ? 0 : 0.02 * r * r},
                           OnePass(pass), memory);
    EXPECT_GE(run.pixel.radius, 0.6 * r * (1 - 1e-12)) << pass;
    EXPECT_LE(run.pixel.radius, 1.15 * r * (1 + 1e-12)) << pass;
    run.scaled = appm->Scaled(
        memory, {.passes = pass + 1, .rounds = pass + 1, .photons = static_cast<double>(pass + 1)});
    EXPECT_EQ(run.scaled.has_value(), pass >= 7) << pass;
  }
  return run;
}

TEST(AppmTest, FollowsTheFactorOfTheImageThereAndBack) {
  EXPECT_DOUBLE_EQ(RunScaled(0.4, 0, 0.4).pixel.radius, 0.4);
  EXPECT_DOUBLE_EQ(RunScaled(0.4, 0).pixel.radius, 1);
}

// Radii were 1 until the ninth pass and 0.4 nearly always since: the mean of their inverse sixth
// powers is that of 0.4 to a fiftieth.
TEST(AppmTest, SaysWhichFactorPassesHad) {
  const ScaledRun run = RunScaled(0.4, 0, 0.4);
  EXPECT_EQ(run.scaled->most, 1);
  EXPECT_NEAR(run.scaled->use, 0.4, 0.004);
}

// Radii as above, and bias that goes as their squares, of 0.02 at whole ones: each pass shows the
// same of it. Nine passes have whole radii, one 0.6 and the others 0.4.
TEST(AppmTest, KnowsTheBiasOfWholeRadiiByAllItHad) {
  const ScaledRun run = RunScaled(0.4, 0, 0.4);
  // Five of the nine passes with whole radii are even.
  EXPECT_NEAR(0.5 * (run.scaled->even_bias + run.scaled->odd_bias), 0.02, 1e-12);
  EXPECT_NEAR(run.scaled->even_bias / run.scaled->odd_bias, 1, 0.1);
  const double fourths = 9 + std::pow(0.6, 4) + 390 * std::pow(0.4, 4);
  EXPECT_NEAR(run.scaled->blurred, std::pow(fourths / 400, 0.25), 1e-9);
}

// Ten passes with the first radius, of which the last two have four times the photons and twice the
// bias: (8 · 0.02 + 8 · 0.04) / 16.
TEST(AppmTest, WeighsBiasByPhotons) {
  RenderSettings settings;
  settings.radius_controller = RadiusControllerKind::kAppm;
  const auto appm = MakeRadiusController(settings, 1);
  std::vector<double> memory(appm->MemoryPerPixel());
  const auto columns = ExpectedCurvature(100, 0, 1);
  for (std::uint64_t pass = 0; pass < 10; ++pass) {
    const double bias = pass < 8 ? 0.02 : 0.04;
    const RoundEvidence evidence = {.photons = 100,
                                    .radius = 1,
                                    .columns = columns,
                                    .rounds = pass + 1,
                                    .noise_share = 0.1,
                                    .even_bias = pass % 2 == 0 ? bias : 0,
                                    .odd_bias = pass % 2 == 0 ? 0 : bias,
                                    .photons_per_pass = pass < 8 ? 100.0 : 400.0};
    (void)appm->Next({1, 0}, evidence, OnePass(pass), memory);
  }
  const auto scaled = appm->Scaled(memory, {.passes = 10, .rounds = 10, .photons = 1600});
  ASSERT_TRUE(scaled.has_value());
  EXPECT_NEAR(scaled->even_bias, 0.03, 1e-12);
  EXPECT_NEAR(scaled->odd_bias, 0.03, 1e-12);
  EXPECT_NEAR(scaled->blurred, 1, 1e-12);
}

// Blur that is likely in this pixel holds its radius below the factor of the image, and the
// factor holds it below what its blur asks for.
TEST(AppmTest, TakesTheSmallerOfItsEvidenceAndTheFactorOfTheImage) {
  const ScaledRun alone = RunScaled(1, 0.5);
  ASSERT_LT(alone.pixel.radius, 0.8);
  EXPECT_NEAR(alone.scaled->most, alone.pixel.radius, 0.15);
  EXPECT_LT(RunScaled(0.95, 0.5, 0.95).pixel.radius, 0.8);
  EXPECT_DOUBLE_EQ(RunScaled(0.2, 0.5, 0.2).pixel.radius, 0.2);
}

// One frequency photon of weight 1 in every ten, all of one trace: the radius goes where that trace
// says, and no further.
PixelRadius RunFrequency(RadiusControllerKind kind, double trace, int passes) {
  RenderSettings settings;
  settings.radius_controller = kind;
  settings.bias = 0.02;
  const auto controller = MakeRadiusController(settings, 1);
  std::vector<double> memory(controller->MemoryPerPixel());
  PixelRadius pixel = {1, 0};
  for (int pass = 0; pass < passes; ++pass) {
    const auto r = static_cast<double>(pixel.radius);
    const double photons = 50 * r * r;
    const double frequency_photons = photons / 10;
    const double x = trace * r * r;
    const auto units = [&](double v) { return std::trunc(frequency_photons * v / kWeightUnit); };
    const std::array<double, kFrequencyColumns> columns = {
        std::round(frequency_photons), units(1), std::trunc(frequency_photons / kWeight2Unit),
        units(x), units(x * x)};
    pixel = controller->Next(pixel, {photons, pixel.radius, columns},
                             OnePass(static_cast<std::uint64_t>(pass)), memory);
  }
  return pixel;
}

TEST(FrequencyTest, StopsAtThePredictedRadius) {
  // Epanechnikov: sqrt(12 · 0.02 / tr) = 0.5.
  constexpr double kTrace = 12 * 0.02 / 0.25;
  const double stopped = RunFrequency(RadiusControllerKind::kFrequency, kTrace, 400).radius;
  EXPECT_NEAR(stopped, 0.5, 0.005);
  EXPECT_EQ(RunFrequency(RadiusControllerKind::kFrequency, kTrace, 800).radius, stopped);
  // The consistent variant goes on below it, but slower than PPM.
  const double consistent =
      RunFrequency(RadiusControllerKind::kFrequencyConsistent, kTrace, 800).radius;
  EXPECT_LT(consistent, 0.495F);
  EXPECT_GT(consistent, 0.4F);
  // Even light: the radius stays, but for the first pass, whose five frequency photons say nothing
  // yet.
  EXPECT_DOUBLE_EQ(RunFrequency(RadiusControllerKind::kFrequency, 0, 100).radius,
                   std::sqrt(2.0 / 3));
  EXPECT_EQ(RunFrequency(RadiusControllerKind::kFrequencyMse, 0, 100).radius, 1);
}

// Passes without frequency photons say nothing about the light, but their photons count.
TEST(FrequencyTest, PassesWithoutEvidenceLeaveThePredictionAlone) {
  RenderSettings settings;
  settings.radius_controller = RadiusControllerKind::kFrequency;
  const auto controller = MakeRadiusController(settings, 1);
  std::vector<double> memory(controller->MemoryPerPixel());
  const auto units = [](double v) { return std::rint(v / kWeightUnit); };
  const std::array<double, kFrequencyColumns> columns = {20, units(20), 20 / kWeight2Unit, units(5),
                                                         units(1.25)};
  PixelRadius pixel = controller->Next({1, 0}, {100, 1, columns}, OnePass(0), memory);
  const auto before = controller->Predict(memory);
  ASSERT_TRUE(before.has_value());
  const std::array<double, kFrequencyColumns> nothing{};
  for (std::uint64_t pass = 1; pass < 4; ++pass) {
    pixel = controller->Next(pixel, {100, pixel.radius, nothing}, OnePass(pass), memory);
  }
  EXPECT_DOUBLE_EQ(controller->Predict(memory)->trace, before->trace);
  EXPECT_GT(pixel.photons, 200);
}

TEST(EvidenceOfTest, FrequencyPhotonsKeepTheirShareOverAPeriod) {
  RenderSettings settings;
  settings.frequency_share = 0.05;
  int passes_with = 0;
  for (std::uint64_t pass = 0; pass < 4 * kFrequencyPeriod; ++pass) {
    if (EvidenceOf(RadiusControllerKind::kFrequency, pass) == Evidence::kFrequency) ++passes_with;
    EXPECT_EQ(EvidenceOf(RadiusControllerKind::kPpm, pass), Evidence::kNone);
  }
  EXPECT_EQ(EvidenceOf(RadiusControllerKind::kFrequency, 0), Evidence::kFrequency);
  EXPECT_NEAR(passes_with * FrequencyShareInPass(settings), 16 * 0.05, 1e-12);
}

TEST(FrequencyMseTest, TakesTheRadiusOfLeastErrorAtOnceAndThenFollowsTheDensity) {
  constexpr double kTrace = 40;  // tolerance at a radius of 0.077
  const double early = RunFrequency(RadiusControllerKind::kFrequencyMse, kTrace, 20).radius;
  const double late = RunFrequency(RadiusControllerKind::kFrequencyMse, kTrace, 2000).radius;
  // r ~ (photons per area)^(-1/6).
  EXPECT_NEAR(static_cast<double>(late / early), std::pow(100.0, -1.0 / 6), 0.06);
  EXPECT_GT(late, 0.077F);
}

}  // namespace
}  // namespace lucerna
