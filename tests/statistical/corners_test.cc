// Corners and edges are as bright as they should be.
//
// In a closed room in which every surface shines alike and reflects half of what arrives, the
// radiance is the same everywhere, whatever stands in the room: 1 from the surface, 1/2 that came
// straight from others and is sampled, and 1/2 by photons. So every photon that an edge lets
// through, and every part of a disc where there are none, shows in the mean.
//
// Measurements are means of independent renders; bounds are Student's quantile of their spread, at
// a chance of a false alarm of 1e-3 for all of this file.
#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "gtest/gtest.h"

#include "render/math/warp.h"
#include "tests/support/local_render.h"
#include "tests/support/measure.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

constexpr int kParts = 32;
constexpr int kComparisons = 11;

// A room whose walls, numbered 0, shine inwards; light 0 shines from one side, light 1 from both.
Scene Room() {
  Scene scene;
  AddMaterial(scene, DiffuseMaterial(0.5F));
  AddAreaLight(scene, 1);
  AddAreaLight(scene, 1, /*two_sided=*/true);
  AddBox(scene, {-1, -1, -1}, {1, 1, 1}, 0);
  TriangleMesh& walls = scene.meshes.back();
  walls.traits.area_light = 0;
  for (std::size_t i = 0; i < walls.indices.size(); i += 3)
    std::swap(walls.indices[i + 1], walls.indices[i + 2]);
  // Down at an angle: floor, walls and three corners of both, and whatever stands there.
  SetCamera(scene, {-0.8, -0.7, 0.5}, {0.3, 0.2, -0.9}, {0, 0, 1}, 90, 48);
  return scene;
}

void AddShiningBox(Scene& scene, Vec3 low, Vec3 high) {
  AddBox(scene, low, high, 0);
  scene.meshes.back().traits.area_light = 0;
}

// A column from below the floor to above the ceiling, of flat sides, with round normals or none.
void AddColumn(Scene& scene, float x, float y, float radius, std::uint32_t sides, bool is_round) {
  TriangleMesh mesh;
  mesh.traits.material = 0;
  mesh.traits.area_light = 0;
  for (std::uint32_t i = 0; i < sides; ++i) {
    const double angle = 2 * kPi64 * i / sides;
    const Vec3 normal = {static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle)),
                         0};
    for (const float z : {-1.1F, 1.1F}) {
      mesh.positions.push_back({x + radius * normal.x, y + radius * normal.y, z});
      if (is_round) mesh.normals.push_back(normal);
    }
    const std::uint32_t next = (i + 1) % sides;
    for (const std::uint32_t corner :
         {2 * i, 2 * next, 2 * next + 1, 2 * i, 2 * next + 1, 2 * i + 1})
      mesh.indices.push_back(corner);
  }
  scene.meshes.push_back(std::move(mesh));
}

// Of 1.25 pixels in radius, where a first disc of three pixels finds nine tenths of the light, and
// one of a pixel 1.014.
void AddColumns(Scene& scene, std::uint32_t sides, bool is_round) {
  for (const auto& [x, y] : {std::pair(-0.1F, -0.4F),
                             {0.2F, 0.1F},
                             {-0.2F, 0.2F},
                             {-0.5F, 0.1F},
                             {0.3F, -0.5F},
                             {0.0F, -0.1F},
                             {-0.3F, -0.2F},
                             {0.1F, 0.4F},
                             {-0.4F, 0.5F},
                             {0.5F, -0.2F},
                             {0.4F, 0.3F},
                             {-0.05F, 0.65F}})
    AddColumn(scene, x, y, 0.05F, sides, is_round);
}

// A board whose sides are rounded by three strips to a quarter of a circle, of a radius of half a
// pixel: no edge of it turns by as much as 45 degrees but at its two ends.
void AddRoundedBoard(Scene& scene, double middle) {
  constexpr double kLow = -0.85;
  constexpr double kHigh = -0.7;
  constexpr double kHalfWidth = 0.06;
  constexpr double kRounding = 0.015;
  constexpr std::uint32_t kStrips = 3;
  std::vector<Vec3> profile;  // of its end, around
  for (std::uint32_t corner = 0; corner < 4; ++corner) {
    const double x = middle + (corner == 1 || corner == 2 ? -1 : 1) * (kHalfWidth - kRounding);
    const double z = corner < 2 ? kHigh - kRounding : kLow + kRounding;
    for (std::uint32_t i = 0; i <= kStrips; ++i) {
      const double angle = kPi64 / 2 * (corner + static_cast<double>(i) / kStrips);
      profile.push_back({static_cast<float>(x + kRounding * std::cos(angle)), 0,
                         static_cast<float>(z + kRounding * std::sin(angle))});
    }
  }
  TriangleMesh mesh;
  mesh.traits.material = 0;
  mesh.traits.area_light = 0;
  const auto count = static_cast<std::uint32_t>(profile.size());
  for (const float y : {-0.5F, 0.6F}) {
    for (const Vec3 place : profile)
      mesh.positions.push_back({place.x, y, place.z});
  }
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t next = (i + 1) % count;
    for (const std::uint32_t corner : {i, count + next, next, i, count + i, count + next})
      mesh.indices.push_back(corner);
    if (i == 0 || next == 0) continue;
    for (const std::uint32_t corner : {0U, i, next, count, count + next, count + i})
      mesh.indices.push_back(corner);
  }
  scene.meshes.push_back(std::move(mesh));
}

struct Furniture {
  std::string name;
  std::function<void(Scene&)> add;
};

std::vector<Furniture> AllFurniture() {
  return {
      {"nothing", [](Scene&) {}},
      {"a box on the floor",
       [](Scene& scene) {
         AddShiningBox(scene, {-0.2F, -0.3F, -1}, {0.3F, 0.3F, -0.6F});
       }},
      {"a box sunk into the floor and a wall",
       [](Scene& scene) {
         AddShiningBox(scene, {-0.2F, 0.5F, -1.2F}, {0.3F, 1.2F, -0.5F});
       }},
      {"a step",
       [](Scene& scene) {
         AddShiningBox(scene, {-0.3F, -1, -1}, {1, 1, -0.93F});
       }},
      {"a thin wall",
       [](Scene& scene) {
         AddQuad(scene, {0, -0.4F, -1}, {0, 0.8F, 0}, {0, 0, 0.5F}, 0, 1);
       }},
      {"a disk",
       [](Scene& scene) {
         AddDisk(scene, {0.3F, 0.3F, -0.7F}, {0, 0, 1}, 0.4F, 0, 1);
       }},
      {"a ball sunk into the floor",
       [](Scene& scene) {
         AddSphere(scene, {0.1F, 0, -1.3F}, 0.6F, 0, 0);
       }},
      {"round columns", [](Scene& scene) { AddColumns(scene, 32, true); }},
      {"columns of twelve flat sides", [](Scene& scene) { AddColumns(scene, 12, false); }},
      {"octagonal columns", [](Scene& scene) { AddColumns(scene, 8, false); }},
      {"boards with rounded sides",
       [](Scene& scene) {
         for (const double middle : {-0.4, -0.1, 0.2, 0.5})
           AddRoundedBoard(scene, middle);
       }},
  };
}

TEST(CornersTest, AreAsBrightAsTheRestOfAFurnace) {
  const double quantile = StudentQuantile(SidakLevel(1e-3, kComparisons), kParts);
  for (const Furniture& furniture : AllFurniture()) {
    SCOPED_TRACE(furniture.name);
    Scene scene = Room();
    furniture.add(scene);
    RenderOverrides overrides;
    overrides.initial_radius = 0;
    overrides.max_depth = 40;
    overrides.photons_per_pass = 20000;
    const MeasuredMean photons =
        Measure(scene, SettingsFor(scene, overrides), 6, kParts, "photons.G");
    const double bound = quantile * photons.standard_error;
    // Of the whole radiance, 2: 0.05 %, and what chance may do.
    EXPECT_NEAR(photons.mean, 0.5, 0.0005 * 2 + bound) << "bound " << bound;
    EXPECT_LT(bound, 0.004);
  }
}

}  // namespace
}  // namespace lucerna
