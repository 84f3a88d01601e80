// A transform that moves is right at its ends, turns evenly the shorter way, and stretches evenly.
#include "render/math/animated_transform.h"

#include <array>
#include <cmath>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace lucerna {
namespace {

using ::testing::HasSubstr;

AnimatedTransform Between(const Transform& start, const Transform& end, double from = 0,
                          double to = 1) {
  StatusOr<AnimatedTransform> animated = AnimatedTransform::Create(start, from, end, to);
  EXPECT_TRUE(animated.ok()) << animated.status();
  return *std::move(animated);
}

void ExpectNear(const Transform& a, const Transform& b, double tolerance = 1e-12) {
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t j = 0; j < 4; ++j)
      EXPECT_NEAR(a.rows()[i][j], b.rows()[i][j], tolerance) << i << " " << j;
  }
}

Transform Turn(double angle_deg, const std::array<double, 3>& axis) {
  return Transform::Rotate(angle_deg, axis[0], axis[1], axis[2]).value();
}

TEST(AnimatedTransformTest, IsItsEndsAtAndBeyondThem) {
  const Transform start = Turn(20, {1, 2, 3}) * Transform::Scale(1, 2, 3);
  const Transform end = Transform::Translate(1, 2, 3) * Turn(100, {0, 1, 1});
  const AnimatedTransform animated = Between(start, end, 2, 5);
  for (const double before : {-1e9, 1.0, 2.0})
    EXPECT_EQ(animated.At(before), start) << before;
  for (const double after : {5.0, 6.0, 1e9})
    EXPECT_EQ(animated.At(after), end) << after;
  // What is put together again is what was taken apart.
  ExpectNear(animated.At(2 + 1e-13), start);
  ExpectNear(animated.At(5 - 1e-13), end);
}

TEST(AnimatedTransformTest, TurnsEvenly) {
  for (const std::array<double, 3> axis :
       {std::array<double, 3>{0, 0, 1}, {1, 0, 0}, {0, -1, 0}, {1, 2, 3}, {-3, 1, -1}}) {
    for (const double angle_deg : {1e-7, 1.0, 90.0, 120.0, 179.0, -60.0}) {
      const Transform first = Turn(33, {2, -1, 1});
      const AnimatedTransform animated = Between(first, Turn(angle_deg, axis) * first);
      for (const double share : {0.125, 0.3, 0.5, 0.9})
        ExpectNear(animated.At(share), Turn(share * angle_deg, axis) * first);
    }
  }
}

// Quaternions are the same turned over: whichever of the two is found, the way is the shorter one.
TEST(AnimatedTransformTest, TurnsTheShorterWay) {
  ExpectNear(Between(Transform(), Turn(270, {0, 0, 1})).At(0.5), Turn(-45, {0, 0, 1}));
  ExpectNear(Between(Turn(170, {0, 0, 1}), Turn(190, {0, 0, 1})).At(0.5), Turn(180, {0, 0, 1}));
}

TEST(AnimatedTransformTest, MovesAndStretchesEvenly) {
  const AnimatedTransform moved =
      Between(Transform::Translate(1, 2, 3), Transform::Translate(5, 2, 1), 10, 20);
  ExpectNear(moved.At(12.5), Transform::Translate(2, 2, 2.5));
  ExpectNear(Between(Transform::Scale(1, 1e-20, 1), Transform::Scale(3, 3e-20, 1)).At(0.5),
             Transform::Scale(2, 2e-20, 1));
  // A large common factor does not keep the decomposition from its goal.
  const double huge = 1e30;
  const Transform end = Turn(90, {0, 0, 1}) * Transform::Scale(huge, huge, huge);
  ExpectNear(Between(Transform::Scale(huge, huge, huge), end).At(0.5),
             Turn(45, {0, 0, 1}) * Transform::Scale(huge, huge, huge), 1e-12 * huge);
}

// A camera's transform often mirrors: it must turn as one that does not.
TEST(AnimatedTransformTest, MirrorsAtAllTimesOrNever) {
  const Transform mirror = Transform::Scale(-1, 1, 1);
  ExpectNear(Between(mirror, Turn(90, {0, 1, 0}) * mirror).At(0.5), Turn(45, {0, 1, 0}) * mirror);
  const auto mixed = AnimatedTransform::Create(mirror, 0, Transform(), 1);
  EXPECT_THAT(std::string(mixed.status().message()), HasSubstr("one mirrors and the other"));
}

TEST(AnimatedTransformTest, RefusesWhatCannotBeInverted) {
  for (const Transform& flat : {Transform::Scale(1, 1, 0), Transform::Scale(0, 0, 0)}) {
    EXPECT_FALSE(AnimatedTransform::Create(flat, 0, Transform(), 1).ok());
    EXPECT_FALSE(AnimatedTransform::Create(Transform(), 0, flat, 1).ok());
  }
}

TEST(AnimatedTransformTest, MovesWithinItsTimesAlone) {
  const AnimatedTransform animated = Between(Transform(), Transform::Translate(1, 0, 0), 1, 2);
  EXPECT_TRUE(animated.MovesWithin(0, 3));
  EXPECT_TRUE(animated.MovesWithin(1.5, 1.6));
  EXPECT_FALSE(animated.MovesWithin(0, 1));
  EXPECT_FALSE(animated.MovesWithin(2, 3));
  EXPECT_FALSE(Between(Transform(), Transform()).MovesWithin(0, 1));
}

TEST(AnimatedTransformTest, KeepsItsMotionInAnotherUnit) {
  const Transform start = Transform::Translate(1, 2, 3) * Transform::Scale(1, 2, 1);
  const Transform end = Transform::Translate(4, 0, 1) * Turn(80, {1, 1, 0});
  const AnimatedTransform animated = Between(start, end);
  const Transform to_unit = Transform::Scale(8, 8, 8);
  for (const double time : {0.0, 0.25, 0.7, 1.0}) {
    ExpectNear(animated.ScaledBy(8).At(time),
               to_unit * animated.At(time) * to_unit.Inverse().value());
  }
}

}  // namespace
}  // namespace lucerna
