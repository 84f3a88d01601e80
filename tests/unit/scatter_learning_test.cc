// What pilot paths saw of first scatterings must become a guide where that pays, and nowhere else.
#include "render/estimate/scatter_learning.h"

#include <cmath>
#include <vector>

#include "gtest/gtest.h"

#include "render/math/rng.h"
#include "render/math/warp.h"

namespace lucerna {
namespace {

// A floor at z = 0 from x = -1 to 1, whose photons are needed in a small cone around `to`, or in
// all directions alike.
void AddFloor(std::vector<ScatterReport>& reports, int count, float x, Vec3 to, float width,
              std::uint64_t key) {
  KeyedRng rng(key);
  for (int i = 0; i < count; ++i) {
    const float u1 = rng.Uniform();
    const float u2 = rng.Uniform();
    const Vec3 position = {x + rng.Uniform(), rng.Uniform(), 0};
    const Vec3 cone = Normalize(to + Vec3{u1 - 0.5F, u2 - 0.5F, 0} * width);
    const Vec3 direction = width > 0 ? cone : SquareToCosineHemisphere(u1, u2);
    reports.push_back({position, direction, direction.z * kInversePi, 1});
  }
}

TEST(ScatterLearningTest, LeadsPhotonsThroughAWindow) {
  std::vector<ScatterReport> reports;
  const Vec3 to = Normalize({0.5F, 0, 1});
  AddFloor(reports, 1000, -1, to, 0.2F, 1);
  AddFloor(reports, 1000, 0, {}, 0, 2);
  const ScatterGuide guide = LearnScatterGuide(reports);
  // Where all directions count alike, the BSDF is as good.
  for (const float x : {0.1F, 0.5F, 0.9F})
    EXPECT_EQ(guide.CellAt({x, 0.5F, 0}), ScatterGuide::kNoCell) << x;
  KeyedRng rng(3);
  for (const float x : {-0.9F, -0.5F, -0.1F}) {
    const ScatterGuide::Cell cell = guide.CellAt({x, 0.5F, 0});
    ASSERT_NE(cell, ScatterGuide::kNoCell) << x;
    // The cone has a solid angle of about 0.04 cos θ sr: the BSDF sends about 1 % there.
    int hits = 0;
    for (int i = 0; i < 1000; ++i) {
      const float u1 = rng.Uniform();
      const Vec3 wi = guide.Draw(cell, u1, rng.Uniform());
      const Vec3 on_plane = wi * (to.z / std::max(wi.z, 1e-3F));
      hits += MaxAbs(on_plane - to) < 0.11F ? 1 : 0;
    }
    EXPECT_GT(hits, 150) << x;
    // Fluxes there are as much lower as photons are more, but none is lost.
    EXPECT_LT(guide.FluxFactor(cell, to, static_cast<double>(to.z) / kPi64), 0.15);
    EXPECT_GT(guide.DensityAt(cell, Normalize({-1, 0, 1})), 0);
  }
}

// Of boxes of one size, the one with nine times the mass gets three times the photons. A share is
// kept in steps of 1/256, so that each of the 15 halvings below the first may err by 1/256 of it.
TEST(ScatterLearningTest, SharesFollowTheRootOfTheMass) {
  const Vec3 strong = Normalize({0.3F, 0.2F, 1});
  const Vec3 weak = Normalize({-0.3F, -0.2F, 1});
  std::vector<ScatterReport> reports;
  for (int i = 0; i < 60; ++i) {
    const Vec3 position = {static_cast<float>(i), 0, 0};
    reports.push_back({position, strong, 0.1F, 9});
    reports.push_back({position, weak, 0.1F, 1});
  }
  const ScatterGuide guide = LearnScatterGuide(reports);
  const ScatterGuide::Cell cell = guide.CellAt({1, 0, 0});
  ASSERT_NE(cell, ScatterGuide::kNoCell);
  // A quarter of a mean report more in each.
  const double more = 0.25 * 5;
  EXPECT_NEAR(guide.DensityAt(cell, strong) / guide.DensityAt(cell, weak) /
                  std::sqrt((60 * 9 + more) / (60 + more)),
              1, 15.0 / 256);
}

TEST(ScatterLearningTest, LearnsNothingFromNothing) {
  EXPECT_TRUE(LearnScatterGuide({}).empty());
  std::vector<ScatterReport> few;
  AddFloor(few, 5, 0, {0, 0, 1}, 0.01F, 4);
  EXPECT_TRUE(LearnScatterGuide(few).empty());
  std::vector<ScatterReport> worthless;
  AddFloor(worthless, 1000, 0, {0, 0, 1}, 0.01F, 4);
  for (ScatterReport& report : worthless)
    report.mass = 0;
  EXPECT_TRUE(LearnScatterGuide(worthless).empty());
}

// One report of a mass that is a million times that of the others does not decide.
TEST(ScatterLearningTest, ASingleHugeMassDoesNotDecide) {
  std::vector<ScatterReport> reports;
  AddFloor(reports, 100, 0, {}, 0, 5);
  reports[50].mass = 1e6;
  EXPECT_TRUE(LearnScatterGuide(reports).empty());
}

// However many reports and wherever: reports of one place make one cell, and a guide has no more
// nodes than messages hold.
TEST(ScatterLearningTest, FitsInItsNodes) {
  std::vector<ScatterReport> at_a_place;
  AddFloor(at_a_place, 2000, 0, Normalize({1, 1, 1}), 0.1F, 6);
  for (ScatterReport& report : at_a_place)
    report.position = {1, 2, 3};
  const ScatterGuide one = LearnScatterGuide(at_a_place);
  EXPECT_EQ(one.CellAt({7, 7, 7}), 0U);
  std::vector<ScatterReport> many;
  KeyedRng rng(7);
  for (int i = 0; i < 200000; ++i) {
    const float u1 = rng.Uniform();
    const Vec3 direction = SquareToSphere(u1, 0.05F * rng.Uniform());
    many.push_back({{rng.Uniform(), rng.Uniform(), rng.Uniform()}, direction, 0.01F, 1});
  }
  const ScatterGuide guide = LearnScatterGuide(many);
  EXPECT_FALSE(guide.empty());
  EXPECT_LE(guide.nodes().size(), kMostScatterNodes);
}

}  // namespace
}  // namespace lucerna
