// Up to its edges a surface is as bright as it is, and keeps its light to itself.
//
// Photons lie on a fine lattice, so that what is gathered is an integral over the region, good to
// the lattice's step.
#include "worker/cut_disc.h"

#include <cmath>
#include <functional>
#include <vector>

#include "gtest/gtest.h"

#include "render/estimate/evidence.h"
#include "render/math/kernel.h"
#include "render/math/octahedral.h"
#include "render/math/rng.h"
#include "tests/support/gather_sums.h"
#include "tests/support/test_scenes.h"
#include "worker/gather.h"

namespace lucerna {
namespace {

constexpr float kStep = 1.0F / 160;

// Light on a plane: photons of flux `light`(x, y), a lattice over [-1, 1]².
void AddPlane(Deposits& deposits, const Frame& frame, Vec3 origin,
              const std::function<float(float, float)>& light) {
  for (int i = -160; i < 160; ++i) {
    for (int j = -160; j < 160; ++j) {
      const float x = (static_cast<float>(i) + 0.5F) * kStep;
      const float y = (static_cast<float>(j) + 0.5F) * kStep;
      const float flux = light(x, y);
      if (flux == 0) continue;
      deposits.rows.push_back({origin + frame.s * x + frame.t * y, Gray(flux),
                               static_cast<std::uint32_t>(Mix64(deposits.size()))});
      deposits.normals.push_back(frame.n);
      deposits.arrivals_oct.push_back(EncodeOctahedral(frame.n));
    }
  }
}

struct Gathered {
  double density = 0;  // where the light is 1 everywhere, 1
  double blur = 0;     // over the kernel's integral
  double laplacian = 0, weight2 = 0;
  std::uint32_t count = 0;
};

Gathered At(const Scene& scene, const Deposits& deposits, Vec3 position, Vec3 normal,
            float radius = 0.3F, KernelKind kernel = KernelKind::kEpanechnikov) {
  ThreadTeam team(1);
  Bounds region;
  region.Add({-2, -2, -2});
  region.Add({2, 2, 2});
  const PhotonGrid grid({deposits}, region, 2 * radius, team);
  HitpointBlock block;
  block.positions = {position};
  block.normals_oct = {EncodeOctahedral(normal)};
  const FeatureEdges features(scene);
  const FluxScale scale = FluxScale::ForPower(Gray(1));
  const Accumulation sum =
      GatherSums(block, {radius}, {.grid = grid, .features = &features}, scene.materials,
                 Kernel{kernel}, scale, team, Evidence::kCurvature);
  if (sum.size() == 0) return {};
  const auto r = static_cast<double>(radius);
  const double per_area = static_cast<double>(kStep) * static_cast<double>(kStep) / (r * r);
  const double unit = Kernel{kernel}.Norm() * per_area;
  const double quantum = static_cast<double>(scale.watts_per_quantum.g);
  const auto column = [&](std::size_t c) { return static_cast<double>(sum.evidence[c][0]); };
  return {static_cast<double>(sum.flux[1][0]) * quantum * unit,
          column(kBlurColumn) * quantum * unit,
          column(kCommonColumns + kCurvatureLaplacian) * kWeightUnit * per_area,
          column(kCommonColumns + kCurvatureWeight2) * kWeight2Unit * per_area, sum.counts[0]};
}

const Frame kFloor(Vec3{0, 0, 1});
const std::function<float(float, float)> kEven = [](float, float) { return 1.0F; };

// The floor [-1, 1]² and, with its bottom edge on x = 0, a wall.
Scene Corner() {
  Scene scene;
  AddMaterial(scene, DiffuseMaterial(0.5F));
  AddQuad(scene, {-1, -1, 0}, {1, 0, 0}, {0, 2, 0}, 0);
  AddQuad(scene, {0, -1, 0}, {0, 2, 0}, {0, 0, 1}, 0);
  return scene;
}

Deposits CornerLight(const std::function<float(float, float)>& on_floor, float on_wall) {
  Deposits deposits;
  AddPlane(deposits, kFloor, {}, [&](float x, float y) {
    const Vec3 p = kFloor.s * x + kFloor.t * y;
    return p.x < 0 ? on_floor(p.x, p.y) : 0;
  });
  const Frame wall(Vec3{-1, 0, 0});
  AddPlane(deposits, wall, {},
           [&](float x, float y) { return (wall.s * x + wall.t * y).z > 0 ? on_wall : 0; });
  return deposits;
}

// In a hollow corner neither the wall's light nor what lies behind it has a part.
TEST(CutDiscTest, EstimatesEvenLightUpToACorner) {
  const Scene scene = Corner();
  const Deposits deposits = CornerLight(kEven, 100);
  for (const KernelKind kernel : {KernelKind::kConstant, KernelKind::kEpanechnikov,
                                  KernelKind::kBiweight, KernelKind::kGaussian}) {
    for (const float distance : {0.001F, 0.05F, 0.1F, 0.25F, 0.35F, 0.6F}) {
      const Gathered sum = At(scene, deposits, {-distance, 0.2F, 0}, {0, 0, 1}, 0.3F, kernel);
      EXPECT_NEAR(sum.density, 1, 0.02) << distance;
      EXPECT_NEAR(sum.blur, 0, 0.02) << distance;
      EXPECT_NEAR(sum.laplacian, 0, 0.03) << distance;
      // π · 1.5², as over a whole disc.
      EXPECT_NEAR(sum.weight2, 7.07, 0.1) << distance;
      EXPECT_NEAR(At(scene, deposits, {0, 0.2F, distance}, {-1, 0, 0}, 0.3F, kernel).density, 100,
                  2);
    }
  }
}

// Light that changes evenly is as bright as at the hitpoint, from half a radius on; at the corner
// itself it is off by 0.26 radii times the gradient (see RegionWeight).
TEST(CutDiscTest, EstimatesALinearGradientUpToACorner) {
  const auto light = [](float x, float y) { return 2 + x + 0.5F * y; };
  const Deposits deposits = CornerLight(light, 0);
  for (const float distance : {0.001F, 0.06F, 0.12F, 0.16F, 0.25F, 0.35F}) {
    const Gathered sum = At(Corner(), deposits, {-distance, -0.1F, 0}, {0, 0, 1});
    const auto expected = static_cast<double>(light(-distance, -0.1F));
    // By the same quadrature: the distance in radii, and the bias in radii times the gradient.
    const double bias = distance == 0.001F  ? 0.260
                        : distance == 0.06F ? 0.132
                        : distance == 0.12F ? 0.015
                                            : 0;
    EXPECT_NEAR(sum.density, expected - 0.3 * bias, 0.005 * expected) << distance;
    EXPECT_NEAR(sum.blur, 0, 0.01 * expected + 0.3 * bias) << distance;
    EXPECT_NEAR(sum.laplacian, 0, 0.05) << distance;
  }
}

// A thin wall on a floor: light on its other side is that of another room. Nothing of it comes
// through, whatever it is.
TEST(CutDiscTest, TakesNoLightThroughAThinWall) {
  Scene scene;
  AddMaterial(scene, DiffuseMaterial(0.5F));
  AddQuad(scene, {-1, -1, 0}, {2, 0, 0}, {0, 2, 0}, 0);
  AddQuad(scene, {0, -1, 0}, {0, 2, 0}, {0, 0, 1}, 0);
  Deposits deposits;
  AddPlane(deposits, kFloor, {},
           [&](float x, float y) { return (kFloor.s * x + kFloor.t * y).x < 0 ? 1.0F : 1000.0F; });
  EXPECT_NEAR(At(scene, deposits, {-0.02F, 0, 0}, {0, 0, 1}).density, 1, 0.02);
  EXPECT_NEAR(At(scene, deposits, {0.02F, 0, 0}, {0, 0, 1}).density, 1000, 20);
}

// A box that stands on the middle of a floor, or is sunk into it: no photons lie beneath.
TEST(CutDiscTest, SeesTheFeetOfThingsThatStandOnAFloor) {
  for (const float bottom : {0.0F, -0.3F}) {
    Scene scene;
    AddMaterial(scene, DiffuseMaterial(0.5F));
    AddQuad(scene, {-1, -1, 0}, {2, 0, 0}, {0, 2, 0}, 0);
    AddBox(scene, {0, 0, bottom}, {0.5F, 0.5F, 1}, 0);
    Deposits deposits;
    AddPlane(deposits, kFloor, {}, [&](float x, float y) {
      const Vec3 p = kFloor.s * x + kFloor.t * y;
      return p.x > 0 && p.x < 0.5F && p.y > 0 && p.y < 0.5F ? 0.0F : 1.0F;
    });
    for (const Vec3 at :
         {Vec3{-0.02F, 0.2F, 0}, {-0.02F, -0.02F, 0}, {-0.1F, 0.02F, 0}, {0.51F, 0.51F, 0}}) {
      EXPECT_NEAR(At(scene, deposits, at, {0, 0, 1}).density, 1, 0.03) << at.x << " " << at.y;
    }
  }
}

// Walls without corners in common that meet, and neighbours in one plane, change nothing but noise.
TEST(CutDiscTest, KeepsEvenLightWhereItCutsTooMuch) {
  Scene scene;
  AddMaterial(scene, DiffuseMaterial(0.5F));
  AddQuad(scene, {-1, -1, 0}, {1, 0, 0}, {0, 2, 0}, 0);
  AddQuad(scene, {0, -1, 0}, {1, 0, 0}, {0, 0.93F, 0}, 0);
  AddQuad(scene, {0, -0.07F, 0}, {1, 0, 0}, {0, 1.07F, 0}, 0);
  Deposits deposits;
  AddPlane(deposits, kFloor, {}, kEven);
  KeyedRng rng(3);
  for (int i = 0; i < 40; ++i) {
    const float x = 0.4F * rng.Uniform() - 0.2F;
    const float y = 0.4F * rng.Uniform() - 0.2F;
    EXPECT_NEAR(At(scene, deposits, {x, y, 0}, {0, 0, 1}).density, 1, 0.03) << x << " " << y;
  }
  // Away from all edges every photon counts, as without any: the same bits.
  Scene none;
  AddMaterial(none, DiffuseMaterial(0.5F));
  const Gathered with = At(scene, deposits, {-0.48F, 0, 0}, {0, 0, 1});
  const Gathered without = At(none, deposits, {-0.48F, 0, 0}, {0, 0, 1});
  EXPECT_EQ(with.density, without.density);
  EXPECT_EQ(with.laplacian, without.laplacian);
}

// Even light is even in all twelve cells beside an edge too.
TEST(CutDiscTest, FillsTheSectorsBeyondAnEdge) {
  const Scene scene = Corner();
  const Deposits deposits = CornerLight(kEven, 100);
  ThreadTeam team(1);
  Bounds region;
  region.Add({-2, -2, -2});
  region.Add({2, 2, 2});
  const PhotonGrid grid({deposits}, region, 0.5F, team);
  const FeatureEdges features(scene);
  for (const float distance : {0.01F, 0.1F, 0.2F}) {
    HitpointBlock block;
    block.positions = {{-distance, 0.1F, 0}};
    block.normals_oct = {EncodeOctahedral({0, 0, 1})};
    const Accumulation sum =
        GatherSums(block, {0.4F}, {.grid = grid, .features = &features}, scene.materials, Kernel{},
                   FluxScale::ForPower(Gray(1)), team, Evidence::kSectors);
    ASSERT_EQ(sum.size(), 1U);
    // Photons a cell: a twelfth of the disc's area, over the lattice's step squared.
    const double expected = 3.14159 * 0.16 / 12 * 160 * 160;
    for (std::size_t i = 0; i < kSectors; ++i) {
      EXPECT_NEAR(static_cast<double>(sum.evidence[kCommonColumns + i][0]), expected,
                  0.05 * expected)
          << distance;
    }
  }
}

// A hundred plates that stand on a floor like books, with light before the first of them alone; and
// a round hole whose rim has a hundred sides, of which none hides another where they are few enough
// to be seen at once.
TEST(CutDiscTest, KeepsEvenLightWhereEdgesCrowd) {
  Scene books;
  AddMaterial(books, DiffuseMaterial(0.5F));
  AddQuad(books, {-1, -1, 0}, {2, 0, 0}, {0, 2, 0}, 0);
  for (int i = 0; i < 100; ++i)
    AddQuad(books, {0.002F * static_cast<float>(i), -1, 0}, {0, 2, 0}, {0, 0, 1}, 0);
  Deposits light;
  AddPlane(light, kFloor, {},
           [&](float x, float y) { return (kFloor.s * x + kFloor.t * y).x < 0 ? 1.0F : 0.0F; });
  for (const float distance : {0.01F, 0.1F, 0.2F, 0.4F})
    EXPECT_NEAR(At(books, light, {-distance, 0.1F, 0}, {0, 0, 1}).density, 1, 0.02) << distance;

  Scene well;
  AddMaterial(well, DiffuseMaterial(0.5F));
  AddQuad(well, {-1, -1, 0}, {2, 0, 0}, {0, 2, 0}, 0);
  constexpr int kSides = 100;
  const auto at = [](int i) {
    const float angle = 6.2831853F * static_cast<float>(i) / kSides;
    return Vec3{0.2F * std::cos(angle), 0.2F * std::sin(angle), 0};
  };
  for (int i = 0; i < kSides; ++i)
    AddQuad(well, at(i), at(i + 1) - at(i), {0, 0, 1}, 0);
  Deposits beside;
  AddPlane(beside, kFloor, {},
           [&](float x, float y) { return x * x + y * y > 0.04F ? 1.0F : 0.0F; });
  // From outside about a third of the sides is seen.
  for (const float distance : {0.21F, 0.3F, 0.5F})
    EXPECT_NEAR(At(well, beside, {distance, 0, 0}, {0, 0, 1}).density, 1, 0.02) << distance;
}

// Nothing leaves its range where little is left of a disc, or where a photon is as strong as there
// is room for.
TEST(CutDiscTest, HoldsContributionsInTheirRange) {
  Scene scene;
  AddMaterial(scene, DiffuseMaterial(0.5F));
  AddQuad(scene, {-0.004F, -1, 0}, {0.008F, 0, 0}, {0, 2, 0}, 0);
  ThreadTeam team(1);
  const FluxScale scale = FluxScale::ForPower(Gray(1));
  Deposits deposits;
  const float flux = kLargestContribution / 3 * scale.watts_per_quantum.g;
  deposits.rows.push_back({{0, 0, 0}, Gray(flux), 7});
  deposits.normals.push_back({0, 0, 1});
  Bounds region;
  region.Add({-1, -1, -1});
  region.Add({1, 1, 1});
  const PhotonGrid grid({deposits}, region, 0.2F, team);
  HitpointBlock block;
  const FeatureEdges features(scene);
  RadiusColumn radii;
  for (int i = -4; i <= 4; ++i) {
    for (const float radius : {0.01F, 0.05F, 0.2F}) {
      block.positions.push_back({0.00099F * static_cast<float>(i), 0.001F, 0});
      block.normals_oct.push_back(EncodeOctahedral({0, 0, 1}));
      radii.push_back(radius);
    }
  }
  const Accumulation sum =
      GatherSums(block, radii, {.grid = grid, .features = &features}, scene.materials,
                 Kernel{KernelKind::kConstant}, scale, team, Evidence::kCurvature);
  ASSERT_GT(sum.size(), 20U);
  const auto most = static_cast<std::int64_t>(8 * kLargestContribution);
  for (std::size_t i = 0; i < sum.size(); ++i) {
    EXPECT_LE(std::abs(sum.flux[0][i]), most);
    for (std::size_t column = 0; column < sum.evidence.size(); ++column) {
      // Squares are counted in finer units.
      constexpr auto kFiner = static_cast<std::int64_t>(kWeightUnit / kWeight2Unit);
      const bool is_squares = column == kCommonColumns + kCurvatureWeight2;
      EXPECT_LE(std::abs(sum.evidence[column][i]), is_squares ? kFiner * most : most);
    }
  }
}

}  // namespace
}  // namespace lucerna
