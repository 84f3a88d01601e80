// Light on a measured surface is that of the metal from which its table was made, by every way that
// light takes to an image.
#include <cmath>
#include <string>

#include "gtest/gtest.h"

#include "render/math/warp.h"
#include "render/transport/bsdf.h"
#include "tests/support/measure.h"
#include "tests/support/measured_file.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

constexpr int kSeeds = 8;
constexpr int kQuestions = 6;
const Vec3 kEye = Normalize({1, 0, 1});

// Within its noise and `between_knots`, what lines between the knots of the table leave.
void ExpectMean(const MeasuredMean& measured, double expected, double between_knots) {
  static const double quantile = StudentQuantile(SidakLevel(1e-3, kQuestions), kSeeds);
  const double bound = quantile * measured.standard_error + between_knots * expected;
  EXPECT_NEAR(measured.mean, expected, bound) << "ratio " << measured.mean / expected;
  EXPECT_LT(bound, 0.06 * expected) << "the bound would let a wrong result pass";
}

Scene MeasuredFloor(float alpha) {
  MetalToMeasure metal;
  metal.alpha_u = metal.alpha_v = alpha;
  Scene scene;
  AddQuad(scene, {-3, -3, 0}, {6, 0, 0}, {0, 6, 0},
          AddMaterial(scene, MeasuredMaterial(MeasureMetal(metal))));
  SetCamera(scene, {2, 0, 2}, {0, 0, 0}, {0, 0, 1}, 0.02, 2);
  return scene;
}

// Eye paths: directions drawn from the table and light that is drawn, weighed together, where paths
// go on and where they stop. The integral is that of the metal's closed form.
TEST(MeasuredSurfaceTest, ReflectsTheSkyAsTheMetalDoes) {
  for (const float alpha : {0.1F, 0.3F}) {
    SCOPED_TRACE(alpha);
    Scene scene = MeasuredFloor(alpha);
    scene.infinite_lights.push_back({Gray(1)});
    const Material metal = ConductorMaterial({0, 0, 0}, Gray(1), alpha, alpha);
    constexpr int kSide = 500;
    double albedo = 0;
    for (int i = 0; i < kSide; ++i) {
      for (int j = 0; j < kSide; ++j) {
        BsdfSample sample;
        const auto at = [](int k) { return (static_cast<float>(k) + 0.5F) / kSide; };
        if (SampleBsdf(metal, kEye, 0, at(i), at(j), Carried::kRadiance, sample))
          albedo += static_cast<double>(sample.weight.g) / (kSide * kSide);
      }
    }
    ExpectMean(Measure(scene, TestSettings(scene, 1, 0.01, 4), 512, kSeeds, "direct.G"), albedo,
               0.02);
  }
}

// Photons from within glass, which eye paths do not find.
TEST(MeasuredSurfaceTest, PhotonsBringWhatTheMetalReflects) {
  for (const float alpha : {0.15F, 0.3F}) {
    SCOPED_TRACE(alpha);
    Scene scene = MeasuredFloor(alpha);
    const Vec3 place = {-0.9F, 0.2F, 1};
    scene.point_lights.push_back({place, Gray(3)});
    AddSphere(scene, place, 0.2F, AddMaterial(scene, DielectricMaterial(1)));
    const Material metal = ConductorMaterial({0, 0, 0}, Gray(1), alpha, alpha);
    constexpr double kRadius = 0.1;
    double expected = 0;
    constexpr int kRings = 100;
    constexpr int kSectors = 64;
    for (int ring = 0; ring < kRings; ++ring) {
      const double t2 = (ring + 0.5) / kRings;
      for (int sector = 0; sector < kSectors; ++sector) {
        const double angle = 2 * static_cast<double>(kPi) * (sector + 0.5) / kSectors;
        const Vec3 point = {static_cast<float>(kRadius * std::sqrt(t2) * std::cos(angle)),
                            static_cast<float>(kRadius * std::sqrt(t2) * std::sin(angle)), 0};
        const float distance = Length(place - point);
        const Vec3 wi = (place - point) / distance;
        expected += 2 * (1 - t2) / (kRings * kSectors) * 3 *
                    static_cast<double>(EvaluateBsdf(metal, kEye, wi, Carried::kRadiance).g * wi.z /
                                        (distance * distance));
      }
    }
    RenderSettings settings = TestSettings(scene, 300000, kRadius, 4);
    settings.alpha = 1 - 1e-7;
    ExpectMean(Measure(scene, settings, 4, kSeeds, "photons.G"), expected, 0.03);
  }
}

// Photons that the surface scatters, onto a ceiling and back, at most as much as the metal does.
TEST(MeasuredSurfaceTest, ScattersPhotonsAsTheMetalDoes) {
  for (const float alpha : {0.15F, 0.4F}) {
    SCOPED_TRACE(alpha);
    const auto mean_with = [&](const Material& floor) {
      Scene scene;
      AddQuad(scene, {-3, -3, 0}, {6, 0, 0}, {0, 6, 0}, AddMaterial(scene, floor));
      AddQuad(scene, {-3, -3, 2}, {0, 6, 0}, {6, 0, 0}, AddMaterial(scene, DiffuseMaterial(0.5F)));
      scene.point_lights.push_back({{-0.9F, 0.2F, 1}, Gray(3)});
      SetCamera(scene, {0, 0, 0.3}, {0.3, 0, 2}, {0, 1, 0}, 60, 8);
      return Measure(scene, TestSettings(scene, 100000, 0.4, 4), 6, kSeeds, "photons.G");
    };
    MetalToMeasure metal;
    metal.alpha_u = metal.alpha_v = alpha;
    const MeasuredMean expected = mean_with(ConductorMaterial({0, 0, 0}, Gray(1), alpha, alpha));
    ASSERT_GT(expected.mean, 0);
    const MeasuredMean found = mean_with(MeasuredMaterial(MeasureMetal(metal)));
    ExpectMean({found.mean, std::hypot(found.standard_error, expected.standard_error)},
               expected.mean, 0.03);
  }
}

}  // namespace
}  // namespace lucerna
