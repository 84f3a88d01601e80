// A transform moves points, directions and normals as affine maps do, and knows what it keeps.
#include "render/math/transform.h"

#include <cmath>

#include "gtest/gtest.h"

namespace lucerna {
namespace {

void ExpectNear(Vec3 actual, Vec3 expected, float error) {
  EXPECT_NEAR(actual.x, expected.x, error);
  EXPECT_NEAR(actual.y, expected.y, error);
  EXPECT_NEAR(actual.z, expected.z, error);
}

TEST(TransformTest, AppliesTheRightFactorFirst) {
  const Transform both = Transform::Translate(1, 2, 3) * Transform::Scale(2, 2, 2);
  EXPECT_EQ(both.Point({1, 1, 1}), (Vec3{3, 4, 5}));
  EXPECT_EQ(both.Vector({1, 1, 1}), (Vec3{2, 2, 2}));
}

TEST(TransformTest, TurnsCounterClockwiseSeenFromTheTipOfTheAxis) {
  ExpectNear(Transform::Rotate(90, 0, 0, 2).value().Point({1, 0, 0}), {0, 1, 0}, 1e-6F);
  ExpectNear(Transform::Rotate(90, 1, 0, 0).value().Point({0, 1, 0}), {0, 0, 1}, 1e-6F);
  ExpectNear(Transform::Rotate(120, 1, 1, 1).value().Point({1, 0, 0}), {0, 1, 0}, 1e-6F);
  EXPECT_FALSE(Transform::Rotate(90, 0, 0, 0).ok());
}

TEST(TransformTest, LooksAlongPlusZWithUpOnTop) {
  const Transform camera = Transform::LookAt({1, 2, 3}, {1, 2, 8}, {0, 1, 0}).value();
  ExpectNear(camera.Point({1, 2, 3}), {0, 0, 0}, 1e-6F);
  ExpectNear(camera.Point({1, 2, 8}), {0, 0, 5}, 1e-6F);
  ExpectNear(camera.Vector({0, 1, 0}), {0, 1, 0}, 1e-6F);
  // Left-handed: with z forward and y up, x is to the right.
  ExpectNear(camera.Vector({1, 0, 0}), {1, 0, 0}, 1e-6F);
  EXPECT_FALSE(Transform::LookAt({1, 2, 3}, {1, 2, 3}, {0, 1, 0}).ok());
  EXPECT_FALSE(Transform::LookAt({0, 0, 0}, {0, 3, 0}, {0, 1, 0}).ok());
}

TEST(TransformTest, InvertsWhatCanBeInverted) {
  const Transform map = Transform::Translate(1, -2, 3) * Transform::Rotate(33, 1, 2, 3).value() *
                        Transform::Scale(2, -3, 0.01);
  const Transform identity = map * map.Inverse().value();
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t j = 0; j < 4; ++j) {
      EXPECT_NEAR(identity.rows()[i][j], i == j ? 1 : 0, 1e-12);
    }
  }
  EXPECT_FALSE(Transform::Scale(1, 0, 1).Inverse().ok());
}

TEST(TransformTest, KeepsNormalsAcrossTheirSurface) {
  const Transform map = Transform::Rotate(40, 1, 0, 1).value() * Transform::Scale(1, 5, -0.1);
  const Vec3 tangent1 = {1, 0, -1};
  const Vec3 tangent2 = {0, 1, -1};
  const Vec3 normal = map.Normal(Cross(tangent1, tangent2));
  EXPECT_NEAR(Dot(normal, Normalize(map.Vector(tangent1))), 0, 1e-6);
  EXPECT_NEAR(Dot(normal, Normalize(map.Vector(tangent2))), 0, 1e-6);
  // On the side that the normal was on, also under a mirror.
  EXPECT_GT(Dot(normal, map.Vector(Cross(tangent1, tangent2))), 0);
}

TEST(TransformTest, KnowsMirrorsAndUniformScales) {
  EXPECT_FALSE(Transform::Scale(1, 2, 3).SwapsHandedness());
  EXPECT_TRUE(Transform::Scale(1, -2, 3).SwapsHandedness());
  EXPECT_FALSE(Transform::Scale(-1, -2, 3).SwapsHandedness());
  const Transform turned = Transform::Rotate(10, 1, 2, 3).value() * Transform::Scale(3, -3, 3);
  EXPECT_NEAR(turned.UniformScale().value(), 3, 1e-12);
  EXPECT_FALSE(Transform::Scale(1, 1, 1.001).UniformScale().ok());
}

TEST(TransformTest, DividesByTheWeightOfAProjectiveMap) {
  const Transform map({{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 2}}});
  EXPECT_EQ(map.Point({2, 4, 6}), (Vec3{1, 2, 3}));
  EXPECT_FALSE(Transform::Scale(HUGE_VAL, 1, 1).IsFinite());
}

}  // namespace
}  // namespace lucerna
