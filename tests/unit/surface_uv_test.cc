// Texture coordinates are pbrt-v4's on every shape, and their slopes are the differences between
// neighbouring points.
#include "render/geometry/surface_uv.h"

#include <cmath>
#include <memory>

#include "gtest/gtest.h"

#include "render/formats/read_scene.h"
#include "render/math/warp.h"
#include "tests/support/memory_files.h"

namespace lucerna {
namespace {

struct Surfaces {
  explicit Surfaces(const std::string& world) {
    MemoryFiles files({{"s.pbrt", "Camera \"perspective\" WorldBegin " + world}});
    ParsedScene parsed = ReadScene(files, "s.pbrt");
    EXPECT_TRUE(parsed.ok()) << parsed.ToStatus();
    scene = std::move(parsed.scene);
    intersector = Intersector::Create(scene).value();
  }
  [[nodiscard]] SurfacePoint Met(Vec3 origin, Vec3 direction) const {
    const Ray ray = {origin, direction, HUGE_VALF};
    Hit hit;
    EXPECT_TRUE(intersector->Intersect(ray, hit));
    return intersector->SurfaceAt(ray, hit);
  }

  Scene scene;
  std::unique_ptr<Intersector> intersector;
};

void ExpectUv(const Surfaces& surfaces, Vec3 origin, Vec3 direction, Vec2 expected) {
  const Vec2 uv = UvAt(surfaces.scene, surfaces.Met(origin, direction));
  EXPECT_NEAR(uv.x, expected.x, 1e-5F);
  EXPECT_NEAR(uv.y, expected.y, 1e-5F);
}

TEST(SurfaceUvTest, TrianglesInterpolateTheirCorners) {
  const Surfaces given(
      "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"point2 uv\" [1 1 3 1 1 5]");
  ExpectUv(given, {0.25F, 0.5F, 1}, {0, 0, -1}, {1.5F, 3});
  const Surfaces st(
      "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"point2 st\" [1 1 3 1 1 5]");
  ExpectUv(st, {0.25F, 0.5F, 1}, {0, 0, -1}, {1.5F, 3});
  const Surfaces bare("Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0]");
  ExpectUv(bare, {0.25F, 0.5F, 1}, {0, 0, -1}, {0.75F, 0.5F});
  // Winding that is turned over takes the coordinates along.
  const Surfaces turned(
      "ReverseOrientation Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"point2 uv\" "
      "[1 1 3 1 1 5]");
  ExpectUv(turned, {0.25F, 0.5F, 1}, {0, 0, -1}, {1.5F, 3});
}

TEST(SurfaceUvTest, SpheresCountFromXToYAndFromSouthToNorth) {
  const Surfaces plain("Shape \"sphere\"");
  ExpectUv(plain, {0, 5, 0}, {0, -1, 0}, {0.25F, 0.5F});
  ExpectUv(plain, {-5, 0, 0}, {1, 0, 0}, {0.5F, 0.5F});
  ExpectUv(plain, {0, -5, 0}, {0, 1, 0}, {0.75F, 0.5F});
  EXPECT_NEAR(UvAt(plain.scene, plain.Met({0, 0, 5}, {0, 0, -1})).y, 1, 1e-5);
  const Vec3 slanted = Normalize({1, 1, 1});
  ExpectUv(plain, slanted * 5, -slanted, {0.125F, 1 - std::acos(slanted.z) / kPi});
  // The transform turns the coordinates with the shape, also when it is an instance.
  const Surfaces turned("Rotate 90 0 0 1 Translate 1 0 0 Shape \"sphere\"");
  ExpectUv(turned, {0, 5, 0}, {0, -1, 0}, {0, 0.5F});
  const Surfaces instance(
      "ObjectBegin \"o\" Rotate 45 0 0 1 Shape \"sphere\" ObjectEnd Rotate 45 0 0 1 "
      "ObjectInstance \"o\"");
  ExpectUv(instance, {-5, 0, 0}, {1, 0, 0}, {0.25F, 0.5F});
}

TEST(SurfaceUvTest, DisksCountFromTheRimInwards) {
  const Surfaces ring(
      "Translate 1 0 0 Scale 2 2 2 Shape \"disk\" \"float radius\" 3 \"float innerradius\" 1");
  ExpectUv(ring, {1, 5, 3}, {0, 0, -1}, {0.25F, 0.25F});
  ExpectUv(ring, {-2, 0, 3}, {0, 0, -1}, {0.5F, 0.75F});
}

TEST(SurfaceUvTest, SlopesAreThoseOfNeighbouringPoints) {
  for (const char* world :
       {"Shape \"sphere\" \"float radius\" 2", "Shape \"disk\" \"float radius\" 4",
        "Shape \"trianglemesh\" \"point3 P\" [-9 -9 0.5 9 -8 0 1 9 -1] \"point2 uv\" [0 1 3 2 -1 "
        "7]"}) {
    SCOPED_TRACE(world);
    const Surfaces surfaces(world);
    const Vec3 origin = {0.7F, 0.9F, 5};
    const SurfacePoint here = surfaces.Met(origin, {0, 0, -1});
    const Vec2 uv = UvAt(surfaces.scene, here);
    const UvSlopes slopes = UvSlopesAt(surfaces.scene, here);
    const Frame frame(here.geometric_normal);
    double u = 0;
    double v = 0;
    constexpr float kStep = 1e-2F;
    for (const Vec3 side : {frame.s, frame.t}) {
      const Vec3 next = here.position + side * kStep + here.geometric_normal;
      const Vec3 before = here.position - side * kStep + here.geometric_normal;
      const Vec2 a = UvAt(surfaces.scene, surfaces.Met(next, -here.geometric_normal));
      const Vec2 b = UvAt(surfaces.scene, surfaces.Met(before, -here.geometric_normal));
      u += std::pow(static_cast<double>(a.x - b.x) / static_cast<double>(2 * kStep), 2);
      v += std::pow(static_cast<double>(a.y - b.y) / static_cast<double>(2 * kStep), 2);
    }
    EXPECT_NEAR(slopes.u / u, 1, 5e-3) << uv.x;
    EXPECT_NEAR(slopes.v / v, 1, 5e-3) << uv.y;
  }
}

}  // namespace
}  // namespace lucerna
