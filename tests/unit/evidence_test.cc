// Columns of evidence are sums over the photons in the disc, exact like all the rest.
#include "render/estimate/evidence.h"

#include <atomic>
#include <cmath>

#include "gtest/gtest.h"

#include "render/math/octahedral.h"
#include "render/math/rng.h"
#include "render/wire/accumulation_codec.h"
#include "tests/support/test_scenes.h"
#include "worker/gather.h"
#include "worker/photon_spectrum.h"

namespace lucerna {
namespace {

// Photons of flux (1, 1, 1) on the plane z = 0 and one hitpoint of radius 0.5 at the origin.
struct Cloud {
  std::vector<std::vector<Deposit>> deposits{1};
  std::vector<std::vector<float>> traces{1};
  HitpointBlock block;
  RadiusColumn radii = {0.5F};
  Bounds region;

  explicit Cloud(int photons) {
    KeyedRng rng(3);
    for (int i = 0; i < photons; ++i) {
      const float x = 2 * rng.Uniform() - 1;
      const float y = 2 * rng.Uniform() - 1;
      const Vec3 up = {0, 0, 1};
      deposits[0].push_back(
          {{x, y, 0}, Gray(1), up, EncodeOctahedral(up), static_cast<std::uint32_t>(rng.Bits())});
      // Three of four photons have no spectrum.
      traces[0].push_back(i % 4 == 0 ? 10 * rng.Uniform() : -1.0F);
      region.Add({x, y, 0});
    }
    block.positions = {{0, 0, 0}};
    block.normals_oct = {EncodeOctahedral({0, 0, 1})};
  }

  [[nodiscard]] Accumulation Sum(Evidence evidence) const {
    ThreadTeam team(1);
    const PhotonGrid grid(deposits, traces, region, 0.3F, team);
    const std::atomic<bool> stop = false;
    return Gather(block, radii, grid, {DiffuseMaterial(0.5F)}, Kernel{},
                  FluxScale::ForPower(Gray(1)), team, stop, evidence);
  }
};

TEST(EvidenceTest, SectorsAreTwelveCellsOfEqualAreaAndHoldEveryPhotonOnce) {
  const Accumulation sum = Cloud(120000).Sum(Evidence::kSectors);
  ASSERT_EQ(sum.evidence.size(), kSectors);
  double total = 0;
  for (const auto& column : sum.evidence)
    total += static_cast<double>(column[0]);
  EXPECT_EQ(total, sum.counts[0]);
  // Binomial counts: five standard deviations.
  const double expected = total / kSectors;
  for (const auto& column : sum.evidence) {
    EXPECT_NEAR(static_cast<double>(column[0]), expected, 5 * std::sqrt(expected));
  }
}

TEST(EvidenceTest, FrequencyColumnsAreTheSumsTheySay) {
  const Cloud cloud(4000);
  const Accumulation sum = cloud.Sum(Evidence::kFrequency);
  ASSERT_EQ(sum.evidence.size(), kFrequencyColumns);
  double count = 0;
  double trace = 0;
  double trace2 = 0;
  for (std::size_t i = 0; i < cloud.deposits[0].size(); ++i) {
    const Vec3 p = cloud.deposits[0][i].position;
    if (cloud.traces[0][i] < 0 || !(LengthSquared(p) < 0.25F)) continue;
    const double x = static_cast<double>(cloud.traces[0][i] * 0.25F);
    ++count;
    trace += x;
    trace2 += x * x;
  }
  // Flux and power are both 1 here, so every weight is 1 up to the luminance's own rounding.
  EXPECT_EQ(sum.evidence[kFrequencyCount][0], static_cast<std::int64_t>(count));
  const auto value = [&](FrequencyColumn c) {
    return kWeightUnit * static_cast<double>(sum.evidence[c][0]);
  };
  EXPECT_NEAR(value(kFrequencyWeight), count, 1e-4 * count);
  EXPECT_NEAR(value(kFrequencyWeight2), count, 1e-4 * count);
  EXPECT_NEAR(value(kFrequencyTrace), trace, 1e-4 * trace);
  EXPECT_NEAR(value(kFrequencyTrace2), trace2, 1e-4 * trace2);
}

TEST(EvidenceTest, CurvatureColumnsReachFurtherThanTheFluxDoes) {
  const Cloud cloud(4000);
  const Accumulation sum = cloud.Sum(Evidence::kCurvature);
  ASSERT_EQ(sum.evidence.size(), kCurvatureColumns);
  const float reach2 = 0.25F * kCurvatureReach * kCurvatureReach;
  double count = 0;
  double laplacian = 0;
  for (const Deposit& deposit : cloud.deposits[0]) {
    const float squared = LengthSquared(deposit.position);
    if (!(squared < reach2)) continue;
    ++count;
    laplacian += 2 * static_cast<double>(squared / reach2) - 1;
  }
  EXPECT_EQ(sum.counts[0], count);
  const auto value = [&](CurvatureColumn c) {
    return kWeightUnit * static_cast<double>(sum.evidence[c][0]);
  };
  EXPECT_NEAR(value(kCurvatureWeight2), count, 1e-4 * count);
  EXPECT_NEAR(value(kCurvatureLaplacian), laplacian, 1e-4 * count);
  EXPECT_EQ(sum.flux, cloud.Sum(Evidence::kNone).flux);
}

TEST(EvidenceTest, IsMergedCheckedAndCarriedOnTheWire) {
  const Cloud cloud(2000);
  const Accumulation sum = cloud.Sum(Evidence::kFrequency);
  PassSums sums(1, kFrequencyColumns);
  ASSERT_TRUE(sums.Add(sum).ok());
  ASSERT_TRUE(sums.Add(sum).ok());
  EXPECT_EQ(sums.evidence()[kFrequencyTrace][0], 2 * sum.evidence[kFrequencyTrace][0]);
  ASSERT_TRUE(sums.Subtract(sum).ok());
  EXPECT_EQ(sums.evidence()[kFrequencyTrace][0], sum.evidence[kFrequencyTrace][0]);
  // A worker that thinks of another controller is refused.
  EXPECT_FALSE(sums.Add(cloud.Sum(Evidence::kNone)).ok());
  EXPECT_FALSE(PassSums(1).Add(sum).ok());

  const auto decoded = DecodeAccumulation(EncodeAccumulation(sum, 1), 1);
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(*decoded, sum);
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
  const auto tracer = SpectrumTracer::Create(scene, settings, *intersector, lights).value();
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
  EXPECT_NEAR(static_cast<double>(tracer->Received(carried, floor, -wi)),
              2 * 3 / (distance * distance), 1e-3 / distance);
}

}  // namespace
}  // namespace lucerna
