// What is left out of a scene because of closed surfaces would have come to nothing.
//
// Hundreds of scenes of rooms that share walls, touch, lie in each other, lack a wall or have one
// of glass, with lights and the camera anywhere: no photon of a light that is left out ever lands
// where the camera could see it, and no straight line leads from a light that is not sampled to a
// surface that would ask for it.
#include "render/analysis/enclosures.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "gtest/gtest.h"

#include "render/analysis/needs.h"
#include "render/analysis/reachability.h"
#include "render/geometry/intersector.h"
#include "render/math/rng.h"
#include "render/transport/light.h"
#include "tests/support/test_scenes.h"
#include "worker/photon_path.h"

namespace lucerna {
namespace {

constexpr int kScenes = 600;

struct RandomScene {
  KeyedRng rng;
  Scene scene;
  std::array<std::int32_t, 3> materials{};  // walls, mirrors, glass

  explicit RandomScene(std::uint64_t key) : rng(key) {
    materials = {AddMaterial(scene, DiffuseMaterial(0.8F)),
                 AddMaterial(scene, ConductorMaterial(Gray(0.1F), Gray(5), 0, 0)),
                 AddMaterial(scene, DielectricMaterial(1.5F))};
    const Vec3 eye = Anywhere();
    const Vec3 look = Anywhere();
    SetCamera(scene, {eye.x, eye.y, eye.z}, {look.x, look.y, look.z}, {0, 0, 1}, 60, 8);
    const int rooms = 1 + Below(4);
    for (int i = 0; i < rooms; ++i)
      AddRoom();
    if (Below(3) == 0) AddSphere(scene, Anywhere(), 0.3F + rng.Uniform(), Material());
    const std::int32_t light = AddAreaLight(scene, 1, /*two_sided=*/Below(2) == 0);
    scene.point_lights.push_back({Anywhere(), Gray(1)});
    const Vec3 center = Anywhere();
    AddSphere(scene, center, 0.05F + 0.2F * rng.Uniform(), materials[0], light);
    if (Below(2) == 0) AddSphere(scene, center, 0.3F, materials[2]);
    AddDisk(scene, Anywhere(), Direction(), 0.05F + 0.3F * rng.Uniform(), materials[0], light);
    AddQuad(scene, Anywhere(), Direction() * 0.2F, Direction() * 0.3F, materials[0], light);
    scene.infinite_lights.push_back({Gray(1)});
  }

  int Below(int count) { return static_cast<int>(rng.Uniform() * static_cast<float>(count)); }
  Vec3 Anywhere() {
    const float x = rng.Uniform();
    const float y = rng.Uniform();
    return {4 * x, 4 * y, 4 * rng.Uniform()};
  }
  Vec3 Direction() {
    const float x = rng.Uniform() - 0.5F;
    const float y = rng.Uniform() - 0.5F;
    return Normalize({x, y, rng.Uniform() - 0.4999F});
  }
  // Mostly walls.
  std::int32_t Material() {
    const int kind = Below(8);
    return materials[kind < 6 ? 0U : static_cast<std::size_t>(kind - 5)];
  }
  // Corners on a coarse lattice, so that rooms touch and share walls; six meshes, of which one may
  // be missing or of another material.
  void AddRoom() {
    const std::int32_t odd_material = Material();
    // A pane of glass that lies on a wall, or a mirror, is met in its place or not, as rounding has
    // it.
    const float off = odd_material == materials[0] ? 0 : 0.01F + 0.05F * rng.Uniform();
    const auto corner = [&] { return off + static_cast<float>(Below(3)); };
    const Vec3 low = {corner(), corner(), corner()};
    const auto size = [&] { return static_cast<float>(1 + Below(2)); };
    const Vec3 x = {size(), 0, 0};
    const Vec3 y = {0, size(), 0};
    const Vec3 z = {0, 0, size()};
    const std::array<std::array<Vec3, 3>, 6> quads = {
        {{low, x, y}, {low, y, z}, {low, z, x}, {low + z, x, y}, {low + x, y, z}, {low + y, z, x}}};
    const int odd = Below(10);
    const bool is_missing = Below(2) == 0;
    for (int i = 0; i < 6; ++i) {
      if (i == odd && is_missing) continue;
      const auto& quad = quads[static_cast<std::size_t>(i)];
      AddQuad(scene, quad[0], quad[1], quad[2], i == odd ? odd_material : materials[0]);
    }
  }
};

// The scene with no light but that of a number.
Scene LitOnlyBy(Scene scene, std::uint32_t number) {
  const LightNumbers numbers(scene);
  const auto keep = [&](auto& shapes, std::uint32_t first) {
    for (std::uint32_t i = 0; i < shapes.size(); ++i) {
      if (first + i != number) shapes[i].traits.area_light = kNoAreaLight;
    }
  };
  keep(scene.meshes, 0);
  keep(scene.spheres, numbers.spheres);
  keep(scene.disks, numbers.disks);
  if (number != numbers.point_lights) scene.point_lights.clear();
  if (number != numbers.infinite) scene.infinite_lights.clear();
  return scene;
}

TEST(LeftOutTest, NoPhotonOfAShutOutLightIsEverSeen) {
  int left_out = 0;
  int kept = 0;
  std::uint64_t landed = 0;
  for (std::uint64_t key = 0; key < kScenes; ++key) {
    const Scene all = RandomScene(key).scene;
    const UnreachableLights lights = FindUnreachableLights(all);
    kept += 5 - static_cast<int>(lights.of_photons.size());
    const Vec3 eye = all.camera.camera_to_world.Point({});
    for (const std::uint32_t number : lights.of_photons) {
      ++left_out;
      const Scene scene = LitOnlyBy(all, number);
      const auto intersector = Intersector::Create(scene).value();
      const LightSet set(scene, *intersector);
      const RenderSettings settings = TestSettings(scene, 1000, 0.1, 20);
      const PhotonPathTracer tracer(scene, *intersector, set, settings, NeedsOf(scene, settings),
                                    nullptr, Bounds());
      for (std::uint64_t index = 0; index < 300; ++index) {
        const PhotonHistory history = tracer.Replay(0, index);
        Vec3 before = history.emission.ray.origin;
        for (const PhotonLanding& landing : history.landings) {
          const SurfacePoint& surface = landing.surface;
          const Vec3 came_from = before - surface.position;
          before = surface.position;
          // Of an opaque surface only the side is lit that the photon came from.
          if (landing.material_kind != Material::Kind::kDielectric &&
              Dot(came_from, surface.geometric_normal) *
                      Dot(eye - surface.position, surface.geometric_normal) <=
                  0) {
            continue;
          }
          ++landed;
          const Vec3 from = LeavingPoint(surface, eye - surface.position);
          ASSERT_TRUE(intersector->Occluded({from, eye - from, 1}))
              << "scene " << key << ", light " << number << ", photon " << index;
        }
      }
    }
  }
  // Neither is the test empty, nor are all lights left out.
  EXPECT_GT(left_out, kScenes / 4);
  EXPECT_GT(kept, kScenes);
  EXPECT_GT(landed, 100'000U);
}

TEST(LeftOutTest, NoLightThatIsNotSampledIsInSight) {
  int left_out = 0;
  for (std::uint64_t key = 0; key < kScenes; ++key) {
    RandomScene random(key);
    const Scene& all = random.scene;
    const UnreachableLights lights = FindUnreachableLights(all);
    for (const std::uint32_t number : lights.of_sampling) {
      ++left_out;
      const Scene scene = LitOnlyBy(all, number);
      const auto intersector = Intersector::Create(scene).value();
      const LightSet set(scene, *intersector);
      int asked = 0;
      for (int i = 0; i < 3000; ++i) {
        const Ray ray = {random.Anywhere(), random.Direction(), HUGE_VALF};
        Hit hit;
        if (!intersector->Intersect(ray, hit)) continue;
        const SurfacePoint surface = intersector->SurfaceAt(ray, hit);
        // The light's own surface lights nothing of itself.
        if (!ScattersBroadly(scene.materials[surface.material]) ||
            surface.area_light != kNoAreaLight) {
          continue;
        }
        LightSample light;
        if (!set.SampleDirect({surface.position}, 0.5, random.rng.Uniform(), random.rng.Uniform(),
                              light)) {
          continue;
        }
        ++asked;
        const Vec3 from = LeavingPoint(surface, light.wi);
        const Ray shadow =
            light.is_distant ? Ray{from, light.wi, HUGE_VALF} : Ray{from, light.target - from, 1};
        ASSERT_TRUE(intersector->Occluded(shadow)) << "scene " << key << ", light " << number;
      }
      EXPECT_GT(asked, 10);
    }
  }
  EXPECT_GT(left_out, kScenes / 20);
}

}  // namespace
}  // namespace lucerna
