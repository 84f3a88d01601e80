// Lights send the power they have, where they should, and are drawn by the density they say.
#include "render/transport/light.h"

#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include "gtest/gtest.h"

#include "render/math/rng.h"
#include "render/math/warp.h"
#include "tests/support/chi_square.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

struct Lit {
  explicit Lit(Scene s)
      : scene(std::make_unique<Scene>(std::move(s))),
        intersector(Intersector::Create(*scene).value()),
        lights(*scene, *intersector) {}

  std::unique_ptr<Scene> scene;
  std::unique_ptr<Intersector> intersector;
  LightSet lights;
};

Scene BlackRoom() {
  Scene scene;
  AddMaterial(scene, DiffuseMaterial(0));
  return scene;
}

Scene QuadLight() {
  Scene scene = BlackRoom();
  AddQuad(scene, {1, 0, 2}, {0, 0.5F, 0.5F}, {1, 0, 0}, 0, AddAreaLight(scene, 3));
  return scene;
}
Scene SphereLight() {
  Scene scene = BlackRoom();
  AddSphere(scene, {1, -1, 2}, 0.7F, 0, AddAreaLight(scene, 3));
  return scene;
}
Scene InwardSphereLight() {
  Scene scene = BlackRoom();
  AddSphere(scene, {0.2F, 0, 0}, 2, 0, AddAreaLight(scene, 3), /*inward=*/true);
  return scene;
}
Scene RingLight() {
  Scene scene = BlackRoom();
  AddDisk(scene, {1, 1, 1}, Normalize({-1, -1, -1}), 1, 0, AddAreaLight(scene, 3));
  scene.disks[0].inner_radius = 0.5F;
  return scene;
}
Scene TwoSidedLight() {
  Scene scene = BlackRoom();
  AddDisk(scene, {0, 0.3F, 1}, Normalize({0, 1, 0.2F}), 1, 0, AddAreaLight(scene, 3, true));
  return scene;
}
Scene Sky() {
  Scene scene = BlackRoom();
  AddDisk(scene, {0, 0, -1}, {0, 0, 1}, 0.5F, 0);
  scene.infinite_lights.push_back({Gray(2)});
  return scene;
}
// Rows of pixels from the top, of the colours that come with `values`.
std::shared_ptr<const Picture> PictureOf(int width, const std::vector<float>& values) {
  Picture picture;
  picture.width = width;
  picture.height = static_cast<int>(values.size()) / width;
  for (const float value : values)
    picture.linear.insert(picture.linear.end(), {value, 0.5F * value, value * value});
  return std::make_shared<const Picture>(std::move(picture));
}
std::int32_t AddPictureLight(Scene& scene, bool two_sided = false) {
  AreaLight light = {Gray(3), two_sided, PictureOf(4, {1, 2, 1, 0, 0, 5, 0.2F, 3, 1, 1, 9, 2})};
  light.largest_pixel = light.picture->Largest();
  scene.area_lights.push_back(light);
  return static_cast<std::int32_t>(scene.area_lights.size()) - 1;
}
Scene PictureQuad() {
  Scene scene = BlackRoom();
  AddQuad(scene, {1, 0, 2}, {0, 0.5F, 0.5F}, {1, 0, 0}, 0, AddPictureLight(scene));
  // Turned, and beyond the picture's edge.
  scene.meshes.back().uvs = {{-0.2F, 0.1F}, {0.9F, 0}, {1, 0.8F}, {0, 1}};
  return scene;
}
Scene PictureSphere() {
  Scene scene = BlackRoom();
  AddSphere(scene, {1, -1, 2}, 0.7F, 0, AddPictureLight(scene));
  return scene;
}
Scene PictureRing() {
  Scene scene = BlackRoom();
  AddDisk(scene, {1, 1, 1}, Normalize({-1, -1, -1}), 1, 0, AddPictureLight(scene, true));
  scene.disks[0].inner_radius = 0.3F;
  return scene;
}
// Light from a sky with a map, through a rectangle above the origin, beside something.
Scene PortalSky() {
  Scene scene = BlackRoom();
  AddDisk(scene, {0, 0, -1}, {0, 0, 1}, 0.5F, 0);
  InfiniteLight light = {Gray(2)};
  light.kind = InfiniteLight::Kind::kPortal;
  light.map = PictureOf(4, {1, 2, 1, 0, 0, 5, 0.2F, 3, 1, 1, 9, 2, 4, 1, 1, 3});
  light.portal = Portal{{-0.5F, 0.2F, 1}, {0.8F, 0, 0.3F}, {0, 1.5F, 0}};
  scene.infinite_lights.push_back(light);
  return scene;
}
// Among other lights, a wall of both sides among them.
Scene PortalAmongLights() {
  Scene scene = PortalSky();
  AddSphere(scene, {-2, 0, 1}, 0.3F, 0, AddAreaLight(scene, 20));
  AddQuad(scene, {1, -2, -2}, {0, 0.5F, 0.5F}, {1, 0, 0}, 0, AddAreaLight(scene, 2, true));
  return scene;
}
Scene Mixed() {
  Scene scene = QuadLight();
  AddSphere(scene, {-2, 0, 1}, 0.3F, 0, AddAreaLight(scene, 20));
  scene.infinite_lights.push_back({{0.1F, 0.2F, 0.4F}});
  return scene;
}

const std::vector<std::pair<const char*, Scene (*)()>> kLights = {
    {"quad", &QuadLight},
    {"sphere", &SphereLight},
    {"inside a sphere", &InwardSphereLight},
    {"ring", &RingLight},
    {"two-sided disk", &TwoSidedLight},
    {"sky", &Sky},
    {"quad with a picture", &PictureQuad},
    {"sphere with a picture", &PictureSphere},
    {"two-sided ring with a picture", &PictureRing},
    {"portal", &PortalSky},
    {"portal among lights", &PortalAmongLights},
    {"several", &Mixed}};

// The density of drawing `wi` from the origin, by asking what lies there.
double PdfToward(const Lit& lit, Vec3 wi) {
  const Ray ray = {{0, 0, 0}, wi, HUGE_VALF};
  Hit hit;
  if (!lit.intersector->Intersect(ray, hit)) {
    return static_cast<double>(lit.lights.PdfDirectInfinite({0, 0, 0}, wi));
  }
  const SurfacePoint surface = lit.intersector->SurfaceAt(ray, hit);
  if (IsBlack(lit.lights.EmittedRadiance(surface, -wi))) return 0;
  return static_cast<double>(lit.lights.PdfDirect({0, 0, 0}, surface));
}

TEST(SampleDirectTest, DrawsByTheDensityThatItsSightGives) {
  const double level = SidakLevel(1e-3, 10);
  std::uint64_t key = 40;
  for (const auto& [name, make] : kLights) {
    if (make == &Mixed) continue;  // emitters in each other's way: density is choice × visibility
    const Lit lit(make());
    const double p_value = DirectionsPValue(
        [&](float u_lobe, float u1, float u2, Vec3& direction) {
          LightSample sample;
          if (!lit.lights.SampleDirect({0, 0, 0}, u_lobe, u1, u2, sample)) return false;
          direction = sample.wi;
          // Where a picture is black, sight finds no light.
          if (IsBlack(sample.radiance_over_pdf)) return false;
          // A point behind its own light is drawn and then found hidden.
          return !lit.intersector->Occluded(
              {{0, 0, 0},
               sample.wi,
               sample.is_distant ? HUGE_VALF : 0.999F * Length(sample.target)});
        },
        [&](Vec3 wi) { return PdfToward(lit, wi); }, 200000, ++key,
        lit.lights.emitter(0).spread >= 0 ? 64 : 24);
    // The sky is drawn through the disk too, where sight finds the disk.
    if (make != &Sky) {
      EXPECT_GT(p_value, level) << name;
    }
  }
}

TEST(SampleDirectTest, AgreesWithSightPointByPoint) {
  KeyedRng rng(50);
  for (const auto& [name, make] : kLights) {
    const Lit lit(make());
    int compared = 0;
    for (int i = 0; i < 20000; ++i) {
      const float u_choice = rng.Uniform();
      const float u1 = rng.Uniform();
      const float u2 = rng.Uniform();
      LightSample sample;
      if (!lit.lights.SampleDirect({0, 0, 0}, u_choice, u1, u2, sample)) continue;
      const Ray ray = {{0, 0, 0}, sample.wi, HUGE_VALF};
      Hit hit;
      const bool met = lit.intersector->Intersect(ray, hit);
      if (sample.is_distant) {
        if (met) continue;
        EXPECT_FLOAT_EQ(sample.radiance_over_pdf.g * sample.pdf,
                        lit.lights.InfiniteRadiance({0, 0, 0}, sample.wi).g)
            << name;
        ASSERT_FLOAT_EQ(sample.pdf, lit.lights.PdfDirectInfinite({0, 0, 0}, sample.wi)) << name;
        ++compared;
        continue;
      }
      // Light of another light, or a rim that rounding decides.
      if (!met || std::abs(hit.t / Length(sample.target) - 1) > 1e-3F) continue;
      const SurfacePoint surface = lit.intersector->SurfaceAt(ray, hit);
      const float cosine = std::abs(Dot(surface.geometric_normal, sample.wi));
      if (cosine < 0.05F) continue;
      ASSERT_NEAR(lit.lights.PdfDirect({0, 0, 0}, surface) / sample.pdf, 1, 1e-3) << name;
      const Rgb radiance = lit.lights.EmittedRadiance(surface, -sample.wi);
      if (IsBlack(radiance) && IsBlack(sample.radiance_over_pdf)) continue;
      // A picture is brighter beside the place by the rounding of the place.
      const double tolerance = lit.lights.emitter(sample.emitter).spread >= 0 ? 1e-3 : 1e-5;
      ASSERT_NEAR(sample.radiance_over_pdf.g * sample.pdf / radiance.g, 1, tolerance) << name;
      ++compared;
    }
    EXPECT_GT(compared, 3000) << name;
  }
}

TEST(SampleDirectTest, GivesDeltaLightsTheirIrradiance) {
  Scene scene = BlackRoom();
  AddSphere(scene, {0, 0, 50}, 1, 0);
  scene.point_lights.push_back({{0, 3, 4}, Gray(10)});
  LightSample sample;
  {
    const Lit lit(scene);
    ASSERT_TRUE(lit.lights.SampleDirect({0, 0, 0}, 0.5F, 0.1F, 0.2F, sample));
    EXPECT_EQ(sample.pdf, 0);
    EXPECT_EQ(sample.target, (Vec3{0, 3, 4}));
    EXPECT_FLOAT_EQ(sample.radiance_over_pdf.r, 10.0F / 25);
  }
  scene.point_lights.clear();
  scene.distant_lights.push_back({Normalize({0, -1, -1}), Gray(7)});
  const Lit lit(scene);
  ASSERT_TRUE(lit.lights.SampleDirect({0, 0, 0}, 0.5F, 0.1F, 0.2F, sample));
  EXPECT_FLOAT_EQ(sample.radiance_over_pdf.r, 7);
  EXPECT_NEAR(Length(sample.wi - Normalize({0, 1, 1})), 0, 1e-6);
  EXPECT_TRUE(sample.is_distant);
}

// Mean flux of emissions, per channel.
std::array<double, 3> MeanFlux(const LightSet& lights, std::uint64_t key, double& error) {
  KeyedRng rng(key);
  constexpr int kPhotons = 400000;
  std::array<double, 3> sum{};
  double squares = 0;
  for (int i = 0; i < kPhotons; ++i) {
    const float u_choice = rng.Uniform();
    const float a = rng.Uniform();
    const float b = rng.Uniform();
    const float c = rng.Uniform();
    const float d = rng.Uniform();
    Emission emission;
    if (!lights.SampleEmission(u_choice, a, b, c, d, emission)) continue;
    for (int channel = 0; channel < 3; ++channel) {
      sum[static_cast<std::size_t>(channel)] +=
          static_cast<double>(emission.flux[channel]) / kPhotons;
    }
    squares += static_cast<double>(MaxChannel(emission.flux)) *
               static_cast<double>(MaxChannel(emission.flux)) / kPhotons;
  }
  // A bound on the standard error of each channel.
  error = std::sqrt(squares / kPhotons);
  return sum;
}

// A light that hangs over a floor and shines up into nothing sends no photons, and one beside it
// that shines down sends all.
TEST(SampleEmissionTest, SendsNothingFromFacesThatNothingLiesInFrontOf) {
  Scene scene = BlackRoom();
  AddQuad(scene, {-2, -2, 0}, {4, 0, 0}, {0, 4, 0}, 0);
  const std::int32_t light = AddAreaLight(scene, 3);
  AddQuad(scene, {0, 0, 1}, {0, 1, 0}, {1, 0, 0}, 0, light);  // down
  const Lit down(scene);
  AddQuad(scene, {-1, -1, 1}, {1, 0, 0}, {0, 1, 0}, 0, light);  // up
  const Lit both(scene);
  EXPECT_EQ(both.lights.TotalPower(), down.lights.TotalPower());
  EXPECT_GT(both.lights.TotalPower().g, 0);
  for (int i = 0; i < 1000; ++i) {
    Emission emission;
    ASSERT_TRUE(both.lights.SampleEmission((i + 0.5) / 1000, 0.3F, 0.4F, 0.5F, 0.6F, emission));
    EXPECT_LT(emission.ray.direction.z, 0);
  }
  // With something over it, it sends too.
  AddQuad(scene, {-2, -2, 2}, {4, 0, 0}, {0, 4, 0}, 0);
  const Lit roofed(scene);
  EXPECT_FLOAT_EQ(roofed.lights.TotalPower().g, 2 * down.lights.TotalPower().g);
}

TEST(SampleEmissionTest, SendsTheTotalPower) {
  Scene scene = Mixed();
  scene.area_lights[1].radiance = {20, 2, 0.2F};
  scene.point_lights.push_back({{0, 0, 5}, {1, 3, 0}});
  scene.spot_lights.push_back({{0, 0, 3}, {0, 0, -1}, {5, 5, 50}, 0.9F, 0.5F});
  scene.distant_lights.push_back({{0, 0, -1}, {0.1F, 0.5F, 0.1F}});
  const Lit lit(scene);
  double error = 0;
  const auto mean = MeanFlux(lit.lights, 60, error);
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(mean[static_cast<std::size_t>(c)], static_cast<double>(lit.lights.TotalPower()[c]),
                4.5 * error)
        << c;
  }
}

TEST(SampleEmissionTest, SendsTheTotalPowerOfPicturesAndPortals) {
  std::uint64_t key = 80;
  for (const auto& [name, make] : kLights) {
    const Lit lit(make());
    double error = 0;
    const auto mean = MeanFlux(lit.lights, ++key, error);
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR(mean[static_cast<std::size_t>(c)],
                  static_cast<double>(lit.lights.TotalPower()[c]), 4.5 * error)
          << name << " " << c;
    }
  }
}

// What the check of emitted energies relies on (server/emission_check.h).
TEST(SampleEmissionTest, HasNoPhotonStrongerThanTheLargestShare) {
  KeyedRng rng(73);
  for (const auto& [name, make] : kLights) {
    const Lit lit(make());
    for (int i = 0; i < 20000; ++i) {
      std::array<float, 5> u{};
      for (float& number : u)
        number = rng.Uniform();
      Emission emission;
      if (!lit.lights.SampleEmission(u[0], u[1], u[2], u[3], u[4], emission)) continue;
      const Emitter& emitter = lit.lights.emitter(emission.emitter);
      const float mean = Luminance(emitter.power) / emitter.choice;
      EXPECT_LE(Luminance(emission.flux),
                mean * lit.lights.lights()[emitter.light].largest_share * 1.0001F)
          << name;
    }
  }
}

// Photons of all emitters together fill the light with flux: their flux times their density, over
// area across the ray and solid angle, is the radiance there. A ray that looks back says the same.
TEST(SampleEmissionTest, HasTheDensityThatMakesFluxRadiance) {
  KeyedRng rng(71);
  for (const auto& [name, make] : kLights) {
    const Lit lit(make());
    int compared = 0;
    for (int i = 0; i < 2000; ++i) {
      std::array<float, 5> u{};
      for (float& number : u)
        number = rng.Uniform();
      Emission emission;
      if (!lit.lights.SampleEmission(u[0], u[1], u[2], u[3], u[4], emission)) continue;
      const Vec3 back = -emission.ray.direction;
      const Emitter& emitter = lit.lights.emitter(emission.emitter);
      // `rounding`: of the place on a picture, which is beside its brightest pixel perhaps.
      const auto expect_radiance = [&](Rgb radiance, float tolerance, float rounding = 0) {
        for (int c = 0; c < 3; ++c) {
          EXPECT_NEAR(emission.flux[c] * emission.density, radiance[c],
                      tolerance * radiance[c] + rounding)
              << name;
        }
      };
      if (emitter.kind == EmitterKind::kPortal) {
        // Behind the portal, as a receiver sees it.
        const Portal& portal = *lit.scene->infinite_lights[0].portal;
        const Vec3 normal = Cross(portal.along_x, portal.along_y);
        const Vec3 below =
            emission.ray.origin -
            back * ((Dot(emission.ray.origin - portal.corner, normal) + 0.5F) / Dot(back, normal));
        EXPECT_NEAR(lit.lights.EmissionDensityInfinite(below, back) / emission.density, 1, 1e-3F);
        expect_radiance(lit.lights.InfiniteRadiance(below, back), 1e-3F);
        ++compared;
        continue;
      }
      if (emitter.spread < 0) expect_radiance(emitter.radiance, 1e-4F);
      if (emitter.kind == EmitterKind::kInfinite) {
        EXPECT_EQ(lit.lights.EmissionDensityInfinite(emission.ray.origin, back), emission.density)
            << name;
        ++compared;
        continue;
      }
      const Ray ray = {emission.ray.origin + emission.ray.direction * 1e-3F, back, HUGE_VALF};
      Hit hit;
      if (!lit.intersector->Intersect(ray, hit)) continue;
      const SurfacePoint surface = lit.intersector->SurfaceAt(ray, hit);
      if (IsBlack(lit.lights.EmittedRadiance(surface, emission.ray.direction))) continue;
      if (emitter.spread >= 0) {
        EXPECT_NEAR(lit.lights.EmissionDensity(surface) / emission.density, 1, 1e-3F) << name;
        // The photon begins off the surface: seen from the side, beside its place on the picture.
        if (std::abs(Dot(surface.geometric_normal, back)) > 0.1F) {
          expect_radiance(lit.lights.EmittedRadiance(surface, emission.ray.direction), 1e-4F,
                          5e-5F * lit.lights.LargestRadiance());
        }
      } else {
        EXPECT_EQ(lit.lights.EmissionDensity(surface), emission.density) << name;
      }
      ++compared;
    }
    EXPECT_GT(compared, 1000) << name;
  }
}

TEST(SampleEmissionTest, GivesDeltaLightsNoBoundToTheirDensity) {
  Scene scene = BlackRoom();
  AddQuad(scene, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0);
  scene.point_lights.push_back({{0, 0, 1}, Gray(1)});
  scene.spot_lights.push_back({{0, 0, 1}, {0, 0, -1}, Gray(1), 0.9F, 0.8F});
  scene.distant_lights.push_back({{0, 0, -1}, Gray(1)});
  const Lit lit(std::move(scene));
  for (int i = 0; i < 32; ++i) {
    Emission emission;
    emission.density = 0;
    if (!lit.lights.SampleEmission((i + 0.5) / 32, 0.5F, 0.5F, 0.25F, 0.5F, emission)) continue;
    EXPECT_EQ(emission.density, HUGE_VALF);
  }
}

// A scene of lights of all kinds in reach of each other.
Scene LightsOfAllKinds() {
  Scene scene = Mixed();
  AddDisk(scene, {0, 0.3F, 1}, Normalize({0, 1, 0.2F}), 1, 0, AddAreaLight(scene, 3, true));
  AddDisk(scene, {1, 1, 1}, Normalize({-1, -1, -1}), 1, 0, AddAreaLight(scene, 3));
  scene.disks.back().inner_radius = 0.5F;
  CurvePiece piece;
  piece.from = {0, 1, 0};
  piece.to = {0.5F, 2, 0.3F};
  piece.from_radius = 0.1F;
  piece.to_radius = 0.03F;
  piece.traits.area_light = AddAreaLight(scene, 30);
  scene.curve_pieces.push_back(piece);
  scene.point_lights.push_back({{0, 0.2F, 1}, Gray(20)});
  scene.spot_lights.push_back({{0, 0, 1}, Normalize({0.1F, 0.3F, -1}), Gray(50), 0.9F, 0.8F});
  scene.distant_lights.push_back({Normalize({0.3F, 0, -1}), Gray(5)});
  Picture picture;
  picture.width = picture.height = 8;
  for (int i = 0; i < 64; ++i) {
    const auto value = static_cast<float>(i % 5);
    picture.linear.insert(picture.linear.end(), {value, value, value});
  }
  InfiniteLight sky = {Gray(0.5F)};
  sky.kind = InfiniteLight::Kind::kEnvironment;
  sky.map = std::make_shared<const Picture>(std::move(picture));
  scene.infinite_lights.push_back(sky);
  InfiniteLight behind = sky;
  behind.kind = InfiniteLight::Kind::kPortal;
  behind.portal = Portal{{-0.5F, 0.2F, 3}, {0.8F, 0, 0.3F}, {0, 1.5F, 0}};
  scene.infinite_lights.push_back(behind);
  AddQuad(scene, {1, 1, 2}, {0, 0.5F, 0.5F}, {1, 0, 0}, 0, AddPictureLight(scene));
  AddDisk(scene, {-1, 1, 1}, Normalize({-1, -1, -1}), 1, 0, AddPictureLight(scene, true));
  return scene;
}

// Numbers that are drawn again give the same photon.
TEST(SampleEmissionTest, FindsTheNumbersOfAPhoton) {
  const Lit lit(LightsOfAllKinds());
  const float size = lit.intersector->bounds().Diagonal();
  KeyedRng rng(91);
  std::vector<int> found(static_cast<std::size_t>(lit.lights.size()));
  for (int i = 0; i < 20'000; ++i) {
    const auto choice = static_cast<double>(rng.Uniform());
    const float u1 = rng.Uniform();
    const float u2 = rng.Uniform();
    const float u3 = rng.Uniform();
    const float u4 = rng.Uniform();
    Emission emission;
    if (!lit.lights.SampleEmission(choice, u1, u2, u3, u4, emission)) continue;
    Ray ray = emission.ray;
    const EmitterKind kind = lit.lights.emitter(emission.emitter).kind;
    // Anywhere on its line.
    if (kind == EmitterKind::kDistant || kind == EmitterKind::kInfinite ||
        kind == EmitterKind::kEnvironment || kind == EmitterKind::kPortal) {
      ray.origin = ray.origin + ray.direction * (rng.Uniform() * size);
    }
    const auto numbers = lit.lights.NumbersOf(emission.emitter, ray, rng);
    ASSERT_TRUE(numbers);
    Emission again;
    ASSERT_TRUE(lit.lights.SampleEmission(
        (*numbers)[4], static_cast<float>((*numbers)[0]), static_cast<float>((*numbers)[1]),
        static_cast<float>((*numbers)[2]), static_cast<float>((*numbers)[3]), again));
    ASSERT_EQ(again.emitter, emission.emitter);
    ++found[emission.emitter];
    // Where a map jumps, the smallest step leads to another direction; seldom.
    EXPECT_LT(Length(again.ray.direction - emission.ray.direction), 2e-3F) << NameOf(kind);
    EXPECT_LT(Length(again.ray.origin - emission.ray.origin), 2e-3F * size) << NameOf(kind);
  }
  for (std::uint32_t emitter = 0; emitter < lit.lights.size(); ++emitter) {
    EXPECT_EQ(found[emitter] > 0, lit.lights.emitter(emitter).choice > 0)
        << NameOf(lit.lights.emitter(emitter).kind);
  }
}

// Those that a photon does not depend on must be as even as photons draw them: a guide that learns
// from them would take what they have in common for a place where light is.
TEST(SampleEmissionTest, DrawsNumbersThatDoNotMatter) {
  Scene scene = BlackRoom();
  AddQuad(scene, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0);
  scene.point_lights.push_back({{0, 0, 1}, Gray(1)});
  scene.spot_lights.push_back({{0, 0, 1}, {0, 0, -1}, Gray(1), 0.9F, 0.8F});
  scene.distant_lights.push_back({{0, 0, -1}, Gray(1)});
  const Lit lit(std::move(scene));
  KeyedRng rng(5);
  constexpr int kDraws = 4000;
  for (std::uint32_t emitter = 0; emitter < lit.lights.size(); ++emitter) {
    const bool is_distant = lit.lights.emitter(emitter).kind == EmitterKind::kDistant;
    // The photons are all the same.
    const Ray ray = {{0.1F, 0, 1}, {0, 0, -1}, HUGE_VALF};
    PrimaryNumbers sum{};
    PrimaryNumbers squares{};
    for (int i = 0; i < kDraws; ++i) {
      const PrimaryNumbers numbers = lit.lights.NumbersOf(emitter, ray, rng).value();
      for (std::size_t d = 0; d < kEmissionDimensions; ++d) {
        sum[d] += numbers[d] / kDraws;
        squares[d] += numbers[d] * numbers[d] / kDraws;
      }
    }
    for (const std::size_t d :
         is_distant ? std::array<std::size_t, 2>{2, 3} : std::array<std::size_t, 2>{0, 1}) {
      // Of even numbers the mean has the variance 1/12 and that of squares 4/45, over their number.
      EXPECT_NEAR(sum[d], 0.5, 4.5 * std::sqrt(1.0 / 12 / kDraws)) << emitter << " " << d;
      EXPECT_NEAR(squares[d], 1.0 / 3, 4.5 * std::sqrt(4.0 / 45 / kDraws)) << emitter << " " << d;
    }
  }
}

TEST(SampleEmissionTest, HasThePowerOfEachLightInClosedForm) {
  const auto power = [](const Scene& scene) {
    return static_cast<double>(Lit(scene).lights.TotalPower().g);
  };
  EXPECT_NEAR(power(SphereLight()), 3 * kPi64 * 4 * kPi64 * 0.49, 1e-3);
  EXPECT_NEAR(power(RingLight()), 3 * kPi64 * kPi64 * 0.75, 1e-4);
  EXPECT_NEAR(power(TwoSidedLight()), 2 * 3 * kPi64 * kPi64, 1e-4);
  Scene scene = BlackRoom();
  scene.point_lights.push_back({{}, Gray(2)});
  EXPECT_NEAR(power(scene), 8 * kPi64, 1e-5);
  scene.point_lights.clear();
  // The integral of the intensity over the sphere, by midpoints.
  const SpotLight spot = {{}, {0, 0, 1}, Gray(4), 0.95F, 0.6F};
  scene.spot_lights.push_back(spot);
  double expected = 0;
  constexpr int kSteps = 100000;
  for (int i = 0; i < kSteps; ++i) {
    const double cosine = 0.6 + 0.4 * (i + 0.5) / kSteps;
    const double x = std::min(1.0, (cosine - 0.6) / 0.35);
    expected += 4 * 2 * kPi64 * x * x * (3 - 2 * x) * 0.4 / kSteps;
  }
  EXPECT_NEAR(power(scene), expected, 1e-4);
  double error = 0;
  const Lit lit(scene);
  const double mean = MeanFlux(lit.lights, 61, error)[1];
  EXPECT_NEAR(mean, expected, 4.5 * error);
}

TEST(SampleEmissionTest, LeavesSurfacesByTheCosine) {
  const double level = SidakLevel(1e-3, 2);
  for (const bool two_sided : {false, true}) {
    Scene scene = BlackRoom();
    AddDisk(scene, {0, 0, 0}, {0, 0, 1}, 1, 0, AddAreaLight(scene, 1, two_sided));
    const Lit lit(scene);
    const double p_value = DirectionsPValue(
        [&](float u_lobe, float u1, float u2, Vec3& direction) {
          Emission emission;
          if (!lit.lights.SampleEmission(0.5F, u_lobe, u2, u1, u2, emission)) return false;
          EXPECT_GT(emission.ray.origin.z * emission.ray.direction.z, 0);
          direction = emission.ray.direction;
          return true;
        },
        [&](Vec3 d) {
          const auto cosine = static_cast<double>(d.z);
          return two_sided ? std::abs(cosine) / (2 * kPi64) : std::max(0.0, cosine) / kPi64;
        },
        200000, 70);
    EXPECT_GT(p_value, level) << two_sided;
  }
}

// Light from infinity fills the room's bounding sphere evenly: what it sends through a disk in
// the room is radiance × π × area, whichever way the disk looks.
TEST(SampleEmissionTest, FillsTheSceneFromInfinity) {
  const Lit lit(Sky());
  KeyedRng rng(80);
  constexpr int kPhotons = 1000000;
  double through = 0;
  double squares = 0;
  for (int i = 0; i < kPhotons; ++i) {
    const float a = rng.Uniform();
    const float b = rng.Uniform();
    const float c = rng.Uniform();
    const float d = rng.Uniform();
    Emission emission;
    ASSERT_TRUE(lit.lights.SampleEmission(0.5F, a, b, c, d, emission));
    Hit hit;
    if (!lit.intersector->Intersect(emission.ray, hit)) continue;
    const auto flux = static_cast<double>(emission.flux.g);
    through += flux / kPhotons;
    squares += flux * flux / kPhotons;
  }
  // Both faces of the disk of radius 0.5.
  const double expected = 2 * kPi64 * (2 * kPi64 * 0.25);
  EXPECT_NEAR(through, expected, 4 * std::sqrt(squares / kPhotons));
}

// A rectangle whose alpha leaves its second half along x; or that half alone, of as much radiance.
Scene HalfLight(bool is_masked) {
  Scene scene = BlackRoom();
  const std::int32_t light = AddAreaLight(scene, 3);
  AddQuad(scene, {-2, -2, 0}, {4, 0, 0}, {0, 4, 0}, 0);
  AddQuad(scene, {is_masked ? -1.0F : 0.0F, -1, 2}, {0, 2, 0}, {is_masked ? 2.0F : 1.0F, 0, 0}, 0,
          light);
  if (!is_masked) return scene;
  TextureMapping halves;
  halves.scale_u = 2;
  scene.meshes.back().uvs = {{0, 0}, {0, 0.9F}, {1, 0.9F}, {1, 0}};
  scene.meshes.back().traits.alpha_texture = AddStripes(scene, 0, 1, halves);
  return scene;
}

// By strata of the three numbers, some of which the masked half's edge cuts: within 1 %.
TEST(SampleDirectTest, OfAMaskedLightIsThatOfWhatIsLeft) {
  const auto irradiance = [](const Scene& scene) {
    const Lit lit(scene);
    constexpr int kSide = 64;
    double sum = 0;
    for (int i = 0; i < kSide * kSide * kSide; ++i) {
      const auto at = [](int part) { return (static_cast<float>(part % kSide) + 0.5F) / kSide; };
      const auto choice = static_cast<double>(at(i / (kSide * kSide)));
      LightSample sample;
      if (lit.lights.SampleDirect({{0.3F, 0.2F, 0}, {0, 0, 1}}, choice, at(i), at(i / kSide),
                                  sample)) {
        sum += static_cast<double>(sample.radiance_over_pdf.g * sample.wi.z);
      }
    }
    return sum / (static_cast<double>(kSide) * kSide * kSide);
  };
  const double expected = irradiance(HalfLight(false));
  EXPECT_GT(expected, 0);
  EXPECT_NEAR(irradiance(HalfLight(true)), expected, 0.01 * expected);
}

// A ball of alpha a that shines on both sides: a ray that looks at it meets the near wall with
// probability a, else the far one with a again, and both shine L. Where the eye cannot find them,
// they are sampled: without shadows L a from each.
TEST(SampleDirectTest, FindsBothWallsOfABallThatIsSeenThrough) {
  Scene scene = BlackRoom();
  AddSphere(scene, {0, 0, 3}, 1, 0, AddAreaLight(scene, 2, true));
  scene.spheres[0].traits.alpha = 0.25F;
  const Lit lit(scene);
  // Of a cone of sin θ = 1/3 around the normal: π sin²θ · L · a, from two walls.
  const double expected = 2 * std::numbers::pi / 9 * 2 * 0.25;
  constexpr int kSide = 1024;
  double sum = 0;
  for (int i = 0; i < kSide * kSide; ++i) {
    const auto at = [](int part) { return (static_cast<float>(part % kSide) + 0.5F) / kSide; };
    LightSample sample;
    if (lit.lights.SampleDirect({{0, 0, 0}, {0, 0, 1}}, 0.5, at(i), at(i / kSide), sample))
      sum += static_cast<double>(sample.radiance_over_pdf.g * sample.wi.z);
  }
  EXPECT_NEAR(sum / (static_cast<double>(kSide) * kSide), expected, 2e-3 * expected);
}

TEST(SampleEmissionTest, OfAMaskedLightLeavesWhatIsThereAlone) {
  const Lit whole(HalfLight(false));
  const Lit masked(HalfLight(true));
  // At 256 x 256 places, and a little more.
  const float ratio = masked.lights.TotalPower().g / whole.lights.TotalPower().g;
  EXPECT_GE(ratio, 1);
  EXPECT_LT(ratio, 1.01F);
  KeyedRng rng(3);
  double sum = 0;
  constexpr int kPhotons = 1 << 16;
  for (int i = 0; i < kPhotons; ++i) {
    const double choice = static_cast<double>(rng.Uniform());
    const float u1 = rng.Uniform();
    const float u2 = rng.Uniform();
    const float u3 = rng.Uniform();
    Emission emission;
    if (!masked.lights.SampleEmission(choice, u1, u2, u3, rng.Uniform(), emission)) continue;
    EXPECT_GE(emission.ray.origin.x, 0);
    sum += static_cast<double>(emission.flux.g);
  }
  // Half of the photons carry twice the mean: the deviation is 1 / 256 of it.
  const auto power = static_cast<double>(whole.lights.TotalPower().g);
  EXPECT_NEAR(sum / kPhotons, power, 4 * power / 256);
}

// Of two lights as bright at the origin, one has 1e-12 of the power: half of what is not drawn
// anywhere alike goes to it, and of the rest a twentieth, where its power would send none.
TEST(SampleDirectTest, FindsANearLightBesideAFarOneOfAllThePower) {
  Scene scene = BlackRoom();
  scene.point_lights.push_back({{0, 0, 1}, Gray(1)});
  scene.point_lights.push_back({{0, 1e6F, 0}, Gray(1e12F)});
  const Lit lit(std::move(scene));
  KeyedRng rng(3);
  int near = 0;
  constexpr int kSamples = 10000;
  constexpr double kShare =
      static_cast<double>(kShareAnywhere) / 20 + (1 - static_cast<double>(kShareAnywhere)) / 2;
  for (int i = 0; i < kSamples; ++i) {
    LightSample sample;
    const float u = rng.Uniform();
    ASSERT_TRUE(lit.lights.SampleDirect({0, 0, 0}, static_cast<double>(u), 0, 0, sample));
    if (sample.wi.z < 0.5F) continue;
    ++near;
    EXPECT_NEAR(sample.radiance_over_pdf.g, 1 / kShare, 1e-3);
  }
  // Five standard deviations.
  EXPECT_NEAR(near, kSamples * kShare, 5 * std::sqrt(kSamples * kShare));
}

// Many lights, each of which brings about the same to a point near it and little elsewhere: one
// sample is close to the sum, whatever is drawn.
TEST(SampleDirectTest, DrawsAmongManyLightsByWhatTheyBring) {
  Scene scene = BlackRoom();
  KeyedRng places(7);
  for (int i = 0; i < 400; ++i) {
    const float x = 20 * places.Uniform() - 10;
    const float y = 20 * places.Uniform() - 10;
    scene.point_lights.push_back({{x, y, 1}, Gray(1 + 9 * places.Uniform())});
  }
  const Lit lit(std::move(scene));
  const LitPoint floor = {{1, -2, 0}, {0, 0, 1}};
  double sum = 0;
  double by_power = 0;
  for (std::uint32_t i = 0; i < lit.lights.size(); ++i) {
    const PointLight& light = lit.scene->point_lights[i];
    const Vec3 to = light.position - floor.position;
    const auto brings =
        static_cast<double>(light.intensity.g * to.z / (LengthSquared(to) * Length(to)));
    sum += brings;
    by_power += brings * brings / static_cast<double>(lit.lights.emitter(i).direct_choice);
  }
  by_power /= sum * sum;
  double mean = 0;
  double squares = 0;
  constexpr int kSamples = 100000;
  for (int i = 0; i < kSamples; ++i) {
    LightSample sample;
    ASSERT_TRUE(lit.lights.SampleDirect(floor, (i + 0.5) / kSamples, 0, 0, sample));
    const double value = static_cast<double>(sample.radiance_over_pdf.g * sample.wi.z) / sum;
    mean += value / kSamples;
    squares += value * value / kSamples;
  }
  EXPECT_NEAR(mean, 1, 1e-3);
  EXPECT_LT(squares - 1, (by_power - 1) / 8);
}

// What a job leaves out gets nothing, and the rest shares what there is.
TEST(LightSetTest, LeavesOutWhatTheJobDoesNotNeed) {
  Scene scene = SphereLight();
  scene.point_lights.push_back({{0, 0, 0}, Gray(1)});
  scene.point_lights.push_back({{0, 1, 0}, Gray(5)});
  scene.infinite_lights.push_back({Gray(2)});
  const auto intersector = Intersector::Create(scene).value();
  const LightNumbers numbers(scene);
  const LightSet all(scene, *intersector);
  const auto set = [&](std::vector<std::uint32_t> of_photons,
                       std::vector<std::uint32_t> of_sampling) {
    return LightSet(scene, *intersector,
                    LightSelection{{std::move(of_photons), std::move(of_sampling)}});
  };
  const float sum = all.TotalPower().g;
  const LightSet unseen = set({numbers.spheres}, {});
  EXPECT_FLOAT_EQ(unseen.TotalPower().g, sum - all.emitter(0).power.g);
  EXPECT_EQ(unseen.emitter(0).choice, 0);
  EXPECT_EQ(unseen.emitter(0).direct_choice, 0);

  const LightSet unsampled = set({}, {numbers.point_lights + 1, numbers.infinite});
  EXPECT_EQ(unsampled.TotalPower(), all.TotalPower());
  for (std::uint32_t i = 0; i < 4; ++i)
    EXPECT_EQ(unsampled.emitter(i).choice, all.emitter(i).choice);
  EXPECT_EQ(unsampled.emitter(2).direct_choice, 0);
  EXPECT_EQ(unsampled.emitter(3).direct_choice, 0);
  EXPECT_FLOAT_EQ(unsampled.emitter(0).direct_choice + unsampled.emitter(1).direct_choice, 1);
  EXPECT_EQ(unsampled.PdfDirectInfinite({0, 0, 0}, {0, 0, 1}), 0);
  for (int i = 0; i < 100; ++i) {
    LightSample sample;
    ASSERT_TRUE(unsampled.SampleDirect({3, 3, 3}, (i + 0.5) / 100, 0.4F, 0.6F, sample));
    EXPECT_FALSE(sample.is_distant);
    EXPECT_FALSE(sample.target == (Vec3{0, 1, 0}));
  }

  LightSample sample;
  const LightSet none =
      set({}, {numbers.spheres, numbers.point_lights, numbers.point_lights + 1, numbers.infinite});
  EXPECT_FALSE(none.SampleDirect({3, 3, 3}, 0.5, 0.4F, 0.6F, sample));
  EXPECT_EQ(none.TotalPower(), all.TotalPower());
}

// Of several lights each has an even share of a twentieth of the photons, and the rest by power.
TEST(LightSetTest, EachLightHasAnEvenShareOfSomePhotons) {
  Scene scene = QuadLight();
  ASSERT_EQ(Lit(scene).lights.lights().size(), 1U);
  const Lit single(scene);
  EXPECT_EQ(single.lights.emitter(0).choice + single.lights.emitter(1).choice, 1)
      << "one light alone: by power";
  scene.point_lights.push_back({{0, 1, 2}, Gray(1e-6F)});
  scene.point_lights.push_back({{0, 0, 0}, Gray(0)});
  const Lit lit(scene);
  const double of_quad = static_cast<double>(lit.lights.emitter(0).power.g) * 2;
  const double of_point = static_cast<double>(lit.lights.emitter(2).power.g);
  const double by_power = of_point / (of_point + of_quad);
  EXPECT_NEAR(lit.lights.emitter(2).choice, 0.95 * by_power + 0.05 / 2, 1e-7);
  EXPECT_NEAR(lit.lights.emitter(0).choice, 0.5 * (0.95 * (1 - by_power) + 0.05 / 2), 1e-6);
  EXPECT_EQ(lit.lights.emitter(3).choice, 0);

  // Photons come so, and all their flux together is the power.
  constexpr int kPhotons = 20000;
  int from_point = 0;
  double flux = 0;
  for (int i = 0; i < kPhotons; ++i) {
    Emission emission;
    ASSERT_TRUE(lit.lights.SampleEmission((i + 0.5) / kPhotons, 0.3F, 0.6F, 0.2F, 0.7F, emission));
    from_point += emission.emitter == 2 ? 1 : 0;
    flux += static_cast<double>(emission.flux.g) / kPhotons;
    EXPECT_EQ(lit.lights.emitter(emission.emitter).light, emission.emitter == 2 ? 1 : 0);
  }
  EXPECT_NEAR(from_point, 0.025 * kPhotons, 2);
  EXPECT_NEAR(flux, static_cast<double>(lit.lights.TotalPower().g), 1e-3 * flux);

  ASSERT_EQ(lit.lights.lights().size(), 2U) << "one that is off is none";
  EXPECT_EQ(lit.lights.lights()[0].emitters, 2U);
  EXPECT_EQ(lit.lights.lights()[1].position, (Vec3{0, 1, 2}));
}

TEST(LightSetTest, TheFaintestOfManyLightsCountAsOne) {
  Scene scene = BlackRoom();
  for (int i = 0; i < 100; ++i)
    scene.point_lights.push_back({{static_cast<float>(i), 0, 0}, Gray(i % 2 == 0 ? 1 : 2)});
  const Lit lit(scene);
  ASSERT_EQ(lit.lights.lights().size(), kMaxLightGroups);
  EXPECT_EQ(lit.lights.lights().back().lights, 37U);
  float power = 0;
  for (const LightGroup& light : lit.lights.lights())
    power += light.power.g;
  EXPECT_NEAR(power, lit.lights.TotalPower().g, 1e-3F * power);
  for (std::uint32_t i = 1; i < 100; i += 2)
    EXPECT_LT(lit.lights.emitter(i).light, kMaxLightGroups - 1) << "the stronger half has its own";
  EXPECT_EQ(lit.lights.emitter(98).light, kMaxLightGroups - 1);
}

// A light that is off is none.
TEST(LightSetTest, CountsLightsTooFaintToCountBesideTheOthers) {
  Scene scene = SphereLight();
  EXPECT_EQ(Lit(scene).lights.faint_lights(), 0U);
  scene.point_lights.push_back({{0, 2, 0}, Gray(1e-11F)});
  EXPECT_EQ(Lit(scene).lights.faint_lights(), 0U) << "it has its even share";
  scene.point_lights.back() = {{0, 0, 0}, Gray(1e-17F)};
  EXPECT_EQ(Lit(scene).lights.faint_lights(), 1U);
  scene.point_lights.push_back({{0, 1, 0}, Gray(0)});
  AddSphere(scene, {5, 0, 2}, 1e-9F, 0, AddAreaLight(scene, 1));
  EXPECT_EQ(Lit(scene).lights.faint_lights(), 2U);
  scene.area_lights[0].radiance = Gray(1e-15F);
  EXPECT_EQ(Lit(scene).lights.faint_lights(), 0U) << "what is faint depends on the rest";
}

}  // namespace
}  // namespace lucerna
