// Rays meet a piece of a curve where they first enter one of its balls, and never from inside.
#include <cmath>
#include <numbers>
#include <vector>

#include "gtest/gtest.h"

#include "render/geometry/shape_geometry.h"
#include "render/math/rng.h"
#include "render/math/warp.h"
#include "render/scene/shape_curve.h"
#include "tests/support/chi_square.h"

namespace lucerna {
namespace {

CurvePiece Piece(Vec3 from, Vec3 to, float from_radius, float to_radius) {
  CurvePiece piece;
  piece.from = from;
  piece.to = to;
  piece.from_radius = from_radius;
  piece.to_radius = to_radius;
  piece.center = from * 0.5F + to * 0.5F;
  return piece;
}

std::vector<CurvePiece> Pieces() {
  return {Piece({0, 0, 0}, {1, 0.5F, 0.2F}, 0.2F, 0.2F), Piece({0, 0, 0}, {0, 0, 1}, 0.1F, 0.6F),
          Piece({1, 0, 0}, {0, 0, 0}, 0.5F, 0), Piece({0, 0, 0}, {0.1F, 0, 0}, 0.5F, 0.1F),
          Piece({0, 0, 0}, {0, 0, 0}, 0.5F, 0.5F)};
}

// By balls one after the other.
double FirstEntry(const CurvePiece& piece, Double3 origin, Double3 direction) {
  constexpr int kBalls = 20000;
  double first = HUGE_VAL;
  for (int i = 0; i <= kBalls; ++i) {
    const double s = static_cast<double>(i) / kBalls;
    const CurvePiece::Axis axis(piece);
    const double radius = axis.radius + axis.growth * s;
    const Double3 to = axis.from + axis.along * s - origin;
    const double along = Dot(to, direction);
    const double left = radius * radius - Dot(to - direction * along, to - direction * along);
    if (left >= 0) first = std::min(first, along - std::sqrt(left));
  }
  return first;
}

TEST(CurvePieceTest, RaysEnterTheFirstBall) {
  KeyedRng rng(7);
  for (const CurvePiece& piece : Pieces()) {
    int hits = 0;
    for (int i = 0; i < 300; ++i) {
      const float u1 = rng.Uniform();
      const float u2 = rng.Uniform();
      const Vec3 origin = piece.center + SquareToSphere(u1, u2) * 3;
      const Vec3 target =
          piece.center + Vec3{rng.Uniform() - 0.5F, rng.Uniform() - 0.5F, rng.Uniform() - 0.5F};
      const Vec3 direction = Normalize(target - origin);
      const double expected = FirstEntry(piece, Double3(origin), Double3(direction));
      float t = 0;
      const bool is_hit = IntersectShape(piece, origin, direction, 0, HUGE_VALF, t);
      // Between two of the 20000 balls the cone bulges by less than 1e-8.
      ASSERT_EQ(is_hit, expected < HUGE_VAL) << i;
      if (!is_hit) continue;
      ++hits;
      // A grazing ray enters far sooner for a little more radius.
      const ShapeFace face = FaceAt(piece, {origin, direction, HUGE_VALF}, t);
      const auto slant = static_cast<double>(-Dot(face.normal, direction));
      ASSERT_NEAR(t, expected, 1e-6 + 1e-7 / std::max(slant, 1e-3)) << i;
      EXPECT_GE(slant, -1e-3);
      EXPECT_NEAR(piece.SignedDistance(Double3(face.position)), 0, 1e-6);
      EXPECT_NEAR(Length(face.position - (origin + direction * t)), 0, 1e-5);
      // The normal is the gradient of the distance.
      const Vec3 out = face.position + face.normal * 0.01F;
      EXPECT_NEAR(piece.SignedDistance(Double3(out)), 0.01, 1e-5);
      // It is left in all outward directions, and from within.
      const Vec3 off = face.position + face.normal * ClearanceOf(piece);
      const Vec3 away = FaceForward(SquareToSphere(u2, u1), face.normal);
      EXPECT_FALSE(IntersectShape(piece, off, away, 0, HUGE_VALF, t));
      EXPECT_FALSE(IntersectShape(piece, face.position - face.normal * 0.02F,
                                  SquareToSphere(u2, u1), 0, HUGE_VALF, t));
    }
    EXPECT_GT(hits, 50);
  }
}

TEST(CurvePieceTest, PointsOnItAreEven) {
  const CurvePiece piece = Piece({0, 0, 0}, {0, 0, 1}, 0.1F, 0.6F);
  // The side of a cone between the circles that touch the ends: pi (r + R) l of their own radii.
  const double slope = 0.5;
  const double shrink = std::sqrt(1 - slope * slope);
  EXPECT_NEAR(piece.Area<double>(), std::numbers::pi * 0.7 * shrink * shrink, 1e-6);
  constexpr int kCells = 16;
  std::vector<double> observed(kCells);
  std::vector<double> expected(kCells);
  KeyedRng rng(3);
  constexpr int kSamples = 40000;
  for (int i = 0; i < kSamples; ++i) {
    const float u1 = rng.Uniform();
    const float u2 = rng.Uniform();
    const ShapeFace face = SampleFace(piece, u1, u2);
    ASSERT_NEAR(piece.SignedDistance(Double3(face.position)), 0, 1e-6);
    const double s = CurvePiece::Axis(piece).Nearest(Double3(face.position));
    const int along = std::min(3, static_cast<int>(4 * s));
    const double turn =
        std::atan2(static_cast<double>(face.position.y), static_cast<double>(face.position.x)) /
            (2 * std::numbers::pi) +
        0.5;
    ++observed[static_cast<std::size_t>(4 * along + std::min(3, static_cast<int>(4 * turn)))];
  }
  for (int cell = 0; cell < kCells; ++cell) {
    const double s = (cell / 4 + 0.5) / 4;
    // Circles are as long as their radii are: 0.1 + 0.5 s over its mean of 0.35.
    expected[static_cast<std::size_t>(cell)] = kSamples * (0.1 + 0.5 * s) / 0.35 / kCells;
  }
  EXPECT_GT(ChiSquarePValue(observed, expected), 1e-4);
}

TEST(CurvePieceTest, OutlineIsTheDistanceFromTheTube) {
  const CurvePiece piece = Piece({0, 0, 0}, {2, 0, 0}, 0.25F, 0.25F);
  const OutlinePlace beside = NearestOutline(piece, {1, -3, 1}, {0, 1, 0});
  EXPECT_NEAR(beside.along, 3, 1e-9);
  EXPECT_NEAR(beside.distance, 0.75, 1e-9);
  EXPECT_NEAR(NearestOutline(piece, {4, -3, 0}, {0, 1, 0}).distance, 1.75, 1e-9);
  EXPECT_LT(NearestOutline(piece, {1, -3, 0.1}, {0, 1, 0}).distance, 0);
}

}  // namespace
}  // namespace lucerna
