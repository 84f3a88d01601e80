// The light in media must be right: as strong as closed forms and quadratures say.
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include "gtest/gtest.h"

#include "render/math/rng.h"
#include "render/math/transform.h"
#include "render/math/warp.h"
#include "render/scene/density_grid.h"
#include "tests/support/local_render.h"
#include "tests/support/measure.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

constexpr int kParts = 10;
constexpr int kQuestions = 60;  // see closed_form_test.cc

void ExpectMean(const MeasuredMean& measured, double expected, double bias = 0) {
  static const double quantile = StudentQuantile(SidakLevel(1e-3, kQuestions), kParts);
  const double bound = quantile * measured.standard_error + bias + 2e-5 * expected;
  EXPECT_NEAR(measured.mean, expected, bound) << "ratio " << measured.mean / expected;
  EXPECT_LT(bound, 0.05 * expected) << "the bound would let a wrong result pass";
}

Medium GrayMedium(float absorption, float scattering, float g = 0) {
  Medium medium;
  medium.absorption = Gray(absorption);
  medium.scattering = Gray(scattering);
  medium.g = g;
  return medium;
}

// A closed sphere that shines everywhere, filled with a medium.
Scene FilledFurnace(float reflectance, const Medium& medium) {
  Scene scene;
  scene.media = {medium};
  scene.camera.medium = 0;
  const std::int32_t wall = AddMaterial(scene, DiffuseMaterial(reflectance));
  AddSphere(scene, {0.5F, 0, 0}, 2, wall, AddAreaLight(scene, 1), /*inward=*/true);
  // The sphere's outward normal points to its inside.
  scene.spheres[0].traits.medium_outside = 0;
  SetCamera(scene, {0, 0, 0.3}, {1, 0.2, 0}, {0, 1, 0}, 80, 6);
  scene.camera.medium = 0;
  return scene;
}

// Where nothing is absorbed, radiance is the same everywhere and in all directions, with and
// without scattering: what comes from the wall, what the medium scatters and what photons bring to
// the wall through it add up to the same.
TEST(MediaFurnaceTest, IsAsBrightAsAnEmptyOneWhereNothingIsAbsorbed) {
  for (const float g : {0.0F, 0.5F}) {
    SCOPED_TRACE(g);
    const Scene scene = FilledFurnace(0.5F, GrayMedium(0, 0.4F, g));
    ExpectMean(Measure(scene, TestSettings(scene, 60000, 0.4, 100), 4, kParts, "G"), 2, 2e-3);
  }
}

// The same of a medium that is thick in some places and missing in others.
TEST(MediaFurnaceTest, IsAsBrightWhereDensityVaries) {
  Medium medium = GrayMedium(0, 0.8F, 0.4F);
  std::vector<float> values;
  KeyedRng rng(3);
  for (int i = 0; i < 4 * 3 * 5; ++i)
    values.push_back(std::max(0.0F, 3 * rng.Uniform() - 1));
  medium.density = std::make_shared<const DensityGrid>(std::array<int, 3>{4, 3, 5},
                                                       std::move(values), Vec3{-1.6F, -1.2F, -1.8F},
                                                       Vec3{2.4F, 1.6F, 1.5F}, Transform());
  const Scene scene = FilledFurnace(0.5F, medium);
  ExpectMean(Measure(scene, TestSettings(scene, 60000, 0.4, 100), 4, kParts, "G"), 2, 2e-3);
}

// Absorption alone: each ray's column density, up to the wall.
TEST(MediaFurnaceTest, IsDarkenedByTheColumnDensityOfEachRay) {
  Medium medium = GrayMedium(0.35F, 0);
  medium.density =
      std::make_shared<const DensityGrid>(std::array<int, 3>{2, 1, 1}, std::vector<float>{1, 3},
                                          Vec3{-9.5F, -99, -99}, Vec3{10.5F, 99, 99}, Transform());
  Scene scene = FilledFurnace(0, medium);
  SetCamera(scene, {0.5, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0.5, 4);
  scene.camera.medium = 0;
  const Image image = RenderLocally(scene, TestSettings(scene, 100, 0.3, 5), 1);
  // From 2 in the middle, at x = 0.5, by 0.2 a unit of length. Across, density falls by 1/99 a unit
  // of 2, and rays stay within 0.01 of the axis.
  const double column = 2 * (2 + 0.1 * 2);
  EXPECT_NEAR(ChannelMean(image, "G"), std::exp(-0.35 * column), 1e-4);
}

// A black wall that shines with radiance 1, around a medium that absorbs and does not scatter:
// exp(-σ d) along each ray; at the sphere's centre d is the radius.
TEST(MediaFurnaceTest, IsDarkenedByAbsorptionAsBeersLawSays) {
  Scene scene = FilledFurnace(0, GrayMedium(0.35F, 0));
  SetCamera(scene, {0.5, 0, 0}, {1, 0, 0}, {0, 1, 0}, 80, 4);
  scene.camera.medium = 0;
  const Image image = RenderLocally(scene, TestSettings(scene, 100, 0.3, 5), 1);
  EXPECT_NEAR(ChannelMean(image, "G"), std::exp(-0.7), 1e-5);
}

// A density that is the same across x.
struct LinearDensity {
  double at_0 = 1, per_x = 0;
  [[nodiscard]] double At(double x) const { return at_0 + per_x * x; }
  // Its mean between two places.
  [[nodiscard]] double Mean(double from, double to) const { return (At(from) + At(to)) / 2; }
};

// A point light of intensity 1 in a large medium; black walls far away, a single scattering. Along
// the camera's ray the in-scattered radiance is an integral over the distance.
double SingleScattering(const Medium& medium, double offset, double length,
                        const LinearDensity& density) {
  const double sigma_s = static_cast<double>(medium.scattering.g);
  const double sigma_t = sigma_s + static_cast<double>(medium.absorption.g);
  const auto g = static_cast<double>(medium.g);
  constexpr int kSteps = 4000;
  double sum = 0;
  // The light is beside the point at distance 3.
  for (int i = 0; i < kSteps; ++i) {
    const double t = length * (i + 0.5) / kSteps;
    const double squared = offset * offset + (t - 3) * (t - 3);
    const double d = std::sqrt(squared);
    // Light travels from (3, offset) to (t, 0) and on towards the camera at t = 0.
    const double cosine = -(t - 3) / d;
    const double phase = (1 - g * g) / (4 * kPi64 * std::pow(1 + g * g - 2 * g * cosine, 1.5));
    const double column = density.Mean(0, t) * t + density.Mean(3, t) * d;
    sum +=
        sigma_s * density.At(t) * phase * std::exp(-sigma_t * column) / squared * length / kSteps;
  }
  return sum;
}

// The same as the kernel sees it: around the ray, weighed by Epanechnikov's kernel of this radius.
double SmoothedSingleScattering(const Medium& medium, double offset, double length, double radius,
                                const LinearDensity& density) {
  constexpr int kRings = 12;
  constexpr int kSectors = 12;
  double sum = 0;
  double weights = 0;
  for (int ring = 0; ring < kRings; ++ring) {
    const double share = (ring + 0.5) / kRings;  // of the disc's area
    const double weight = 1 - share;
    for (int sector = 0; sector < kSectors; ++sector) {
      const double angle = 2 * kPi64 * (sector + 0.5) / kSectors;
      const double aside = radius * std::sqrt(share);
      const double there = std::hypot(offset + aside * std::cos(angle), aside * std::sin(angle));
      sum += weight * SingleScattering(medium, there, length, density);
      weights += weight;
    }
  }
  return sum / weights;
}

class SingleScatteringTest : public testing::TestWithParam<LinearDensity> {};

TEST_P(SingleScatteringTest, IsTheIntegralAlongTheRay) {
  constexpr double kOffset = 0.8;
  constexpr double kRadius = 0.8;  // of surfaces; segments have half of it
  const LinearDensity density = GetParam();
  for (const float g : {0.0F, 0.5F, -0.5F}) {
    SCOPED_TRACE(g);
    Medium medium = GrayMedium(0.05F, 0.1F, g);
    if (density.per_x != 0) {
      constexpr float kFar = 1e5F;
      medium.density = std::make_shared<const DensityGrid>(
          std::array<int, 3>{2, 1, 1},
          std::vector<float>{static_cast<float>(density.At(0)), static_cast<float>(density.At(20))},
          Vec3{-10, -kFar, -kFar}, Vec3{30, kFar, kFar}, Transform());
    }
    Scene scene;
    scene.media = {medium};
    const std::int32_t black = AddMaterial(scene, DiffuseMaterial(0));
    AddSphere(scene, {3, 0, 0}, 7, black, kNoAreaLight, /*inward=*/true);
    scene.spheres[0].traits.medium_outside = 0;
    PointLight light;
    light.position = {3, static_cast<float>(kOffset), 0};
    light.intensity = Gray(1);
    light.medium = 0;
    scene.point_lights.push_back(light);
    // A very narrow view along x.
    SetCamera(scene, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0.5, 1);
    scene.camera.medium = 0;
    RenderSettings settings = TestSettings(scene, 400000, kRadius, 1);
    settings.alpha = 1;  // radii are held
    ExpectMean(Measure(scene, settings, 4, kParts, "G"),
               SmoothedSingleScattering(medium, kOffset, 10, kRadius / 2, density));
  }
}

INSTANTIATE_TEST_SUITE_P(Densities, SingleScatteringTest,
                         testing::Values(LinearDensity{}, LinearDensity{0.2, 0.3}),
                         [](const auto& test) {
                           return test.param.per_x == 0 ? "Even" : "Growing";
                         });

// A ball of a medium that absorbs nothing, in a place where light comes from everywhere, looks like
// what is behind it, however thick it is. Its border is seen at a slant, and a disc
// across a segment is as wide as the free path is long. What is left is that the ball bends away
// from the plane by which depth is measured: within a disc of radius a by x²/(2b), and the mean of
// x² under Epanechnikov's kernel is a²/6 across the slant, and more along it by the square of
// 1/cosine.
TEST(ThickMediumTest, IsAsBrightAsWhatIsAroundItWhereItsBorderIsSlanted) {
  constexpr float kBall = 0.5F;
  constexpr float kExtinction = 20;
  constexpr double kDisc = 0.05;
  Scene scene;
  scene.media = {GrayMedium(0, kExtinction)};
  const std::int32_t black = AddMaterial(scene, DiffuseMaterial(0));
  AddSphere(scene, {0, 0, 0}, 1.2F, black, AddAreaLight(scene, 1), /*inward=*/true);
  Material interface;
  interface.kind = Material::Kind::kInterface;
  AddSphere(scene, {0, 0, 0}, kBall, AddMaterial(scene, interface));
  scene.spheres[1].traits.medium_inside = 0;
  const Vec3 eye = {0, 0, -1.15F};
  const Vec3 target = {0.25F, 0, -0.433F};
  SetCamera(scene, {0, 0, -1.15}, {0.25, 0, -0.433}, {0, 1, 0}, 8, 4);
  RenderSettings settings = TestSettings(scene, 600000, 2 * kDisc, 1000);
  settings.alpha = 1;  // radii are held
  const auto cosine = static_cast<double>(-Dot(Normalize(target - eye), target / kBall));
  const double deeper =
      kDisc * kDisc / 6 * (1 + 1 / (cosine * cosine)) / (2 * static_cast<double>(kBall)) / cosine;
  const double lost = static_cast<double>(kExtinction) * deeper;
  EXPECT_NEAR(lost, 0.042, 0.002);
  // The next term of the exponential is a tenth of it or less.
  ExpectMean(Measure(scene, settings, 4, kParts, "G"), 1 - lost, 0.1 * lost);
}

// A beam of light through a box of fog without borders of its own: light behind an interface, seen
// through it, and a wall lit through it, as Beer's law says.
TEST(InterfaceTest, IsPassedByEyePathsShadowRaysAndPhotons) {
  const auto wall_radiance = [](bool has_medium) {
    Scene scene;
    Material interface;
    interface.kind = Material::Kind::kInterface;
    if (has_medium) {
      scene.media = {GrayMedium(0.5F, 0)};
      AddBox(scene, {-3, -3, 1}, {3, 3, 2}, AddMaterial(scene, interface));
      scene.meshes[0].traits.medium_inside = 0;
    }
    AddQuad(scene, {-2, -2, 0}, {4, 0, 0}, {0, 4, 0}, AddMaterial(scene, DiffuseMaterial(0.6F)));
    PointLight light;
    light.position = {0, 0, 3};
    light.intensity = Gray(10);
    scene.point_lights.push_back(light);
    SetCamera(scene, {0, 0, 5}, {0, 0, 0}, {0, 1, 0}, 1, 4);
    return ChannelMean(RenderLocally(scene, TestSettings(scene, 100, 0.3, 5), 2), "G");
  };
  // Straight down and up again: one unit of the medium each way.
  EXPECT_NEAR(wall_radiance(true) / wall_radiance(false), std::exp(-1.0), 2e-4);
}

}  // namespace
}  // namespace lucerna
