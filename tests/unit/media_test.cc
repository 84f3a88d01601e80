// Phase functions are densities, transmittance is what is left on a way through media, and the tree
// of photons finds those near a segment.
#include "render/transport/media.h"

#include <cmath>
#include <set>
#include <vector>

#include "gtest/gtest.h"

#include "render/base/parallel.h"
#include "render/math/octahedral.h"
#include "render/math/rng.h"
#include "render/math/warp.h"
#include "tests/support/gather_sums.h"
#include "tests/support/test_scenes.h"
#include "worker/gather_segments.h"
#include "worker/photon_grid.h"
#include "worker/photon_tree.h"

namespace lucerna {
namespace {

TEST(PhaseFunctionTest, IsADensityWithTheMeanCosineThatItNames) {
  for (const float g : {-0.7F, 0.0F, 0.3F, 0.9F}) {
    constexpr int kSteps = 200000;
    double total = 0;
    double mean = 0;
    for (int i = 0; i < kSteps; ++i) {
      const double cosine = -1 + 2 * (i + 0.5) / kSteps;
      const double density =
          2 * kPi64 * static_cast<double>(PhaseHenyeyGreenstein(static_cast<float>(cosine), g));
      total += density * 2 / kSteps;
      mean += density * cosine * 2 / kSteps;
    }
    EXPECT_NEAR(total, 1, 1e-4) << g;
    EXPECT_NEAR(mean, static_cast<double>(g), 1e-4) << g;
  }
}

// Shares of samples in tenths of the cosine's range against the integral of the density.
TEST(PhaseFunctionTest, IsSampledInProportionToItsDensity) {
  constexpr int kSamples = 100000;
  constexpr int kBins = 10;
  const Vec3 direction = Normalize(Vec3{0.3F, -0.5F, 0.8F});
  for (const float g : {-0.6F, 0.0F, 0.8F}) {
    KeyedRng rng(7);
    std::vector<int> counts(kBins);
    for (int i = 0; i < kSamples; ++i) {
      const float u1 = rng.Uniform();
      const Vec3 wi = SamplePhase(direction, g, u1, rng.Uniform());
      EXPECT_NEAR(Length(wi), 1, 1e-5F);
      const float cosine = Dot(direction, wi);
      ++counts[static_cast<std::size_t>(std::clamp((cosine + 1) / 2 * kBins, 0.0F, kBins - 1.0F))];
    }
    for (int bin = 0; bin < kBins; ++bin) {
      constexpr int kSteps = 2000;
      double expected = 0;
      for (int i = 0; i < kSteps; ++i) {
        const double cosine = -1 + 2.0 * (bin + (i + 0.5) / kSteps) / kBins;
        expected += 2 * kPi64 *
                    static_cast<double>(PhaseHenyeyGreenstein(static_cast<float>(cosine), g)) * 2 /
                    kBins / kSteps;
      }
      const double deviation = std::sqrt(expected * (1 - expected) / kSamples);
      EXPECT_NEAR(counts[static_cast<std::size_t>(bin)] / static_cast<double>(kSamples), expected,
                  5 * deviation + 1e-5)
          << g << " bin " << bin;
    }
  }
}

// A glass-less box of a medium between x = 0 and 2, in front of empty space, with a wall behind.
Scene SceneWithBox(const Medium& medium) {
  Scene scene;
  scene.media = {medium};
  Material interface;
  interface.kind = Material::Kind::kInterface;
  const std::int32_t border = AddMaterial(scene, interface);
  AddBox(scene, {0, -1, -1}, {2, 1, 1}, border);
  for (TriangleMesh& mesh : scene.meshes)
    mesh.traits.medium_inside = 0;
  AddQuad(scene, {5, -1, -1}, {0, 2, 0}, {0, 0, 2}, AddMaterial(scene, DiffuseMaterial(0.5F)));
  return scene;
}

TEST(MediaTest, LeaveWhatBeersLawSays) {
  Medium medium;
  medium.absorption = {0.1F, 0.2F, 0.4F};
  medium.scattering = {0.3F, 0, 0.1F};
  const Scene scene = SceneWithBox(medium);
  const auto intersector = Intersector::Create(scene).value();
  const Media media(scene, *intersector);
  int rays = 0;
  // From empty space through the whole box; the direction is not unit.
  Rgb left = media.Transmittance({{-1, 0.1F, 0.2F}, {2, 0, 0}, 2}, kNoMedium, rays);
  EXPECT_NEAR(left.r, std::exp(-0.8), 1e-5);
  EXPECT_NEAR(left.g, std::exp(-0.4), 1e-5);
  EXPECT_NEAR(left.b, std::exp(-1.0), 1e-5);
  EXPECT_EQ(rays, 3);
  // From inside.
  left = media.Transmittance({{0.5F, 0, 0}, {0, 1, 0}, 10}, 0, rays);
  EXPECT_NEAR(left.r, std::exp(-0.4), 1e-5);
  // Ends inside.
  left = media.Transmittance({{-1, 0, 0}, {1, 0, 0}, 2.5F}, kNoMedium, rays);
  EXPECT_NEAR(left.r, std::exp(-0.6), 1e-5);
  // Nothing passes the wall.
  EXPECT_TRUE(IsBlack(media.Transmittance({{-1, 0, 0}, {1, 0, 0}, 10}, kNoMedium, rays)));
}

TEST(MediaTest, KnowWhereALightIsThatNamesNone) {
  const Scene scene = SceneWithBox({});
  const auto intersector = Intersector::Create(scene).value();
  const Media media(scene, *intersector);
  EXPECT_EQ(media.AtLight({1, 0.3F, 0.2F}, kNoMedium), 0);
  EXPECT_EQ(media.AtLight({-0.5F, 0.3F, 0.2F}, kNoMedium), kNoMedium);
  EXPECT_EQ(media.AtLight({-0.5F, 0.3F, 0.2F}, 0), 0);
}

TEST(PhotonTreeTest, FindsThePhotonsThatASearchOfAllFinds) {
  KeyedRng rng(3);
  std::vector<Deposits> chunks(3);
  std::vector<Vec3> positions;
  for (int i = 0; i < 1000; ++i) {
    Deposits& chunk = chunks[static_cast<std::size_t>(i % 3)];
    const float x = rng.Uniform();
    const float y = rng.Uniform();
    const Vec3 position = {x, y, 0.3F * rng.Uniform()};
    chunk.rows.push_back({position, Gray(1), static_cast<std::uint32_t>(i), 0});
    chunk.arrivals_oct.push_back(EncodeOctahedral({0, 0, 1}));
    positions.push_back(position);
  }
  ThreadTeam team(2);
  const PhotonTree tree(chunks, team);
  ASSERT_EQ(tree.size(), positions.size());
  for (int trial = 0; trial < 50; ++trial) {
    const Vec3 origin = {rng.Uniform(), rng.Uniform(), -0.2F + rng.Uniform()};
    const Vec3 direction =
        Normalize(Vec3{rng.Uniform() - 0.5F, rng.Uniform() - 0.5F, rng.Uniform() - 0.5F});
    const PhotonTree::Cone cone = {origin, direction, 0.2F + rng.Uniform(), 0.01F, 0.08F};
    std::set<std::uint32_t> expected;
    for (std::uint32_t i = 0; i < positions.size(); ++i) {
      const Vec3 to = positions[i] - origin;
      const float t = Dot(to, direction);
      if (!(t >= 0 && t <= cone.length)) continue;
      const float radius = 0.01F + 0.07F * t / cone.length;
      if (Length(to - direction * t) < radius) expected.insert(i);
    }
    std::set<std::uint32_t> found;
    tree.ForEachWithin(
        cone, [&](std::size_t /*number*/, const ScatteredPhoton& photon, float /*t*/, float /*t2*/,
                  float /*radius*/) { EXPECT_TRUE(found.insert(photon.key).second); });
    EXPECT_EQ(found, expected) << trial;
  }
}

// A border in the plane z = 0, seen along (1, 0, -1) / sqrt(2): a photon lies sqrt(2) times as deep
// along that direction as below the border, wherever the segment begins, and those are found that
// lie beside the segment before its beginning.
TEST(SegmentReachTest, DepthCountsFromTheBorder) {
  HitpointBlock block;
  block.positions = {{0, 0, 0}, {1, 2, 0}};
  block.normals_oct = {0, EncodeOctahedral({0, 0, 1})};
  block.segments = {{{4, 2, -3}, 0, 0.5F}};
  const SegmentReach reach(block, 0, 0.2F);
  for (const float below : {0.0F, 0.01F, 0.3F}) {
    for (const float x : {0.8F, 1.0F, 1.5F})
      EXPECT_NEAR(reach.Depth({x, 2.1F, -below}, 1), below * std::sqrt(2.0F), 1e-4F);
  }
  // Above the border, beside the segment and before it.
  EXPECT_EQ(reach.Depth({1.1F, 2, 0.01F}, 0.11F), 0);
  EXPECT_LT(reach.Depth({0.95F, 2, 0.01F}, 0.05F), 0);
  // The disc of radius 0.1 at the beginning reaches 0.1 before and behind it.
  EXPECT_NEAR(reach.cone.length, 3 * std::sqrt(2.0F) + 0.1F, 1e-4F);
  EXPECT_NEAR(Length(reach.cone.origin - Vec3{1, 2, 0}), 0.1F, 1e-4F);
  EXPECT_EQ(reach.cone.first_radius, 0.1F);
  EXPECT_EQ(reach.cone.last_radius, 0.2F);
  // Where no surface is, a segment begins at right angles to itself.
  block.normals_oct[1] = EncodeOctahedral(Normalize(Vec3{-1, 0, 1}));
  EXPECT_NEAR(SegmentReach(block, 0, 0.2F).cone.length, 3 * std::sqrt(2.0F), 1e-4F);
}

// Segments come behind any number of surfaces, and each gathers once.
TEST(GatherTest, EachSegmentGathersOnceWhereverItsRowIs) {
  KeyedRng rng(5);
  const auto random_point = [&] {
    const float x = rng.Uniform();
    const float y = rng.Uniform();
    return Vec3{x, y, rng.Uniform()};
  };
  std::vector<Deposits> scattered(1);
  for (std::uint32_t i = 0; i < 200; ++i) {
    scattered[0].rows.push_back({random_point(), Gray(1), i, 0});
    scattered[0].arrivals_oct.push_back(EncodeOctahedral({0, 0, 1}));
  }
  ThreadTeam team(2);
  const PhotonTree tree(scattered, team);
  Bounds region;
  region.Add(Vec3{0, 0, 0});
  region.Add(Vec3{1, 1, 1});
  const PhotonGrid grid({}, region, 0.1F, team);
  const std::vector<Medium> media(1);
  constexpr std::size_t kSegments = 5000;
  for (const std::size_t surfaces : {0U, 5U, 2047U, 2048U, 3000U}) {
    SCOPED_TRACE(surfaces);
    HitpointBlock block;
    block.positions.assign(surfaces, {9, 9, 9});
    block.normals_oct.resize(surfaces);
    for (std::size_t i = 0; i < kSegments; ++i) {
      block.positions.push_back(random_point());
      block.normals_oct.push_back(EncodeOctahedral(Normalize(random_point())));
      block.segments.push_back({random_point(), 0, 1});
    }
    std::vector<std::uint32_t> expected(surfaces);
    for (std::size_t i = 0; i < kSegments; ++i) {
      std::uint32_t count = 0;
      const SegmentReach reach(block, i, 0.1F);
      tree.ForEachWithin(reach.cone, [&](std::size_t photon, const ScatteredPhoton& /*of_it*/,
                                         float along, float /*t2*/, float /*radius*/) {
        if (reach.Depth(tree.position(photon), along) >= 0) ++count;
      });
      expected.push_back(count);
    }
    std::vector<std::uint32_t> found_by(tree.size(), kNotFound);
    const GatheredPhotons photons = {
        .grid = grid, .scattered = &tree, .media = &media, .scattered_found_by = found_by};
    const Accumulation sums =
        GatherSums(block, RadiusColumn(block.size(), 0.1F), photons, {},
                   Kernel{KernelKind::kConstant}, FluxScale::ForPower(Gray(1)), team);
    std::vector<std::uint32_t> counts(block.size());
    for (std::size_t i = 0; i < sums.size(); ++i)
      counts[sums.hitpoints[i]] = sums.counts[i];
    EXPECT_EQ(counts, expected);
  }
}

TEST(PhotonTreeTest, MayBeEmpty) {
  ThreadTeam team(1);
  const PhotonTree tree({}, team);
  EXPECT_EQ(tree.size(), 0U);
  tree.ForEachWithin({{0, 0, 0}, {1, 0, 0}, 1, 1, 1},
                     [](auto&&...) { FAIL() << "there is no photon"; });
}

}  // namespace
}  // namespace lucerna
