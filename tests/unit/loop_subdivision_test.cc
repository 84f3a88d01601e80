// A subdivision surface has its known limits: planes stay planes, a regular mesh is a box spline,
// and closed surfaces stay closed, with outward normals.
#include "render/formats/loop_subdivision.h"

#include <cmath>
#include <map>
#include <set>

#include "gtest/gtest.h"

#include "render/math/double3.h"

namespace lucerna {
namespace {

// A regular grid of triangles over [0, n]², at the height of `height`.
template <typename Height>
TriangleMesh Grid(int n, const Height& height) {
  TriangleMesh mesh;
  for (int y = 0; y <= n; ++y) {
    for (int x = 0; x <= n; ++x) {
      const auto fx = static_cast<float>(x);
      const auto fy = static_cast<float>(y);
      mesh.positions.push_back({fx, fy, height(fx, fy)});
    }
  }
  const auto at = [n](int x, int y) { return static_cast<std::uint32_t>(y * (n + 1) + x); };
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) {
      mesh.indices.insert(mesh.indices.end(), {at(x, y), at(x + 1, y), at(x + 1, y + 1)});
      mesh.indices.insert(mesh.indices.end(), {at(x, y), at(x + 1, y + 1), at(x, y + 1)});
    }
  }
  return mesh;
}

TriangleMesh Octahedron() {
  TriangleMesh mesh;
  mesh.positions = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  mesh.indices = {0, 2, 4, 2, 1, 4, 1, 3, 4, 3, 0, 4, 2, 0, 5, 1, 2, 5, 3, 1, 5, 0, 3, 5};
  return mesh;
}

TEST(LoopSubdivisionTest, APlaneStaysAPlaneWithItsNormal) {
  const TriangleMesh control = Grid(3, [](float, float) { return 0.0F; });
  const auto mesh = LoopSubdivide(control, 2);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(mesh->indices.size(), 16 * control.indices.size());
  for (std::size_t i = 0; i < mesh->positions.size(); ++i) {
    EXPECT_EQ(mesh->positions[i].z, 0);
    EXPECT_NEAR(mesh->normals[i].z, 1, 1e-6) << i;
  }
}

// On a regular mesh the limit is the box spline of three directions, which repeats x² + y² up to a
// constant: every direction's second difference is the same.
TEST(LoopSubdivisionTest, ARegularMeshRepeatsAParabola) {
  const auto parabola = [](float x, float y) { return x * x + y * y - x * y; };
  const TriangleMesh control = Grid(8, parabola);
  const auto mesh = LoopSubdivide(control, 2);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  double offset = NAN;
  int inner = 0;
  for (std::size_t i = 0; i < mesh->positions.size(); ++i) {
    const Vec3 p = mesh->positions[i];
    if (p.x < 2 || p.y < 2 || p.x > 6 || p.y > 6) continue;  // what a boundary reaches
    ++inner;
    const auto off = static_cast<double>(p.z - parabola(p.x, p.y));
    if (std::isnan(offset)) offset = off;
    EXPECT_NEAR(off, offset, 1e-5);
    const Vec3 gradient = {-(2 * p.x - p.y), -(2 * p.y - p.x), 1};
    EXPECT_LT(Length(mesh->normals[i] - Normalize(gradient)), 1e-5F) << p.x << " " << p.y;
  }
  EXPECT_GT(inner, 200);
}

TEST(LoopSubdivisionTest, AClosedSurfaceStaysClosedAndFacesOutward) {
  const auto mesh = LoopSubdivide(Octahedron(), 3);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (std::size_t i = 0; i < mesh->indices.size(); ++i) {
    const std::uint32_t next = mesh->indices[i - i % 3 + (i + 1) % 3];
    ++edges[{mesh->indices[i], next}];
  }
  for (const auto& [edge, count] : edges) {
    EXPECT_EQ(count, 1);
    EXPECT_TRUE(edges.contains({edge.second, edge.first}));
  }
  for (std::size_t i = 0; i < mesh->positions.size(); ++i) {
    EXPECT_GT(Dot(mesh->normals[i], mesh->positions[i]), 0.7F * Length(mesh->positions[i]));
    EXPECT_NEAR(Length(mesh->normals[i]), 1, 1e-6);
  }
  // By the symmetry of the octahedron.
  EXPECT_LT(Length(mesh->normals[4] - Vec3{0, 0, 1}), 1e-6F);
}

// Whether the limit is taken after two levels or three, a vertex of the control mesh ends in one
// place.
TEST(LoopSubdivisionTest, LimitsDoNotDependOnTheLevel) {
  TriangleMesh control = Grid(3, [](float x, float y) { return std::sin(x) * y; });
  const auto coarse = LoopSubdivide(control, 1);
  const auto fine = LoopSubdivide(control, 4);
  ASSERT_TRUE(coarse.ok() && fine.ok());
  for (std::size_t i = 0; i < control.positions.size(); ++i) {
    EXPECT_LT(Length(coarse->positions[i] - fine->positions[i]), 1e-5F) << i;
    EXPECT_LT(Length(coarse->normals[i] - fine->normals[i]), 1e-4F) << i;
  }
}

TEST(LoopSubdivisionTest, WhatIsNoSurfaceIsRefused) {
  TriangleMesh twisted = Octahedron();
  std::swap(twisted.indices[0], twisted.indices[1]);
  EXPECT_FALSE(LoopSubdivide(twisted, 1).ok());
  TriangleMesh bow = Octahedron();
  bow.indices = {0, 2, 4, 1, 3, 4};  // two triangles that share a corner
  EXPECT_FALSE(LoopSubdivide(bow, 1).ok());
  TriangleMesh needle = Octahedron();
  needle.indices = {0, 0, 4};
  EXPECT_FALSE(LoopSubdivide(needle, 1).ok());
}

}  // namespace
}  // namespace lucerna
