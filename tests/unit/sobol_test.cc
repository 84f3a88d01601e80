// Points fill the cube as a Sobol' sequence does, and sequences of different keys are independent.
//
// Stratification is exact, so it is counted, not estimated: of the first 2^k points each
// elementary interval of volume 2^-k holds one. That sets the direction numbers apart from wrong
// ones, and scrambling that is not nested from one that is.
#include "render/math/sobol.h"

#include <cmath>
#include <vector>

#include "gtest/gtest.h"

#include "tests/support/chi_square.h"

namespace lucerna {
namespace {

using PointFunction = SobolPoint (*)(std::uint64_t, std::uint64_t);

std::vector<SobolPoint> FirstPoints(PointFunction point, std::uint64_t begin, int k,
                                    std::uint64_t key) {
  std::vector<SobolPoint> points;
  for (std::uint64_t i = 0; i < (std::uint64_t{1} << k); ++i)
    points.push_back(point(begin + i, key));
  return points;
}

// The most points in a box of 2^-along_a × 2^-along_b.
int FullestBox(const std::vector<SobolPoint>& points, std::size_t a, std::size_t b, int along_a,
               int along_b) {
  std::vector<int> boxes(std::size_t{1} << (along_a + along_b));
  int fullest = 0;
  for (const SobolPoint& point : points) {
    const auto x = static_cast<std::size_t>(std::ldexp(point[a], along_a));
    const auto y = static_cast<std::size_t>(std::ldexp(point[b], along_b));
    fullest = std::max(fullest, ++boxes[(x << along_b) + y]);
  }
  return fullest;
}

class SobolTest : public testing::TestWithParam<PointFunction> {};

TEST_P(SobolTest, StratifiesEveryDimension) {
  for (int k = 0; k <= 12; ++k) {
    const auto points = FirstPoints(GetParam(), 0, k, 17);
    for (std::size_t d = 0; d < kSobolDimensions; ++d) {
      ASSERT_EQ(FullestBox(points, d, d, k, 0), 1) << "dimension " << d << ", 2^" << k;
    }
  }
}

// Any aligned run is as good as the first: a pass takes its photons from the middle.
TEST_P(SobolTest, StratifiesALaterRunToo) {
  const auto points = FirstPoints(GetParam(), std::uint64_t{5} << 20, 10, 17);
  for (std::size_t d = 0; d < kSobolDimensions; ++d) {
    EXPECT_EQ(FullestBox(points, d, d, 10, 0), 1) << "dimension " << d;
  }
}

// The first two dimensions are a (0, 2)-sequence. Of the other pairs that are used together Joe
// & Kuo's numbers promise a little less: an interval of volume 2^(t-k) holds 2^t points.
TEST_P(SobolTest, StratifiesThePairsThatAreUsedTogether) {
  struct Pair {
    std::size_t a, b;
    int t;
  };
  for (const Pair pair :
       {Pair{0, 1, 0}, Pair{2, 3, 2}, Pair{4, 5, 3}, Pair{5, 6, 3}, Pair{1, 2, 1}}) {
    for (int k = pair.t; k <= 12; ++k) {
      const auto points = FirstPoints(GetParam(), 0, k, 99);
      for (int along = 0; along <= k - pair.t; ++along) {
        ASSERT_EQ(FullestBox(points, pair.a, pair.b, along, k - pair.t - along), 1 << pair.t)
            << "dimensions " << pair.a << " and " << pair.b << ", 2^" << k << ", " << along;
      }
    }
  }
}

TEST_P(SobolTest, StaysInTheUnitCubeAndChangesItsScramblingAfterItsPeriod) {
  for (std::uint64_t i = 0; i < 4096; ++i) {
    for (const float u : GetParam()(i, i)) {
      ASSERT_GE(u, 0);
      ASSERT_LT(u, 1);
    }
  }
  EXPECT_NE(GetParam()(5, 1), GetParam()(5 + (std::uint64_t{1} << 32), 1));
}

// For one index, points of different keys are independent and uniform, in every pair of
// dimensions, also for keys that follow each other.
TEST_P(SobolTest, KeysAreStrangers) {
  constexpr int kKeys = 65536;
  constexpr std::size_t kSide = 16;
  const double level = SidakLevel(1e-3, 8 * 7 / 2 + 8);
  std::vector<SobolPoint> points;
  for (std::uint64_t key = 0; key <= kKeys; ++key)
    points.push_back(GetParam()(3, key));
  const auto p_value = [&](std::size_t a, std::size_t b, std::size_t shift) {
    std::vector<double> observed(kSide * kSide);
    const std::vector<double> expected(kSide * kSide, static_cast<double>(kKeys) / (kSide * kSide));
    for (std::size_t i = 0; i < kKeys; ++i) {
      observed[static_cast<std::size_t>(points[i][a] * kSide) * kSide +
               static_cast<std::size_t>(points[i + shift][b] * kSide)] += 1;
    }
    return ChiSquarePValue(observed, expected);
  };
  for (std::size_t a = 0; a < kSobolDimensions; ++a) {
    EXPECT_GT(p_value(a, a, 1), level) << "dimension " << a << " of neighbouring keys";
    for (std::size_t b = a + 1; b < kSobolDimensions; ++b) {
      EXPECT_GT(p_value(a, b, 0), level) << "dimensions " << a << " and " << b;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Orders, SobolTest, testing::Values(&OwenSobol, &ShuffledOwenSobol));

// Two sequences side by side fill the square only when one is shuffled: a dimension of one
// against the same dimension of the other is otherwise a scrambled diagonal.
TEST(ShuffledOwenSobolTest, FillsTheSquareTogetherWithAnotherSequence) {
  constexpr int kPoints = 65536;
  constexpr std::size_t kSide = 64;
  const std::vector<double> expected(kSide * kSide, static_cast<double>(kPoints) / (kSide * kSide));
  const auto p_value = [&](PointFunction first, PointFunction second, std::size_t dimension) {
    std::vector<double> observed(kSide * kSide);
    for (std::uint64_t i = 0; i < kPoints; ++i) {
      observed[static_cast<std::size_t>(first(i, 1)[dimension] * kSide) * kSide +
               static_cast<std::size_t>(second(i, 2)[dimension] * kSide)] += 1;
    }
    return ChiSquarePValue(observed, expected);
  };
  const double level = SidakLevel(1e-3, 2 * kSobolDimensions);
  for (std::size_t d = 0; d < kSobolDimensions; ++d) {
    EXPECT_GT(p_value(&OwenSobol, &ShuffledOwenSobol, d), level) << "dimension " << d;
    EXPECT_GT(p_value(&ShuffledOwenSobol, &ShuffledOwenSobol, d), level) << "dimension " << d;
    // The twin that must be refused.
    EXPECT_LT(p_value(&OwenSobol, &OwenSobol, d), 1e-12) << "dimension " << d;
  }
}

}  // namespace
}  // namespace lucerna
