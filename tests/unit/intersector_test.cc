// Rays meet spheres and disks where algebra says, and never the surface that they leave.
#include "render/geometry/intersector.h"

#include <cmath>
#include <limits>
#include <memory>
#include <set>
#include <utility>
#include <vector>

#include "gtest/gtest.h"

#include "render/base/parallel.h"
#include "render/math/rng.h"
#include "render/math/warp.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

Vec3 RandomDirection(KeyedRng& rng) {
  const float u1 = rng.Uniform();
  const float u2 = rng.Uniform();
  return SquareToSphere(u1, u2);
}

Vec3 RandomPoint(KeyedRng& rng, float extent) {
  const float x = rng.Uniform();
  const float y = rng.Uniform();
  const float z = rng.Uniform();
  return Vec3{x - 0.5F, y - 0.5F, z - 0.5F} * (2 * extent);
}

// The distances at which a line meets a sphere, in long double; false when it misses.
bool SphereRoots(const Ray& ray, const Sphere& sphere, long double& near, long double& far) {
  using Long = long double;
  const Long o[3] = {Long{ray.origin.x} - Long{sphere.center.x},
                     Long{ray.origin.y} - Long{sphere.center.y},
                     Long{ray.origin.z} - Long{sphere.center.z}};
  const Long d[3] = {ray.direction.x, ray.direction.y, ray.direction.z};
  Long a = 0;
  Long b = 0;
  Long c = -Long{sphere.radius} * Long{sphere.radius};
  for (int i = 0; i < 3; ++i) {
    a += d[i] * d[i];
    b += o[i] * d[i];
    c += o[i] * o[i];
  }
  const Long discriminant = b * b - a * c;
  if (discriminant < 0) return false;
  near = (-b - std::sqrt(discriminant)) / a;
  far = (-b + std::sqrt(discriminant)) / a;
  return true;
}

struct SphereCase {
  float radius;
  float from_radii;  // distance of the origin from the centre, in radii
  Vec3 center;
};

class SphereTest : public testing::TestWithParam<SphereCase> {};

TEST_P(SphereTest, IsMetWhereTheQuadraticSays) {
  const auto [radius, from_radii, center] = GetParam();
  Scene scene;
  AddMaterial(scene, DiffuseMaterial(0.5F));
  AddSphere(scene, center, radius, 0);
  const auto intersector = Intersector::Create(scene).value();
  KeyedRng rng(11);
  int hits = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vec3 origin = center + RandomDirection(rng) * (radius * from_radii);
    // Towards a point in a ball a little larger than the sphere: hits, misses, near-tangents.
    const Vec3 target = center + RandomDirection(rng) * (radius * 1.2F * rng.Uniform());
    const Ray ray = {origin, Normalize(target - origin), HUGE_VALF};
    long double near = 0;
    long double far = 0;
    const bool crosses = SphereRoots(ray, scene.spheres[0], near, far);
    const long double expected = near > 0 ? near : far;
    Hit hit;
    const bool met = intersector->Intersect(ray, hit);
    ASSERT_EQ(met, crosses && expected > 0);
    ASSERT_EQ(intersector->Occluded(ray), met);
    if (!met) continue;
    ++hits;
    // The one rounding is that of t itself to float.
    ASSERT_NEAR(static_cast<double>(hit.t / expected), 1, 1.3e-7);
    const SurfacePoint surface = intersector->SurfaceAt(ray, hit);
    ASSERT_NEAR(Length(surface.position - center) / radius, 1,
                1e-6F * (1 + MaxAbs(center) / radius));
    ASSERT_NEAR(Length(surface.geometric_normal), 1, 1e-6);
  }
  EXPECT_GT(hits, 1000);
}
INSTANTIATE_TEST_SUITE_P(Places, SphereTest,
                         testing::Values(SphereCase{1, 0, {}}, SphereCase{1, 0.5F, {}},
                                         SphereCase{1, 0.999F, {}}, SphereCase{1, 1.001F, {}},
                                         SphereCase{1, 3, {5, -7, 2}}, SphereCase{1e-3F, 1e3F, {}},
                                         SphereCase{1, 1e6F, {}}, SphereCase{1e4F, 2, {}},
                                         SphereCase{1e5F, 0.9F, {1e5F, 0, 0}}));

TEST(SphereTest, TurnsItsNormalInwardWhenAsked) {
  for (const bool inward : {false, true}) {
    Scene scene;
    AddMaterial(scene, DiffuseMaterial(0.5F));
    AddSphere(scene, {1, 2, 3}, 2, 0, kNoAreaLight, inward);
    const auto intersector = Intersector::Create(scene).value();
    const Ray ray = {{1, 2, -9}, {0, 0, 1}, HUGE_VALF};
    Hit hit;
    ASSERT_TRUE(intersector->Intersect(ray, hit));
    EXPECT_FLOAT_EQ(hit.t, 10);
    EXPECT_EQ(intersector->SurfaceAt(ray, hit).geometric_normal,
              (Vec3{0, 0, inward ? 1.0F : -1.0F}));
    EXPECT_FALSE(intersector->Intersect({ray.origin, ray.direction, 9.99F}, hit));
  }
}

TEST(DiskTest, HasItsHoleAndItsRim) {
  Scene scene;
  AddMaterial(scene, DiffuseMaterial(0.5F));
  AddDisk(scene, {1, 1, 1}, {0, 0, 1}, 2, 0);
  scene.disks[0].inner_radius = 1;
  const auto intersector = Intersector::Create(scene).value();
  Hit hit;
  for (const float side : {-1.0F, 1.0F}) {
    const auto meets = [&](float x) {
      return intersector->Intersect({{1 + x, 1, 1 + 3 * side}, {0, 0, -side}, HUGE_VALF}, hit);
    };
    EXPECT_FALSE(meets(0));
    EXPECT_FALSE(meets(0.999F));
    EXPECT_TRUE(meets(1.001F));
    EXPECT_FLOAT_EQ(hit.t, 3);
    EXPECT_TRUE(meets(1.999F));
    EXPECT_FALSE(meets(2.001F));
    EXPECT_FALSE(meets(-0.999F));
    EXPECT_TRUE(meets(-1.5F));
  }
  EXPECT_FALSE(intersector->Intersect({{-5, 1, 1}, {1, 0, 0}, HUGE_VALF}, hit));
}

TEST(TriangleTest, GivesBarycentricsNormalsAndNumbers) {
  Scene scene;
  const std::int32_t first = AddMaterial(scene, DiffuseMaterial(0.5F));
  const std::int32_t second = AddMaterial(scene, DiffuseMaterial(0.6F));
  AddQuad(scene, {0, 0, 5}, {1, 0, 0}, {0, 1, 0}, first);
  AddQuad(scene, {0, 0, 7}, {1, 0, 0}, {0, 1, 0}, second);
  scene.meshes[1].normals.assign(4, Normalize({0.6F, 0, 0.8F}));
  const auto intersector = Intersector::Create(scene).value();
  Hit hit;
  const Ray down = {{0.75F, 0.25F, 10}, {0, 0, -1}, HUGE_VALF};
  ASSERT_TRUE(intersector->Intersect(down, hit));
  EXPECT_FLOAT_EQ(hit.t, 3);
  EXPECT_EQ(hit.geometry, 1U);
  const SurfacePoint top = intersector->SurfaceAt(down, hit);
  EXPECT_NEAR(Length(top.position - Vec3{0.75F, 0.25F, 7}), 0, 1e-6);
  EXPECT_EQ(top.geometric_normal, (Vec3{0, 0, 1}));
  EXPECT_NEAR(top.shading_normal.x, 0.6F, 1e-6);
  EXPECT_TRUE(top.has_shading_normal);
  EXPECT_EQ(top.material, 1U);
  const Ray up = {{0.25F, 0.75F, 0}, {0, 0, 1}, HUGE_VALF};
  ASSERT_TRUE(intersector->Intersect(up, hit));
  const SurfacePoint bottom = intersector->SurfaceAt(up, hit);
  EXPECT_EQ(bottom.geometry, 0U);
  EXPECT_EQ(bottom.primitive, 1U);
  EXPECT_FALSE(bottom.has_shading_normal);
}

// A mesh can lose all its triangles on the way; that is no reason to refuse the scene.
TEST(IntersectorTest, TakesEmptyMeshesAndEmptyScenes) {
  Scene scene;
  AddMaterial(scene, DiffuseMaterial(0.5F));
  Hit hit;
  const auto empty = Intersector::Create(scene);
  ASSERT_TRUE(empty.ok());
  EXPECT_FALSE((*empty)->Intersect({{0, 0, 0}, {0, 0, 1}, HUGE_VALF}, hit));
  scene.meshes.emplace_back();
  AddSphere(scene, {0, 0, 3}, 1, 0);
  const auto with_empty_mesh = Intersector::Create(scene);
  ASSERT_TRUE(with_empty_mesh.ok()) << with_empty_mesh.status();
  EXPECT_TRUE((*with_empty_mesh)->Intersect({{0, 0, 0}, {0, 0, 1}, HUGE_VALF}, hit));
}

struct Leaving {
  float scale;
  float offset;  // of the centre from the origin, in scales
};

class LeavingPointTest : public testing::TestWithParam<Leaving> {};

// A random shape is met by a ray, and random rays leave on both sides. A triangle and a disk may
// never be met again; nor a sphere from outside; and from inside only across a chord.
TEST_P(LeavingPointTest, IsOffTheSurface) {
  const auto [scale, offset] = GetParam();
  constexpr int kShapes = 300;
  constexpr int kRays = 400;
  KeyedRng rng(23);
  for (int shape = 0; shape < kShapes; ++shape) {
    Scene scene;
    AddMaterial(scene, DiffuseMaterial(0.5F));
    const Vec3 center = RandomDirection(rng) * (scale * offset);
    const int kind = shape % 3;
    if (kind == 0) {
      TriangleMesh mesh;
      for (int i = 0; i < 3; ++i)
        mesh.positions.push_back(center + RandomPoint(rng, scale));
      mesh.indices = {0, 1, 2};
      scene.meshes.push_back(mesh);
    } else if (kind == 1) {
      AddSphere(scene, center, scale, 0);
    } else {
      AddDisk(scene, center, RandomDirection(rng), scale, 0);
    }
    const auto intersector = Intersector::Create(scene).value();
    for (int i = 0; i < kRays; ++i) {
      Vec3 target = center;
      if (kind == 0) {
        const float u1 = rng.Uniform();
        const float u2 = rng.Uniform();
        float b1 = 0;
        float b2 = 0;
        SquareToTriangle(u1, u2, b1, b2);
        const std::vector<Vec3>& p = scene.meshes[0].positions;
        target = p[0] * (1 - b1 - b2) + p[1] * b1 + p[2] * b2;
      }
      const Vec3 origin = center + RandomDirection(rng) * (3 * scale);
      const Ray ray = {origin, Normalize(target - origin), HUGE_VALF};
      Hit hit;
      if (!intersector->Intersect(ray, hit)) continue;
      const SurfacePoint surface = intersector->SurfaceAt(ray, hit);
      const Vec3 direction = RandomDirection(rng);
      const Ray leaving = {LeavingPoint(surface, direction), direction, HUGE_VALF};
      const bool met = intersector->Intersect(leaving, hit);
      const float cosine = Dot(direction, surface.geometric_normal);
      if (kind == 1 && cosine < 0) {
        ASSERT_TRUE(met || cosine > -1e-3F);
        if (!met) continue;
        // The chord of the sphere, within what the offset moves its ends.
        const float slack = 40 * surface.clearance / -cosine;
        ASSERT_NEAR(hit.t, -2 * scale * cosine, slack) << "sphere " << shape;
      } else {
        ASSERT_FALSE(met) << "shape " << shape << " of kind " << kind << ", cosine " << cosine;
      }
    }
  }
}
INSTANTIATE_TEST_SUITE_P(Scales, LeavingPointTest,
                         testing::Values(Leaving{1, 0}, Leaving{1, 10}, Leaving{1, 1000},
                                         Leaving{1e-3F, 0}, Leaving{1e-3F, 1000}, Leaving{1e5F, 0},
                                         Leaving{1e5F, 10}));

// Coordinates of 1e-6, 1 and 1e6 with sizes as large, and far below them: at 1e-5 of its
// coordinates a shape is some hundred numbers wide.
INSTANTIATE_TEST_SUITE_P(Coordinates, LeavingPointTest,
                         testing::Values(Leaving{1e-6F, 0}, Leaving{1e-6F, 1}, Leaving{1e-9F, 1e3F},
                                         Leaving{1e-11F, 1e5F}, Leaving{1e-5F, 1e5F},
                                         Leaving{1e6F, 0}, Leaving{1e6F, 1}, Leaving{1e3F, 1e3F},
                                         Leaving{10, 1e5F}));

// A tree that holds large triangles more than once finds the same hits, to the last bit.
TEST(IntersectorTest, GivesTheSameHitsWhetherTrianglesAreSplitOrNot) {
  KeyedRng rng(21);
  Scene scene;
  AddMaterial(scene, DiffuseMaterial(0.5F));
  TriangleMesh mesh;
  for (std::uint32_t i = 0; i < 3000; ++i) {
    mesh.indices.push_back(i);
    const Vec3 long_side = RandomPoint(rng, i % 7 == 0 ? 5.0F : 0.2F);
    mesh.positions.push_back(RandomPoint(rng, 3) + long_side);
  }
  scene.meshes.push_back(mesh);
  const auto plain = Intersector::Create(scene, {.robust_rays = true, .split_triangles = false});
  const auto split = Intersector::Create(scene, {.robust_rays = true, .split_triangles = true});
  int met = 0;
  for (int i = 0; i < 20000; ++i) {
    const Ray ray = {RandomPoint(rng, 4), RandomDirection(rng), HUGE_VALF};
    Hit a;
    Hit b;
    const bool is_met = (*plain)->Intersect(ray, a);
    ASSERT_EQ((*split)->Intersect(ray, b), is_met);
    ASSERT_EQ((*split)->Occluded(ray), is_met);
    if (!is_met) continue;
    ++met;
    ASSERT_TRUE(a.t == b.t && a.u == b.u && a.v == b.v && a.primitive == b.primitive);
  }
  EXPECT_GT(met, 5000);
}

// Without shading normals a hit has the normal of its triangle.
TEST(IntersectorTest, SmoothsOnlyWhereItIsAsked) {
  Scene scene;
  AddQuad(scene, {-1, -1, 0}, {2, 0, 0}, {0, 2, 0}, AddMaterial(scene, DiffuseMaterial(0.5F)));
  scene.meshes[0].normals.assign(4, Normalize({1, 0, 1}));
  const Ray ray = {{0.2F, 0.3F, 1}, {0, 0, -1}, HUGE_VALF};
  for (const bool smooth : {true, false}) {
    const auto intersector = Intersector::Create(scene, {.shading_normals = smooth}).value();
    Hit hit;
    ASSERT_TRUE(intersector->Intersect(ray, hit));
    const SurfacePoint point = intersector->SurfaceAt(ray, hit);
    EXPECT_EQ(point.has_shading_normal, smooth);
    EXPECT_EQ(point.shading_normal == point.geometric_normal, !smooth);
  }
}

// A hit that is computed from the shape alone is the hit that tracing finds: of spheres and disks
// to the bit, of triangles as near as float tells.
TEST(IntersectorTest, FindsAHitAgainOnItsShape) {
  KeyedRng rng(5);
  Scene scene;
  AddMaterial(scene, DiffuseMaterial(0.5F));
  for (int i = 0; i < 30; ++i) {
    AddQuad(scene, RandomPoint(rng, 3), RandomDirection(rng), RandomDirection(rng), 0);
    AddSphere(scene, RandomPoint(rng, 3), 0.4F, 0);
    AddDisk(scene, RandomPoint(rng, 3), RandomDirection(rng), 0.5F, 0);
    // Through near walls of these, far ones are found.
    if (i % 2 == 0) scene.spheres.back().traits.alpha = 0.5F;
  }
  const auto intersector = Intersector::Create(scene).value();
  std::set<std::uint32_t> shapes;
  for (int i = 0; i < 20000; ++i) {
    const Ray ray = {RandomPoint(rng, 4), RandomDirection(rng), HUGE_VALF};
    Hit traced;
    if (!intersector->Intersect(ray, traced)) continue;
    const std::uint32_t shape = intersector->ShapeOf(traced);
    shapes.insert(shape);
    const Hit found = intersector->HitOn(shape, ray);
    ASSERT_EQ(found.geometry, traced.geometry);
    ASSERT_EQ(found.primitive, traced.primitive);
    if (traced.geometry >= scene.meshes.size()) {
      ASSERT_EQ(found.t, traced.t);
      continue;
    }
    // Seen edge-on a triangle tells less.
    const Vec3 normal = intersector->SurfaceAt(ray, traced).geometric_normal;
    const float slack = 2e-6F / std::max(1e-3F, std::abs(Dot(normal, ray.direction)));
    ASSERT_NEAR(found.t, traced.t, 4 * slack);
    ASSERT_NEAR(found.u, traced.u, slack * 10);
    ASSERT_NEAR(found.v, traced.v, slack * 10);
  }
  EXPECT_EQ(shapes.size(), 120U) << "each has its number";
  EXPECT_EQ(*shapes.rbegin(), 119U);
}

// Rays at the edges and corners of a triangle have their hit on it, whatever rounding says.
TEST(IntersectorTest, KeepsHitsOnTheirTriangle) {
  Scene scene;
  AddQuad(scene, {0.1F, 0.2F, 3}, {0.7F, 0.1F, 0}, {0, 0.9F, 0.3F},
          AddMaterial(scene, DiffuseMaterial(0.5F)));
  const auto intersector = Intersector::Create(scene).value();
  const TriangleMesh& mesh = scene.meshes[0];
  KeyedRng rng(6);
  for (int i = 0; i < 2000; ++i) {
    const float along = i % 10 == 0 ? 0 : rng.Uniform();
    const Vec3 target =
        mesh.positions[mesh.indices[0]] * (1 - along) + mesh.positions[mesh.indices[1]] * along;
    const Ray ray = {{0, 0, 0}, Normalize(target), HUGE_VALF};
    const Hit hit = intersector->HitOn(0, ray);
    ASSERT_GE(hit.u, 0);
    ASSERT_GE(hit.v, 0);
    ASSERT_LE(hit.u + hit.v, 1 + 1e-6F);
    ASSERT_NEAR(hit.t, Length(target), 1e-5F);
  }
  // In the triangle's own plane, two units from its middle.
  Scene flat;
  AddQuad(flat, {0, 0, 0}, {3, 0, 0}, {0, 3, 0}, AddMaterial(flat, DiffuseMaterial(0.5F)));
  const auto on_edge = Intersector::Create(flat).value();
  const Hit edge_on = on_edge->HitOn(0, {{0, 1, 0}, {1, 0, 0}, HUGE_VALF});
  EXPECT_EQ(edge_on.t, 2);
  EXPECT_EQ(edge_on.u, 1.0F / 3);
  EXPECT_EQ(edge_on.v, 1.0F / 3);
}

TEST(IntersectorTest, GivesEveryThreadTheSameHits) {
  Scene scene;
  AddMaterial(scene, DiffuseMaterial(0.5F));
  KeyedRng rng(31);
  for (int i = 0; i < 200; ++i) {
    AddSphere(scene, RandomPoint(rng, 5), 0.3F, 0);
    AddQuad(scene, RandomPoint(rng, 5), RandomDirection(rng), RandomDirection(rng), 0);
  }
  const auto intersector = Intersector::Create(scene).value();
  const auto again = Intersector::Create(scene).value();
  constexpr std::size_t kRays = 20000;
  const auto trace = [&](const Intersector& with, int threads) {
    std::vector<Hit> hits(kRays);
    ThreadTeam team(threads);
    team.For(kRays, 64, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        KeyedRng own(i);
        const Vec3 origin = RandomPoint(own, 6);
        if (!with.Intersect({origin, RandomDirection(own), HUGE_VALF}, hits[i])) hits[i].t = -1;
      }
    });
    return hits;
  };
  const std::vector<Hit> one = trace(*intersector, 1);
  const std::vector<Hit> three = trace(*again, 3);
  for (std::size_t i = 0; i < kRays; ++i) {
    ASSERT_EQ(one[i].t, three[i].t);
    ASSERT_EQ(one[i].u, three[i].u);
    ASSERT_EQ(one[i].geometry, three[i].geometry);
    ASSERT_EQ(one[i].primitive, three[i].primitive);
  }
}

// Debian's Embree ends the process for such rays when there are shapes beside triangles.
TEST(IntersectorTest, RaysThatAreNoNumbersOrBeyondAllRangeMeetNothing) {
  Scene scene;
  const std::int32_t white = AddMaterial(scene, DiffuseMaterial(0.5F));
  AddSphere(scene, {0, 0, 0}, 1, white);
  AddQuad(scene, {-1, -1, 2}, {2, 0, 0}, {0, 2, 0}, white);
  const auto intersector = Intersector::Create(scene).value();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinity = std::numeric_limits<float>::infinity();
  for (const float odd : {nan, infinity, -infinity, 1e30F, -3e18F}) {
    for (const Ray& ray :
         {Ray{{odd, 0, -3}, {0, 0, 1}, HUGE_VALF}, Ray{{0, odd, 5}, {0, 0, -1}, 10},
          Ray{{0, 0, -3}, {0, odd, 1}, HUGE_VALF}}) {
      Hit hit;
      EXPECT_FALSE(intersector->Intersect(ray, hit)) << odd;
      EXPECT_FALSE(intersector->Occluded(ray)) << odd;
    }
  }
}

// As many as a coordinator has whose jobs wait for workers.
TEST(IntersectorTest, ThousandsOfScenesMayBeThereAtOnce) {
  Scene scene;
  AddQuad(scene, {-1, -1, 0}, {2, 0, 0}, {0, 2, 0}, AddMaterial(scene, DiffuseMaterial(0.5F)));
  std::vector<std::unique_ptr<Intersector>> intersectors;
  for (int i = 0; i < 3000; ++i) {
    StatusOr<std::unique_ptr<Intersector>> made = Intersector::Create(scene);
    ASSERT_TRUE(made.ok()) << i << ": " << made.status();
    intersectors.push_back(std::move(*made));
  }
  Hit hit;
  EXPECT_TRUE(intersectors.back()->Intersect({{0, 0, 1}, {0, 0, -1}}, hit));
}

}  // namespace
}  // namespace lucerna
