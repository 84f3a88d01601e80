// Does a pass bring to its pixels what the papers say, and as exactly as a slice keeps it?
#include "render/tracing/pass_slice.h"

#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "gtest/gtest.h"

#include "render/base/parallel.h"
#include "render/estimate/evidence.h"
#include "render/estimate/image_sums.h"
#include "render/estimate/pixel_radii.h"
#include "render/math/rng.h"

namespace lucerna {
namespace {

// Rounding to the 16 significant bits of radiance changes a number by less than this share, to the
// 8 of a statistic by less than that, and with dither to the 8 of light by a few photons by less
// than a step of these.
constexpr double kRadianceRounding = 0x1p-16;
constexpr double kStatisticRounding = 0x1p-8;
constexpr double kFewPhotonsRounding = 0x1p-7;

// A pass of `pixels` pixels without hitpoints, direct light or features.
EyePass DarkPass(std::uint64_t pass, std::size_t pixels) {
  EyePass eye;
  eye.pass = pass;
  eye.direct.resize(pixels);
  eye.features.resize(pixels);
  return eye;
}

// Such a pass with a hitpoint in one of the pixels.
EyePass PassOfOneHitpoint(std::uint64_t pass, std::size_t pixels, std::uint32_t pixel, Rgb weight,
                          float unit_radius) {
  EyePass eye = DarkPass(pass, pixels);
  eye.block.positions = {{0, 0, 0}};
  eye.block.normals_oct = {0};
  eye.pixels = {pixel};
  eye.weights = {weight};
  eye.unit_radii = {unit_radius};
  return eye;
}

RoundPlan Plan(std::uint64_t photons, RadiusColumn radii) {
  return {.photons_per_pass = photons,
          .radii = std::make_shared<const RadiusColumn>(std::move(radii))};
}

RenderSettings Settings(RadiusControllerKind controller, KernelKind kernel) {
  RenderSettings settings;
  settings.radius_controller = controller;
  settings.kernel = kernel;
  return settings;
}

SliceSums SliceOfPass(EyePass pass, const RoundPlan& plan, PassSums sums,
                      const RenderSettings& settings, const FluxScale& scale) {
  ThreadTeam team(2);
  return lucerna::SliceOfPass(std::move(pass), plan, std::move(sums), settings, SceneNeeds(), scale,
                              team);
}

// One pixel, one hitpoint a pass, PPM with immediate radii: tau' = (tau + Phi) r'^2 / r^2 and
// L = tau / (pi r^2 P passes), as in Hachisuka et al. 2008, against the sum that is kept here.
TEST(SliceOfPassTest, EqualsTheRescaledFluxOfProgressivePhotonMapping) {
  RenderSettings settings = Settings(RadiusControllerKind::kPpm, KernelKind::kConstant);
  settings.alpha = 0.7;
  const auto ppm = MakeRadiusController(settings, 0.25F);
  const FluxScale scale = FluxScale::ForPower({3, 5, 0.1F});
  constexpr std::uint64_t kPhotons = 1000;
  ThreadTeam team(1);
  ImageSums image(1);
  PixelRadii radii(1, 0.25F, *ppm);
  KeyedRng rng(5);
  double tau = 0;
  double r = 0.25;
  double n = 0;
  for (std::uint64_t pass = 0; pass < 300; ++pass) {
    Accumulation accumulation;
    // So many photons that their light has 16 bits; the method knows only ratios of their numbers.
    const std::uint32_t m = static_cast<std::uint32_t>(rng.Bits() % 20) << 20;
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
    const RoundPlan plan = Plan(kPhotons, radii.Current());
    const SliceSums slice =
        SliceOfPass(PassOfOneHitpoint(pass, 1, 0, {1, 1, 1}, 1), plan, sums, settings, scale);
    image.Add(slice, team);
    radii.Step({slice, *plan.radii}, {}, team);
    if (m == 0) continue;
    tau += static_cast<double>(quanta) * static_cast<double>(scale.watts_per_quantum.g);
    const double ratio = (n + settings.alpha * m) / (n + m);
    tau *= ratio;
    r *= std::sqrt(ratio);
    n += settings.alpha * m;
  }
  const double hachisuka = tau / (std::numbers::pi * r * r * kPhotons);
  // All terms are positive, so the sum is off by no larger share than each of them: the rounding of
  // a pass, and that of a float's radius, which adds up as a random walk does.
  EXPECT_NEAR(image.At(0).photons[1] / hachisuka, 1, kRadianceRounding + 1e-6 * std::sqrt(300.0));
  EXPECT_NEAR(static_cast<double>(radii.Current()[0]) / r, 1, 1e-5);
}

// 1e12 photons a pass that all reach one hitpoint, each with its 2^18 quanta: integers of 58 bits.
TEST(SliceOfPassTest, KeepsItsDigitsWithATrillionPhotonsAPass) {
  const RenderSettings settings = Settings(RadiusControllerKind::kPppm, KernelKind::kConstant);
  const auto controller = MakeRadiusController(settings, 0.25F);
  const FluxScale scale = FluxScale::ForPower(Gray(1));
  constexpr std::uint64_t kPhotons = 1'000'000'000'000;
  constexpr std::uint64_t kPasses = 16;
  ThreadTeam team(1);
  ImageSums image(1);
  PixelRadii radii(1, 0.25F, *controller);
  long double expected = 0;
  for (std::uint64_t pass = 0; pass < kPasses; ++pass) {
    PassSums sums(1, kCommonColumns);
    Accumulation batch;
    batch.hitpoints = {0};
    batch.counts = {4'000'000'000};
    for (auto& channel : batch.flux)
      channel = {std::int64_t{4'000'000'000} << kFluxBits};
    batch.evidence.assign(kCommonColumns, {0});
    for (int i = 0; i < 250; ++i)
      ASSERT_TRUE(sums.Add(batch).ok());
    const RoundPlan plan = Plan(kPhotons, radii.Current());
    const long double radius = static_cast<long double>((*plan.radii)[0]);
    expected += 1 / (std::numbers::pi_v<long double> * radius * radius);
    const SliceSums slice =
        SliceOfPass(PassOfOneHitpoint(pass, 1, 0, {1, 1, 1}, 1), plan, sums, settings, scale);
    image.Add(slice, team);
    radii.Step({slice, *plan.radii}, {}, team);
  }
  // Every term is rounded to 16 bits, and a few roundings of 2^-53 are nothing beside that.
  EXPECT_NEAR(image.At(0).photon_count / (kPasses * kPhotons), 1, kRadianceRounding);
  EXPECT_NEAR(image.At(0).photons[1] / static_cast<double>(expected), 1, kRadianceRounding);
  EXPECT_LE(static_cast<double>(radii.Current()[0]), 0.25);
}

TEST(SliceOfPassTest, CountsAPassWithoutHitpointAsDark) {
  const RenderSettings settings = Settings(RadiusControllerKind::kPpm, KernelKind::kEpanechnikov);
  EyePass eye = PassOfOneHitpoint(0, 2, 1, {2, 0, -1}, 0.5F);
  eye.direct[0] = {1, 2, 3};
  eye.rays = 17;
  PassSums sums(1, kCommonColumns);
  Accumulation accumulation;
  accumulation.hitpoints = {0};
  accumulation.counts = {3};
  for (auto& channel : accumulation.flux)
    channel = {8};
  accumulation.evidence = {{4}};
  ASSERT_TRUE(sums.Add(accumulation).ok());
  const RoundPlan plan = Plan(4, {1, 1});
  ASSERT_EQ(HitpointRadii(eye, plan), RadiusColumn{0.5F});
  const FluxScale scale = {Gray(1), Gray(1)};
  const SliceSums first = SliceOfPass(eye, plan, sums, settings, scale);
  EyePass without_hitpoint = DarkPass(1, 2);
  without_hitpoint.direct[0] = {0, 0, 1};
  const SliceSums second =
      SliceOfPass(without_hitpoint, plan, PassSums(0, kCommonColumns), settings, scale);
  ThreadTeam team(1);
  ImageSums image(2);
  image.Add(first, team);
  image.Add(second, team);
  EXPECT_EQ(image.passes(), 2U);
  EXPECT_EQ(image.eye_rays(), 17U);
  const ImageSums::Pixel dark = image.At(0);
  EXPECT_EQ(dark.photons[0], 0);
  EXPECT_EQ(dark.direct[2], 3 + 1);
  EXPECT_EQ(dark.half_difference[2], 3 - 1) << "of an even pass and an odd one";
  EXPECT_EQ(dark.photon_count, 0);
  // weight × flux × 2/(π r²) / photons
  const double density = 8 * 2 / (std::numbers::pi * 0.25) / 4;
  const ImageSums::Pixel lit = image.At(1);
  EXPECT_NEAR(lit.photons[0], 2 * density, 2 * density * kFewPhotonsRounding);
  EXPECT_EQ(lit.photons[1], 0);
  EXPECT_NEAR(lit.photons[2], -density, density * kFewPhotonsRounding);
  EXPECT_EQ(lit.half_difference, lit.photons);
  // Half the flux is outside the inner kernel's share: (4/8) density, over what that kernel leaves.
  const double luminance = 2 * 0.2126 - 0.0722;
  const double bias = luminance * density / 2 / (1 - 1.0 / 9);
  EXPECT_NEAR(lit.even_bias, bias, bias * kStatisticRounding);
  EXPECT_EQ(lit.odd_bias, 0);
  EXPECT_EQ(lit.photon_count, 3U);
  // The same blur in units of the scene's power and of a squared unit radius of 1.
  const double blur = 4 / (1 - 1.0 / 9) * 2 / std::numbers::pi / (1 << kFluxBits);
  EXPECT_NEAR(static_cast<double>(first.At(kBlur, 1)), blur, blur * kStatisticRounding);
  // Luminances of the two passes, L and 0, are L/2 from their mean.
  const double of_pass = WorkingLuminance(lit.photons[0], lit.photons[1], lit.photons[2]);
  EXPECT_NEAR(lit.squared_deviations, of_pass * of_pass / 2, 1e-12 * of_pass * of_pass);
}

// A caustic hitpoint adds light to its pixel with its own radius, and nothing to the numbers that
// the pixel's radius follows from.
TEST(SliceOfPassTest, ACausticHitpointAddsLightAndNoEvidence) {
  const RenderSettings settings = Settings(RadiusControllerKind::kPpm, KernelKind::kConstant);
  EyePass eye = PassOfOneHitpoint(0, 1, 0, {1, 1, 1}, 0.5F);
  eye.block.positions.push_back({0, 0, 1});
  eye.block.normals_oct.push_back(0);
  eye.block.caustic_rows = 1;
  eye.pixels.push_back(0);
  eye.weights.push_back({3, 3, 3});
  eye.unit_radii.push_back(0.25F);
  PassSums sums(2, kCommonColumns);
  Accumulation accumulation;
  accumulation.hitpoints = {0, 1};
  accumulation.counts = {3, 1000};
  for (auto& channel : accumulation.flux)
    channel = {8, 16};
  accumulation.evidence = {{4, 1 << 20}};
  ASSERT_TRUE(sums.Add(accumulation).ok());
  RoundPlan plan = Plan(4, {1});
  plan.caustic_radius = 2;
  EXPECT_EQ(HitpointRadii(eye, plan), (RadiusColumn{0.5F, 0.5F}));
  const SliceSums slice = SliceOfPass(eye, plan, sums, settings, {Gray(1), Gray(1)});
  const double per_flux = 1 / (std::numbers::pi * 0.25) / 4;
  const double expected = (8 + 3 * 16) * per_flux;
  EXPECT_NEAR(static_cast<double>(slice.At(kPhotonRadiance, 0)), expected,
              expected * kFewPhotonsRounding);
  EXPECT_EQ(slice.At(kPhotonCount, 0), 3.0F);
  const double blur = 4 / (1 - 1.0 / 9) / std::numbers::pi / (1 << kFluxBits);
  EXPECT_NEAR(static_cast<double>(slice.At(kBlur, 0)), blur, blur * kStatisticRounding);
  EXPECT_EQ(slice.At(slice.first_feature() + kUnitRadius, 0), 0.5F);
  EXPECT_EQ(slice.At(slice.first_feature() + kHitpoints, 0), 1.0F);
}

// Of a pixel with three paths, of which one has no hitpoint: what the others bring is a sum of
// their shares, and its statistics are means over all three.
TEST(SliceOfPassTest, StatisticsOfSeveralPathsAreTheirMeans) {
  const RenderSettings settings = Settings(RadiusControllerKind::kAppm, KernelKind::kConstant);
  const std::size_t columns = kCommonColumns + ControllerColumns(settings.radius_controller);
  EyePass eye = PassOfOneHitpoint(20, 2, 0, Gray(0.5F / 3), 0.5F);
  for (const std::uint32_t pixel : {0U, 1U}) {
    eye.block.positions.push_back({0, 0, 1});
    eye.block.normals_oct.push_back(0);
    eye.pixels.push_back(pixel);
    eye.weights.push_back(Gray(pixel == 0 ? 0.5F / 3 : 1));
    eye.unit_radii.push_back(0.25F);
  }
  PassSums sums(3, columns);
  Accumulation accumulation;
  accumulation.hitpoints = {0, 1, 2};
  accumulation.counts = {30, 60, 7};
  for (auto& channel : accumulation.flux)
    channel = {8, 16, 5};
  for (std::size_t column = 0; column < columns; ++column)
    accumulation.evidence.push_back({12, 24, 5});
  ASSERT_TRUE(sums.Add(accumulation).ok());
  RoundPlan plan = Plan(4, {1, 1});
  plan.eye_paths = std::make_shared<const EyePathCounts>(EyePathCounts{3, 1});
  const SliceSums slice = SliceOfPass(eye, plan, sums, settings, {Gray(1), Gray(1)});
  // Over radii of 0.5 and 0.25.
  const double expected = 0.5 / 3 * (8 * 4 + 16 * 16) / std::numbers::pi / 4;
  EXPECT_NEAR(static_cast<double>(slice.At(kPhotonRadiance, 0)), expected,
              expected * kFewPhotonsRounding);
  EXPECT_EQ(slice.At(kPhotonCount, 0), 30.0F);
  EXPECT_EQ(slice.At(kPhotonCount, 1), 7.0F);
  for (std::size_t column = 0; column < slice.evidence; ++column) {
    EXPECT_EQ(slice.At(kSliceColumns + column, 0), 12.0F);
    EXPECT_EQ(slice.At(kSliceColumns + column, 1), 5.0F);
  }
  const double blur = 12 / (1 - 1.0 / 9) / std::numbers::pi / (1 << kFluxBits);
  EXPECT_NEAR(static_cast<double>(slice.At(kBlur, 0)), blur, blur * kStatisticRounding);
}

// Half of the squared difference of two paths is the variance of one, of their direct light and
// what photons bring to them together.
TEST(SliceOfPassTest, TwoPathsOfAPixelSayHowMuchOneVaries) {
  const RenderSettings settings = Settings(RadiusControllerKind::kPpm, KernelKind::kConstant);
  constexpr std::uint64_t kCompares = 4;
  ASSERT_TRUE(ComparesEyePaths(kCompares));
  EyePass eye = PassOfOneHitpoint(kCompares, 2, 0, Gray(0.5F), 0.5F);
  eye.block.positions.push_back({0, 0, 1});
  eye.block.normals_oct.push_back(0);
  eye.pixels.push_back(0);
  eye.weights.push_back(Gray(0.25F));
  eye.unit_radii.push_back(0.5F);
  eye.paths = {0, 1};
  eye.direct_difference = {Gray(-3), Gray(0)};
  PassSums sums(2, kCommonColumns);
  Accumulation accumulation;
  accumulation.hitpoints = {0, 1};
  accumulation.counts = {3, 6};
  for (auto& channel : accumulation.flux)
    channel = {80, 16};
  accumulation.evidence = {{4, 8}};
  ASSERT_TRUE(sums.Add(accumulation).ok());
  RoundPlan plan = Plan(4, {1, 1});
  plan.eye_paths = std::make_shared<const EyePathCounts>(EyePathCounts{2, 1});
  const SliceSums slice = SliceOfPass(eye, plan, sums, settings, {Gray(1), Gray(1)});
  const double per_flux = 4 / std::numbers::pi / 4;
  const double difference = -3 + 2 * (0.5 * 80 - 0.25 * 16) * per_flux;
  const std::size_t column = slice.first_feature() + kPathVariance;
  EXPECT_NEAR(static_cast<double>(slice.At(column, 0)), difference * difference / 2,
              1e-4 * difference * difference);
  EXPECT_EQ(slice.At(column, 1), 0.0F);
}

// The columns of a controller's evidence come through; in a pass without evidence they are zero.
TEST(SliceOfPassTest, PassesWithoutEvidenceBringColumnsOfZeros) {
  const RenderSettings settings =
      Settings(RadiusControllerKind::kFrequency, KernelKind::kEpanechnikov);
  const auto slice_of = [&](std::uint64_t pass) {
    const std::size_t columns = EvidenceColumns(EvidenceOf(settings.radius_controller, pass));
    PassSums sums(1, columns);
    Accumulation accumulation;
    accumulation.hitpoints = {0};
    accumulation.counts = {3};
    for (auto& channel : accumulation.flux)
      channel = {8};
    for (std::size_t column = 0; column < columns; ++column)
      accumulation.evidence.push_back({static_cast<std::int64_t>(column) + 5});
    EXPECT_TRUE(sums.Add(accumulation).ok());
    return SliceOfPass(PassOfOneHitpoint(pass, 1, 0, {1, 1, 1}, 1), Plan(4, {1}), sums, settings,
                       {Gray(1), Gray(1)});
  };
  const SliceSums with = slice_of(kFrequencyPeriod);
  const SliceSums without = slice_of(kFrequencyPeriod + 1);
  ASSERT_EQ(with.evidence, std::size_t{kFrequencyColumns});
  ASSERT_EQ(without.columns.size(), with.columns.size());
  for (std::size_t column = 0; column < kFrequencyColumns; ++column) {
    EXPECT_EQ(with.At(kSliceColumns + column, 0), static_cast<float>(column + kCommonColumns + 5));
    EXPECT_EQ(without.At(kSliceColumns + column, 0), 0.0F);
  }
}

// A worker adds what eye paths brought before it has gathered photons.
TEST(SliceOfPassTest, IsMadeOfItsParts) {
  const RenderSettings settings = Settings(RadiusControllerKind::kAppm, KernelKind::kEpanechnikov);
  const std::size_t columns = kCommonColumns + ControllerColumns(settings.radius_controller);
  EyePass eye = PassOfOneHitpoint(3, 2, 1, {2, 0.3F, 1}, 0.7F);
  eye.direct = {{0.1F, 0.2F, 0.3F}, {4, 5, 6}};
  eye.features[1] = {.albedo = {0.3F, 0.4F, 0.5F}, .normal = {0, 0.6F, 0.8F}, .distance = 7};
  eye.rays = 5;
  PassSums sums(1, columns);
  Accumulation accumulation;
  accumulation.hitpoints = {0};
  accumulation.counts = {3};
  accumulation.flux = {{{8}, {9}, {10}}};
  for (std::size_t column = 0; column < columns; ++column)
    accumulation.evidence.push_back({static_cast<std::int64_t>(column) + 5});
  accumulation.tally.photons = 4;
  ASSERT_TRUE(sums.Add(accumulation).ok());
  const RoundPlan plan = Plan(4, {1, 2});
  const FluxScale scale = {Gray(1), Gray(1)};
  const SliceSums expected = SliceOfPass(eye, plan, sums, settings, scale);
  ThreadTeam team(2);
  SliceSums slice = BeginSlice(eye, settings);
  AddEyePaths(slice, eye, settings, SceneNeeds(), team);
  EXPECT_EQ(slice.columns[kDirectRadiance + 1][1], 5);
  EXPECT_EQ(slice.columns[slice.first_feature() + kHits][1], 1);
  EXPECT_EQ(slice.columns[slice.first_feature() + kUnitRadius][1], Rounded(0.7, 16));
  const RadiusColumn expected_radii = HitpointRadii(eye, plan);
  const RadiusColumn radii = TakeHitpointRadii(eye, plan);
  EXPECT_EQ(radii, expected_radii);
  EXPECT_EQ(radii, RadiusColumn{HitpointRadius(2, 0.7F)});
  EXPECT_TRUE(eye.unit_radii.empty());
  AddPhotons(slice, eye, plan, radii, sums, settings, SceneNeeds(), scale, team);
  EXPECT_EQ(slice, expected);
  EXPECT_GT(slice.columns[kPhotonRadiance][1], 0);
}

// Only the first passes carry features: sums over those of them that met a surface.
TEST(SliceOfPassTest, FeaturesAreOfTheFirstPassesThatMetASurface) {
  const RenderSettings settings = Settings(RadiusControllerKind::kPpm, KernelKind::kEpanechnikov);
  ThreadTeam team(1);
  ImageSums image(1);
  for (std::uint64_t pass = 0; pass < 2 * kFeaturePasses; ++pass) {
    EyePass eye = DarkPass(pass, 1);
    if (pass % 2 == 0) {
      eye.features[0].albedo = Gray(0.3F);
      eye.features[0].normal = {0, 0, 1};
      eye.features[0].distance = pass < kFeaturePasses ? 0.7F : 100.0F;
    }
    const SliceSums slice = SliceOfPass(eye, Plan(1, {1}), PassSums(0, kCommonColumns), settings,
                                        FluxScale::ForPower(Gray(1)));
    EXPECT_EQ(slice.columns.size(),
              kSliceColumns + (pass < kFeaturePasses ? std::size_t{kFeatureColumns} : 0));
    image.Add(slice, team);
  }
  const ImageSums::Features features = image.FeaturesAt(0);
  EXPECT_EQ(features.hits, kFeaturePasses / 2);
  EXPECT_EQ(features.hitpoints, 0);
  // A rounding of each pass, and one of a float for each addition.
  const double rounding = kRadianceRounding + kFeaturePasses * 0x1p-24;
  EXPECT_NEAR(static_cast<double>(features.albedo.g / static_cast<float>(features.hits)), 0.3,
              0.3 * rounding);
  EXPECT_NEAR(static_cast<double>(features.distance / static_cast<float>(features.hits)), 0.7,
              0.7 * rounding);
  EXPECT_EQ(features.normal.z, static_cast<float>(features.hits));
}

}  // namespace
}  // namespace lucerna
