// Every map from the square has the density that its comment states.
#include "render/math/warp.h"

#include <vector>

#include "gtest/gtest.h"

#include "render/math/rng.h"
#include "tests/support/chi_square.h"

namespace lucerna {
namespace {

constexpr int kSamples = 400000;
constexpr int kQuestions = 8;
const double kLevel = SidakLevel(1e-3, kQuestions);

TEST(WarpTest, DiskIsUniform) {
  constexpr std::size_t kSide = 20;
  std::vector<double> observed(kSide * kSide);
  const std::vector<double> expected(kSide * kSide, kSamples / static_cast<double>(kSide * kSide));
  KeyedRng rng(1);
  for (int i = 0; i < kSamples; ++i) {
    const float u1 = rng.Uniform();
    const float u2 = rng.Uniform();
    const Vec3 p = SquareToDisk(u1, u2);
    const double squared = static_cast<double>(LengthSquared(p));
    ASSERT_LT(squared, 1 + 1e-6);
    ASSERT_EQ(p.z, 0);
    const double turn =
        (std::atan2(static_cast<double>(p.y), static_cast<double>(p.x)) + kPi64) / (2 * kPi64);
    const auto ring = std::min(kSide - 1, static_cast<std::size_t>(squared * kSide));
    const auto sector = std::min(kSide - 1, static_cast<std::size_t>(turn * kSide));
    observed[ring * kSide + sector] += 1;
  }
  EXPECT_GT(ChiSquarePValue(observed, expected), kLevel);
  EXPECT_EQ(SquareToDisk(0.5F, 0.5F), (Vec3{0, 0, 0}));
}

TEST(WarpTest, CosineHemisphereFollowsTheCosine) {
  const auto draw = [](float, float u1, float u2, Vec3& d) {
    d = SquareToCosineHemisphere(u1, u2);
    return true;
  };
  EXPECT_GT(DirectionsPValue(
                draw, [](Vec3 d) { return std::max(0.0, static_cast<double>(d.z)) / kPi64; },
                kSamples, 2),
            kLevel);
  // A uniform hemisphere must be refused.
  EXPECT_LT(DirectionsPValue(
                draw, [](Vec3 d) { return d.z > 0 ? 1 / (2 * kPi64) : 0; }, kSamples, 2),
            1e-12);
}

TEST(WarpTest, SphereIsUniform) {
  EXPECT_GT(DirectionsPValue(
                [](float, float u1, float u2, Vec3& d) {
                  d = SquareToSphere(u1, u2);
                  return true;
                },
                [](Vec3) { return 1 / (4 * kPi64); }, kSamples, 3),
            kLevel);
}

class ConeTest : public testing::TestWithParam<double> {};

TEST_P(ConeTest, IsUniformAndUnit) {
  const auto one_minus_cos = static_cast<float>(GetParam());
  constexpr std::size_t kSide = 20;
  std::vector<double> observed(kSide * kSide);
  const std::vector<double> expected(kSide * kSide, kSamples / static_cast<double>(kSide * kSide));
  KeyedRng rng(4);
  for (int i = 0; i < kSamples; ++i) {
    const float u1 = rng.Uniform();
    const float u2 = rng.Uniform();
    const Vec3 d = SquareToCone(u1, u2, one_minus_cos);
    ASSERT_NEAR(Length(d), 1, 1e-6);
    // 1 - cosine, by the sine: the cosine of a narrow cone has no digits left.
    const double sine2 = static_cast<double>(d.x) * static_cast<double>(d.x) +
                         static_cast<double>(d.y) * static_cast<double>(d.y);
    const double cosine =
        std::copysign(std::sqrt(std::max(0.0, 1 - sine2)), static_cast<double>(d.z));
    const double height = d.z > 0 ? sine2 / (1 + cosine) : 1 - cosine;
    const double turn =
        (std::atan2(static_cast<double>(d.y), static_cast<double>(d.x)) + kPi64) / (2 * kPi64);
    const auto ring = std::min(kSide - 1, static_cast<std::size_t>(height / GetParam() * kSide));
    const auto sector = std::min(kSide - 1, static_cast<std::size_t>(turn * kSide));
    observed[ring * kSide + sector] += 1;
  }
  EXPECT_GT(ChiSquarePValue(observed, expected), kLevel);
}
INSTANTIATE_TEST_SUITE_P(Widths, ConeTest, testing::Values(1e-10, 1e-4, 0.3, 2.0));

TEST(WarpTest, TriangleIsUniform) {
  constexpr int kRows = 8;
  std::vector<double> observed(kRows * kRows);
  const std::vector<double> expected(kRows * kRows, kSamples / static_cast<double>(kRows * kRows));
  KeyedRng rng(5);
  for (int i = 0; i < kSamples; ++i) {
    const float u1 = rng.Uniform();
    const float u2 = rng.Uniform();
    float b1 = 0;
    float b2 = 0;
    SquareToTriangle(u1, u2, b1, b2);
    ASSERT_GE(b1, 0);
    ASSERT_GE(b2, 0);
    ASSERT_LE(b1 + b2, 1 + 1e-6F);
    const int column = std::min(kRows - 1, static_cast<int>(b1 * kRows));
    const int row = std::min(kRows - 1, static_cast<int>(b2 * kRows));
    const bool upper =
        b1 * kRows - static_cast<float>(column) + (b2 * kRows - static_cast<float>(row)) > 1;
    // Lower triangles lie on and under the diagonal, upper ones strictly under it: both kinds
    // together are kRows² of one area. They are numbered row by row.
    const int before = row * (2 * kRows - row);
    observed[static_cast<std::size_t>(
        std::min(kRows * kRows - 1, before + 2 * column + (upper ? 1 : 0)))] += 1;
  }
  EXPECT_GT(ChiSquarePValue(observed, expected), kLevel);
}

}  // namespace
}  // namespace lucerna
