// A displaced mesh is split evenly on both sides of its edges and lies where its heights put it.
#include "render/formats/displaced_mesh.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

#include "render/math/double3.h"
#include "tests/support/pbrt_text.h"

namespace lucerna {
namespace {

using ::testing::HasSubstr;

constexpr std::size_t kMany = 1'000'000;

TriangleMesh Tetrahedron() {
  TriangleMesh mesh;
  mesh.positions = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
  mesh.indices = {0, 1, 2, 0, 3, 1, 0, 2, 3, 1, 3, 2};
  mesh.uvs.resize(4);
  return mesh;
}

double LongestEdge(const TriangleMesh& mesh, const Transform& to_world) {
  double longest = 0;
  for (std::size_t i = 0; i < mesh.indices.size(); ++i) {
    const std::size_t next = i % 3 == 2 ? i - 2 : i + 1;
    const Double3 a(to_world.Point(mesh.positions[mesh.indices[i]]));
    const Double3 b(to_world.Point(mesh.positions[mesh.indices[next]]));
    longest = std::max(longest, Length(b - a));
  }
  return longest;
}

TEST(DisplacedMeshTest, EdgesAreSplitInTheWorldAndTheSurfaceStaysClosed) {
  const Transform to_world = Transform::Scale(1, 3, 0.5);
  TriangleMesh mesh = Tetrahedron();
  ASSERT_TRUE(Displace(
                  0.2, to_world, kMany, [](Vec3, Vec2, Vec3) { return 0.0; }, mesh)
                  .ok());
  EXPECT_LE(LongestEdge(mesh, to_world), 0.2);
  EXPECT_GT(mesh.indices.size() / 3, 1000U);
  // Each edge belongs to two triangles, one for each way along it, and V - E + F is 2.
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (std::size_t i = 0; i < mesh.indices.size(); ++i)
    ++edges[{mesh.indices[i], mesh.indices[i % 3 == 2 ? i - 2 : i + 1]}];
  for (const auto& [edge, count] : edges) {
    ASSERT_EQ(count, 1);
    ASSERT_TRUE(edges.contains({edge.second, edge.first}));
  }
  EXPECT_EQ(mesh.positions.size() - edges.size() / 2 + mesh.indices.size() / 3, 2U);
}

// To the sphere around it: outward normals, and the sphere's area.
TEST(DisplacedMeshTest, VerticesMoveAlongTheirNormalsAndGetNewOnes) {
  TriangleMesh mesh = Tetrahedron();
  // Normals that all vertices between theirs keep: of a sphere, at the mean of two, to its middle.
  for (const Vec3 position : mesh.positions)
    mesh.normals.push_back(position / Length(position));
  ASSERT_TRUE(Displace(
                  0.05, Transform(), kMany,
                  [](Vec3 position, Vec2, Vec3 normal) {
                    // From `position` along `normal` to the sphere of radius 3.
                    const double along = Dot(Double3(position), Double3(normal));
                    const double squared = Dot(Double3(position), Double3(position));
                    return std::sqrt(along * along + 9 - squared) - along;
                  },
                  mesh)
                  .ok());
  double area = 0;
  for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
    const Double3 a(mesh.positions[mesh.indices[i]]);
    const Double3 b(mesh.positions[mesh.indices[i + 1]]);
    const Double3 c(mesh.positions[mesh.indices[i + 2]]);
    area += Length(Cross(b - a, c - a)) / 2;
  }
  const double sphere = 4 * std::acos(-1.0) * 9;
  EXPECT_NEAR(area / sphere, 1, 5e-3);  // chords of 0.1 to 0.3
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    EXPECT_NEAR(Length(mesh.positions[i]), 3, 1e-5);
    EXPECT_GT(Dot(mesh.positions[i], mesh.normals[i]), 2.9F);
  }
}

TEST(DisplacedMeshTest, WhatCannotBeDoneIsSaid) {
  TriangleMesh mesh = Tetrahedron();
  const auto flat = [](Vec3, Vec2, Vec3) { return 0.0; };
  EXPECT_EQ(Displace(1e-9, Transform(), 1000, flat, mesh).code(),
            absl::StatusCode::kResourceExhausted);
  mesh = Tetrahedron();
  EXPECT_EQ(Displace(
                1, Transform(), kMany, [](Vec3, Vec2, Vec3) { return 1e300; }, mesh)
                .code(),
            absl::StatusCode::kInvalidArgument);
}

// A square of 2 in z = 0 whose part beyond u = 1 / 1.9 a checkerboard raises by 0.25, seen in the
// world, where it is scaled by 10.
TEST(DisplacedMeshTest, PbrtFilesDisplaceTheirPlyMeshes) {
  const std::string header =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
      "property float z\n";
  const std::string uv = "property float u\nproperty float v\n";
  const std::string faces = "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  const std::map<std::string, std::string> files = {
      {"m.ply",
       header + uv + faces + "-1 -1 0 0 0\n1 -1 0 1 0\n1 1 0 1 1\n-1 1 0 0 1\n4 0 1 2 3\n"},
      {"bare.ply", header + faces + "-1 -1 0\n1 -1 0\n1 1 0\n-1 1 0\n4 0 1 2 3\n"}};
  const std::string steps =
      "Texture \"steps\" \"float\" \"checkerboard\" \"float uscale\" 1.9 \"float vscale\" 0.5 "
      "\"float tex1\" 0 \"float tex2\" 0.25 Scale 10 10 10 ";
  const auto shape = [&](const std::string& file, const std::string& parameters) {
    return steps + "Shape \"plymesh\" \"string filename\" \"" + file + "\" " + parameters;
  };
  const Scene scene = ReadWorld(
      shape("m.ply", "\"texture displacement\" \"steps\" \"float edgelength\" 0.5"), files);
  ASSERT_EQ(scene.meshes.size(), 1U);
  const TriangleMesh& mesh = scene.meshes[0];
  EXPECT_LE(LongestEdge(mesh, Transform()), std::hypot(0.5, 2.5) + 1e-4);
  std::size_t raised = 0;
  for (const Vec3& position : mesh.positions) {
    EXPECT_NEAR(position.z, position.x < 0.526F ? 0 : 2.5, 1e-4) << position.x;
    raised += position.z > 1 ? 1 : 0;
  }
  EXPECT_GT(raised, 1000U);
  EXPECT_LT(raised, mesh.positions.size());
  const Scene even =
      ReadWorld(shape("m.ply", "\"float displacement\" 0.5 \"float edgelength\" 100"), files);
  ASSERT_EQ(even.meshes.at(0).positions.size(), 4U);
  EXPECT_EQ(even.meshes[0].positions[2], (Vec3{10, 10, 5}));

  SceneLimits limits;
  limits.max_shape_bytes = 1 << 20;
  const auto said = [&](const std::string& world) {
    return SaidOfPbrt("Camera \"perspective\" WorldBegin " + world, files, limits);
  };
  EXPECT_THAT(said(shape("bare.ply", "\"texture displacement\" \"steps\"")),
              HasSubstr("error: \"displacement\" of Shape \"plymesh\" needs a mesh with texture"));
  EXPECT_THAT(said(shape("m.ply", "\"texture displacement\" \"none\"")), HasSubstr("\"none\""));
  EXPECT_THAT(said(shape("m.ply", "\"texture displacement\" \"steps\" \"float edgelength\" 1e-6")),
              HasSubstr("splits it into more than 4096 triangles"));
}

}  // namespace
}  // namespace lucerna
