// Does the light stay right where sizes, angles, brightness and depth are extreme?
//
// Each scene has an answer that is known: a closed form, the counters of the photons, or the scene
// without what must not matter. docs/numerics.md lists them with the figures measured. Bounds are
// those of closed_form_test.cc: Student's quantile of independent renders, and 2e-5 for floats.
#include <cmath>
#include <string>
#include <string_view>

#include "gtest/gtest.h"

#include "render/math/warp.h"
#include "render/transport/bsdf.h"
#include "tests/support/local_render.h"
#include "tests/support/measure.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

constexpr int kParts = 8;
// At least as many comparisons as this file makes.
constexpr int kQuestions = 60;

double Quantile() {
  static const double quantile = StudentQuantile(SidakLevel(1e-3, kQuestions), kParts);
  return quantile;
}

void ExpectMean(const MeasuredMean& measured, double expected, double tight = 0.02) {
  const double bound = Quantile() * measured.standard_error + 2e-5 * expected;
  EXPECT_NEAR(measured.mean, expected, bound) << "ratio " << measured.mean / expected;
  EXPECT_LT(bound, tight * expected) << "the bound would let a wrong result pass";
}

void ExpectEqualMeans(const MeasuredMean& a, const MeasuredMean& b, double tight = 0.02) {
  const double error = std::hypot(a.standard_error, b.standard_error);
  ExpectMean({a.mean, error}, b.mean, tight);
}

void ExpectFinite(const Image& image) {
  for (const ImageChannel& channel : image.channels) {
    // The distance of a pixel that sees nothing is infinite.
    if (channel.name == "Z") continue;
    for (const float value : channel.pixels)
      ASSERT_TRUE(std::isfinite(value)) << channel.name;
  }
}

// A disc so wide that all photons of a plane are in it, and its kernel even: what is gathered is
// their flux, without the chance of where they fell.
constexpr double kMeterRadius = 1e6;
RenderSettings FluxMeter(const Scene& scene, std::int64_t photons, int depth) {
  RenderSettings settings = TestSettings(scene, photons, kMeterRadius, depth);
  settings.kernel = KernelKind::kConstant;
  settings.alpha = 1 - 1e-7;
  return settings;
}
// [W], from the radiance that a diffuse surface of this reflectance then has.
double MeteredFlux(double radiance, double reflectance) {
  return radiance * kPi64 / reflectance * kPi64 * kMeterRadius * kMeterRadius;
}

// --- furnaces ----------------------------------------------------------------------------------

// A closed sphere that shines everywhere.
Scene Furnace(float reflectance) {
  Scene scene;
  const std::int32_t wall = AddMaterial(scene, DiffuseMaterial(reflectance));
  AddSphere(scene, {0.5F, 0, 0}, 2, wall, AddAreaLight(scene, 1), /*inward=*/true);
  SetCamera(scene, {0, 0, 0.3}, {1, 0.2, 0}, {0, 1, 0}, 80, 6);
  return scene;
}

MeasuredMean FurnaceRadiance(float reflectance, std::int64_t photons, int depth, int passes) {
  const Scene scene = Furnace(reflectance);
  return Measure(scene, TestSettings(scene, photons, 0.6, depth), passes, kParts, "G");
}

TEST(ExtremeFurnaceTest, OfBlackWallsIsTheirEmission) {
  const MeasuredMean black = FurnaceRadiance(0, 1000, 10, 2);
  EXPECT_EQ(black.mean, 1);
  EXPECT_EQ(black.standard_error, 0);
}

// L = Le / (1 - ρ), cut off at the depth.
TEST(ExtremeFurnaceTest, OfNearlyWhiteWallsIsTheSumOfAThousandReflections) {
  const float reflectance = 0.999F;
  const auto rho = static_cast<double>(reflectance);
  ExpectMean(FurnaceRadiance(reflectance, 2000, 10000, 1), 1 / (1 - rho), 0.1);
}

// No photon is absorbed, and the depth ends them all: Le · (1 + depth).
TEST(ExtremeFurnaceTest, OfWhiteWallsGrowsWithItsDepth) {
  ExpectMean(FurnaceRadiance(1, 20000, 1, 2), 2);
  ExpectMean(FurnaceRadiance(1, 20000, 10, 2), 11);
  ExpectMean(FurnaceRadiance(1, 200, 10000, 1), 10001);
}

// A closed white room makes 17 million deposits of few photons: more than are held at a time.
TEST(ExtremeFurnaceTest, GathersLongPathsInParts) {
  Scene scene = Furnace(1);
  scene.film.width = scene.film.height = scene.film.crop_x1 = scene.film.crop_y1 = 1;
  constexpr std::uint64_t kPhotons = 1700;
  constexpr int kDepth = 10000;
  LocalRender render(scene, TestSettings(scene, kPhotons, 5, kDepth));
  render.AddPass();
  // The first landing of each is direct light, which photons leave to eye paths.
  EXPECT_EQ(render.tally().deposits, kPhotons * (kDepth - 1));
  EXPECT_EQ(render.tally().photons, kPhotons);
}

TEST(ExtremeFurnaceTest, OfOnePhotonAPassIsRightOnAverage) {
  ExpectMean(FurnaceRadiance(0.5F, 1, 40, 4096), 2, 0.05);
}

// Whatever the radius, numbers are finite; and a disc wider than the scene holds its flux spread
// over the disc.
TEST(ExtremeFurnaceTest, IsFiniteAtEveryRadius) {
  const Scene scene = Furnace(0.5F);
  for (const std::string_view controller : RadiusControllerNames()) {
    for (const double radius : {1e-18, 1e-9, 1e9, 1e18}) {
      SCOPED_TRACE(std::string(controller) + " " + std::to_string(radius));
      RenderSettings settings = TestSettings(scene, 500, radius, 40);
      settings.radius_controller = *ParseRadiusController(controller);
      const Image image = RenderLocally(scene, settings, 4);
      ExpectFinite(image);
      // Emission and direct light are left.
      EXPECT_NEAR(ChannelMean(image, "G"), 1.5, 1e-6);
    }
  }
}

// --- nothing to see ----------------------------------------------------------------------------

TEST(EmptySceneTest, WithoutLightIsBlack) {
  Scene scene = Furnace(0.5F);
  scene.area_lights[0].radiance = {};
  const Image image = RenderLocally(scene, TestSettings(scene, 1000, 0.5, 5), 3);
  ExpectFinite(image);
  EXPECT_EQ(ChannelMean(image, "G"), 0);
}

// The light lies behind the camera, and so does everything else.
TEST(EmptySceneTest, WithoutASurfaceInViewIsBlack) {
  Scene scene;
  const std::int32_t wall = AddMaterial(scene, DiffuseMaterial(0.5F));
  AddQuad(scene, {-1, -1, -3}, {2, 0, 0}, {0, 2, 0}, wall, AddAreaLight(scene, 1));
  SetCamera(scene, {0, 0, 0}, {0, 0, 1}, {0, 1, 0}, 40, 8);
  const Image image = RenderLocally(scene, TestSettings(scene, 1000, 0.5, 5), 3);
  ExpectFinite(image);
  EXPECT_EQ(ChannelMean(image, "G"), 0);
}

// --- glass -------------------------------------------------------------------------------------

// From any point within R/n of the middle of a glass ball all light comes out in the end: radiance
// inside is n² times that of an even sky. There is no surface to gather on.
TEST(ExtremeGlassTest, BallSeenFromInsideIsBrighterByTheSquaredIndex) {
  Scene scene;
  AddSphere(scene, {0, 0, 0}, 1, AddMaterial(scene, DielectricMaterial(1.5F)));
  scene.infinite_lights.push_back({Gray(1)});
  SetCamera(scene, {0.3, 0.2, 0}, {1, 1, 1}, {0, 1, 0}, 90, 16);
  ExpectMean(Measure(scene, TestSettings(scene, 100, 0.1, 100), 64, kParts, "G"), 2.25);
}

// A pane of the same index as what is around it, met at 89.99 degrees: what lies behind is seen.
TEST(ExtremeGlassTest, OfTheSameIndexVanishesAtGrazingIncidence) {
  Scene scene;
  AddQuad(scene, {0, -5e3F, 0}, {4e4F, 0, 0}, {0, 1e4F, 0},
          AddMaterial(scene, DielectricMaterial(1)));
  const std::int32_t lamp = AddMaterial(scene, DiffuseMaterial(0));
  // Below the pane only, facing the camera.
  AddQuad(scene, {2e4F, -5e3F, -100}, {0, 0, 99.5F}, {0, 1e4F, 0}, lamp, AddAreaLight(scene, 1));
  SetCamera(scene, {0, 0, 1}, {1e4, 0, 0}, {0, 0, 1}, 1e-4, 4);
  const Image image = RenderLocally(scene, TestSettings(scene, 100, 1, 8), 8);
  EXPECT_NEAR(ChannelMean(image, "G"), 1, 1e-6);
}

// A room with a light, and the same with a ball and a block of index 1 between light and floor:
// light comes by photons instead of samples of the emitter.
TEST(ExtremeGlassTest, OfTheSameIndexVanishesBetweenLampAndFloor) {
  Scene scene;
  const std::int32_t floor = AddMaterial(scene, DiffuseMaterial(0.5F));
  AddQuad(scene, {-1, -1, 0}, {2, 0, 0}, {0, 2, 0}, floor);
  AddQuad(scene, {-0.3F, -0.3F, 1.5F}, {0, 0.6F, 0}, {0.6F, 0, 0},
          AddMaterial(scene, DiffuseMaterial(0)), AddAreaLight(scene, 3));
  const std::int32_t none = AddMaterial(scene, DielectricMaterial(1));
  SetCamera(scene, {0, -2, 1}, {0, 0, 0}, {0, 0, 1}, 12, 8);
  RenderSettings settings = TestSettings(scene, 100000, 0.12, 8);
  const MeasuredMean bare = Measure(scene, settings, 3, kParts, "G");
  AddSphere(scene, {0.1F, 0, 0.6F}, 0.5F, none);
  AddBox(scene, {-0.9F, -0.9F, 1.15F}, {0.9F, 0.9F, 1.3F}, none);
  ExpectEqualMeans(Measure(scene, settings, 3, kParts, "G"), bare, 0.03);
}

// The share of light from above that gets through panes one over the other.
double TransmittedShare(int panes, float thickness, float gap) {
  Scene scene;
  constexpr float kDark = 1e-3F;
  AddQuad(scene, {-1, -1, 0}, {2, 0, 0}, {0, 2, 0}, AddMaterial(scene, DiffuseMaterial(kDark)));
  const std::int32_t glass = AddMaterial(scene, DielectricMaterial(1.5F));
  float low = 0.5F;
  for (int pane = 0; pane < panes; ++pane) {
    AddBox(scene, {-3, -3, low}, {3, 3, low + thickness}, glass);
    low = low + thickness + gap;
  }
  SpotLight spot;
  spot.position = {0, 0, 4};
  spot.direction = {0, 0, -1};
  spot.intensity = Gray(1);
  spot.cos_falloff_start = spot.cos_total_width = 0.999F;
  scene.spot_lights.push_back(spot);
  SetCamera(scene, {0.3, 0, 0.3}, {0, 0, 0}, {0, 1, 0}, 0.5, 2);
  const double power = 2 * kPi64 * 0.001;
  return MeteredFlux(Measure(scene, FluxMeter(scene, 50000, 60), 1, kParts, "photons.G").mean,
                     static_cast<double>(kDark)) /
         power;
}

// (1 - R) / (1 + (2n - 1) R) of n panes. Faces that coincide count as one: the limit of
// docs/numerics.md, so that it is known when it moves.
TEST(ExtremeGlassTest, PanesPassTheirSeriesDownToAGapOfTenMicrons) {
  constexpr double kR = 0.04;
  constexpr double kNoise = 2e-3;  // of the choice between passing and reflecting
  EXPECT_NEAR(TransmittedShare(1, 0.5F, 0), (1 - kR) / (1 + kR), kNoise);
  EXPECT_NEAR(TransmittedShare(2, 0.5F, 0.1F), (1 - kR) / (1 + 3 * kR), kNoise);
  EXPECT_NEAR(TransmittedShare(2, 0.5F, 1e-5F), (1 - kR) / (1 + 3 * kR), kNoise);
  EXPECT_NEAR(TransmittedShare(2, 0.5F, 0), (1 - kR) / (1 + 2 * kR), kNoise);
}

// Light that enters a ball leaves it again, whatever balls are inside or touch it: each photon
// reaches the wall around.
TEST(ExtremeGlassTest, NestedAndTouchingBallsLoseNoPhoton) {
  Scene scene;
  const std::int32_t wall = AddMaterial(scene, DiffuseMaterial(1e-6F));
  AddSphere(scene, {0, 0, 0}, 4, wall, kNoAreaLight, /*inward=*/true);
  const std::int32_t glass = AddMaterial(scene, DielectricMaterial(1.5F));
  const std::int32_t water = AddMaterial(scene, DielectricMaterial(1.33F / 1.5F));
  AddSphere(scene, {0, 0, 0}, 1, glass);
  AddSphere(scene, {0.25F, 0, 0}, 0.5F, water);
  AddSphere(scene, {0.25F, 0, 0}, 0.25F, AddMaterial(scene, DielectricMaterial(1.5F / 1.33F)));
  AddSphere(scene, {-0.75F, 0, 0}, 0.25F, water);  // touches the outer ball from inside
  AddSphere(scene, {0, 2, 0}, 1, glass);           // and this one from outside
  SpotLight spot;
  spot.position = {0, -1.7F, 0};
  spot.direction = {0, 1, 0};
  spot.intensity = Gray(1);
  spot.cos_falloff_start = spot.cos_total_width = 0.82F;  // just less wide than the ball
  scene.spot_lights.push_back(spot);
  SetCamera(scene, {-1.5, 1, 1.5}, {-3, 2, 3}, {0, 1, 0}, 10, 2);
  constexpr std::uint64_t kPhotons = 200000;
  LocalRender render(scene, FluxMeter(scene, kPhotons, 1000));
  render.AddPass();
  EXPECT_EQ(render.tally().dropped, 0U);
  // The wall sends one photon in a million back.
  EXPECT_NEAR(static_cast<double>(render.tally().deposits), static_cast<double>(kPhotons), 4);
}

// A slab between glass and air, turned so that no axis is along a face, and a light and a camera in
// it: 1000 total reflections to the end.
struct Rod {
  Vec3 along, across, up;
  [[nodiscard]] Vec3 At(float x, float y, float z) const { return along * x + across * y + up * z; }
};

Rod TurnedRod() {
  const Vec3 along = Normalize({0.6F, 0.5F, 0.3F});
  const Frame frame(along);
  return {along, frame.s, frame.t};
}

constexpr float kRodLength = 1000;

// Both faces as strips of pieces that share their corners: between others, rays would get through.
void AddRod(Scene& scene, const Rod& rod, std::int32_t glass) {
  constexpr int kPieces = 102;
  TriangleMesh mesh;
  for (int i = 0; i <= kPieces; ++i) {
    const float x = -10 + 10 * static_cast<float>(i);
    for (const Vec3 corner : {rod.At(x, -5, 0), rod.At(x, 5, 0), rod.At(x, -5, 1), rod.At(x, 5, 1)})
      mesh.positions.push_back(corner);
    if (i == kPieces) break;
    const auto first = static_cast<std::uint32_t>(4 * i);
    for (const std::uint32_t corner : {0, 1, 5, 0, 5, 4, 2, 6, 7, 2, 7, 3})
      mesh.indices.push_back(first + corner);
  }
  mesh.traits.material = glass;
  scene.meshes.push_back(mesh);
}

TEST(TotalReflectionTest, EyePathsKeepTheirRadianceOverAThousandBounces) {
  Scene scene;
  const Rod rod = TurnedRod();
  AddRod(scene, rod, AddMaterial(scene, DielectricMaterial(1.5F)));
  AddQuad(scene, rod.At(kRodLength, -5, -0.5F), rod.up * 2, rod.across * 10,
          AddMaterial(scene, DiffuseMaterial(0)), AddAreaLight(scene, 1));
  const Vec3 eye = rod.At(0.25F, 0, 0.5F);
  const Vec3 look = eye + rod.along + rod.up;
  SetCamera(scene, {eye.x, eye.y, eye.z}, {look.x, look.y, look.z},
            {rod.across.x, rod.across.y, rod.across.z}, 0.05, 4);
  const Image image = RenderLocally(scene, TestSettings(scene, 100, 1, 2000), 4);
  EXPECT_NEAR(ChannelMean(image, "G"), 1, 2e-5);
}

TEST(TotalReflectionTest, PhotonsKeepTheirFluxOverAThousandBounces) {
  // Light by 2000 photons has 11 bits, dithered: a deviation of at most half a step, 2^-11, in each
  // pixel, and 5e-6 in the mean of so many.
  constexpr int kPixels = 100;
  Scene scene;
  const Rod rod = TurnedRod();
  AddRod(scene, rod, AddMaterial(scene, DielectricMaterial(1.5F)));
  AddQuad(scene, rod.At(kRodLength, -5, -0.5F), rod.up * 2, rod.across * 10,
          AddMaterial(scene, DiffuseMaterial(0.5F)));
  SpotLight spot;
  spot.position = rod.At(0.25F, 0, 0.5F);
  spot.direction = Normalize(rod.along + rod.up);
  spot.intensity = Gray(1);
  spot.cos_falloff_start = spot.cos_total_width = 0.999999F;
  scene.spot_lights.push_back(spot);
  const Vec3 eye = rod.At(kRodLength - 2, 0, 0.5F);
  const Vec3 look = rod.At(kRodLength, 0, 0.5F);
  SetCamera(scene, {eye.x, eye.y, eye.z}, {look.x, look.y, look.z},
            {rod.across.x, rod.across.y, rod.across.z}, 5, kPixels);
  LocalRender render(scene, FluxMeter(scene, 2000, 2000));
  render.AddPass();
  EXPECT_EQ(render.tally().deposits, render.tally().photons);
  const double power = 2 * kPi64 * (1 - static_cast<double>(0.999999F));
  EXPECT_NEAR(MeteredFlux(ChannelMean(render.MakeImage(), "photons.G"), 0.5) / power, 1, 2e-5);
}

// --- light -------------------------------------------------------------------------------------

// A floor z = 0 of reflectance 1/2 and a camera that sees its origin.
Scene Floor() {
  Scene scene;
  AddQuad(scene, {-3, -3, 0}, {6, 0, 0}, {0, 6, 0}, AddMaterial(scene, DiffuseMaterial(0.5F)));
  AddMaterial(scene, DiffuseMaterial(0));
  SetCamera(scene, {2.5, 0, 1}, {0, 0, 0}, {0, 0, 1}, 0.05, 2);
  return scene;
}
constexpr std::int32_t kBlack = 1;

TEST(ExtremeLightTest, AtGrazingIncidenceIsItsCosine) {
  for (const double angle_deg : {89.9, 89.999, 89.9999}) {
    SCOPED_TRACE(angle_deg);
    const double cosine = std::cos(angle_deg * kPi64 / 180);
    Scene scene = Floor();
    scene.distant_lights.push_back(
        {{static_cast<float>(std::sqrt(1 - cosine * cosine)), 0, static_cast<float>(-cosine)},
         Gray(3)});
    ExpectMean(Measure(scene, TestSettings(scene, 1, 0.01, 1), 4, kParts, "direct.G"),
               3 * cosine * 0.5 / kPi64);
  }
}

// A square of 1e-6 and one of 1e3 [m], as bright in all.
TEST(ExtremeLightTest, OfAreasEighteenDecadesApartAddsUp) {
  Scene scene = Floor();
  AddQuad(scene, {-5e-7F, -5e-7F, 1}, {0, 1e-6F, 0}, {1e-6F, 0, 0}, kBlack,
          AddAreaLight(scene, 1e12F));
  AddQuad(scene, {-500, -500, 1000}, {0, 1000, 0}, {1000, 0, 0}, kBlack, AddAreaLight(scene, 1));
  // Four times a quarter of the large square, from a corner of it.
  const double a = 0.5;
  const double side = a / std::sqrt(1 + a * a);
  const double form = 4 / kPi64 * side * std::atan(side);
  ExpectMean(Measure(scene, TestSettings(scene, 1, 0.01, 1), 10000, kParts, "direct.G"),
             (1e12 * 1e-12 + kPi64 * form) * 0.5 / kPi64);
}

// Two sealed rooms whose lights are 1e20 apart in power; the camera is in one of them. No photon is
// spent on the other.
TEST(ExtremeLightTest, TwentyDecadesBrighterNextDoorChangeNothing) {
  for (const float radiance : {1e10F, 1e-10F}) {
    SCOPED_TRACE(radiance);
    Scene scene = Furnace(0.5F);
    scene.area_lights[0].radiance = Gray(radiance);
    AddSphere(scene, {20, 0, 0}, 2, 0, AddAreaLight(scene, 1 / radiance), /*inward=*/true);
    const RenderSettings settings = TestSettings(scene, 20000, 0.6, 40);
    const auto own = static_cast<double>(radiance);
    ExpectMean(Measure(scene, settings, 4, kParts, "direct.G"), 1.5 * own);
    ExpectMean(Measure(scene, settings, 4, kParts, "G"), 2 * own);
  }
}

// --- roughness ---------------------------------------------------------------------------------

TEST(ExtremeRoughnessTest, MetalUnderAnEvenSkyReflectsItsAlbedo) {
  for (const float alpha : {1e-6F, 1e-4F, 1.0F}) {
    SCOPED_TRACE(alpha);
    Scene scene;
    AddQuad(scene, {-3, -3, 0}, {6, 0, 0}, {0, 6, 0},
            AddMaterial(scene, ConductorMaterial({0.2F, 0.2F, 0.2F}, {3, 3, 3}, alpha, alpha)));
    SetCamera(scene, {2, 0, 2}, {0, 0, 0}, {0, 0, 1}, 0.02, 2);
    scene.infinite_lights.push_back({Gray(1)});
    const Vec3 wo = Normalize({1, 0, 1});
    constexpr int kSide = 1000;
    double albedo = 0;
    for (int i = 0; i < kSide; ++i) {
      for (int j = 0; j < kSide; ++j) {
        BsdfSample sample;
        const auto at = [](int k) { return (static_cast<float>(k) + 0.5F) / kSide; };
        if (SampleBsdf(scene.materials[0], wo, 0, at(i), at(j), Carried::kRadiance, sample)) {
          albedo += static_cast<double>(sample.weight.g) / (kSide * kSide);
        }
      }
    }
    const MeasuredMean m =
        Measure(scene, TestSettings(scene, 1, 0.01, 4), 1024, kParts, "direct.G");
    ExpectMean(m, albedo);
  }
}

// --- foci --------------------------------------------------------------------------------------

// A light before a hollow mirror, and a plate where its image is: all light arrives, on a spot some
// 1e6 times as bright as the beam, and no number leaves its range with any controller.
TEST(FocusTest, OfAHollowMirrorKeepsItsFlux) {
  Scene scene;
  constexpr float kDark = 1e-3F;
  // 1 / 1.95 + 1 / 0.6724 = 2 / R
  constexpr float kPlate = 1 - 0.672414F;
  AddDisk(scene, {0, 0, kPlate}, {0, 0, 1}, 0.004F, AddMaterial(scene, DiffuseMaterial(kDark)));
  const Material mirror = ConductorMaterial(Gray(1), Gray(1e4F), 0, 0);
  AddSphere(scene, {0, 0, 0}, 1, AddMaterial(scene, mirror), kNoAreaLight, /*inward=*/true);
  SpotLight spot;
  spot.position = {0, 0, -0.95F};
  spot.direction = {0, 0, 1};
  spot.intensity = Gray(1);
  spot.cos_falloff_start = spot.cos_total_width = 0.9999F;
  scene.spot_lights.push_back(spot);
  SetCamera(scene, {0.01, 0, 0.35}, {0, 0, static_cast<double>(kPlate)}, {0, 1, 0}, 2, 2);
  // The plate's own shadow is in the beam.
  const double shadow = 1 - std::cos(std::atan(0.004 / (0.95 + static_cast<double>(kPlate))));
  const double power = 2 * kPi64 * (1 - static_cast<double>(0.9999F) - shadow);
  LocalRender render(scene, FluxMeter(scene, 100000, 3));
  render.AddPass();
  EXPECT_NEAR(MeteredFlux(ChannelMean(render.MakeImage(), "photons.G"), kDark) / power, 1, 2e-3);
  for (const std::string_view controller : RadiusControllerNames()) {
    SCOPED_TRACE(controller);
    RenderSettings settings = TestSettings(scene, 2000, 1e-3, 10);
    settings.radius_controller = *ParseRadiusController(controller);
    ExpectFinite(RenderLocally(scene, settings, 6));
  }
}

// --- a caustic beside a dark wall --------------------------------------------------------------

// A wall lit through a ball of index 1 by an emitter that has a hundredth of the light, and far
// enough from it a spot that is 1e6 times as bright, which one beam makes of all the rest.
Scene DarkWall(bool has_caustic) {
  Scene scene;
  AddQuad(scene, {-1, -1, 0}, {4, 0, 0}, {0, 2, 0}, AddMaterial(scene, DiffuseMaterial(0.1F)));
  const std::int32_t none = AddMaterial(scene, DielectricMaterial(1));
  scene.point_lights.push_back({{0, 0, 1}, Gray(1)});
  AddSphere(scene, {0, 0, 1}, 0.1F, none);
  if (has_caustic) {
    SpotLight spot;
    spot.position = {1.5F, 0, 1};
    spot.direction = {0, 0, -1};
    spot.intensity = Gray(1e6F);
    spot.cos_falloff_start = spot.cos_total_width = 1 - 2e-4F;
    scene.spot_lights.push_back(spot);
    AddBox(scene, {1.2F, -0.3F, 0.4F}, {1.8F, 0.3F, 0.6F}, none);
  }
  SetCamera(scene, {0, -1, 1}, {0.3, 0, 0}, {0, 0, 1}, 40, 8);
  return scene;
}

TEST(CausticTest, AMillionTimesBrighterLeavesTheWallBesideItRight) {
  const auto wall = [](const Scene& scene) {
    return Measure(scene, TestSettings(scene, 200000, 0.2, 5), 4, kParts, "photons.G");
  };
  ExpectEqualMeans(wall(DarkWall(true)), wall(DarkWall(false)), 0.1);
}

// --- large meshes and films --------------------------------------------------------------------

TEST(LargeMeshTest, OfTwoMillionTrianglesIsTheFloorItCovers) {
  Scene scene;
  AddMaterial(scene, DiffuseMaterial(0.5F));
  constexpr std::uint32_t kSide = 1000;
  TriangleMesh mesh;
  for (std::uint32_t y = 0; y <= kSide; ++y) {
    for (std::uint32_t x = 0; x <= kSide; ++x) {
      mesh.positions.push_back(
          {6 * static_cast<float>(x) / kSide - 3, 6 * static_cast<float>(y) / kSide - 3, 0});
      if (x == kSide || y == kSide) continue;
      const std::uint32_t at = y * (kSide + 1) + x;
      for (const std::uint32_t corner :
           {at, at + 1, at + kSide + 2, at, at + kSide + 2, at + kSide + 1})
        mesh.indices.push_back(corner);
    }
  }
  scene.meshes.push_back(mesh);
  scene.point_lights.push_back({{0, 0, 1}, Gray(2)});
  SetCamera(scene, {2.5, 0, 1}, {0, 0, 0}, {0, 0, 1}, 0.01, 2);
  const Image image = RenderLocally(scene, TestSettings(scene, 1000, 0.1, 3), 2);
  EXPECT_NEAR(ChannelMean(image, "G"), 2 * 0.5 / kPi64, 1e-5);
}

// Nine pixels in the middle of 16384 x 16384 see what a camera sees whose whole film they are.
TEST(LargeFilmTest, ACropOfItIsRight) {
  Scene scene = Floor();
  scene.point_lights.push_back({{0, 0, 0.01F}, Gray(1e-4F)});
  SetCamera(scene, {0.001, 0, 1}, {0, 0, 0}, {0, 1, 0}, 90, 16384);
  scene.film.crop_x0 = scene.film.crop_y0 = 8191 - 64;
  scene.film.crop_x1 = scene.film.crop_y1 = 8191 - 61;
  const MeasuredMean crop = Measure(scene, TestSettings(scene, 1, 0.01, 1), 64, kParts, "direct.G");
  scene.film.width = scene.film.height = 3;
  scene.film.crop_x0 = scene.film.crop_y0 = 0;
  scene.film.crop_x1 = scene.film.crop_y1 = 3;
  // Film x of the large one goes from -1 to 1 and y from 1 to -1.
  const double low = 2 * (8191 - 64) / 16384.0 - 1;
  const double high = 2 * (8191 - 61) / 16384.0 - 1;
  scene.camera.screen_window = Window{low, high, -high, -low};
  ExpectEqualMeans(crop, Measure(scene, TestSettings(scene, 1, 0.01, 1), 64, kParts, "direct.G"),
                   0.001);
}

}  // namespace
}  // namespace lucerna
