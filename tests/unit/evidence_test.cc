// Columns of evidence are sums over the photons in the disc, exact like all the rest.
#include "render/estimate/evidence.h"

#include <atomic>
#include <cmath>
#include <memory>
#include <utility>

#include "gtest/gtest.h"

#include "render/math/octahedral.h"
#include "render/math/rng.h"
#include "render/wire/accumulation_codec.h"
#include "tests/support/gather_sums.h"
#include "tests/support/test_scenes.h"
#include "worker/gather.h"
#include "worker/photon_spectrum.h"

namespace lucerna {
namespace {

// Photons of flux (1, 1, 1) on the plane z = 0 and one hitpoint of radius 0.5 at the origin.
struct Cloud {
  Deposits deposits;
  HitpointBlock block;
  RadiusColumn radii = {0.5F};
  Bounds region;

  explicit Cloud(int photons) {
    KeyedRng rng(3);
    for (int i = 0; i < photons; ++i) {
      const float x = 2 * rng.Uniform() - 1;
      const float y = 2 * rng.Uniform() - 1;
      const Vec3 up = {0, 0, 1};
      deposits.rows.push_back({{x, y, 0}, Gray(1), static_cast<std::uint32_t>(rng.Bits())});
      deposits.normals.push_back(up);
      // Three of four photons have no spectrum.
      deposits.traces.push_back(i % 4 == 0 ? 10 * rng.Uniform() : -1.0F);
      region.Add({x, y, 0});
    }
    block.positions = {{0, 0, 0}};
    block.normals_oct = {EncodeOctahedral({0, 0, 1})};
  }

  [[nodiscard]] Accumulation Sum(Evidence evidence) const {
    ThreadTeam team(1);
    const PhotonGrid grid({deposits}, region, 0.3F, team);
    return GatherSums(block, radii, {grid}, {DiffuseMaterial(0.5F)}, Kernel{},
                      FluxScale::ForPower(Gray(1)), team, evidence);
  }
};

// Photons of the greatest weight and spectrum that are told apart: the sum of squares stays at
// 2^62.
TEST(EvidenceTest, HoldsTheSumOfSquaredTracesBelowItsEnd) {
  Cloud cloud(1);
  cloud.deposits.rows[0].position = {0, 0, 0};
  cloud.deposits.rows[0].flux = Gray(1e4F);
  cloud.deposits.traces[0] = 1e30F;
  // Each term is 2^48: 2^14 of them are 2^62, to the unit, and one more changes nothing.
  const auto fill = [&](std::size_t count) {
    cloud.deposits.rows.resize(count, cloud.deposits.rows[0]);
    cloud.deposits.normals.resize(count, cloud.deposits.normals[0]);
    cloud.deposits.traces.resize(count, 1e30F);
  };
  fill((1U << 14) - 1);
  const auto trace2 = [&] {
    return cloud.Sum(Evidence::kFrequency).evidence[kCommonColumns + kFrequencyTrace2][0];
  };
  EXPECT_EQ(trace2(), (std::int64_t{1} << 62) - (std::int64_t{1} << 48));
  for (int i = 0; i < 2; ++i) {
    fill(cloud.deposits.size() + 1);
    EXPECT_EQ(trace2(), std::int64_t{1} << 62);
  }
}

// Where every photon is weak, as where guides send many, the noise of the Laplacian must not be
// lost: the radius follows from its ratio to the Laplacian.
TEST(EvidenceTest, CountsTheSquaresOfSmallWeights) {
  for (const float flux : {0.25F, 0.01F, 0x1p-10F, 0x1p-12F, 0x1p-15F}) {
    Cloud cloud(2000);
    for (Deposit& deposit : cloud.deposits.rows)
      deposit.flux = Gray(flux);
    const auto count = static_cast<double>(cloud.Sum(Evidence::kCurvature).counts[0]);
    const double expected = count * static_cast<double>(flux) * static_cast<double>(flux);
    const Accumulation curvature = cloud.Sum(Evidence::kCurvature);
    const double square =
        kWeight2Unit *
        static_cast<double>(curvature.evidence[kCommonColumns + kCurvatureWeight2][0]);
    // Never less, and the same where a square has a few units.
    EXPECT_GE(square, 0.99 * expected) << flux;
    EXPECT_GT(square, 0) << flux;
    if (flux >= 0x1p-10F) {
      EXPECT_LE(square, 1.07 * expected) << flux;
    }
  }
}

TEST(EvidenceTest, SectorsAreTwelveCellsOfEqualAreaAndHoldEveryPhotonOnce) {
  const Accumulation sum = Cloud(120000).Sum(Evidence::kSectors);
  ASSERT_EQ(sum.evidence.size(), kCommonColumns + kSectors);
  double total = 0;
  for (const auto& column : std::span(sum.evidence).subspan(kCommonColumns))
    total += static_cast<double>(column[0]);
  EXPECT_EQ(total, sum.counts[0]);
  // Binomial counts: five standard deviations.
  const double expected = total / kSectors;
  for (const auto& column : std::span(sum.evidence).subspan(kCommonColumns)) {
    EXPECT_NEAR(static_cast<double>(column[0]), expected, 5 * std::sqrt(expected));
  }
}

TEST(EvidenceTest, FrequencyColumnsAreTheSumsTheySay) {
  const Cloud cloud(4000);
  const Accumulation sum = cloud.Sum(Evidence::kFrequency);
  ASSERT_EQ(sum.evidence.size(), kCommonColumns + kFrequencyColumns);
  double count = 0;
  double trace = 0;
  double trace2 = 0;
  for (std::size_t i = 0; i < cloud.deposits.size(); ++i) {
    const Vec3 p = cloud.deposits.rows[i].position;
    if (cloud.deposits.traces[i] < 0 || !(LengthSquared(p) < 0.25F)) continue;
    const double x = static_cast<double>(cloud.deposits.traces[i] * 0.25F);
    ++count;
    trace += x;
    trace2 += x * x;
  }
  // Flux and power are both 1 here, so every weight is 1 up to the luminance's own rounding.
  EXPECT_EQ(sum.evidence[kCommonColumns + kFrequencyCount][0], static_cast<std::int64_t>(count));
  const auto value = [&](FrequencyColumn c) {
    return (c == kFrequencyWeight2 ? kWeight2Unit : kWeightUnit) *
           static_cast<double>(sum.evidence[kCommonColumns + c][0]);
  };
  EXPECT_NEAR(value(kFrequencyWeight), count, 1e-4 * count);
  EXPECT_NEAR(value(kFrequencyWeight2), count, 1e-4 * count);
  EXPECT_NEAR(value(kFrequencyTrace), trace, 1e-4 * trace);
  EXPECT_NEAR(value(kFrequencyTrace2), trace2, 1e-4 * trace2);
}

TEST(EvidenceTest, CurvatureColumnsReachFurtherThanTheFluxDoes) {
  const Cloud cloud(4000);
  const Accumulation sum = cloud.Sum(Evidence::kCurvature);
  ASSERT_EQ(sum.evidence.size(), kCommonColumns + kCurvatureColumns);
  const float reach2 = 0.25F * kCurvatureReach * kCurvatureReach;
  double count = 0;
  double laplacian = 0;
  for (const Deposit& deposit : cloud.deposits.rows) {
    const float squared = LengthSquared(deposit.position);
    if (!(squared < reach2)) continue;
    ++count;
    laplacian += 2 * static_cast<double>(squared / reach2) - 1;
  }
  EXPECT_EQ(sum.counts[0], count);
  const auto value = [&](CurvatureColumn c) {
    return (c == kCurvatureWeight2 ? kWeight2Unit : kWeightUnit) *
           static_cast<double>(sum.evidence[kCommonColumns + c][0]);
  };
  EXPECT_NEAR(value(kCurvatureWeight2), count, 1e-4 * count);
  EXPECT_NEAR(value(kCurvatureLaplacian), laplacian, 1e-4 * count);
  EXPECT_EQ(sum.flux, cloud.Sum(Evidence::kNone).flux);
}

TEST(EvidenceTest, IsMergedCheckedAndCarriedOnTheWire) {
  const Cloud cloud(2000);
  const Accumulation sum = cloud.Sum(Evidence::kFrequency);
  PassSums sums(1, kCommonColumns + kFrequencyColumns);
  ASSERT_TRUE(sums.Add(sum).ok());
  ASSERT_TRUE(sums.Add(sum).ok());
  EXPECT_EQ(sums.evidence()[kCommonColumns + kFrequencyTrace][0],
            2 * sum.evidence[kCommonColumns + kFrequencyTrace][0]);
  // A worker that thinks of another controller is refused.
  EXPECT_FALSE(sums.Add(cloud.Sum(Evidence::kNone)).ok());
  EXPECT_FALSE(PassSums(1, kCommonColumns).Add(sum).ok());

  const auto decoded = DecodeAccumulation(EncodeAccumulation(sum, 1), 1);
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(*decoded, sum);
}

// A scene ready for spectra, with kernels of radius 0.01. Its last mesh is flat, and receives.
struct SpectrumScene {
  explicit SpectrumScene(Scene s) : scene(std::move(s)) {
    intersector = Intersector::Create(scene).value();
    lights = std::make_unique<LightSet>(scene, *intersector);
    RenderSettings settings;
    settings.width = settings.height = 64;
    settings.initial_radius = 0.01;
    settings.radius_controller = RadiusControllerKind::kFrequency;
    tracer =
        SpectrumTracer::Create(scene, settings, NeedsOf(scene, settings), *intersector, *lights)
            .value();
  }

  // What of light number `emitter` arrives after `distance` on a surface facing it.
  [[nodiscard]] double HeadOn(std::uint32_t emitter, Vec3 direction, float distance,
                              const Material& material) const {
    Emission emission;
    emission.ray = {{0, 0, 0}, direction, HUGE_VALF};
    emission.flux = lights->emitter(emitter).power;
    emission.emitter = emitter;
    auto carried = tracer->Leave(emission);
    tracer->Fly(carried, emission.ray, distance, SpectrumTracer::Shadows::kLeftOut);
    SurfacePoint receiver;
    receiver.geometry = static_cast<std::uint32_t>(scene.meshes.size()) - 1;
    receiver.shading_normal = receiver.geometric_normal = -direction;
    return static_cast<double>(tracer->Received(carried, receiver, material, -direction));
  }

  Scene scene;
  std::unique_ptr<Intersector> intersector;
  std::unique_ptr<LightSet> lights;
  std::unique_ptr<SpectrumTracer> tracer;
};

TEST(SpectrumTracerTest, TakesAConnectedLampAsOneInHoweverManyMeshesItComes) {
  Scene whole;
  const std::int32_t material = AddMaterial(whole, DiffuseMaterial(0.5F));
  AddQuad(whole, {0, 0, 0}, {0, 0.3F, 0}, {0.3F, 0, 0}, material, AddAreaLight(whole, 1));
  AddQuad(whole, {5, 5, 0}, {0, 0.1F, 0}, {0.1F, 0, 0}, material, AddAreaLight(whole, 1));
  AddQuad(whole, {-5, -5, -3}, {10, 0, 0}, {0, 10, 0}, material);
  // The first light's triangles as two meshes.
  Scene split = whole;
  TriangleMesh second = split.meshes[0];
  split.meshes[0].indices.resize(3);
  second.indices.erase(second.indices.begin(), second.indices.begin() + 3);
  split.meshes.insert(split.meshes.begin() + 1, second);

  const Material diffuse = DiffuseMaterial(0.5F);
  const double one = SpectrumScene(whole).HeadOn(0, {0, 0, -1}, 0.01F, diffuse);
  // Two axes of s = 12/side², after 0.01 along the ray s/(1 + s·0.01²/4).
  const auto expected = [](double side) {
    const double precision = 12 / (side * side);
    return 2 * precision / (1 + precision * 0.01 * 0.01 / 4);
  };
  EXPECT_NEAR(one, expected(0.3), 1e-4 * one);
  const SpectrumScene parts(split);
  for (const std::uint32_t emitter : {0U, 1U}) {
    EXPECT_DOUBLE_EQ(parts.HeadOn(emitter, {0, 0, -1}, 0.01F, diffuse), one);
  }
  // A light that does not touch it has its own size.
  EXPECT_NEAR(parts.HeadOn(2, {0, 0, -1}, 0.01F, diffuse), expected(0.1), 1e-4 * expected(0.1));
}

// The rim of a hard cone at the angle a from the photon is an edge at the distance a·d, felt as
// edges are: strength/(a·d)² in each axis, besides the falloff's own 3/d².
TEST(SpectrumTracerTest, SeesTheRimOfAHardSpot) {
  Scene scene;
  AddQuad(scene, {-5, -5, -3}, {10, 0, 0}, {0, 10, 0}, AddMaterial(scene, DiffuseMaterial(0.5F)));
  constexpr double kHalfAngle = 0.5;
  const auto cosine = static_cast<float>(std::cos(kHalfAngle));
  scene.spot_lights.push_back({{0, 0, 0}, {0, 0, -1}, Gray(1), cosine, cosine});
  const SpectrumScene spot(scene);
  const double strength = EdgeStrength(0.02, 1.0 / 6);
  for (const double angle : {0.0, 0.3, 0.48}) {
    const Vec3 direction = {static_cast<float>(std::sin(angle)), 0,
                            static_cast<float>(-std::cos(angle))};
    const double to_rim = kHalfAngle - angle;
    const double expected = 2 * (3 + strength / (to_rim * to_rim)) / 4;
    EXPECT_NEAR(spot.HeadOn(0, direction, 2, DiffuseMaterial(0.5F)), expected, 0.01 * expected)
        << angle;
  }
}

// A flat hitpoint seen through a narrow lobe sees a point light's beam as its vergence makes
// the direction change across the surface: s + v² q (1 + p q)⁻¹ in each axis, v = 1/d.
TEST(SpectrumTracerTest, AGlossyHitpointSeesThroughItsLobe) {
  constexpr double kAlpha = 0.25;
  const double q = 1 / (1.2 * kAlpha * kAlpha);
  const Material glossy = ConductorMaterial(Gray(0.2F), Gray(3), kAlpha, kAlpha);
  Scene scene;
  AddQuad(scene, {-5, -5, -3}, {10, 0, 0}, {0, 10, 0}, AddMaterial(scene, glossy));
  scene.point_lights.push_back({{0, 0, 0}, Gray(1)});
  const SpectrumScene point(scene);
  const double expected = 2 * (3 + q) / 4;
  EXPECT_NEAR(point.HeadOn(0, {0, 0, -1}, 2, glossy), expected, 0.01 * expected);
  EXPECT_NEAR(point.HeadOn(0, {0, 0, -1}, 2, DiffuseMaterial(0.5F)), 1.5, 0.01);
}

// A point light over a mirror: what arrives is the light of its image, whose falloff is known.
TEST(SpectrumTracerTest, SeesTheImageOfAPointLightInAMirror) {
  Scene scene;
  Material mirror = ConductorMaterial(Gray(0.2F), Gray(3), 0, 0);
  const std::int32_t reflecting = AddMaterial(scene, mirror);
  AddQuad(scene, {-5, -5, 0}, {10, 0, 0}, {0, 10, 0}, reflecting);
  scene.point_lights.push_back({{0, 0, 2}, Gray(1)});
  const auto intersector = Intersector::Create(scene).value();
  const LightSet lights(scene, *intersector);
  RenderSettings settings;
  settings.width = settings.height = 64;
  settings.initial_radius = 0.01;
  settings.radius_controller = RadiusControllerKind::kFrequency;
  const auto tracer =
      SpectrumTracer::Create(scene, settings, NeedsOf(scene, settings), *intersector, lights)
          .value();
  Emission emission;
  emission.ray = {{0, 0, 2}, Normalize({0.6F, 0, -1}), HUGE_VALF};
  auto carried = tracer->Leave(emission);
  Hit hit;
  ASSERT_TRUE(intersector->Intersect(emission.ray, hit));
  const SurfacePoint surface = intersector->SurfaceAt(emission.ray, hit);
  const Vec3 wo = -emission.ray.direction;
  const Vec3 wi = {-wo.x, -wo.y, wo.z};
  tracer->Fly(carried, emission.ray, hit.t, SpectrumTracer::Shadows::kFound);
  tracer->Scatter(carried, surface, scene.materials[0], wo, wi);
  const float second = 3;
  tracer->Fly(carried, {surface.position, wi, HUGE_VALF}, second, SpectrumTracer::Shadows::kFound);
  SurfacePoint floor = surface;
  floor.shading_normal = floor.geometric_normal = -wi;  // met head on
  const double distance = static_cast<double>(hit.t + second);
  EXPECT_NEAR(static_cast<double>(tracer->Received(carried, floor, DiffuseMaterial(0.5F), -wi)),
              2 * 3 / (distance * distance), 1e-3 / distance);
}

}  // namespace
}  // namespace lucerna
