// Surfaces have edges where they end, turn or meet, and nowhere else.
#include "render/geometry/feature_edges.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "gtest/gtest.h"

#include "render/math/rng.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

double LengthOf(const FeatureEdges& edges) {
  double length = 0;
  for (const FeatureSegment& segment : edges.segments())
    length += static_cast<double>(Length(segment.ends[1] - segment.ends[0]));
  return length;
}

Scene Empty() {
  Scene scene;
  AddMaterial(scene, DiffuseMaterial(0.5F));
  return scene;
}

TEST(FeatureEdgesTest, OfAnEmptySceneAreNone) {
  EXPECT_TRUE(FeatureEdges(Empty()).empty());
  Scene ball = Empty();
  AddSphere(ball, {0, 0, 0}, 1, 0);
  const FeatureEdges edges(ball);
  EXPECT_TRUE(edges.empty());
  EXPECT_FALSE(edges.HasNear({0, 0, 0}, 10));
}

TEST(FeatureEdgesTest, OfAQuadAreItsFourSidesAndOfABoxItsTwelve) {
  Scene quad = Empty();
  AddQuad(quad, {0, 0, 0}, {2, 0, 0}, {0, 3, 0}, 0);
  EXPECT_EQ(FeatureEdges(quad).segments().size(), 4U) << "and not the diagonal";
  Scene box = Empty();
  AddBox(box, {0, 0, 0}, {1, 2, 3}, 0);
  const FeatureEdges edges(box);
  EXPECT_EQ(edges.segments().size(), 12U);
  EXPECT_NEAR(LengthOf(edges), 4 * (1 + 2 + 3), 1e-5);
}

// Quads that share corners by position alone are one surface, unless they differ in what stays on
// them, or a wall rises between them.
TEST(FeatureEdgesTest, OfNeighboursAreNoneUnlessTheyDiffer) {
  Scene scene = Empty();
  AddQuad(scene, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0);
  AddQuad(scene, {1, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0);
  EXPECT_EQ(FeatureEdges(scene).segments().size(), 6U);
  Scene mirror = Empty();
  AddMaterial(mirror, ConductorMaterial(Gray(0.2F), Gray(3), 0, 0));
  AddQuad(mirror, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0);
  AddQuad(mirror, {1, 0, 0}, {1, 0, 0}, {0, 1, 0}, 1);
  EXPECT_EQ(FeatureEdges(mirror).segments().size(), 7U);
  AddQuad(scene, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 0);
  EXPECT_EQ(FeatureEdges(scene).segments().size(), 10U) << "a thin wall";
  // The same twice over has no more edges.
  Scene twice = Empty();
  for (int i = 0; i < 2; ++i) {
    AddQuad(twice, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0);
    AddQuad(twice, {1, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0);
  }
  // Sides that end in one direction, twice, are ends still.
  EXPECT_EQ(FeatureEdges(twice).segments().size(), 6U);
}

TEST(FeatureEdgesTest, OfABendDependOnItsAngle) {
  for (const double degrees : {0.0, 20.0, 44.0, 45.0, 90.0, 179.9}) {
    const double turn = degrees * std::numbers::pi / 180;
    Scene scene = Empty();
    AddQuad(scene, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0);
    AddQuad(scene, {1, 0, 0},
            {static_cast<float>(std::cos(turn)), 0, static_cast<float>(std::sin(turn))}, {0, 1, 0},
            0);
    EXPECT_EQ(FeatureEdges(scene).segments().size(), degrees < 45 ? 6U : 7U) << degrees;
  }
}

TEST(FeatureEdgesTest, OfADiskAreItsRims) {
  Scene scene = Empty();
  AddDisk(scene, {1, 2, 3}, Normalize({1, 1, 1}), 2, 0);
  EXPECT_NEAR(LengthOf(FeatureEdges(scene)), 4 * std::numbers::pi, 1e-3);
  scene.disks[0].inner_radius = 1;
  EXPECT_NEAR(LengthOf(FeatureEdges(scene)), 6 * std::numbers::pi, 1e-3);
}

std::vector<FeatureSegment> CrossingsOf(const Scene& scene) {
  return SurfaceCrossings(scene, WeldMeshes(scene.meshes));
}

// A box that is sunk into the floor meets it in a square; one that stands on it does not.
TEST(FeatureEdgesTest, AreWhereSurfacesPassThroughEachOther) {
  const auto crossings = [](float bottom, float size) {
    Scene scene = Empty();
    AddQuad(scene, {-4 * size, -5 * size, 0}, {8 * size, 0, 0}, {0, 9 * size, 0}, 0);
    AddBox(scene, {0, 0, bottom * size}, {size, 2 * size, 3 * size}, 0);
    const std::vector<FeatureSegment> segments = CrossingsOf(scene);
    double length = 0;
    for (const FeatureSegment& segment : segments) {
      for (const Vec3 end : segment.ends)
        EXPECT_NEAR(end.z / size, 0, 1e-6);
      length += static_cast<double>(Length(segment.ends[1] - segment.ends[0]) / size);
    }
    return length;
  };
  for (const float size : {1e-6F, 1.0F, 1e6F}) {
    EXPECT_NEAR(crossings(-0.5F, size), 6, 1e-4) << size;
    EXPECT_EQ(crossings(0.5F, size), 0) << size;
    EXPECT_EQ(crossings(0, size), 0) << size;
  }
}

// Most triangles of the floor are alone.
TEST(FeatureEdgesTest, AreWhereABoxIsSunkIntoAFloorOfManyTriangles) {
  constexpr int kSquares = 64;
  constexpr float kSide = 8.0F / kSquares;
  const auto crossing_length = [](float bottom) {
    Scene scene = Empty();
    TriangleMesh& floor = scene.meshes.emplace_back();
    for (int j = 0; j <= kSquares; ++j) {
      for (int i = 0; i <= kSquares; ++i) {
        floor.positions.push_back(
            {-4.01F + kSide * static_cast<float>(i), -4.02F + kSide * static_cast<float>(j), 0});
      }
    }
    for (std::uint32_t j = 0; j < kSquares; ++j) {
      for (std::uint32_t i = 0; i < kSquares; ++i) {
        const std::uint32_t at = j * (kSquares + 1) + i;
        for (const std::uint32_t corner :
             {at, at + 1, at + kSquares + 1, at + 1, at + kSquares + 2, at + kSquares + 1})
          floor.indices.push_back(corner);
      }
    }
    AddBox(scene, {0, 0, bottom}, {1, 2, 3}, 0);
    double length = 0;
    for (const FeatureSegment& segment : CrossingsOf(scene))
      length += static_cast<double>(Length(segment.ends[1] - segment.ends[0]));
    return length;
  };
  EXPECT_NEAR(crossing_length(-0.5F), 6, 1e-4);
  EXPECT_EQ(crossing_length(0.5F), 0);
}

TEST(FeatureEdgesTest, AreTheCirclesOfSunkenBalls) {
  Scene scene = Empty();
  AddQuad(scene, {-4, -5, 0}, {8, 0, 0}, {0, 9, 0}, 0);
  AddSphere(scene, {0.3F, 0, 0.6F}, 1, 0);
  double length = 0;
  for (const FeatureSegment& segment : CrossingsOf(scene)) {
    for (const Vec3 end : segment.ends) {
      // Around the circle, never inside.
      const double radius =
          std::hypot(static_cast<double>(end.x) - 0.3, static_cast<double>(end.y));
      EXPECT_GT(radius, 0.8 - 1e-6);
      EXPECT_LT(radius, 0.8 * (1 + 1e-4));
    }
    length += static_cast<double>(Length(segment.ends[1] - segment.ends[0]));
  }
  EXPECT_NEAR(length, 2 * std::numbers::pi * 0.8, 1e-3);
  scene.spheres[0].center.z = 1;
  EXPECT_TRUE(CrossingsOf(scene).empty()) << "it lies on the floor";
  Scene disk = Empty();
  AddDisk(disk, {0, 0, 0}, {0, 0, 1}, 3, 0);
  AddSphere(disk, {0.3F, 0, 0.6F}, 1, 0);
  EXPECT_EQ(CrossingsOf(disk).size(), 256U);
  AddQuad(disk, {-1, -1, -1}, {0, 2, 0}, {0, 0, 2}, 0);
  EXPECT_EQ(CrossingsOf(disk).size(), 256U + 2U) << "the two triangles of a wall";
}

// Two blades that turn about each other cross where both planes meet.
TEST(FeatureEdgesTest, OfCrossingTrianglesLieInBoth) {
  KeyedRng rng(5);
  const auto point = [&] {
    const float x = rng.Uniform();
    const float y = rng.Uniform();
    const float z = rng.Uniform();
    return Vec3{x, y, z};
  };
  int crossed = 0;
  for (int trial = 0; trial < 300; ++trial) {
    Scene scene = Empty();
    std::array<Vec3, 6> corners;
    for (Vec3& corner : corners)
      corner = point();
    for (const std::size_t first : {0U, 3U}) {
      TriangleMesh mesh;
      mesh.positions = {corners[first], corners[first + 1], corners[first + 2]};
      mesh.indices = {0, 1, 2};
      mesh.traits.material = 0;
      scene.meshes.push_back(mesh);
    }
    // The oracle: a side of one passes through the other.
    const auto passes = [&](std::size_t t, Vec3 from, Vec3 to) {
      const Vec3 n = Cross(corners[t + 1] - corners[t], corners[t + 2] - corners[t]);
      const float a = Dot(from - corners[t], n);
      const float b = Dot(to - corners[t], n);
      if ((a > 0) == (b > 0)) return false;
      const Vec3 p = from + (to - from) * (a / (a - b));
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3 corner = corners[t + k];
        if (Dot(Cross(corners[t + (k + 1) % 3] - corner, p - corner), n) < 0) return false;
      }
      return true;
    };
    int sides = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      sides += passes(0, corners[3 + k], corners[3 + (k + 1) % 3]) ? 1 : 0;
      sides += passes(3, corners[k], corners[(k + 1) % 3]) ? 1 : 0;
    }
    const std::vector<FeatureSegment> segments = CrossingsOf(scene);
    EXPECT_EQ(segments.size(), sides == 2 ? 1U : 0U) << trial;
    crossed += sides == 2 ? 1 : 0;
  }
  EXPECT_GT(crossed, 30);
}

TEST(FeatureEdgesTest, AreFoundWhereTheyAre) {
  KeyedRng rng(9);
  std::vector<FeatureSegment> segments;
  for (int i = 0; i < 300; ++i) {
    const auto at = [&](float size) {
      const float x = rng.Uniform();
      const float y = rng.Uniform();
      const float z = rng.Uniform();
      return Vec3{size * x, 3 * size * y, 0.1F * size * z};
    };
    const Vec3 a = at(10);
    segments.push_back({{a, i % 5 == 0 ? at(10) : a + at(0.1F)}});
  }
  const FeatureEdges edges(segments);
  ASSERT_EQ(edges.segments().size(), segments.size());
  int found_any = 0;
  for (int i = 0; i < 3000; ++i) {
    const float x = rng.Uniform();
    const float y = rng.Uniform();
    const Vec3 center = {12 * x - 1, 34 * y - 2, 0.5F};
    const float reach = std::pow(10.0F, -3 + 4 * rng.Uniform());
    const float turn = 6.3F * rng.Uniform();
    const Vec3 normal = Normalize({std::cos(turn), std::sin(turn), rng.Uniform()});
    const float height = i % 3 == 0 ? HUGE_VALF : reach * rng.Uniform();
    std::multiset<const FeatureSegment*> found;
    edges.ForEachNear({center, normal, reach, height}, [&](const FeatureSegment& segment) {
      found.insert(&segment);
      return true;
    });
    bool any_in_reach = false;
    for (const FeatureSegment& segment : edges.segments()) {
      const Vec3 a = segment.ends[0];
      const Vec3 along = segment.ends[1] - a;
      const float t = std::clamp(Dot(center - a, along) / LengthSquared(along), 0.0F, 1.0F);
      const float distance = Length(a + along * t - center);
      const float low = Dot(a - center, normal);
      const float high = low + Dot(along, normal);
      // Of both sides of the plane, or how far off it the nearer end is.
      const float off = low * high <= 0 ? 0 : std::min(std::abs(low), std::abs(high));
      const float slack = 1e-4F * (reach + 1e-2F);
      any_in_reach |= distance < reach - slack;
      // Those at the very end are found or not.
      if (distance < reach - slack && off < height - slack) {
        EXPECT_EQ(found.count(&segment), 1U);
        ++found_any;
      } else if (distance > reach + slack || off > height + slack) {
        EXPECT_EQ(found.count(&segment), 0U);
      }
    }
    EXPECT_TRUE(!any_in_reach || edges.HasNear(center, reach));
  }
  EXPECT_GT(found_any, 1000);
  // A visit that returns false is the last.
  int visited = 0;
  edges.ForEachNear({{5, 15, 0.5F}, {0, 0, 1}, 40, HUGE_VALF},
                    [&](const FeatureSegment&) { return ++visited < 7; });
  EXPECT_EQ(visited, 7);
}

// A scene of another size has the same edges near its discs.
TEST(FeatureEdgesTest, AreFoundAtAnySize) {
  std::vector<std::size_t> counts;
  for (const float size : {1.0F, 0x1p-40F, 0x1p40F}) {
    KeyedRng rng(21);
    std::vector<FeatureSegment> segments;
    for (int i = 0; i < 100; ++i) {
      const auto at = [&] {
        const float x = rng.Uniform();
        const float y = rng.Uniform();
        return Vec3{size * x, size * y, size * rng.Uniform()};
      };
      const Vec3 a = at();
      segments.push_back({{a, at()}});
    }
    std::size_t count = 0;
    const float half = 0.5F * size;
    FeatureEdges(segments).ForEachNear({{half, half, half}, {0, 0, 1}, half, 0.1F * size},
                                       [&](const FeatureSegment&) { return ++count > 0; });
    counts.push_back(count);
  }
  EXPECT_GT(counts[0], 20U);
  EXPECT_EQ(counts[1], counts[0]);
  EXPECT_EQ(counts[2], counts[0]);
}

}  // namespace
}  // namespace lucerna
