// A path that a shading normal sends to behind a triangle.
#include "render/tracing/facet_sides.h"

#include "gtest/gtest.h"

#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

constexpr Vec3 kAbove = {0, 0.6F, 0.8F};
constexpr Vec3 kBelow = {0, 0.6F, -0.8F};

SurfacePoint SmoothedPoint(std::uint32_t geometry = 0) {
  SurfacePoint point;
  point.geometric_normal = {0, 0, 1};
  point.has_shading_normal = true;
  point.geometry = geometry;
  return point;
}

Material Metal(float alpha) {
  return ConductorMaterial(Gray(0.2F), Gray(3), alpha, alpha);
}

TEST(SidesAgreeTest, ComparesTheScatteringWithTheGeometricSides) {
  const SurfacePoint point = SmoothedPoint();
  EXPECT_TRUE(SidesAgree(point, kAbove, {0, 0, 1}, /*transmits=*/false));
  EXPECT_FALSE(SidesAgree(point, kAbove, kBelow, /*transmits=*/false));
  EXPECT_TRUE(SidesAgree(point, kAbove, kBelow, /*transmits=*/true));
  EXPECT_FALSE(SidesAgree(point, kAbove, {0, 0, 1}, /*transmits=*/true));
}

TEST(FacetSidesTest, EndsPathsWhereSidesDisagreeButAtMetalWherePathsGoOn) {
  const SurfacePoint point = SmoothedPoint();
  for (const Material& material : {DiffuseMaterial(0.5F), DielectricMaterial(1.5F),
                                   DielectricMaterial(1.5F, 0.6F), Metal(0.3F)}) {
    FacetSides sides;
    EXPECT_TRUE(sides.Scatter(point, material, kAbove, {0, 0, 1}, /*transmits=*/false));
    EXPECT_TRUE(sides.Scatter(point, material, kAbove, kBelow, /*transmits=*/true));
    EXPECT_FALSE(sides.Scatter(point, material, kAbove, kBelow, /*transmits=*/false));
    EXPECT_FALSE(sides.is_behind());
    EXPECT_FALSE(sides.MayBeLit(point, kAbove, kBelow, /*transmits=*/false));
    EXPECT_TRUE(sides.MayBeLit(point, kAbove, kBelow, /*transmits=*/true));
  }
  for (const float alpha : {0.0F, 0.1F}) {
    FacetSides sides;
    EXPECT_TRUE(sides.Scatter(point, Metal(alpha), kAbove, {0, 0, 1}, /*transmits=*/false));
    EXPECT_FALSE(sides.is_behind());
    EXPECT_TRUE(sides.Scatter(point, Metal(alpha), kAbove, kBelow, /*transmits=*/false));
    EXPECT_TRUE(sides.is_behind());
  }
}

TEST(FacetSidesTest, KeepsAPathInTheShapeThatItEnteredUntilItComesOut) {
  const Material metal = Metal(0);
  const SurfacePoint point = SmoothedPoint(7);
  FacetSides sides;
  EXPECT_TRUE(sides.MayMeet(SmoothedPoint(8), DiffuseMaterial(0.5F)));
  ASSERT_TRUE(sides.Scatter(point, metal, kAbove, kBelow, /*transmits=*/false));
  SurfacePoint instance = point;
  instance.instance = 3;
  EXPECT_FALSE(sides.MayMeet(SmoothedPoint(8), metal));
  EXPECT_FALSE(sides.MayMeet(instance, metal));
  EXPECT_FALSE(sides.MayMeet(point, DiffuseMaterial(0.5F)));
  ASSERT_TRUE(sides.MayMeet(point, metal));

  // Inside, from below.
  const Vec3 deeper = {0, -0.6F, -0.8F};
  EXPECT_FALSE(sides.MayBeLit(point, kBelow, deeper, /*transmits=*/false));
  ASSERT_TRUE(sides.Scatter(point, metal, kBelow, deeper, /*transmits=*/false));
  EXPECT_TRUE(sides.is_behind());
  EXPECT_TRUE(sides.MayBeLit(point, kBelow, kAbove, /*transmits=*/false));
  ASSERT_TRUE(sides.Scatter(point, metal, kBelow, kAbove, /*transmits=*/false));
  EXPECT_FALSE(sides.is_behind());
  EXPECT_TRUE(sides.MayMeet(SmoothedPoint(8), DiffuseMaterial(0.5F)));
}

}  // namespace
}  // namespace lucerna
