// Bumps and normal maps turn shading normals as their heights and pictures say, and stretched
// highlights lie along u.
#include "render/transport/bump.h"

#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <vector>

#include "gtest/gtest.h"

#include "render/geometry/surface_tangents.h"
#include "render/geometry/surface_uv.h"
#include "render/math/rng.h"
#include "render/transport/material_at.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

// Heights that rise by `along_u` and `along_v` over the texture.
void AddSlope(Scene& scene, float along_u, float along_v) {
  for (const float corner : {0.0F, along_v, along_u, along_u + along_v}) {
    Texture constant;
    constant.color = Gray(corner);
    scene.textures.push_back(constant);
  }
  Texture slope;
  slope.kind = Texture::Kind::kBilinear;
  slope.parts = {0, 1, 2, 3};
  scene.textures.push_back(slope);
}

Material Bumpy() {
  Material material = DiffuseMaterial(0.5F);
  material.displacement = 4;
  material.slope_step = {0.0005F, 0.0005F};
  return material;
}

// A floor of 4 by 2 in x and y.
void AddFloor(Scene& scene, const Material& material) {
  AddQuad(scene, {-2, -1, 0}, {4, 0, 0}, {0, 2, 0}, AddMaterial(scene, material));
  scene.meshes.back().uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
}

SurfacePoint Met(const Scene& scene, Vec3 from, Vec3 towards) {
  const std::unique_ptr<Intersector> intersector = Intersector::Create(scene).value();
  const Ray ray = {from, Normalize(towards), HUGE_VALF};
  Hit hit;
  EXPECT_TRUE(intersector->Intersect(ray, hit));
  return intersector->SurfaceAt(ray, hit);
}

void ExpectNear(Vec3 a, Vec3 b, float tolerance) {
  for (int axis = 0; axis < 3; ++axis)
    EXPECT_NEAR(a[axis], b[axis], tolerance) << axis;
}

// The normal of z = a x / 4 + b y / 2.
TEST(BumpTest, TurnsTheNormalOfAFloorByTheSlope) {
  for (const double unit : {1.0, 0x1p20}) {
    Scene scene;
    scene.unit = unit;
    AddSlope(scene, static_cast<float>(1.2 * unit), static_cast<float>(-0.4 * unit));
    AddFloor(scene, Bumpy());
    SurfacePoint point = Met(scene, {0.3F, 0.2F, 1}, {0, 0, -1});
    std::optional<Material> storage;
    (void)MaterialAt(scene, point, {0, 0, 1}, storage);
    EXPECT_TRUE(point.has_shading_normal);
    // Floats tell heights apart to a few 1e-7, over steps of 5e-4.
    ExpectNear(point.shading_normal, Normalize(Vec3{-0.3F, 0.2F, 1}), 2e-3F);
    EXPECT_EQ(point.geometric_normal, (Vec3{0, 0, 1}));
  }
}

// Heights of a sphere that grow with u and v lean its normals back along both.
TEST(BumpTest, TurnsTheNormalOfASphere) {
  Scene scene;
  AddSlope(scene, 0.4F, 0.5F);
  AddSphere(scene, {0, 0, 0}, 2, AddMaterial(scene, Bumpy()));
  SurfacePoint point = Met(scene, {0, 5, 0}, {0, -1, 0});
  std::optional<Material> storage;
  (void)MaterialAt(scene, point, {0, 1, 0}, storage);
  // On the equator, a quarter of a turn from u = 0: the height is 0.1 + 0.25. It rises by 0.4 in a
  // turn, towards -x here, and by 0.5 in half a turn, towards z.
  const float radius = 2.35F;
  const float along_u = 0.4F / (2 * std::numbers::pi_v<float> * radius);
  const float along_v = 0.5F / (std::numbers::pi_v<float> * radius);
  ExpectNear(point.shading_normal, Normalize(Vec3{along_u, 1, -along_v}), 1e-3F);
}

TEST(BumpTest, EvenHeightsChangeNothing) {
  Scene scene;
  AddSlope(scene, 0, 0);
  AddSphere(scene, {1, 2, 3}, 2, AddMaterial(scene, Bumpy()));
  SurfacePoint point = Met(scene, {5, 3, 4}, {-1, 0, 0});
  const Vec3 before = point.shading_normal;
  std::optional<Material> storage;
  (void)MaterialAt(scene, point, {1, 0, 0}, storage);
  ExpectNear(point.shading_normal, before, 1e-5F);
}

// A material of the first texture, which says the normal (0.36, -0.48, 0.8) everywhere.
Material AddNormalMap(Scene& scene) {
  Picture picture;
  picture.width = picture.height = 1;
  picture.linear = {0.68F, 0.26F, 0.9F};
  Texture map;
  map.kind = Texture::Kind::kPicture;
  map.picture = std::make_shared<const Picture>(picture);
  scene.textures = {map};
  Material material = DiffuseMaterial(0.5F);
  material.normal_map = 0;
  return material;
}

TEST(BumpTest, ANormalMapSaysTheNormal) {
  Scene scene;
  const Material material = AddNormalMap(scene);
  // u along y, so that local x is world y and local y is world -x.
  AddQuad(scene, {-2, -2, 0}, {4, 0, 0}, {0, 4, 0}, AddMaterial(scene, material));
  scene.meshes.back().uvs = {{0, 1}, {0, 0}, {1, 0}, {1, 1}};
  SurfacePoint point = Met(scene, {0.5F, 0.2F, 1}, {0, 0, -1});
  std::optional<Material> storage;
  (void)MaterialAt(scene, point, {0, 0, 1}, storage);
  ExpectNear(point.shading_normal, {0.48F, 0.36F, 0.8F}, 1e-5F);
}

// A picture of normals that follows v stands out the same way where it is mirrored, whether by its
// coordinates or by v; its slopes may be scaled.
TEST(BumpTest, ANormalMapMayFollowVAndBeScaled) {
  for (const bool is_smoothed : {false, true}) {
    for (const float u_sign : {1.0F, -1.0F}) {
      for (const float v_sign : {1.0F, -1.0F}) {
        Scene scene;
        Material material = AddNormalMap(scene);
        material.normal_map_follows_v = true;
        material.normal_scale = 2;
        AddQuad(scene, {-2, -2, 0}, {4, 0, 0}, {0, 4, 0}, AddMaterial(scene, material));
        scene.meshes.back().uvs = {{0, 0}, {u_sign, 0}, {u_sign, v_sign}, {0, v_sign}};
        if (is_smoothed) scene.meshes.back().normals.assign(4, {0, 0, 1});
        SurfacePoint point = Met(scene, {0.5F, 0.2F, 1}, {0, 0, -1});
        std::optional<Material> storage;
        (void)MaterialAt(scene, point, {0, 0, 1}, storage);
        // (0.36, -0.48, 0.8), whose slopes are doubled.
        const Vec3 expected = Normalize({u_sign * 0.72F, v_sign * -0.96F, 0.8F});
        ExpectNear(point.shading_normal, expected, 1e-5F);
      }
    }
  }
}

// A step along dpdu changes u alone, by as much.
TEST(SurfaceTangentsTest, AreTheInverseOfTextureCoordinates) {
  Scene scene;
  const std::int32_t material = AddMaterial(scene, DiffuseMaterial(0.5F));
  AddSphere(scene, {0, 0, 0}, 1.5F, material);
  AddDisk(scene, {5, 0, 0}, Normalize({0.2F, 0.3F, 1}), 2, material);
  AddQuad(scene, {-9, -1, 0}, {4, 0, 1}, {1, 2, 0}, material);
  scene.meshes.back().uvs = {{0.1F, 0}, {1, 0.2F}, {1.4F, 1}, {0, 1.1F}};
  for (const Vec3 target : {Vec3{0.3F, 0.5F, 0.4F}, Vec3{5.5F, 0.7F, 0}, Vec3{-6.5F, 0.1F, 0.5F}}) {
    const SurfacePoint point = Met(scene, target + Vec3{0, 0, 9}, {0, 0, -1});
    const SurfaceTangents tangents = TangentsAt(scene, point);
    if (MeshOf(scene, point.geometry) != nullptr) {
      // Within the triangle, coordinates are linear in barycentric ones.
      const auto [p0, p1, p2] = CornersOf(scene, scene.meshes[0], point.primitive, kNoInstance);
      const auto uv = UvsOf(scene.meshes[0], point.primitive);
      ExpectNear(tangents.dpdu * (uv[1].x - uv[0].x) + tangents.dpdv * (uv[1].y - uv[0].y), p1 - p0,
                 1e-4F);
      ExpectNear(tangents.dpdu * (uv[2].x - uv[0].x) + tangents.dpdv * (uv[2].y - uv[0].y), p2 - p0,
                 1e-4F);
      continue;
    }
    constexpr float kStep = 1e-3F;
    const Vec2 here = UvAt(scene, point);
    const auto change = [&](Vec3 along) {
      SurfacePoint moved = point;
      moved.position = point.position + along * kStep;
      const Vec2 there = UvAt(scene, moved);
      return Vec2{(there.x - here.x) / kStep, (there.y - here.y) / kStep};
    };
    EXPECT_NEAR(change(tangents.dpdu).x, 1, 0.02F);
    EXPECT_NEAR(change(tangents.dpdu).y, 0, 0.02F);
    EXPECT_NEAR(change(tangents.dpdv).x, 0, 0.02F);
    EXPECT_NEAR(change(tangents.dpdv).y, 1, 0.02F);
  }
}

// pbrt-v4's: on a mesh with vertex normals both are at right angles.
TEST(SurfaceTangentsTest, OfASmoothedMeshAreAtRightAngles) {
  Scene scene;
  AddFloor(scene, DiffuseMaterial(0.5F));
  TriangleMesh& mesh = scene.meshes.back();
  mesh.normals = {Normalize({-0.3F, 0, 1}), Normalize({0.3F, 0, 1}), Normalize({0.3F, 0, 1}),
                  Normalize({-0.3F, 0, 1})};
  const SurfacePoint point = Met(scene, {1, 0.2F, 1}, {0, 0, -1});
  ASSERT_TRUE(point.has_shading_normal);
  const SurfaceTangents tangents = TangentsAt(scene, point);
  EXPECT_NEAR(Dot(tangents.dpdu, tangents.dpdv), 0, 1e-4F);
  EXPECT_NEAR(Dot(tangents.dpdu, point.shading_normal), 0, 1e-4F);
  // As long as what is left of the derivative by u across the normal.
  EXPECT_NEAR(Length(tangents.dpdv), 4 * point.shading_normal.z, 1e-3F);
  EXPECT_GT(tangents.dndu.x, 0.5F);
}

TEST(BumpTest, StretchedFacetsLieAlongU) {
  Scene scene;
  AddQuad(scene, {-2, -2, 0}, {4, 0, 0}, {0, 4, 0},
          AddMaterial(scene, ConductorMaterial(Gray(1), Gray(3), 0.5F, 0.1F)));
  scene.meshes.back().uvs = {{0, 0}, {0, 1}, {1, 1}, {1, 0}};
  SurfacePoint point = Met(scene, {0.5F, 0.2F, 1}, {0, 0, -1});
  EXPECT_EQ(point.tangent, Vec3());
  std::optional<Material> storage;
  (void)MaterialAt(scene, point, {0, 0, 1}, storage);
  ExpectNear(point.tangent, {0, 1, 0}, 1e-6F);
  ExpectNear(ShadingFrame(point).s, {0, 1, 0}, 1e-6F);
  ExpectNear(ShadingFrame(point).t, {-1, 0, 0}, 1e-6F);
}

}  // namespace
}  // namespace lucerna
