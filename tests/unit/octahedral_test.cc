// A direction in 32 bits comes back within 1e-4 rad, wherever it points.
#include "render/math/octahedral.h"

#include <cmath>

#include "gtest/gtest.h"

#include "render/math/rng.h"
#include "render/math/warp.h"

namespace lucerna {
namespace {

double RoundTripErrorRad(Vec3 v) {
  const Vec3 back = DecodeOctahedral(EncodeOctahedral(v));
  EXPECT_NEAR(Length(back), 1, 1e-6);
  const Vec3 cross = Cross(v, back);
  return std::atan2(static_cast<double>(Length(cross)), static_cast<double>(Dot(v, back)));
}

TEST(OctahedralTest, KeepsDirectionsWithinATenthOfAMilliradian) {
  KeyedRng rng(3);
  double worst = 0;
  for (int i = 0; i < 1000000; ++i) {
    const float u1 = rng.Uniform();
    const float u2 = rng.Uniform();
    worst = std::max(worst, RoundTripErrorRad(SquareToSphere(u1, u2)));
  }
  EXPECT_LT(worst, 1e-4);
  // A larger quantum would pass a looser bound; a finer one is not to be had in 32 bits.
  EXPECT_GT(worst, 2e-5);
}

TEST(OctahedralTest, KeepsAxesExactlyAndEdgesWell) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const float sign : {-1.0F, 1.0F}) {
      const Vec3 v = {axis == 0 ? sign : 0.0F, axis == 1 ? sign : 0.0F, axis == 2 ? sign : 0.0F};
      EXPECT_EQ(DecodeOctahedral(EncodeOctahedral(v)), v);
    }
  }
  // The folds: z = 0, and x or y = 0 on either side, with zeros of both signs.
  for (const float a : {-1.0F, -0.3F, -1e-6F, -0.0F, 0.0F, 1e-6F, 0.3F, 1.0F}) {
    for (const float b : {-1.0F, -0.7F, -1e-6F, 1e-6F, 0.7F, 1.0F}) {
      EXPECT_LT(RoundTripErrorRad(Normalize(Vec3{a, b, 0})), 1e-4) << a << " " << b;
      EXPECT_LT(RoundTripErrorRad(Normalize(Vec3{a, b, -1e-6F})), 1e-4) << a << " " << b;
      EXPECT_LT(RoundTripErrorRad(Normalize(Vec3{a, 0, b})), 1e-4) << a << " " << b;
      EXPECT_LT(RoundTripErrorRad(Normalize(Vec3{0, a, b})), 1e-4) << a << " " << b;
    }
  }
}

TEST(OctahedralTest, DecodesEveryCodeToAUnitVector) {
  KeyedRng rng(4);
  for (int i = 0; i < 1000000; ++i) {
    const Vec3 v = DecodeOctahedral(static_cast<std::uint32_t>(rng.Bits()));
    ASSERT_NEAR(Length(v), 1, 1e-6);
  }
  for (const std::uint32_t code : {0U, 0xFFFFFFFFU, 0xFFFF0000U, 0x0000FFFFU}) {
    EXPECT_NEAR(Length(DecodeOctahedral(code)), 1, 1e-6) << code;
  }
}

}  // namespace
}  // namespace lucerna
