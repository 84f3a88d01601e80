// The edges that border on the light of a segment, and no others, at their exact distances. The
// oracle has no hierarchies, wings or welding: it tests the segment against every pair
// of triangles.
#include "render/geometry/silhouette.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "gtest/gtest.h"

#include "render/base/parallel.h"
#include "render/math/rng.h"
#include "render/math/warp.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

std::unique_ptr<SilhouetteEdges> EdgesOf(const Scene& scene, float reach) {
  return SilhouetteEdges::Create(scene, reach).value();
}

// From one point to another.
NearbyEdges Between(const SilhouetteEdges& edges, Vec3 from, Vec3 to) {
  return edges.Find(from, Normalize(to - from), Length(to - from));
}

TEST(SilhouetteEdgesTest, OfABoxIsTheEdgeThatTheSegmentPasses) {
  Scene scene;
  AddBox(scene, {0, 0, 0}, {1, 1, 1}, 0);
  const auto edges = EdgesOf(scene, 0.5F);
  EXPECT_EQ(edges->edge_count(), 12U);  // no diagonals
  // Past the edge x = z = 1, at 45 degrees.
  const NearbyEdges passed = Between(*edges, {3, 0.5F, -0.8F}, {-1, 0.5F, 3.2F});
  ASSERT_EQ(passed.all().size(), 1U);
  EXPECT_NEAR(passed.all()[0].distance_across, 0.2 / std::numbers::sqrt2, 1e-6);
  EXPECT_NEAR(passed.all()[0].distance_along, 1.9 * std::numbers::sqrt2, 1e-6);
  // Farther than the reach.
  EXPECT_TRUE(Between(*edges, {4, 0.5F, -0.8F}, {0, 0.5F, 3.2F}).all().empty());
}

TEST(SilhouetteEdgesTest, OfABoxLitStraightAlongItsWallAreBothEnds) {
  Scene scene;
  AddBox(scene, {0, 0, 0}, {1, 1, 1}, 0);
  const auto edges = EdgesOf(scene, 0.5F);
  const NearbyEdges passed = edges->Find({1.25F, 0.5F, 3}, {0, 0, -1}, 8);
  ASSERT_EQ(passed.all().size(), 2U);
  for (int i = 0; i < 2; ++i) {
    EXPECT_FLOAT_EQ(passed.all()[i].distance_across, 0.25F);
    EXPECT_FLOAT_EQ(passed.all()[i].distance_along, i == 0 ? 2.0F : 3.0F);
  }
}

TEST(SilhouetteEdgesTest, OfARoomSeenFromInsideAreNone) {
  Scene scene;
  AddBox(scene, {0, 0, 0}, {1, 1, 1}, 0);
  const auto edges = EdgesOf(scene, 0.5F);
  KeyedRng rng(3);
  for (int i = 0; i < 1000; ++i) {
    const auto inside = [&] { return 0.01F + 0.98F * rng.Uniform(); };
    const Vec3 from = {inside(), inside(), inside()};
    const Vec3 to = {inside(), inside(), inside()};
    ASSERT_TRUE(Between(*edges, from, to).all().empty());
  }
}

TEST(SilhouetteEdgesTest, OfAQuadAreItsFourOpenEdgesFromOutside) {
  Scene scene;
  AddQuad(scene, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0);
  const auto edges = EdgesOf(scene, 0.3F);
  EXPECT_EQ(edges->edge_count(), 4U);  // no diagonal
  for (const Vec3 outside :
       {Vec3{-0.1F, 0.4F, 0}, Vec3{1.1F, 0.4F, 0}, Vec3{0.4F, -0.1F, 0}, Vec3{0.4F, 1.1F, 0}}) {
    for (const float side : {1.0F, -1.0F}) {
      const NearbyEdges passed = edges->Find(outside + Vec3{0, 0, side}, {0, 0, -side}, 2);
      ASSERT_EQ(passed.all().size(), 1U);
      EXPECT_NEAR(passed.all()[0].distance_across, 0.1, 1e-6);
      EXPECT_NEAR(passed.all()[0].distance_along, 1, 1e-6);
    }
  }
  // Beyond a corner both edges are nearest at the same place; it counts once.
  const NearbyEdges corner = edges->Find({-0.03F, -0.04F, 1}, {0, 0, -1}, 2);
  ASSERT_EQ(corner.all().size(), 1U);
  EXPECT_NEAR(corner.all()[0].distance_across, 0.05, 1e-6);
  // What lands on the quad or leaves it, or would go through it, does not border on its rim.
  EXPECT_TRUE(Between(*edges, {0.05F, 0.4F, 0.0001F}, {-1, 0.4F, 1}).all().empty());
  EXPECT_TRUE(Between(*edges, {-1, 0.4F, 1}, {0.05F, 0.4F, 0.0001F}).all().empty());
  EXPECT_TRUE(edges->Find({0.05F, 0.4F, 1}, {0, 0, -1}, 2).all().empty());
}

TEST(SilhouetteEdgesTest, MeetAcrossMeshesAndRepeatedVertices) {
  // A plane of two quads, each a mesh of its own, and the same twice over.
  Scene scene;
  for (int times = 0; times < 2; ++times) {
    AddQuad(scene, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0);
    AddQuad(scene, {1, 0, -0.0F}, {1, 0, 0}, {0, 1, 0}, 0);
    EXPECT_EQ(EdgesOf(scene, 0.1F)->edge_count(), 6U);
  }
  // With a wall that stands on the seam: its foot is hidden by the floor, its top is open.
  AddQuad(scene, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 0);
  EXPECT_EQ(EdgesOf(scene, 0.1F)->edge_count(), 9U);
}

TEST(SilhouetteEdgesTest, TurnOfFewerThanATenthOfADegreeIsNone) {
  for (const float turn : {0.001F, 0.003F, -0.001F, -0.003F}) {
    Scene scene;
    AddQuad(scene, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0);
    AddQuad(scene, {1, 0, 0}, {std::cos(turn), 0, std::sin(turn)}, {0, 1, 0}, 0);
    EXPECT_EQ(EdgesOf(scene, 0.1F)->edge_count(), std::abs(turn) > 0.002F ? 7U : 6U) << turn;
  }
}

TEST(SilhouetteEdgesTest, OfASphereAreExact) {
  Scene scene;
  AddSphere(scene, {1, 2, 3}, 0.5F, 0);
  const auto edges = EdgesOf(scene, 0.25F);
  KeyedRng rng(5);
  for (int i = 0; i < 1000; ++i) {
    const Frame frame(SquareToSphere(rng.Uniform(), rng.Uniform()));
    const float across = rng.Uniform() * 0.4F;
    const float before = 0.5F + 3 * rng.Uniform();
    const float after = 0.5F + 3 * rng.Uniform();
    const Vec3 beside = Vec3{1, 2, 3} + frame.s * (0.5F + across);
    const NearbyEdges passed = edges->Find(beside - frame.n * before, frame.n, before + after);
    if (std::abs(across - 0.25F) < 1e-5F || across < 1e-5F) continue;
    ASSERT_EQ(passed.all().size(), across < 0.25F ? 1U : 0U) << across;
    if (passed.all().empty()) continue;
    EXPECT_NEAR(passed.all()[0].distance_across, across, 2e-6);
    EXPECT_NEAR(passed.all()[0].distance_along, before, 2e-6);
  }
  // One that starts on the sphere, or ends there, does not graze it.
  EXPECT_TRUE(Between(*edges, {1, 2, 3.5F}, {1, 4, 4}).all().empty());
  EXPECT_TRUE(Between(*edges, {1, 4, 4}, {1, 2, 3.5F}).all().empty());
}

TEST(SilhouetteEdgesTest, OfADiskAreItsRims) {
  Scene scene;
  AddDisk(scene, {0, 0, 1}, {0, 0, 1}, 2, 0);
  scene.disks[0].inner_radius = 1;
  const auto edges = EdgesOf(scene, 0.5F);
  EXPECT_EQ(edges->edge_count(), 2U * kRimSides);
  for (int i = 0; i < 500; ++i) {
    const double angle = 0.02 * i;
    for (const double radius : {0.75, 0.999, 1.001, 1.5, 1.999, 2.001, 2.25}) {
      const Vec3 from = {static_cast<float>(radius * std::cos(angle)),
                         static_cast<float>(radius * std::sin(angle)), 3};
      const NearbyEdges passed = edges->Find(from, {0, 0, -1}, 5);
      if (radius > 1 && radius < 2) {
        ASSERT_TRUE(passed.all().empty());
        continue;
      }
      ASSERT_EQ(passed.all().size(), 1U) << radius << " " << angle;
      const double expected = radius < 1 ? 1 - radius : radius - 2;
      EXPECT_NEAR(passed.all()[0].distance_across, expected, 2 * 1.6e-4);
      EXPECT_NEAR(passed.all()[0].distance_along, 2, 1e-6);
    }
  }
}

TEST(SilhouetteEdgesTest, NearTheEndsOfTheSegmentIsContact) {
  Scene scene;
  AddQuad(scene, {-10, 0, 0}, {20, 0, 0}, {0, 1, 0}, 0);  // the edge y = z = 0
  const auto edges = EdgesOf(scene, 0.5F);
  const auto count = [&](float before, float after) {
    return edges->Find({0, -0.1F, before}, {0, 0, -1}, before + after).all().size();
  };
  EXPECT_EQ(count(1, 1), 1U);
  EXPECT_EQ(count(0.0012F, 1), 1U);
  EXPECT_EQ(count(0.0008F, 1), 0U);
  EXPECT_EQ(count(1, 0.0012F), 1U);
  EXPECT_EQ(count(1, 0.0008F), 0U);
}

// --- The oracle.

struct P3 {
  long double x, y, z;
};
P3 ToP3(Vec3 v) {
  return {v.x, v.y, v.z};
}
P3 operator-(P3 a, P3 b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
P3 operator+(P3 a, P3 b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
P3 operator*(P3 a, long double s) {
  return {a.x * s, a.y * s, a.z * s};
}
long double Dot(P3 a, P3 b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
P3 Cross(P3 a, P3 b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

struct Expected {
  long double along, across;
  Vec3 ends[2];
  int nearest_end;
  bool is_border;
};

// Everything that borders on the segment; false when one is so close to a limit that either
// answer is right.
bool Oracle(const std::vector<std::array<Vec3, 3>>& triangles, const Scene& scene, Vec3 from,
            Vec3 towards, float length, float reach, std::vector<Expected>& expected) {
  const P3 o = ToP3(from);
  const P3 w = ToP3(towards);
  const auto clear = [](long double a, long double b) { return std::abs(a - b) > 2e-5L; };
  std::vector<Expected> all;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    for (std::size_t side = 0; side < 3; ++side) {
      const Vec3 a = triangles[i][side];
      const Vec3 b = triangles[i][(side + 1) % 3];
      // All triangles on the same edge; the first of them answers for it.
      std::vector<P3> third = {ToP3(triangles[i][(side + 2) % 3])};
      bool is_first = true;
      for (std::size_t j = 0; j < triangles.size(); ++j) {
        for (std::size_t k = 0; k < 3 && j != i; ++k) {
          const Vec3 c = triangles[j][k];
          const Vec3 d = triangles[j][(k + 1) % 3];
          if (!((c == a && d == b) || (c == b && d == a))) continue;
          is_first = is_first && i < j;
          third.push_back(ToP3(triangles[j][(k + 2) % 3]));
        }
      }
      if (!is_first) continue;
      // The distance from the edge to the segment is convex along the edge.
      const P3 p = ToP3(a);
      const P3 e = ToP3(b) - p;
      const auto nearest_t = [&](long double u) {
        return std::clamp(Dot(p + e * u - o, w), 0.0L, static_cast<long double>(length));
      };
      const auto apart = [&](long double u) {
        const P3 m = o + w * nearest_t(u) - (p + e * u);
        return std::sqrt(Dot(m, m));
      };
      long double low = 0;
      long double high = 1;
      for (int step = 0; step < 70; ++step) {
        const long double one = low + (high - low) / 3;
        const long double two = high - (high - low) / 3;
        (apart(one) < apart(two) ? high : low) = apart(one) < apart(two) ? two : one;
      }
      const long double u = (low + high) / 2;
      const long double t = nearest_t(u);
      const long double across = apart(u);
      if (!clear(across, reach) || !clear(t / length, 1e-3L) || !clear(t / length, 0.999L)) {
        if (across < reach + 1e-4L) return false;
      }
      if (across >= reach || t < 1e-3L * length || t > 0.999L * length) continue;
      // Seen along the segment: do all faces lie on one side, and the segment on the other?
      const P3 normal = Cross(e, w);
      const long double scale = std::sqrt(Dot(normal, normal));
      const long double passing = Dot(o - p, normal) / scale;
      std::size_t alone = 0;
      for (const P3& corner : third) {
        const long double where = Dot(corner - p, normal) / scale;
        if (!clear(where, 0) || !clear(passing, 0)) return false;
        if (where * passing < 0) ++alone;
      }
      if (alone != 0 && alone != third.size()) continue;
      const bool at_end = u < 1e-7L || u > 1 - 1e-7L;
      if (!at_end && (u < 1e-4L || u > 1 - 1e-4L)) return false;
      all.push_back({t, across, {a, b}, !at_end ? -1 : u < 0.5L ? 0 : 1, alone > 0});
    }
  }
  // Of edges that share the place they are nearest at, the nearest.
  for (const Expected& one : all) {
    bool is_continued = false;
    for (const Expected& other : all) {
      const bool is_nearer = other.across < one.across - 1e-9L ||
                             (other.across < one.across + 1e-9L &&
                              (other.is_border != one.is_border ? other.is_border : &other < &one));
      for (int k = 0; k < 4 && is_nearer; ++k) {
        if (!(other.ends[k % 2] == one.ends[k / 2])) continue;
        const P3 back = ToP3(one.ends[1 - k / 2]) - ToP3(one.ends[k / 2]);
        const P3 on = ToP3(other.ends[1 - k % 2]) - ToP3(other.ends[k % 2]);
        const long double turn =
            std::acos(-Dot(back, on) / std::sqrt(Dot(back, back) * Dot(on, on)));
        is_continued = is_continued || k / 2 == one.nearest_end ||
                       turn < 30 * std::numbers::pi_v<long double> / 180;
      }
    }
    if (one.is_border && !is_continued) expected.push_back(one);
  }
  for (const Sphere& sphere : scene.spheres) {
    const P3 to_center = ToP3(sphere.center) - o;
    const long double t = Dot(to_center, w);
    const P3 m = to_center - w * t;
    const long double across = std::sqrt(Dot(m, m)) - sphere.radius;
    if (!clear(across, 0) || !clear(across, reach) || !clear(t / length, 1e-3L) ||
        !clear(t / length, 0.999L)) {
      return false;
    }
    if (across < 0 || across > reach || t < 1e-3L * length || t > 0.999L * length) continue;
    expected.push_back({t, across, {}, -1, true});
  }
  return true;
}

// Tetrahedra, fans of triangles around one edge, strips and single triangles, with and without
// shared indices.
Scene RandomScene(KeyedRng& rng) {
  Scene scene;
  const auto point = [&] {
    const float x = rng.Uniform();
    const float y = rng.Uniform();
    const float z = rng.Uniform();
    return Vec3{x, y, z};
  };
  for (int shape = 0; shape < 10; ++shape) {
    TriangleMesh mesh;
    const Vec3 place = point();
    for (int i = 0; i < 6; ++i)
      mesh.positions.push_back(place + point() * 0.4F);
    switch (shape % 4) {
      case 0:
        mesh.indices = {0, 1, 2, 0, 3, 1, 1, 3, 2, 2, 3, 0};
        break;
      case 1:
        mesh.indices = {0, 1, 2, 0, 1, 3, 1, 0, 4};
        break;
      case 2:
        mesh.indices = {0, 1, 2, 2, 1, 3, 2, 3, 4, 4, 3, 5};
        break;
      default:
        mesh.indices = {0, 1, 2};
    }
    if (rng.Uniform() < 0.5F) {
      TriangleMesh soup;
      for (const std::uint32_t index : mesh.indices) {
        soup.indices.push_back(static_cast<std::uint32_t>(soup.positions.size()));
        soup.positions.push_back(mesh.positions[index]);
      }
      mesh = soup;
    }
    scene.meshes.push_back(mesh);
  }
  AddSphere(scene, point(), 0.2F * rng.Uniform() + 0.01F, 0);
  AddSphere(scene, point(), 0.2F * rng.Uniform() + 0.01F, 0);
  return scene;
}

TEST(SilhouetteEdgesTest, AreThoseOfBruteForce) {
  KeyedRng rng(11);
  int compared = 0;
  int found = 0;
  for (int round = 0; round < 100; ++round) {
    const Scene scene = RandomScene(rng);
    std::vector<std::array<Vec3, 3>> triangles;
    for (const TriangleMesh& mesh : scene.meshes) {
      for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
        triangles.push_back({mesh.positions[mesh.indices[i]], mesh.positions[mesh.indices[i + 1]],
                             mesh.positions[mesh.indices[i + 2]]});
      }
    }
    const float reach = 0.05F + 0.2F * rng.Uniform();
    const auto edges = EdgesOf(scene, reach);
    for (int i = 0; i < 40; ++i) {
      const Vec3 direction = SquareToSphere(rng.Uniform(), rng.Uniform());
      const float length = 0.3F + 2 * rng.Uniform();
      const Vec3 from = Vec3{rng.Uniform(), rng.Uniform(), rng.Uniform()} * 1.4F -
                        direction * (length * rng.Uniform());
      std::vector<Expected> expected;
      if (!Oracle(triangles, scene, from, direction, length, reach, expected)) continue;
      if (expected.size() > NearbyEdges::kCapacity) continue;
      std::sort(expected.begin(), expected.end(),
                [](const Expected& a, const Expected& b) { return a.along < b.along; });
      const NearbyEdges passed = edges->Find(from, direction, length);
      ++compared;
      ASSERT_EQ(passed.all().size(), expected.size()) << round << " " << i;
      for (std::size_t k = 0; k < expected.size(); ++k) {
        ++found;
        ASSERT_NEAR(passed.all()[k].distance_along, static_cast<double>(expected[k].along), 1e-5);
        ASSERT_NEAR(passed.all()[k].distance_across, static_cast<double>(expected[k].across), 1e-5);
      }
    }
  }
  EXPECT_GT(compared, 1500);
  EXPECT_GT(found, 2500);
}

TEST(SilhouetteEdgesTest, GivesTheNearestWhenThereAreTooMany) {
  // Blades of which each has its tip beside the segment, the farther the later.
  Scene scene;
  for (int i = 0; i < 160; ++i) {
    const float z = static_cast<float>((i * 37) % 160);
    const float gap = 0.1F + 0.005F * static_cast<float>(i);
    AddQuad(scene, {gap, -1, z}, {1, 0, 0.1F}, {0, 2, 0}, 0);
  }
  const auto edges = EdgesOf(scene, 1);
  const NearbyEdges passed = edges->Find({0, 0, -1}, {0, 0, 1}, 170);
  ASSERT_EQ(passed.all().size(), NearbyEdges::kCapacity);
  float before = 0;
  for (const NearbyEdge& edge : passed.all()) {
    EXPECT_LT(edge.distance_across, 0.1F + 0.005F * 15.5F);
    EXPECT_GE(edge.distance_along, before);
    before = edge.distance_along;
  }
}

TEST(SilhouetteEdgesTest, AreTheSameInEveryThreadAndEveryBuild) {
  KeyedRng rng(23);
  const Scene scene = RandomScene(rng);
  const auto one = EdgesOf(scene, 0.3F);
  const auto other = EdgesOf(scene, 0.3F);
  const auto search = [](const SilhouetteEdges& edges, std::size_t i) {
    KeyedRng own(i);
    const Vec3 direction = SquareToSphere(own.Uniform(), own.Uniform());
    return edges.Find(Vec3{0.7F, 0.7F, 0.7F} - direction, direction, 2);
  };
  ThreadTeam team(2);
  std::vector<int> differs(2000, 0);
  team.For(differs.size(), 10, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const NearbyEdges a = search(*one, i);
      const NearbyEdges b = search(*other, i);
      const bool is_equal = std::equal(a.all().begin(), a.all().end(), b.all().begin(),
                                       b.all().end(), [](const NearbyEdge& x, const NearbyEdge& y) {
                                         return x.distance_along == y.distance_along &&
                                                x.distance_across == y.distance_across &&
                                                x.edge == y.edge;
                                       });
      differs[i] = is_equal ? 0 : 1;
    }
  });
  EXPECT_EQ(std::count(differs.begin(), differs.end(), 1), 0);
}

TEST(SilhouetteEdgesTest, OfNothingAreNone) {
  const Scene scene;
  const auto edges = EdgesOf(scene, 1);
  EXPECT_EQ(edges->edge_count(), 0U);
  EXPECT_TRUE(edges->Find({0, 0, 0}, {0, 0, 1}, 1).all().empty());
}

}  // namespace
}  // namespace lucerna
