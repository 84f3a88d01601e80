// Closed surfaces are found where they are, and nothing is called closed that has a crack.
#include "render/analysis/enclosures.h"

#include <cmath>
#include <vector>

#include "gtest/gtest.h"

#include "render/analysis/reachability.h"
#include "render/math/rng.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

using Numbers = std::vector<std::uint32_t>;

bool Always(const Material& /*material*/) {
  return true;
}

std::vector<ClosedSurface> SurfacesOf(const Scene& scene) {
  return ClosedSurfacesOf(scene, Always);
}

// A box of six quads, each a mesh of its own. Without the first `open` of them.
void AddQuads(Scene& scene, Vec3 low, Vec3 high, std::int32_t material, int open = 0) {
  const Vec3 size = high - low;
  const Vec3 x = {size.x, 0, 0};
  const Vec3 y = {0, size.y, 0};
  const Vec3 z = {0, 0, size.z};
  const std::array<std::array<Vec3, 3>, 6> quads = {
      {{low, x, y}, {low, y, z}, {low, z, x}, {low + z, x, y}, {low + x, y, z}, {low + y, z, x}}};
  for (std::size_t i = static_cast<std::size_t>(open); i < 6; ++i)
    AddQuad(scene, quads[i][0], quads[i][1], quads[i][2], material);
}

// Rooms of 0 to 2 in each axis, the second beyond x = 2. Coordinates are sums of powers of two, so
// that corners meet exactly.
struct Rooms {
  Scene scene;
  std::int32_t wall = AddMaterial(scene, DiffuseMaterial(0.5F));
  std::int32_t glass = AddMaterial(scene, DielectricMaterial(1.5F));
  std::int32_t light = AddAreaLight(scene, 1);

  Rooms() { SetCamera(scene, {0.7, 0.8, 0.9}, {1, 1, 1}, {0, 0, 1}, 60, 8); }
  void AddPoint(Vec3 position) { scene.point_lights.push_back({position, Gray(1)}); }
};

TEST(ClosedSurfaceTest, HoldsWhatIsInsideABox) {
  Scene scene;
  const std::int32_t wall = AddMaterial(scene, DiffuseMaterial(0.5F));
  AddBox(scene, {-1, -2, -3}, {1, 2, 3}, wall);
  const std::vector<ClosedSurface> surfaces = SurfacesOf(scene);
  ASSERT_EQ(surfaces.size(), 1U);
  EXPECT_EQ(surfaces[0].triangle_count(), 12U);
  KeyedRng rng(1);
  int inside = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vec3 p = {4 * rng.Uniform() - 2, 8 * rng.Uniform() - 4, 12 * rng.Uniform() - 6};
    const bool expected = std::abs(p.x) < 1 && std::abs(p.y) < 2 && std::abs(p.z) < 3;
    ASSERT_EQ(surfaces[0].Contains(p), expected) << p.x << " " << p.y << " " << p.z;
    inside += expected ? 1 : 0;
  }
  EXPECT_GT(inside, 150);
  EXPECT_EQ(surfaces[0].Contains({0, 0, 0}), true) << "where diagonals cross";
  EXPECT_EQ(surfaces[0].Contains({1, 0, 0}), std::nullopt) << "on the wall";
  EXPECT_EQ(surfaces[0].Contains({1 + 1e-7F, 0, 0}), std::nullopt) << "too near to tell";
}

TEST(ClosedSurfaceTest, TellsASphereFromItsSurroundings) {
  Scene scene;
  AddSphere(scene, {1, 2, 3}, 2, AddMaterial(scene, DiffuseMaterial(0.5F)));
  const std::vector<ClosedSurface> surfaces = SurfacesOf(scene);
  ASSERT_EQ(surfaces.size(), 1U);
  EXPECT_EQ(surfaces[0].Contains({1, 2, 4.9F}), true);
  EXPECT_EQ(surfaces[0].Contains({1, 2, 5.1F}), false);
  EXPECT_EQ(surfaces[0].Contains({1, 2, 5}), std::nullopt);
  const auto apart = [&](std::vector<Vec3> points) { return surfaces[0].IsApartFrom(points); };
  EXPECT_TRUE(apart({{1, 2, 3}, {1, 3, 3}, {2, 2, 3}}));
  EXPECT_FALSE(apart({{1, 2, 3}, {1, 9, 3}, {2, 2, 3}})) << "through the wall";
  EXPECT_TRUE(apart({{9, 2, 3}, {8, 9, 3}, {9, 2, 9}}));
  EXPECT_FALSE(apart({{-9, 2, 3}, {9, 2, 3}, {0, 9, 3}})) << "all corners outside, and yet through";
}

// Walls of single quads make a room; one that is missing, or moved by a hair, makes none.
TEST(ClosedSurfaceTest, IsMadeOfWhateverMeetsAtItsEdges) {
  const auto count = [](int open, float moved) {
    Rooms rooms;
    AddQuads(rooms.scene, {0, 0, 0}, {2, 2, 2}, rooms.wall, open);
    for (Vec3& p : rooms.scene.meshes.back().positions)
      p.x += moved;
    return SurfacesOf(rooms.scene).size();
  };
  EXPECT_EQ(count(0, 0), 1U);
  EXPECT_EQ(count(1, 0), 0U);
  EXPECT_EQ(count(5, 0), 0U);
  EXPECT_EQ(count(0, 1e-6F), 0U);
}

// Three surfaces: each room, and both together from without. A shelf in the air belongs to none.
TEST(ClosedSurfaceTest, RoomsMayShareAWall) {
  Rooms rooms;
  AddQuads(rooms.scene, {0, 0, 0}, {2, 2, 2}, rooms.wall);
  AddQuads(rooms.scene, {2, 0, 0}, {4, 2, 2}, rooms.wall);
  AddQuad(rooms.scene, {0.5F, 0.5F, 0.5F}, {0.5F, 0, 0}, {0, 0.5F, 0}, rooms.wall);
  const std::vector<ClosedSurface> surfaces = SurfacesOf(rooms.scene);
  ASSERT_EQ(surfaces.size(), 3U);
  int left = 0;
  int right = 0;
  for (const ClosedSurface& surface : surfaces) {
    left += surface.Contains({1, 1, 1.5F}) == true ? 1 : 0;
    right += surface.Contains({3, 1, 1.5F}) == true ? 1 : 0;
    EXPECT_EQ(surface.Contains({5, 1, 1}), false);
  }
  EXPECT_EQ(left, 2);
  EXPECT_EQ(right, 2);
}

TEST(UnreachableLightsTest, AreThoseInAnotherRoom) {
  Rooms rooms;
  AddQuads(rooms.scene, {0, 0, 0}, {2, 2, 2}, rooms.wall);
  AddQuads(rooms.scene, {2, 0, 0}, {4, 2, 2}, rooms.wall);
  AddSphere(rooms.scene, {3, 1, 1.5F}, 0.2F, rooms.wall, rooms.light);
  AddDisk(rooms.scene, {3, 1, 1}, {0, 0, -1}, 0.2F, rooms.wall, rooms.light);
  AddQuad(rooms.scene, {2.5F, 0.5F, 1.999F}, {0, 0.5F, 0}, {0.5F, 0, 0}, rooms.wall, rooms.light);
  rooms.AddPoint({1, 1, 1});
  rooms.AddPoint({3, 1, 0.5F});
  rooms.scene.infinite_lights.push_back({Gray(1)});
  const LightNumbers numbers(rooms.scene);
  EXPECT_EQ(
      FindUnreachableLights(rooms.scene).of_photons,
      (Numbers{12, numbers.spheres, numbers.disks, numbers.point_lights + 1, numbers.infinite}));

  // A window of glass lets everything in, and so does a door.
  Scene window = rooms.scene;
  window.meshes[6 + 1].traits.material = rooms.glass;  // both sides of the wall between them
  window.meshes[4].traits.material = rooms.glass;
  EXPECT_EQ(FindUnreachableLights(window).of_photons, Numbers{numbers.infinite});
  Scene door = rooms.scene;
  for (const std::size_t wall : {std::size_t{6 + 1}, std::size_t{4}}) {
    door.meshes[wall].indices.resize(3);
  }
  EXPECT_EQ(FindUnreachableLights(door).of_photons, Numbers{numbers.infinite});
  Scene skylight = rooms.scene;
  skylight.meshes[5].traits.material = rooms.glass;
  EXPECT_EQ(FindUnreachableLights(skylight).of_photons,
            (Numbers{12, numbers.spheres, numbers.disks, numbers.point_lights + 1}));
}

// What touches a wall, or reaches through it, may shine on both sides.
TEST(UnreachableLightsTest, AreNotThoseThatMeetTheWall) {
  const auto left_out = [](Vec3 corner, Vec3 edge1, Vec3 edge2) {
    Rooms rooms;
    AddBox(rooms.scene, {0, 0, 0}, {2, 2, 2}, rooms.wall);
    AddQuad(rooms.scene, corner, edge1, edge2, rooms.wall, rooms.light);
    return !FindUnreachableLights(rooms.scene).of_photons.empty();
  };
  EXPECT_TRUE(left_out({2.25F, 0.5F, 0.5F}, {0, 1, 0}, {0, 0, 1}));
  EXPECT_FALSE(left_out({2, 0.5F, 0.5F}, {0, 1, 0}, {0, 0, 1})) << "in the wall";
  EXPECT_FALSE(left_out({2, 0.5F, 0.5F}, {1, 0, 0}, {0, 0, 1})) << "against the wall";
  EXPECT_FALSE(left_out({1.5F, 0.5F, 0.5F}, {1, 0, 0}, {0, 0, 1})) << "through the wall";
  EXPECT_FALSE(left_out({2.5F, 0.5F, 0.5F}, {-0.6F, 0, 0}, {0, 0, 1})) << "from outside";
  EXPECT_FALSE(left_out({0.5F, 0.5F, 0.5F}, {0.5F, 0, 0}, {0, 0, 0.5F})) << "in the room";
}

TEST(UnreachableLightsTest, ACameraWithAWideLensSeesBothSides) {
  const auto left_out = [](double lens) {
    Rooms rooms;
    AddBox(rooms.scene, {0, 0, 0}, {2, 2, 2}, rooms.wall);
    rooms.AddPoint({3, 1, 1});
    rooms.scene.camera.lens_radius = lens;
    return FindUnreachableLights(rooms.scene).of_photons.size();
  };
  EXPECT_EQ(left_out(0), 1U);
  EXPECT_EQ(left_out(0.4), 1U);
  EXPECT_EQ(left_out(0.8), 0U);
}

// A light in a bulb: no straight line leads from it to anything that scatters broadly.
TEST(UnreachableLightsTest, LightsInGlassAreNotSampled) {
  const auto of_sampling = [](auto change) {
    Rooms rooms;
    AddBox(rooms.scene, {0, 0, 0}, {2, 2, 2}, rooms.wall);
    AddSphere(rooms.scene, {1, 1, 1.5F}, 0.25F, rooms.glass);
    AddSphere(rooms.scene, {1, 1, 1.5F}, 0.1F, rooms.wall, rooms.light);
    rooms.AddPoint({1, 1, 1.7F});
    rooms.AddPoint({1, 1, 0.5F});
    change(rooms);
    const LightNumbers numbers(rooms.scene);
    Numbers left_out = FindUnreachableLights(rooms.scene).of_sampling;
    for (std::uint32_t& number : left_out)
      number -= numbers.spheres;
    return left_out;
  };
  EXPECT_EQ(of_sampling([](Rooms&) {}), Numbers{1}) << "the point lights the ball";
  EXPECT_EQ(of_sampling([](Rooms& rooms) {
              const std::int32_t black = AddMaterial(rooms.scene, DiffuseMaterial(0));
              rooms.scene.spheres[1].traits.material = black;
            }),
            (Numbers{1, 2}));
  EXPECT_EQ(of_sampling([](Rooms& rooms) {
              AddDisk(rooms.scene, {1, 1, 1.6F}, {0, 0, 1}, 0.1F, rooms.wall);
            }),
            Numbers{})
      << "a holder inside the bulb";
  EXPECT_EQ(of_sampling([](Rooms& rooms) {
              rooms.scene.materials[static_cast<std::size_t>(rooms.glass)].alpha_u = 0.1F;
            }),
            Numbers{})
      << "frosted glass is lit itself";
}

// A ball that shines inwards lights its own inside.
TEST(UnreachableLightsTest, AFurnaceInGlassIsSampledOnItself) {
  for (const bool inward : {true, false}) {
    Rooms rooms;
    AddSphere(rooms.scene, {1, 1, 1}, 0.5F, rooms.wall, rooms.light, inward);
    AddSphere(rooms.scene, {1, 1, 1}, 0.9F, rooms.glass);
    EXPECT_EQ(FindUnreachableLights(rooms.scene).of_sampling.size(), inward ? 0U : 1U);
  }
}

TEST(UnreachableLightsTest, WhatLiesInGlassIsNotLitBySkyThroughIt) {
  Rooms rooms;
  AddBox(rooms.scene, {0, 0, 0}, {2, 2, 2}, rooms.glass);
  AddSphere(rooms.scene, {1, 1, 0.5F}, 0.25F, rooms.wall);
  rooms.scene.infinite_lights.push_back({Gray(1)});
  rooms.AddPoint({1, 1, 1});
  const UnreachableLights left_out = FindUnreachableLights(rooms.scene);
  EXPECT_TRUE(left_out.of_photons.empty());
  EXPECT_EQ(left_out.of_sampling, Numbers{LightNumbers(rooms.scene).infinite});
}

}  // namespace
}  // namespace lucerna
