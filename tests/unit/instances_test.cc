// An instance is met where its copy would be, and paths see the same surface there.
#include <cmath>
#include <utility>

#include "gtest/gtest.h"

#include "render/analysis/needs.h"
#include "render/geometry/intersector.h"
#include "render/geometry/surface_uv.h"
#include "render/math/rng.h"
#include "render/math/warp.h"
#include "render/scene/scene_extent.h"
#include "tests/support/local_render.h"
#include "tests/support/measure.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

// A wavy sheet with normals and texture coordinates, and a box, as one object.
std::vector<TriangleMesh> ObjectMeshes(std::int32_t material) {
  constexpr int kSides = 12;
  TriangleMesh sheet;
  for (int y = 0; y <= kSides; ++y) {
    for (int x = 0; x <= kSides; ++x) {
      const float fx = static_cast<float>(x) / kSides;
      const float fy = static_cast<float>(y) / kSides;
      sheet.positions.push_back({fx, fy, 0.1F * std::sin(6 * fx) * fy});
      sheet.normals.push_back(
          Normalize({-0.6F * std::cos(6 * fx) * fy, -0.1F * std::sin(6 * fx), 1}));
      sheet.uvs.push_back({fx, fy * fy});
    }
  }
  for (std::uint32_t y = 0; y < kSides; ++y) {
    for (std::uint32_t x = 0; x < kSides; ++x) {
      const std::uint32_t a = y * (kSides + 1) + x;
      const std::uint32_t b = a + kSides + 1;
      sheet.indices.insert(sheet.indices.end(), {a, a + 1, b + 1, a, b + 1, b});
    }
  }
  sheet.traits.material = material;
  Scene box;
  AddBox(box, {0.2F, 0.2F, 0.3F}, {0.5F, 0.6F, 0.5F}, material);
  return {sheet, box.meshes[0]};
}

std::vector<Transform> Places() {
  return {Transform::Translate(3, 0, 0) * Transform::Rotate(40, 1, 2, 0.5).value(),
          Transform::Translate(-3, 1, 0) * Transform::Scale(1, 2, 0.5),
          Transform::Translate(0, -3, 1) * Transform::Scale(-1, 1, 1)};
}

// The same places, as instances and as copies.
std::pair<Scene, Scene> SharedAndCopied() {
  Scene shared;
  const std::int32_t material = AddMaterial(shared, DiffuseMaterial(0.5F));
  shared.materials[0] = DiffuseMaterial(0.7F);
  AddQuad(shared, {-6, -6, -1}, {12, 0, 0}, {0, 12, 0}, 0);
  AddDisk(shared, {0, 0, 4}, {0, 0, -1}, 1, 0, AddAreaLight(shared, 5));
  Scene copied = shared;
  shared.object_meshes = ObjectMeshes(material);
  InstancedObject& object = shared.objects.emplace_back();
  object.mesh_count = 2;
  for (const TriangleMesh& mesh : shared.object_meshes) {
    for (const Vec3 position : mesh.positions)
      object.box.Add(position);
  }
  for (const Transform& to_world : Places()) {
    shared.instances.push_back({0, to_world});
    for (TriangleMesh mesh : shared.object_meshes) {
      for (Vec3& position : mesh.positions)
        position = to_world.Point(position);
      for (Vec3& normal : mesh.normals)
        normal = Normalize(to_world.Normal(normal));
      for (std::size_t i = 0; to_world.SwapsHandedness() && i < mesh.indices.size(); i += 3)
        std::swap(mesh.indices[i + 1], mesh.indices[i + 2]);
      copied.meshes.push_back(std::move(mesh));
    }
  }
  return {std::move(shared), std::move(copied)};
}

TEST(InstancesTest, RaysMeetTheSameSurfaceAsOnCopies) {
  const auto [shared, copied] = SharedAndCopied();
  const auto one = Intersector::Create(shared).value();
  const auto other = Intersector::Create(copied).value();
  EXPECT_LT(Length(one->bounds().low - other->bounds().low), 0.6F);
  KeyedRng rng(11);
  int on_instances = 0;
  int differing = 0;
  for (int i = 0; i < 40000; ++i) {
    const float u1 = rng.Uniform();
    const float u2 = rng.Uniform();
    const Vec3 origin = SquareToSphere(u1, u2) * 8;
    const Vec3 target = {8 * rng.Uniform() - 4, 8 * rng.Uniform() - 4, 2 * rng.Uniform() - 1};
    const Ray ray = {origin, Normalize(target - origin), HUGE_VALF};
    Hit a;
    Hit b;
    const bool is_a = one->Intersect(ray, a);
    const bool is_b = other->Intersect(ray, b);
    // Edges are met or missed by rounding.
    if (is_a != is_b || (is_a && std::abs(a.t - b.t) > 1e-4F)) {
      ++differing;
      continue;
    }
    if (!is_a || a.instance == kNoInstance) continue;
    ++on_instances;
    const SurfacePoint p = one->SurfaceAt(ray, a);
    const SurfacePoint q = other->SurfaceAt(ray, b);
    // Some forty roundings of numbers up to 8, and farther along the surface for grazing rays.
    ASSERT_LT(Length(p.position - q.position),
              40 * 8 * 0x1p-24F / std::abs(Dot(ray.direction, p.geometric_normal)));
    ASSERT_GT(Dot(p.geometric_normal, q.geometric_normal), 0.9999F);
    ASSERT_GT(Dot(p.shading_normal, q.shading_normal), 0.9999F);
    ASSERT_EQ(p.material, q.material);
    // Without coordinates of their own, triangles of a mirrored copy have those of other corners.
    if (!MeshOf(shared, p.geometry)->uvs.empty()) {
      ASSERT_NEAR(UvAt(shared, p).y, UvAt(copied, q).y, 1e-4);
      const double slope = UvSlopesAt(copied, q).v;
      ASSERT_NEAR(UvSlopesAt(shared, p).v, slope, 1e-3 * slope);
    }
    // A hit that is known by its number is the same.
    const Hit known = one->HitOn(one->ShapeOf(a), ray);
    ASSERT_EQ(known.geometry, a.geometry);
    ASSERT_EQ(known.primitive, a.primitive);
    ASSERT_EQ(known.instance, a.instance);
    ASSERT_NEAR(known.t, a.t, 1e-4F);
    ASSERT_TRUE(one->Occluded({origin, target - origin, HUGE_VALF}));
    // No ray meets the triangle that it leaves.
    const Vec3 away = SquareToSphere(u2, u1);
    Hit next;
    if (one->Intersect({LeavingPoint(p, away), away, HUGE_VALF}, next)) {
      ASSERT_FALSE(next.instance == a.instance && next.geometry == a.geometry &&
                   next.primitive == a.primitive)
          << i;
    }
  }
  EXPECT_GT(on_instances, 1000);
  EXPECT_LT(differing, 40);
}

// Holes by cubes in the world, and by squares of texture coordinates.
void AddHoles(Scene& scene) {
  Texture none;
  none.color = Gray(0);
  Texture all;
  all.color = Gray(1);
  Texture cubes;
  cubes.kind = Texture::Kind::kCheckerboard;
  cubes.is_in_space = true;
  cubes.mapping.from_world = Transform::Scale(4, 4, 4);
  cubes.parts = {0, 1, -1, -1};
  Texture squares;
  squares.kind = Texture::Kind::kCheckerboard;
  squares.mapping.scale_u = squares.mapping.scale_v = 6;
  squares.parts = {2, 1, -1, -1};
  scene.textures = {none, all, cubes, squares};
  for (TriangleMesh& mesh : scene.meshes)
    mesh.traits.alpha_texture = 3;
  for (TriangleMesh& mesh : scene.object_meshes)
    mesh.traits.alpha_texture = 3;
}

TEST(InstancesTest, MasksHaveTheirHolesWhereCopiesHaveThem) {
  auto [shared, copied] = SharedAndCopied();
  AddHoles(shared);
  AddHoles(copied);
  // Without texture coordinates, mirrored copies have those of other corners.
  shared.object_meshes[1].traits.alpha_texture = 2;
  for (TriangleMesh& mesh : copied.meshes) {
    if (mesh.uvs.empty()) mesh.traits.alpha_texture = 2;
  }
  shared.meshes[0].traits.alpha_texture = 2;
  const auto one = Intersector::Create(shared).value();
  const auto other = Intersector::Create(copied).value();
  KeyedRng rng(12);
  int on_instances = 0;
  int through = 0;
  int differing = 0;
  constexpr int kRays = 20000;
  for (int i = 0; i < kRays; ++i) {
    const float u1 = rng.Uniform();
    const float u2 = rng.Uniform();
    const Vec3 origin = SquareToSphere(u1, u2) * 8;
    const Vec3 target = {8 * rng.Uniform() - 4, 8 * rng.Uniform() - 4, 2 * rng.Uniform() - 1};
    const Ray ray = {origin, Normalize(target - origin), HUGE_VALF};
    Hit a;
    Hit b;
    const bool is_a = one->Intersect(ray, a);
    const bool is_b = other->Intersect(ray, b);
    differing += is_a != is_b || (is_a && std::abs(a.t - b.t) > 1e-4F) ? 1 : 0;
    on_instances += is_a && a.instance != kNoInstance ? 1 : 0;
    through += is_a ? 0 : 1;
  }
  EXPECT_GT(on_instances, 300);
  EXPECT_GT(through, 300);
  // At the edges of holes rounding decides, on a strip of some 1e-6 of a hole's size.
  EXPECT_LT(differing, 40);
}

TEST(InstancesTest, BoundsHoldThem) {
  const auto [shared, copied] = SharedAndCopied();
  const Bounds around = BoundsOf(shared);
  const Bounds exact = BoundsOf(copied);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_LE(around.low[axis], exact.low[axis] + 1e-5F);
    EXPECT_GE(around.high[axis], exact.high[axis] - 1e-5F);
  }
}

TEST(InstancesTest, AnImageHasTheMeanOfThatOfCopies) {
  auto [shared, copied] = SharedAndCopied();
  for (Scene* scene : {&shared, &copied})
    SetCamera(*scene, {0, -7, 6}, {0, 0, 0}, {0, 0, 1}, 60, 24);
  const RenderSettings settings = TestSettings(shared, 4000, 0.3, 8);
  const SceneNeeds needs = NeedsOf(shared, settings);
  EXPECT_TRUE(needs.Uses(Part::kInstances));
  EXPECT_TRUE(needs.Uses(Part::kShadingNormals));
  EXPECT_FALSE(NeedsOf(copied, settings).Uses(Part::kInstances));
  const MeasuredMean one = Measure(shared, settings, 8, 8, "G");
  const MeasuredMean other = Measure(copied, settings, 8, 8, "G");
  // Discs are not cut at the edges of instances, which darkens a share of them by a part.
  EXPECT_LT(std::abs(one.mean - other.mean),
            StudentQuantile(1e-4, 8) * std::hypot(one.standard_error, other.standard_error) +
                0.005 * other.mean);
}

// ---- alpha

TEST(AlphaTest, AShareOfRaysMeetsTheShape) {
  Scene scene;
  AddMaterial(scene, DiffuseMaterial(0.5F));
  AddQuad(scene, {-1, -1, 0}, {2, 0, 0}, {0, 2, 0}, 0);
  AddSphere(scene, {0, 0, -2}, 1, 0);
  scene.meshes[0].traits.alpha = 0.3F;
  scene.spheres[0].traits.alpha = 0.6F;
  const auto intersector = Intersector::Create(scene).value();
  KeyedRng rng(5);
  constexpr int kRays = 20000;
  int on_mesh = 0;
  int on_sphere = 0;
  int shadowed = 0;
  for (int i = 0; i < kRays; ++i) {
    const Ray ray = {{rng.Uniform() - 0.5F, rng.Uniform() - 0.5F, 3}, {0, 0, -1}, HUGE_VALF};
    Hit hit;
    Hit again;
    const bool is_hit = intersector->Intersect(ray, hit);
    ASSERT_EQ(intersector->Intersect(ray, again), is_hit);
    ASSERT_EQ(intersector->Occluded(ray), is_hit);
    if (is_hit) ++(hit.geometry == 0 ? on_mesh : on_sphere);
    shadowed += intersector->Occluded({ray.origin, {0, 0, -3.5F}, 1}) ? 1 : 0;
  }
  // Five standard deviations.
  const auto near = [](int count, double share) {
    EXPECT_NEAR(count, kRays * share, 5 * std::sqrt(kRays * share * (1 - share)));
  };
  near(on_mesh, 0.3);
  // Who passes the near wall of the sphere may meet the far one.
  near(on_sphere, 0.7 * (0.6 + 0.4 * 0.6));
  near(shadowed, 0.3);
}

// Half of a ball is there: through the hole its other wall is seen, from inside.
TEST(AlphaTest, ThroughAHoleTheOtherWallIsMet) {
  Scene scene;
  AddMaterial(scene, DiffuseMaterial(0.5F));
  AddSphere(scene, {0, 0, 0}, 1, 0);
  TextureMapping by_z;
  by_z.kind = TextureMapping::Kind::kPlanar;
  by_z.axis_u = {0, 0, 0.5F};
  by_z.axis_v = {};
  // Whole numbers are even above z = 0.
  scene.spheres[0].traits.alpha_texture = AddStripes(scene, 0, 1, by_z);
  const auto intersector = Intersector::Create(scene).value();
  const Ray down = {{0.6F, 0, 3}, {0, 0, -1}, HUGE_VALF};
  Hit hit;
  ASSERT_TRUE(intersector->Intersect(down, hit));
  EXPECT_NEAR(hit.t, 3.8F, 1e-5F);
  EXPECT_TRUE(intersector->Occluded(down));
  EXPECT_FALSE(intersector->Occluded({down.origin, {0, 0, -3.7F}, 1}));
  ASSERT_TRUE(intersector->Intersect({{0.6F, 0, -3}, {0, 0, 1}, HUGE_VALF}, hit));
  EXPECT_NEAR(hit.t, 2.2F, 1e-5F);
}

// Light with an alpha of zero is not seen, and lights as without.
TEST(AlphaTest, AnInvisibleLightShines) {
  Scene scene;
  AddMaterial(scene, DiffuseMaterial(0.5F));
  AddQuad(scene, {-2, -2, 0}, {4, 0, 0}, {0, 4, 0}, 0);
  AddDisk(scene, {0, 0, 2}, {0, 0, -1}, 1, 0, AddAreaLight(scene, 5));
  SetCamera(scene, {0, -3, 1.5}, {0, 0, 0}, {0, 0, 1}, 40, 16);
  const RenderSettings settings = TestSettings(scene, 1000, 0.2, 3);
  const MeasuredMean seen = Measure(scene, settings, 8, 8, "G");
  scene.disks[0].traits.alpha = 0;
  const MeasuredMean unseen = Measure(scene, settings, 8, 8, "G");
  EXPECT_LT(std::abs(seen.mean - unseen.mean),
            StudentQuantile(1e-4, 8) * std::hypot(seen.standard_error, unseen.standard_error));
  scene.disks[0].traits.alpha = 0.5F;
  const MeasuredMean half = Measure(scene, settings, 8, 8, "G");
  EXPECT_LT(std::abs(half.mean - seen.mean / 2),
            StudentQuantile(1e-4, 8) * std::hypot(seen.standard_error, half.standard_error));
}

}  // namespace
}  // namespace lucerna
