// The light must be right: as strong as closed forms and quadratures say.
//
// Every measurement is the mean of independent renders, so its standard error is known from their
// spread, and Student's quantile makes a bound of it: one for the whole suite, at a chance of a
// false alarm of 1e-3 (Šidák). Photon densities are compared with the irradiance as the kernel
// smooths it, at a radius that is held, so that no bias is left to allow for on flat receivers.
// Every bound is also shown to be tight: a result two percent off would have been refused.
#include <cmath>
#include <functional>
#include <memory>
#include <string>

#include "gtest/gtest.h"

#include "render/math/equal_area_square.h"
#include "render/math/rng.h"
#include "render/math/warp.h"
#include "render/transport/bsdf.h"
#include "tests/support/measure.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

constexpr int kParts = 10;
// At least as many comparisons as this folder makes.
constexpr int kQuestions = 70;

void ExpectMean(const MeasuredMean& measured, double expected, double bias = 0) {
  static const double quantile = StudentQuantile(SidakLevel(1e-3, kQuestions), kParts);
  // Float arithmetic along a path is good for about 1e-5.
  const double bound = quantile * measured.standard_error + bias + 2e-5 * expected;
  EXPECT_NEAR(measured.mean, expected, bound) << "ratio " << measured.mean / expected;
  EXPECT_LT(bound, 0.02 * expected) << "the bound would let a wrong result pass";
  // The planted twin: the density that a radius one percent off would give.
  EXPECT_GT(std::abs(measured.mean * 1.01 * 1.01 * 1.02 - expected), bound);
}

// --- furnaces ----------------------------------------------------------------------------------

// A closed sphere that shines everywhere: each depth adds reflectance times the one before. A
// ball around a point of a sphere cuts out a cap of area πr² exactly, so the density is unbiased.
Scene Furnace(float reflectance) {
  Scene scene;
  const std::int32_t wall = AddMaterial(scene, DiffuseMaterial(reflectance));
  AddSphere(scene, {0.5F, 0, 0}, 2, wall, AddAreaLight(scene, 1), /*inward=*/true);
  SetCamera(scene, {0, 0, 0.3}, {1, 0.2, 0}, {0, 1, 0}, 80, 6);
  return scene;
}

MeasuredMean FurnaceRadiance(float reflectance, int max_depth, KernelKind kernel) {
  const Scene scene = Furnace(reflectance);
  RenderSettings settings = TestSettings(scene, 20000, 0.6, max_depth);
  settings.kernel = kernel;
  return Measure(scene, settings, 4, kParts, "G");
}

// Eye paths and photons both look the texture up: with the material's own 0.5 it would be 2.
TEST(FurnaceTest, ReflectsWhatItsTextureSays) {
  Scene scene = Furnace(0.5F);
  Texture quarter;
  quarter.color = Gray(0.25F);
  Texture board;
  board.kind = Texture::Kind::kCheckerboard;
  board.parts = {0, 0};
  scene.textures = {quarter, board};
  scene.materials[0].texture = 1;
  ExpectMean(Measure(scene, TestSettings(scene, 20000, 0.6, 40), 4, kParts, "G"), 4.0 / 3);
}

TEST(FurnaceTest, AddsUpItsReflections) {
  ExpectMean(FurnaceRadiance(0.5F, 40, KernelKind::kEpanechnikov), 2);
  ExpectMean(FurnaceRadiance(0.5F, 40, KernelKind::kConstant), 2);
  ExpectMean(FurnaceRadiance(0.8F, 100, KernelKind::kEpanechnikov), 5, 1e-6);
}

// max_depth scattering events of all: 1 + ρ + ... + ρ^max_depth.
TEST(FurnaceTest, StopsAtItsDepth) {
  for (const int depth : {1, 2, 3, 6}) {
    SCOPED_TRACE("depth " + std::to_string(depth));
    double expected = 0;
    for (int k = 0; k <= depth; ++k)
      expected += std::pow(0.5, k);
    ExpectMean(FurnaceRadiance(0.5F, depth, KernelKind::kEpanechnikov), expected);
  }
}

// Eight triangles with the normals of a ball, a mirror that takes a ten-thousandth. Many directions
// that it sends light to lie behind the triangle that was met; what goes there comes out again. So
// each way through even light ends in even light, of eye paths and of photons.
TEST(FurnaceTest, KeepsItsLightAroundACoarseRoundMirror) {
  Scene scene = Furnace(0.5F);
  const Vec3 center = {0.5F, 0, 0};
  TriangleMesh ball;
  ball.traits.material = static_cast<std::uint32_t>(
      AddMaterial(scene, ConductorMaterial(Gray(1), Gray(AbsorptionFor(1)), 0, 0)));
  ball.normals = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  for (const Vec3 normal : ball.normals)
    ball.positions.push_back(center + normal * 1.3F);
  for (const std::uint32_t x : {0U, 1U}) {
    for (const std::uint32_t y : {2U, 3U}) {
      for (const std::uint32_t z : {4U, 5U})
        ball.indices.insert(ball.indices.end(), {x, y, z});
    }
  }
  scene.meshes.push_back(ball);
  SetCamera(scene, {-1.2, 0, 0.3}, {0, 1, 0.2}, {0, 0, 1}, 80, 6);
  // The mirror's own, and more where the bound on the ratio of cosines (worker/photon_path.cc)
  // acts, without which a third of this is lost.
  constexpr double kTaken = 0.01;
  ExpectMean(Measure(scene, TestSettings(scene, 100000, 0.6, 100), 24, kParts, "G"), 2, 2 * kTaken);
}

// Metal walls whose normals are bent, around a floor. The bottom is larger than the walls reach, so
// that nothing proves that no light comes in.
TEST(FurnaceTest, LetsNoLightThroughSmoothedMetalWalls) {
  for (const float alpha : {0.0F, 0.1F}) {
    Scene scene;
    const std::int32_t metal =
        AddMaterial(scene, ConductorMaterial(Gray(1), Gray(AbsorptionFor(1)), alpha, alpha));
    const std::int32_t floor = AddMaterial(scene, DiffuseMaterial(0.5F));
    AddQuad(scene, {-0.9F, -0.9F, 0}, {1.8F, 0, 0}, {0, 1.8F, 0}, floor);
    AddQuad(scene, {-3, -3, -0.1F}, {6, 0, 0}, {0, 6, 0}, AddMaterial(scene, DiffuseMaterial(0)));
    const auto wall = [&](Vec3 corner, Vec3 a, Vec3 b) {
      AddQuad(scene, corner, a, b, metal);
      const Vec3 normal = Normalize(Cross(a, b));
      for (int i = 0; i < 4; ++i) {
        scene.meshes.back().normals.push_back(
            Normalize(normal + a * (i % 2 == 0 ? -0.4F : 0.4F) + b * (i < 2 ? -0.4F : 0.4F)));
      }
    };
    wall({-1, -1, -0.2F}, {2, 0, 0}, {0, 0, 1.2F});
    wall({-1, 1, -0.2F}, {2, 0, 0}, {0, 0, 1.2F});
    wall({-1, -1, -0.2F}, {0, 2, 0}, {0, 0, 1.2F});
    wall({1, -1, -0.2F}, {0, 2, 0}, {0, 0, 1.2F});
    wall({-1, -1, 1}, {2, 0, 0}, {0, 2, 0});
    scene.infinite_lights.push_back({Gray(1)});
    SetCamera(scene, {0.5, 0.4, 0.6}, {-1, -0.8, 0.2}, {0, 0, 1}, 90, 16);
    EXPECT_EQ(Measure(scene, TestSettings(scene, 20000, 0.1, 20), 4, 2, "G").mean, 0) << alpha;
  }
}

TEST(FurnaceTest, RefusesASlightlyWhiterWall) {
  const MeasuredMean measured = FurnaceRadiance(0.51F, 40, KernelKind::kEpanechnikov);
  const double quantile = StudentQuantile(SidakLevel(1e-3, kQuestions), kParts);
  EXPECT_GT(std::abs(measured.mean - 2), quantile * measured.standard_error);
}

// --- irradiance on a floor ---------------------------------------------------------------------

constexpr float kFloorReflectance = 0.5F;

// A floor z = 0 and a camera that sees next to nothing of it but the origin.
Scene Floor() {
  Scene scene;
  const std::int32_t floor = AddMaterial(scene, DiffuseMaterial(kFloorReflectance));
  AddQuad(scene, {-3, -3, 0}, {6, 0, 0}, {0, 6, 0}, floor);
  AddMaterial(scene, DiffuseMaterial(0));
  SetCamera(scene, {2.5, 0, 1}, {0, 0, 0}, {0, 0, 1}, 0.05, 2);
  return scene;
}
constexpr std::int32_t kBlack = 1;

// The lights' irradiance [W·m⁻²] at (x, y, 0).
using Irradiance = std::function<double(double x, double y)>;

struct Lamp {
  std::string name;
  Scene scene;
  Irradiance irradiance;
  Vec3 center;
  float around;  // radius of a ball that holds the light and stays above the floor
};

std::vector<Lamp> Lamps() {
  std::vector<Lamp> lamps;
  {
    Lamp lamp{"point", Floor(), {}, {0.4F, 0, 1}, 0.2F};
    lamp.scene.point_lights.push_back({lamp.center, Gray(3)});
    lamp.irradiance = [](double x, double y) {
      return 3 / std::pow((x - 0.4) * (x - 0.4) + y * y + 1, 1.5);
    };
    lamps.push_back(lamp);
  }
  for (const float aside : {0.0F, 0.7F}) {
    Lamp lamp{aside == 0 ? "disc above" : "disc aside", Floor(), {}, {aside, 0, 1}, 0.5F};
    AddDisk(lamp.scene, lamp.center, {0, 0, -1}, 0.4F, kBlack, AddAreaLight(lamp.scene, 2));
    // The form factor from a parallel element to a disc.
    lamp.irradiance = [aside](double x, double y) {
      const double a2 = (x - static_cast<double>(aside)) * (x - static_cast<double>(aside)) + y * y;
      const double z = a2 + 1 + 0.16;
      return 2 * kPi64 * 0.5 * (1 - (a2 + 1 - 0.16) / std::sqrt(z * z - 4 * 0.16 * a2));
    };
    lamps.push_back(lamp);
  }
  for (const float radius : {0.02F, 0.4F}) {
    Lamp lamp{radius < 0.1F ? "bulb" : "globe", Floor(), {}, {0.5F, 0, 1}, 0.6F};
    const float radiance = 2 * 0.16F / (radius * radius);
    AddSphere(lamp.scene, lamp.center, radius, kBlack, AddAreaLight(lamp.scene, radiance));
    lamp.irradiance = [](double x, double y) {
      const double squared = (x - 0.5) * (x - 0.5) + y * y + 1;
      return kPi64 * 2 * 0.16 / squared / std::sqrt(squared);
    };
    lamps.push_back(lamp);
  }
  {
    // A screen of 4 by 3 pixels that faces down; its patches as many small lights.
    Lamp lamp{"screen", Floor(), {}, {0.2F, 0, 1}, 0.7F};
    Picture picture;
    picture.width = 4;
    picture.height = 3;
    picture.channels = 1;
    picture.linear = {0, 0, 20, 1, 0.5F, 0, 0, 3, 4, 1, 0, 0};
    const auto shared = std::make_shared<const Picture>(picture);
    lamp.scene.area_lights.push_back({Gray(0.5F), false, shared, picture.Largest()});
    const Vec3 corner = lamp.center - Vec3{0.5F, 0.4F, 0};
    AddQuad(lamp.scene, corner, {0, 0.8F, 0}, {1, 0, 0}, kBlack, 0);
    lamp.scene.meshes.back().uvs = {{0, 0}, {0, 1}, {1, 1}, {1, 0}};
    lamp.irradiance = [shared](double x, double y) {
      constexpr int kPatches = 120;
      double sum = 0;
      for (int i = 0; i < kPatches; ++i) {
        for (int j = 0; j < kPatches; ++j) {
          const double u = (i + 0.5) / kPatches;
          const double v = (j + 0.5) / kPatches;
          const double dx = 0.2 - 0.5 + u - x;
          const double dy = -0.4 + 0.8 * v - y;
          const double squared = dx * dx + dy * dy + 1;
          const float pixel = PictureColor(*shared, {static_cast<float>(u), static_cast<float>(v)},
                                           Texture::Wrap::kClamp, Texture::Wrap::kClamp)
                                  .g;
          sum += 0.5 * static_cast<double>(pixel) / (squared * squared);
        }
      }
      return sum * 0.8 / (kPatches * kPatches);
    };
    lamps.push_back(lamp);
  }
  return lamps;
}

TEST(IrradianceTest, OfSampledLightIsTheClosedForm) {
  for (const Lamp& lamp : Lamps()) {
    SCOPED_TRACE(lamp.name);
    const RenderSettings settings = TestSettings(lamp.scene, 1, 0.01, 1);
    ExpectMean(Measure(lamp.scene, settings, 4096, kParts, "direct.G"),
               lamp.irradiance(0, 0) * static_cast<double>(kFloorReflectance) / kPi64,
               // The camera sees a millimetre of floor.
               1e-3 * lamp.irradiance(0, 0));
  }
}

TEST(IrradianceTest, FromInfinityIsTheClosedForm) {
  const double albedo_over_pi = static_cast<double>(kFloorReflectance) / kPi64;
  Scene distant = Floor();
  distant.distant_lights.push_back({Normalize({1, 2, -2}), Gray(3)});
  ExpectMean(Measure(distant, TestSettings(distant, 1, 0.01, 1), 16, kParts, "direct.G"),
             3 * 2.0 / 3 * albedo_over_pi);
  Scene sky = Floor();
  sky.infinite_lights.push_back({Gray(1.5F)});
  ExpectMean(Measure(sky, TestSettings(sky, 1, 0.01, 1), 4096, kParts, "direct.G"),
             1.5 * kPi64 * albedo_over_pi);
}

// The same sky as a map, and one that is brighter here than there: drawn from the map and from the
// surface, and joined.
TEST(IrradianceTest, FromAnEnvironmentMapIsTheSumOverItsPatches) {
  constexpr int kSide = 8;
  for (const bool is_even : {true, false}) {
    SCOPED_TRACE(is_even);
    Picture picture;
    picture.width = picture.height = kSide;
    picture.channels = 1;
    for (int i = 0; i < kSide * kSide; ++i)
      picture.linear.push_back(is_even ? 1.5F : i == 29 ? 20.0F : 0.1F * static_cast<float>(i % 5));
    double irradiance = 0;
    constexpr int kLattice = 400 * kSide;
    for (int y = 0; y < kLattice; ++y) {
      for (int x = 0; x < kLattice; ++x) {
        const float cosine = EqualAreaDirection({(static_cast<float>(x) + 0.5F) / kLattice,
                                                 (static_cast<float>(y) + 0.5F) / kLattice})
                                 .z;
        if (cosine <= 0) continue;
        irradiance += static_cast<double>(picture.At(x / 400, y / 400).g * cosine) * 4 * kPi64 /
                      (static_cast<double>(kLattice) * kLattice);
      }
    }
    Scene sky = Floor();
    InfiniteLight light;
    light.radiance = Gray(1);
    light.kind = InfiniteLight::Kind::kEnvironment;
    light.map = std::make_shared<const Picture>(std::move(picture));
    sky.infinite_lights.push_back(light);
    ExpectMean(Measure(sky, TestSettings(sky, 1, 0.01, 1), 4096, kParts, "direct.G"),
               irradiance * static_cast<double>(kFloorReflectance) / kPi64);
  }
}

// The mean of the irradiance under an Epanechnikov kernel of `radius` around the origin.
double Smoothed(const Irradiance& irradiance, double radius) {
  constexpr int kRings = 200;
  constexpr int kSectors = 64;
  double sum = 0;
  for (int ring = 0; ring < kRings; ++ring) {
    const double t2 = (ring + 0.5) / kRings;
    for (int sector = 0; sector < kSectors; ++sector) {
      const double angle = 2 * kPi64 * (sector + 0.5) / kSectors;
      const double r = radius * std::sqrt(t2);
      sum +=
          2 * (1 - t2) * irradiance(r * std::cos(angle), r * std::sin(angle)) / (kRings * kSectors);
    }
  }
  return sum;
}

// A radius that is held over the passes.
RenderSettings HeldRadius(const Scene& scene, std::int64_t photons, double radius, int depth) {
  RenderSettings settings = TestSettings(scene, photons, radius, depth);
  settings.alpha = 1 - 1e-7;
  return settings;
}

// A ball of matter that bends nothing hides the light from sampling: all its light comes by
// photons.
TEST(IrradianceTest, OfPhotonsIsTheClosedForm) {
  for (Lamp& lamp : Lamps()) {
    SCOPED_TRACE(lamp.name);
    AddSphere(lamp.scene, lamp.center, lamp.around, AddMaterial(lamp.scene, DielectricMaterial(1)));
    const RenderSettings settings = HeldRadius(lamp.scene, 150000, 0.3, 4);
    const double expected =
        Smoothed(lamp.irradiance, 0.3) * static_cast<double>(kFloorReflectance) / kPi64;
    ExpectMean(Measure(lamp.scene, settings, 3, kParts, "photons.G"), expected);
    EXPECT_EQ(Measure(lamp.scene, settings, 1, 2, "direct.G").mean, 0);
  }
}

// An even sky behind a portal that looks up, at z = 1 from (-0.3, -0.5) to (0.5, 0.4), without any
// wall around it.
Lamp PortalLamp() {
  Lamp lamp{"portal", Floor(), {}, {0, 0, 1}, 0};
  InfiniteLight light;
  light.radiance = Gray(1.5F);
  light.kind = InfiniteLight::Kind::kPortal;
  light.portal = Portal{{-0.3F, -0.5F, 1}, {0.8F, 0, 0}, {0, 0.9F, 0}};
  lamp.scene.infinite_lights.push_back(light);
  // The form factor of a rectangle, by its corners.
  lamp.irradiance = [](double x, double y) {
    const auto corner = [](double a, double b) {
      const double p = std::sqrt(1 + a * a);
      const double q = std::sqrt(1 + b * b);
      return (a / p * std::atan(b / p) + b / q * std::atan(a / q)) / (2 * kPi64);
    };
    return 1.5 * kPi64 *
           (corner(0.5 - x, 0.4 - y) - corner(-0.3 - x, 0.4 - y) - corner(0.5 - x, -0.5 - y) +
            corner(-0.3 - x, -0.5 - y));
  };
  return lamp;
}

TEST(IrradianceTest, ThroughAPortalIsTheClosedForm) {
  const double albedo_over_pi = static_cast<double>(kFloorReflectance) / kPi64;
  const Lamp lamp = PortalLamp();
  const double expected = lamp.irradiance(0, 0) * albedo_over_pi;
  ExpectMean(Measure(lamp.scene, TestSettings(lamp.scene, 1, 0.01, 1), 4096, kParts, "direct.G"),
             expected, 1e-3 * expected);

  // By photons: a pane that bends nothing, between floor and portal.
  Scene by_photons = lamp.scene;
  AddBox(by_photons, {-4, -4, 0.7F}, {4, 4, 0.8F}, AddMaterial(by_photons, DielectricMaterial(1)));
  const RenderSettings settings = HeldRadius(by_photons, 150000, 0.3, 4);
  ExpectMean(Measure(by_photons, settings, 3, kParts, "photons.G"),
             Smoothed(lamp.irradiance, 0.3) * albedo_over_pi);
  EXPECT_EQ(Measure(by_photons, settings, 1, 2, "direct.G").mean, 0);

  // A pane above the portal: a ray that leaves the pane begins on the far side and sees no light,
  // and photons that land on the pane first bring none.
  Scene beyond = lamp.scene;
  AddBox(beyond, {-4, -4, 1.2F}, {4, 4, 1.3F}, AddMaterial(beyond, DielectricMaterial(1)));
  EXPECT_EQ(Measure(beyond, settings, 1, 2, "photons.G").mean, 0);
  EXPECT_EQ(Measure(beyond, settings, 16, 2, "direct.G").mean, 0);

  // A roof beyond the portal, half as high again over the floor, that is black: from (x, y) the
  // part of the portal before it is that for which 1.5 times the way to it along y ends at y > 0.
  Lamp shaded = lamp;
  shaded.irradiance = [](double x, double y) {
    const double rim = std::clamp(y - y / 1.5, -0.5, 0.4);
    const auto corner = [](double a, double b) {
      const double p = std::sqrt(1 + a * a);
      const double q = std::sqrt(1 + b * b);
      return (a / p * std::atan(b / p) + b / q * std::atan(a / q)) / (2 * kPi64);
    };
    return 1.5 * kPi64 *
           (corner(0.5 - x, rim - y) - corner(-0.3 - x, rim - y) - corner(0.5 - x, -0.5 - y) +
            corner(-0.3 - x, -0.5 - y));
  };
  for (Scene* const scene : {&shaded.scene, &by_photons})
    AddQuad(*scene, {-40, 0, 1.5F}, {80, 0, 0}, {0, 40, 0}, kBlack);
  const double half = shaded.irradiance(0, 0) * albedo_over_pi;
  ExpectMean(
      Measure(shaded.scene, TestSettings(shaded.scene, 1, 0.01, 1), 4096, kParts, "direct.G"), half,
      1e-3 * half);
  ExpectMean(Measure(by_photons, HeldRadius(by_photons, 150000, 0.3, 4), 3, kParts, "photons.G"),
             Smoothed(shaded.irradiance, 0.3) * albedo_over_pi);
}

// --- glass -------------------------------------------------------------------------------------

// A point light in the middle of a glass ball in a black room: what the glass sends back passes
// the middle again, so all of it comes out, whatever the index.
TEST(GlassTest, LetsAllLightOutInTheEnd) {
  for (const float ior : {1.0F, 1.5F, 2.4F}) {
    SCOPED_TRACE("index " + std::to_string(ior));
    Scene scene;
    constexpr float kWall = 1e-3F;
    const std::int32_t wall = AddMaterial(scene, DiffuseMaterial(kWall));
    AddSphere(scene, {0, 0, 0}, 1, wall, kNoAreaLight, /*inward=*/true);
    AddSphere(scene, {0, 0, 0}, 0.4F, AddMaterial(scene, DielectricMaterial(ior)));
    scene.point_lights.push_back({{0, 0, 0}, Gray(5)});
    SetCamera(scene, {0, 0, 0.7}, {0.2, 0.1, 2}, {0, 1, 0}, 20, 2);
    // Irradiance Φ / 4πR² = I / R²; what the wall sends back is a thousandth of it.
    ExpectMean(Measure(scene, HeldRadius(scene, 50000, 0.4, 60), 4, kParts, "photons.G"),
               5 * static_cast<double>(kWall) / kPi64, 2e-3 * 5e-3 / kPi64);
  }
}

double FresnelReflectance(double cosine, double ior) {
  float cos_t = 0;
  return static_cast<double>(
      FresnelDielectric(static_cast<float>(cosine), static_cast<float>(ior), cos_t));
}

// A pane passes (1 - R) / (1 + R) after all reflections between its faces.
TEST(GlassTest, PanePassesTheFresnelSeries) {
  for (const double angle_deg : {0.0, 55.0}) {
    SCOPED_TRACE(angle_deg);
    const double cosine = std::cos(angle_deg * kPi64 / 180);
    Scene scene;
    constexpr float kDark = 1e-3F;
    AddQuad(scene, {-1, -1, 0}, {2, 0, 0}, {0, 2, 0}, AddMaterial(scene, DiffuseMaterial(kDark)));
    AddBox(scene, {-2, -2, 0.45F}, {2, 2, 0.55F}, AddMaterial(scene, DielectricMaterial(1.5F)));
    scene.distant_lights.push_back(
        {{static_cast<float>(std::sqrt(1 - cosine * cosine)), 0, static_cast<float>(-cosine)},
         Gray(2)});
    SetCamera(scene, {0.3, 0, 0.3}, {0, 0, 0}, {0, 1, 0}, 0.5, 2);
    const double r = FresnelReflectance(cosine, 1.5);
    ExpectMean(Measure(scene, HeldRadius(scene, 400000, 0.4, 30), 2, kParts, "photons.G"),
               2 * cosine * (1 - r) / (1 + r) * static_cast<double>(kDark) / kPi64,
               2e-3 * 2 * 1e-3 / kPi64);
  }
}

Scene ShiningWall() {
  Scene scene;
  AddMaterial(scene, DiffuseMaterial(0));
  AddQuad(scene, {-5, -5, 4}, {0, 10, 0}, {10, 0, 0}, 0, AddAreaLight(scene, 1));
  return scene;
}

TEST(GlassTest, EyePathsThroughAPaneSeeTheFresnelSeries) {
  Scene scene = ShiningWall();
  AddBox(scene, {-9, -9, 1}, {9, 9, 1.5F}, AddMaterial(scene, DielectricMaterial(1.5F)));
  SetCamera(scene, {0, 0, 0}, {0, 0, 1}, {0, 1, 0}, 0.5, 4);
  const double r = 0.04;
  ExpectMean(Measure(scene, TestSettings(scene, 1, 0.01, 40), 2048, kParts, "direct.G"),
             (1 - r) / (1 + r));
}

// From inside glass the world is brighter by the square of the index, of which each pair of
// reflections between the faces keeps R².
TEST(GlassTest, EyePathsFromInsideSeeRadianceCompressed) {
  Scene scene = ShiningWall();
  AddBox(scene, {-9, -9, -1}, {9, 9, 1}, AddMaterial(scene, DielectricMaterial(1.5F)));
  SetCamera(scene, {0, 0, 0}, {0, 0, 1}, {0, 1, 0}, 0.5, 4);
  ExpectMean(Measure(scene, TestSettings(scene, 1, 0.01, 40), 2048, kParts, "direct.G"),
             2.25 / 1.04);
}

// --- glossy surfaces ---------------------------------------------------------------------------

const Rgb kMetalEta = {0.2F, 0.2F, 0.2F};
const Rgb kMetalK = {3, 3, 3};

Scene MetalFloor(float alpha) {
  Scene scene;
  AddQuad(scene, {-3, -3, 0}, {6, 0, 0}, {0, 6, 0},
          AddMaterial(scene, ConductorMaterial(kMetalEta, kMetalK, alpha, alpha)));
  AddMaterial(scene, DiffuseMaterial(0));
  SetCamera(scene, {2, 0, 2}, {0, 0, 0}, {0, 0, 1}, 0.02, 2);
  return scene;
}

// Both ways to draw a direction together give the integral of BSDF and light, below the roughness
// where eye paths go on and above it where they stop.
TEST(MisTest, RoughMetalReflectsTheSkyByItsDirectionalAlbedo) {
  for (const float alpha : {0.05F, 0.1F, 0.3F}) {
    SCOPED_TRACE(alpha);
    Scene scene = MetalFloor(alpha);
    scene.infinite_lights.push_back({Gray(1)});
    const Vec3 wo = Normalize({1, 0, 1});
    // The same integral over visible normals, by a fine lattice of the sampling square.
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
    ExpectMean(Measure(scene, TestSettings(scene, 1, 0.01, 4), 1024, kParts, "direct.G"), albedo,
               1e-4);
  }
}

TEST(MisTest, RoughMetalReflectsLampsOfAnySize) {
  for (const float alpha : {0.05F, 0.1F, 0.3F}) {
    for (const float radius : {0.05F, 1.0F}) {
      SCOPED_TRACE(std::to_string(alpha) + " " + std::to_string(radius));
      Scene scene = MetalFloor(alpha);
      const Vec3 center = {-1.2F, 0.1F, 1.4F};
      const Vec3 normal = Normalize(-center);
      AddDisk(scene, center, normal, radius, 1, AddAreaLight(scene, 1));
      const Vec3 wo = Normalize({1, 0, 1});
      const Frame frame(normal);
      constexpr int kSide = 2000;
      double expected = 0;
      for (int i = 0; i < kSide; ++i) {
        for (int j = 0; j < kSide; ++j) {
          const double r = static_cast<double>(radius) * std::sqrt((i + 0.5) / kSide);
          const double angle = 2 * kPi64 * (j + 0.5) / kSide;
          const Vec3 p = center + frame.s * static_cast<float>(r * std::cos(angle)) +
                         frame.t * static_cast<float>(r * std::sin(angle));
          if (p.z <= 0) continue;
          const float distance = Length(p);
          const Vec3 wi = p / distance;
          expected +=
              static_cast<double>(EvaluateBsdf(scene.materials[0], wo, wi, Carried::kRadiance).g *
                                  wi.z * std::max(0.0F, -Dot(wi, normal)) / (distance * distance));
        }
      }
      expected *= kPi64 * static_cast<double>(radius) * static_cast<double>(radius) /
                  (static_cast<double>(kSide) * kSide);
      ExpectMean(Measure(scene, TestSettings(scene, 1, 0.01, 4), 4096, kParts, "direct.G"),
                 expected, 1e-3 * expected);
    }
  }
}

// A ball of rough glass under a sky of radiance 1, seen from (0, 0, -5) within kReach of the axis
// on the plane z = -4. The oracle walks from the eye through the ball by its own loop: no photons,
// no gathering, no lights.
constexpr float kReach = 0.45F;

double RoughBallRadiance(const Material& glass, int max_depth) {
  KeyedRng rng(5);
  constexpr int kWalks = 1000000;
  double sum = 0;
  for (int walk = 0; walk < kWalks; ++walk) {
    const float film_x = rng.Uniform();
    const float film_y = rng.Uniform();
    const Vec3 eye = {0, 0, -5};
    const Vec3 along = Normalize({kReach * (2 * film_x - 1), kReach * (2 * film_y - 1), 4});
    // The nearer root of |eye + t along| = 1.
    const float b = Dot(eye, along);
    Vec3 p = eye + along * (-b - std::sqrt(b * b - 24));
    Vec3 wo = -along;
    double weight = 1;
    for (int depth = 0; depth < max_depth; ++depth) {
      p = Normalize(p);
      const Frame frame(p);
      const float u_lobe = rng.Uniform();
      const float u1 = rng.Uniform();
      const float u2 = rng.Uniform();
      BsdfSample sample;
      if (!SampleBsdf(glass, frame.ToLocal(wo), u_lobe, u1, u2, Carried::kRadiance, sample)) break;
      weight *= static_cast<double>(sample.weight.g);
      const Vec3 wi = frame.ToWorld(sample.wi);
      if (sample.wi.z > 0) {
        sum += weight / kWalks;
        break;
      }
      p = p + wi * (-2 * Dot(p, wi));
      wo = -wi;
    }
  }
  return sum;
}

class RoughGlassTest : public testing::TestWithParam<double> {};

// By eye paths that go on through the glass, and by photons gathered on it.
INSTANTIATE_TEST_SUITE_P(Alphas, RoughGlassTest,
                         testing::Values(static_cast<double>(kGatherAlphaDielectric) - 0.2,
                                         static_cast<double>(kGatherAlphaDielectric) + 0.05));

TEST_P(RoughGlassTest, BallUnderAnEvenSkyIsAsBrightAsItsWalksSay) {
  Scene scene;
  const Material glass = DielectricMaterial(1.5F, static_cast<float>(GetParam()));
  AddMaterial(scene, glass);
  AddSphere(scene, {0, 0, 0}, 1, 0);
  scene.infinite_lights.push_back({Gray(1)});
  const double fov_deg = 2 * std::atan(static_cast<double>(kReach) / 4) * 180 / kPi64;
  SetCamera(scene, {0, 0, -5}, {0, 0, 0}, {0, 1, 0}, fov_deg, 24);
  constexpr int kDepth = 12;
  const double expected = RoughBallRadiance(glass, kDepth);
  EXPECT_LT(expected, 1);
  // The walks' own noise, and the turn of the surface within the radius: (r/R)²/6.
  ExpectMean(Measure(scene, HeldRadius(scene, 150000, 0.12, kDepth), 32, kParts, "G"), expected,
             (0.12 * 0.12 / 6 + 2e-3) * expected);
}

}  // namespace
}  // namespace lucerna
