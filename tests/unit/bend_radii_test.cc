// A surface is bent as the round one is that it was made of, with vertex normals or without.
#include "render/geometry/bend_radii.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>

#include "gtest/gtest.h"

#include "render/math/warp.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

// Rows of a turned surface: at each of them its radius and height, and the slope of its normals.
struct Ring {
  double radius, z, normal_radius, normal_z;
};

// Of so many flat sides. Each side's corners are its own unless they are shared.
template <std::size_t kRings>
TriangleMesh Turned(const std::array<Ring, kRings>& rings, std::uint32_t sides, bool has_normals,
                    bool shares_corners = true) {
  TriangleMesh mesh;
  mesh.traits.material = 0;
  for (std::size_t r = 0; r + 1 < kRings; ++r) {
    for (std::uint32_t i = 0; i < sides; ++i) {
      const auto first = static_cast<std::uint32_t>(mesh.positions.size());
      for (const auto& [ring, side] : {std::pair(r, i), {r, i + 1}, {r + 1, i + 1}, {r + 1, i}}) {
        const double angle = 2 * kPi64 * (side % sides) / sides;
        const Ring& at = rings[ring];
        const auto turned = [&](double radius, double z) {
          return Vec3{static_cast<float>(radius * std::cos(angle)),
                      static_cast<float>(radius * std::sin(angle)), static_cast<float>(z)};
        };
        mesh.positions.push_back(turned(at.radius, at.z));
        if (has_normals) mesh.normals.push_back(turned(at.normal_radius, at.normal_z));
      }
      mesh.indices.insert(mesh.indices.end(),
                          {first, first + 1, first + 2, first, first + 2, first + 3});
    }
  }
  if (!shares_corners) return mesh;
  TriangleMesh shared;
  shared.traits = mesh.traits;
  for (const std::uint32_t index : mesh.indices) {
    std::uint32_t same = 0;
    while (same < shared.positions.size() && shared.positions[same] != mesh.positions[index])
      ++same;
    if (same == shared.positions.size()) {
      shared.positions.push_back(mesh.positions[index]);
      if (has_normals) shared.normals.push_back(mesh.normals[index]);
    }
    shared.indices.push_back(same);
  }
  return shared;
}

TriangleMesh Tube(double radius, std::uint32_t sides, bool has_normals,
                  bool shares_corners = true) {
  return Turned(std::array{Ring{radius, -5 * radius, 1, 0}, Ring{radius, 0, 1, 0},
                           Ring{radius, 5 * radius, 1, 0}},
                sides, has_normals, shares_corners);
}

TriangleMesh Ball(double radius, bool has_normals) {
  constexpr std::size_t kRows = 13;
  std::array<Ring, kRows> rings;
  for (std::size_t i = 0; i < kRows; ++i) {
    const double latitude = -1.2 + 2.4 * static_cast<double>(i) / (kRows - 1);
    rings[i] = {radius * std::cos(latitude), radius * std::sin(latitude), std::cos(latitude),
                std::sin(latitude)};
  }
  return Turned(rings, 24, has_normals);
}

Scene SceneOf(TriangleMesh mesh) {
  Scene scene;
  AddMaterial(scene, DiffuseMaterial(0.5F));
  scene.meshes.push_back(std::move(mesh));
  return scene;
}

SurfacePoint OnTriangle(std::uint32_t triangle) {
  SurfacePoint point;
  point.primitive = triangle;
  return point;
}

std::uint32_t Triangles(const Scene& scene) {
  return static_cast<std::uint32_t>(scene.meshes[0].indices.size() / 3);
}

TEST(BendRadiiTest, OfAMeshAreThoseOfTheRoundSurface) {
  for (const double radius : {0.25, 0x1p-40, 0x1p40}) {
    SCOPED_TRACE(radius);
    for (const Scene& scene : {SceneOf(Tube(radius, 16, true)), SceneOf(Ball(radius, true))}) {
      const BendRadii bends(scene);
      for (std::uint32_t i = 0; i < Triangles(scene); ++i)
        ASSERT_NEAR(bends.At(OnTriangle(i)) / radius, 1, 1e-5);
    }
  }
}

// Facets have the normals that the round surface has, by symmetry on a tube.
TEST(BendRadiiTest, OfFacetsAreThoseOfTheRoundSurface) {
  for (const double radius : {0.25, 0x1p-40, 0x1p40}) {
    SCOPED_TRACE(radius);
    for (const std::uint32_t sides : {9U, 12U, 40U}) {
      for (const bool shares_corners : {true, false}) {
        SCOPED_TRACE(sides);
        const Scene tube = SceneOf(Tube(radius, sides, false, shares_corners));
        const BendRadii bends(tube);
        for (std::uint32_t i = 0; i < Triangles(tube); ++i)
          ASSERT_NEAR(bends.At(OnTriangle(i)) / radius, 1, 1e-4);
      }
    }
    // Beside the rims of a ball's middle normals lean to the one side where there are facets.
    const Scene ball = SceneOf(Ball(radius, false));
    const BendRadii bends(ball);
    for (std::uint32_t i = 4 * 24; i < Triangles(ball) - 4 * 24; ++i)
      ASSERT_NEAR(bends.At(OnTriangle(i)) / radius, 1, 0.1);
  }
}

// Files have the normals of facets at their corners, too.
TEST(BendRadiiTest, FacetsMayHaveNormals) {
  TriangleMesh mesh = Tube(0.25, 12, true, /*shares_corners=*/false);
  for (std::size_t i = 0; i < mesh.normals.size(); i += 4) {
    const Vec3 normal = Normalize(mesh.normals[i] + mesh.normals[i + 1]);
    std::fill_n(mesh.normals.begin() + static_cast<std::ptrdiff_t>(i), 4, normal);
  }
  EXPECT_TRUE(HasFacets(mesh));
  const Scene tube = SceneOf(std::move(mesh));
  const BendRadii bends(tube);
  for (std::uint32_t i = 0; i < Triangles(tube); ++i)
    ASSERT_NEAR(bends.At(OnTriangle(i)) / 0.25, 1, 1e-4);
  EXPECT_FALSE(HasFacets(Tube(0.25, 12, true)));
}

// A tube of a thousand sides is as round as one of twelve; a fine grid is flat wherever it lies and
// however it is turned, though its vertices are rounded.
TEST(BendRadiiTest, FineFacetsAreKnownFromRounding) {
  const Scene tube = SceneOf(Tube(0.25, 1000, false));
  const BendRadii bends(tube);
  for (std::uint32_t i = 0; i < Triangles(tube); ++i)
    ASSERT_NEAR(bends.At(OnTriangle(i)) / 0.25, 1, 0.05);

  const Frame frame(Normalize({0.3F, 0.5F, 0.8F}));
  for (const float away : {0.0F, 10.0F, 1000.0F}) {
    SCOPED_TRACE(away);
    TriangleMesh grid;
    grid.traits.material = 0;
    constexpr std::uint32_t kSide = 200;
    for (std::uint32_t y = 0; y <= kSide; ++y) {
      for (std::uint32_t x = 0; x <= kSide; ++x) {
        grid.positions.push_back(Vec3{away, away, 0} + frame.s * (static_cast<float>(x) / kSide) +
                                 frame.t * (static_cast<float>(y) / kSide));
        if (x == kSide || y == kSide) continue;
        const std::uint32_t a = y * (kSide + 1) + x;
        const std::uint32_t b = a + kSide + 1;
        grid.indices.insert(grid.indices.end(), {a, a + 1, b + 1, a, b + 1, b});
      }
    }
    const Scene scene = SceneOf(std::move(grid));
    const BendRadii flat(scene);
    for (std::uint32_t i = 0; i < Triangles(scene); ++i)
      ASSERT_EQ(flat.At(OnTriangle(i)), HUGE_VALF);
  }
}

// What turns by 45 degrees or more is no one surface: an octagonal bar and a box are flat.
TEST(BendRadiiTest, FacetsAcrossACreaseAreFlat) {
  for (const std::uint32_t sides : {3U, 4U, 8U}) {
    SCOPED_TRACE(sides);
    const Scene bar = SceneOf(Tube(1, sides, false));
    const BendRadii bends(bar);
    for (std::uint32_t i = 0; i < Triangles(bar); ++i)
      EXPECT_EQ(bends.At(OnTriangle(i)), HUGE_VALF);
  }
}

// A fan of thousands of facets, one without area, and a sheet that lies on itself turned over.
TEST(BendRadiiTest, OfBrokenMeshesAreNoSurprise) {
  TriangleMesh fan;
  fan.traits.material = 0;
  constexpr std::uint32_t kFacets = 20000;
  fan.positions.push_back({0, 0, 0.2F});
  for (std::uint32_t i = 0; i < kFacets; ++i) {
    const double angle = 2 * kPi64 * i / kFacets;
    fan.positions.push_back(
        {static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle)), 0});
    fan.indices.insert(fan.indices.end(), {0, 1 + i, 1 + (i + 1) % kFacets});
  }
  fan.indices.insert(fan.indices.end(), {0, 1, 1});
  const Scene cone = SceneOf(std::move(fan));
  const BendRadii bends(cone);
  for (std::uint32_t i = 0; i < Triangles(cone); ++i)
    ASSERT_GT(bends.At(OnTriangle(i)), 0);
  EXPECT_EQ(bends.At(OnTriangle(kFacets)), HUGE_VALF);

  TriangleMesh sheet;
  sheet.traits.material = 0;
  sheet.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  sheet.indices = {0, 1, 2, 0, 2, 1};
  const Scene twice = SceneOf(std::move(sheet));
  EXPECT_EQ(BendRadii(twice).At(OnTriangle(0)), HUGE_VALF);
}

TEST(BendRadiiTest, OfAnalyticShapesAndInstancesAreThoseInTheWorld) {
  for (const bool has_normals : {true, false}) {
    SCOPED_TRACE(has_normals);
    Scene scene;
    AddMaterial(scene, DiffuseMaterial(0.5F));
    AddSphere(scene, {1, 2, 3}, 0.3F, 0, kNoAreaLight, /*inward=*/true);
    AddDisk(scene, {0, 0, 0}, {0, 0, 1}, 2, 0);
    scene.object_meshes.push_back(Tube(1, 16, has_normals));
    InstancedObject object;
    object.mesh_count = 1;
    scene.objects.push_back(object);
    scene.instances.emplace_back().to_world = Transform::Scale(5, 5, 5);
    const BendRadii bends(scene);
    SurfacePoint point;
    point.geometry = GeometryOf(scene, ShapeKind::kSphere);
    EXPECT_NEAR(bends.At(point), 0.3, 1e-6);
    point.geometry = GeometryOf(scene, ShapeKind::kDisk);
    EXPECT_EQ(bends.At(point), HUGE_VALF);
    point.geometry = static_cast<std::uint32_t>(scene.meshes.size()) + kShapeKinds;
    point.primitive = 7;
    point.instance = 0;
    EXPECT_NEAR(bends.At(point), 5, 1e-3);
  }
}

}  // namespace
}  // namespace lucerna
