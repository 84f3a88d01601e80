// Integrals over what is left of a disc are closed forms where there are any, and what random
// points say where there are none.
#include "render/estimate/star_region.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "gtest/gtest.h"

#include "render/math/kernel.h"
#include "render/math/rng.h"
#include "render/math/warp.h"

namespace lucerna {
namespace {

constexpr std::array kKernels = {KernelKind::kConstant, KernelKind::kEpanechnikov,
                                 KernelKind::kBiweight, KernelKind::kGaussian};

StarRegion Region(const std::vector<std::array<Point2, 2>>& segments) {
  StarRegion region;
  for (const auto& [a, b] : segments)
    EXPECT_TRUE(region.Add(a, b));
  region.Finish();
  return region;
}

double Whole(KernelKind kernel) {
  return 1 / Kernel{kernel}.Norm();
}

TEST(StarRegionTest, OfAWholeDiscIsTheKernelsOwnIntegral) {
  const StarRegion region = Region({});
  for (const KernelKind kernel : kKernels) {
    const RegionMoments m = region.MomentsOf(kernel, 1);
    EXPECT_NEAR(m.zeroth, Whole(kernel), 1e-9);
    EXPECT_NEAR(m.x, 0, 1e-12);
    EXPECT_NEAR(m.y, 0, 1e-12);
    EXPECT_NEAR(m.xx, m.yy, 1e-12);
    EXPECT_NEAR(m.xy, 0, 1e-12);
    EXPECT_NEAR(WeightFor(m, Whole(kernel)).constant, 1, 1e-6);
  }
  // The second moment of Epanechnikov's kernel: π/4 - π/6.
  EXPECT_NEAR(region.MomentsOf(KernelKind::kEpanechnikov, 1).xx, kPi64 / 12, 1e-12);
}

// A line at distance h cuts away a segment of the disc.
TEST(StarRegionTest, OfAHalfPlaneIsTheClosedForm) {
  for (const double h : {1e-9, 0.1, 0.4, 0.9, 0.999}) {
    SCOPED_TRACE(h);
    for (const double turn : {0.0, 0.7, 2.2, 4.0}) {
      const double c = std::cos(turn);
      const double s = std::sin(turn);
      const auto at = [&](double x, double y) { return Point2{c * x - s * y, s * x + c * y}; };
      const double end = std::sqrt(1 - h * h);
      const StarRegion region = Region({{at(h, -end), at(h, end)}});
      // For a disc of radius 1 the part beyond x = h: area, and first moment along x.
      const double area = std::acos(h) - h * end;
      const double moment = 2.0 / 3 * end * end * end;
      const RegionMoments m = region.MomentsOf(KernelKind::kConstant, 1);
      EXPECT_NEAR(m.zeroth, kPi64 - area, 1e-9);
      EXPECT_NEAR(m.x * c + m.y * s, -moment, 1e-9);
      EXPECT_NEAR(-m.x * s + m.y * c, 0, 1e-9);
      // Epanechnikov: the integral over x from -1 to h of 4/3 (1 - x²)^(3/2).
      const auto primitive = [](double x) {
        const double root = std::sqrt(1 - x * x);
        return x * root * (5 - 2 * x * x) / 6 + std::asin(x) / 2;
      };
      EXPECT_NEAR(region.MomentsOf(KernelKind::kEpanechnikov, 1).zeroth,
                  primitive(h) - primitive(-1), 1e-9);
    }
  }
}

TEST(StarRegionTest, OfAQuarterDiscIsAQuarterOfTheKernel) {
  constexpr double kNear = 1e-9;
  const StarRegion region =
      Region({{Point2{kNear, -1}, Point2{kNear, 1}}, {Point2{-1, kNear}, Point2{1, kNear}}});
  for (const KernelKind kernel : kKernels) {
    const RegionMoments m = region.MomentsOf(kernel, 1);
    EXPECT_NEAR(m.zeroth, Whole(kernel) / 4, 1e-7);
    EXPECT_NEAR(m.xx, m.yy, 1e-9);
    EXPECT_NEAR(m.x, m.y, 1e-9);
  }
  // ∫ s² ds = 1/3 times ∫ cos from π to 3π/2.
  EXPECT_NEAR(region.MomentsOf(KernelKind::kConstant, 1).x, -1.0 / 3, 1e-9);
}

TEST(StarRegionTest, OfAThinStripIsItsWidth) {
  constexpr double kHalf = 1e-3;
  const StarRegion region =
      Region({{Point2{-1, kHalf}, Point2{1, kHalf}}, {Point2{1, -kHalf}, Point2{-1, -kHalf}}});
  EXPECT_NEAR(region.MomentsOf(KernelKind::kConstant, 1).zeroth, 4 * kHalf, 1e-8);
  // 2h ∫ 1 - x².
  EXPECT_NEAR(region.MomentsOf(KernelKind::kEpanechnikov, 1).zeroth, 2 * kHalf * 4 / 3, 1e-8);
  EXPECT_NEAR(region.MomentsOf(KernelKind::kEpanechnikov, 0.5).zeroth, 4 * kHalf * 4 / 3, 1e-7);
}

TEST(StarRegionTest, DoesNotSeeBehindASegment) {
  const StarRegion region = Region({{Point2{0.5, -0.2}, Point2{0.5, 0.2}}});
  EXPECT_TRUE(region.Sees(0.49F, 0));
  EXPECT_FALSE(region.Sees(0.51F, 0));
  EXPECT_FALSE(region.Sees(0.9F, 0.3F)) << "in the shadow";
  EXPECT_TRUE(region.Sees(0.9F, 0.4F)) << "beside the shadow";
  EXPECT_TRUE(region.Sees(-0.9F, 0)) << "on the other side";
}

// Any segments, crossing each other or not: the integrals are those over the points that are seen.
TEST(StarRegionTest, AgreesWithPointsThatAreSeen) {
  KeyedRng rng(11);
  const auto uniform = [&] { return 2 * static_cast<double>(rng.Uniform()) - 1; };
  for (int trial = 0; trial < 60; ++trial) {
    SCOPED_TRACE(trial);
    std::vector<std::array<Point2, 2>> segments;
    for (int i = 0; i <= trial % 9; ++i)
      segments.push_back({Point2{uniform(), uniform()}, Point2{uniform(), uniform()}});
    const StarRegion region = Region(segments);
    const KernelKind kernel = kKernels[static_cast<std::size_t>(trial) % 4];
    const double scale = trial % 3 == 0 ? 0.4 : trial % 3 == 1 ? 1 : 1.5;
    RegionMoments sum;
    StarRegion::PowerMoments power;
    // A lattice: what it is off by is the length of the borders times its step.
    constexpr int kSteps = 700;
    for (int i = 0; i < kSteps; ++i) {
      for (int j = 0; j < kSteps; ++j) {
        const double x = (i + 0.5) / kSteps * 2 - 1;
        const double y = (j + 0.5) / kSteps * 2 - 1;
        const double u = x * x + y * y;
        if (u >= 1 || !region.Sees(static_cast<float>(x * scale), static_cast<float>(y * scale)))
          continue;
        const double k = static_cast<double>(Kernel{kernel}.Shape(static_cast<float>(u)));
        sum.zeroth += k;
        sum.x += k * x;
        sum.y += k * y;
        sum.xx += k * x * x;
        sum.xy += k * x * y;
        sum.yy += k * y * y;
        for (std::size_t p = 0; p < 3; ++p)
          power.zeroth[p] += std::pow(u, p);
        for (std::size_t p = 0; p < 2; ++p) {
          power.x[p] += std::pow(u, p) * x;
          power.y[p] += std::pow(u, p) * y;
        }
        power.xy += x * y;
      }
    }
    constexpr double kCell = 4.0 / (kSteps * kSteps);
    constexpr double kBound = 4e-3;
    const RegionMoments m = region.MomentsOf(kernel, scale);
    EXPECT_NEAR(m.zeroth, sum.zeroth * kCell, kBound);
    EXPECT_NEAR(m.x, sum.x * kCell, kBound);
    EXPECT_NEAR(m.y, sum.y * kCell, kBound);
    EXPECT_NEAR(m.xx, sum.xx * kCell, kBound);
    EXPECT_NEAR(m.xy, sum.xy * kCell, kBound);
    EXPECT_NEAR(m.yy, sum.yy * kCell, kBound);
    const StarRegion::PowerMoments p = region.PowerMomentsOf(scale);
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_NEAR(p.zeroth[k], power.zeroth[k] * kCell, kBound);
    for (std::size_t k = 0; k < 2; ++k) {
      EXPECT_NEAR(p.x[k], power.x[k] * kCell, kBound);
      EXPECT_NEAR(p.y[k], power.y[k] * kCell, kBound);
    }
    EXPECT_NEAR(p.xy, power.xy * kCell, kBound);
  }
}

// First moments vanish where that needs no weight below 0; elsewhere they are smaller than they
// were.
TEST(StarRegionTest, WeightsKeepTheIntegralAndTakeAwayFirstMoments) {
  for (const KernelKind kernel : kKernels) {
    for (const double h : {1e-6, 0.2, 0.5, 0.8}) {
      for (const bool is_corner : {false, true}) {
        SCOPED_TRACE(h);
        const double far = is_corner ? 0.3 : 9;
        const StarRegion region =
            Region({{Point2{h, -2}, Point2{h, 2}}, {Point2{-1, 1.5 * h + far}, Point2{1, far}}});
        const RegionMoments m = region.MomentsOf(kernel, 1);
        const RegionWeight w = WeightFor(m, Whole(kernel));
        const auto c = static_cast<double>(w.constant);
        const auto sx = static_cast<double>(w.slope_x);
        const auto sy = static_cast<double>(w.slope_y);
        EXPECT_NEAR((c * m.zeroth + sx * m.x + sy * m.y) / Whole(kernel), 1, 1e-5);
        const double rim = std::hypot(sx, sy);
        EXPECT_LE(rim, c * (1 + 1e-6)) << "a weight below 0";
        const double left =
            std::hypot(c * m.x + sx * m.xx + sy * m.xy, c * m.y + sx * m.xy + sy * m.yy);
        if (rim < c * (1 - 1e-6)) {
          EXPECT_NEAR(left, 0, 1e-5);
        } else {
          EXPECT_LT(h, 0.6);
          EXPECT_LT(left, std::hypot(m.x, m.y) * Whole(kernel) / m.zeroth);
        }
      }
    }
  }
}

TEST(StarRegionTest, HasRoomForSoManySegmentsAndNoMore) {
  StarRegion region;
  for (std::size_t i = 0; i < StarRegion::kMostSegments; ++i) {
    const double angle = 2 * kPi64 * static_cast<double>(i) / StarRegion::kMostSegments;
    const double next = angle + 2 * kPi64 / StarRegion::kMostSegments;
    ASSERT_TRUE(region.Add({0.5 * std::cos(angle), 0.5 * std::sin(angle)},
                           {0.5 * std::cos(next), 0.5 * std::sin(next)}));
  }
  EXPECT_FALSE(region.Add({1, 0}, {0, 1}));
  EXPECT_TRUE(region.Add({1, 1}, {2, 2})) << "points at the origin and hides nothing";
  region.Finish();
  // A polygon of n corners on a circle of radius 1/2.
  constexpr double kCorners = StarRegion::kMostSegments;
  EXPECT_NEAR(region.MomentsOf(KernelKind::kConstant, 1).zeroth,
              kCorners / 2 * 0.25 * std::sin(2 * kPi64 / kCorners), 1e-9);
}

// Plates behind each other: the first hides all others, in whatever order they come, and twice
// over.
TEST(StarRegionTest, SegmentsThatAreHiddenTakeNoRoom) {
  const auto plate = [](int i) {
    const double x = 0.1 + 0.001 * i;
    return std::array{Point2{x, -0.2}, Point2{x, 0.3}};
  };
  for (const int step : {1, -1, 37}) {
    SCOPED_TRACE(step);
    StarRegion region;
    region.Clear();
    for (int k = 0; k < 200; ++k) {
      const auto [a, b] = plate((step > 0 ? k * step : 199 - k) % 200);
      ASSERT_TRUE(region.Add(a, b));
      ASSERT_TRUE(region.Add(b, a));
    }
    EXPECT_EQ(region.segments(), 1U);
    region.Finish();
    StarRegion first = Region({plate(0)});
    EXPECT_EQ(region.MomentsOf(KernelKind::kBiweight, 1).zeroth,
              first.MomentsOf(KernelKind::kBiweight, 1).zeroth);
  }
  // One that is seen beside the first stays.
  StarRegion region = Region({plate(0), {Point2{0.3, 0.5}, Point2{0.3, 1.0}}});
  EXPECT_EQ(region.segments(), 2U);
  EXPECT_TRUE(region.Hides({0.3, 0.1}, {0.5, 0.1}));
  EXPECT_FALSE(region.Hides({0.3, 0.1}, {0.3, 1.0}));
  EXPECT_FALSE(region.Hides({0.05, 0.01}, {0.3, 0.1})) << "it begins before it";
}

// What is removed and put in another's place leaves no trace: random segments, nearest last, see
// the same points as nearest first.
TEST(StarRegionTest, TheOrderOfSegmentsDoesNotMatter) {
  KeyedRng rng(17);
  const auto uniform = [&] { return 2 * static_cast<double>(rng.Uniform()) - 1; };
  for (int trial = 0; trial < 200; ++trial) {
    SCOPED_TRACE(trial);
    std::vector<std::array<Point2, 2>> segments;
    for (int i = 0; i < 50; ++i) {
      const Point2 a = {uniform(), uniform()};
      segments.push_back({a, Point2{a.x + 0.3 * uniform(), a.y + 0.3 * uniform()}});
    }
    const StarRegion one = Region(segments);
    std::reverse(segments.begin(), segments.end());
    const StarRegion other = Region(segments);
    EXPECT_EQ(one.segments(), other.segments());
    EXPECT_LT(one.segments(), segments.size());
    EXPECT_NEAR(one.MomentsOf(KernelKind::kEpanechnikov, 1).zeroth,
                other.MomentsOf(KernelKind::kEpanechnikov, 1).zeroth, 1e-9);
    for (int i = 0; i < 100; ++i) {
      const auto x = static_cast<float>(uniform()), y = static_cast<float>(uniform());
      EXPECT_EQ(one.Sees(x, y), other.Sees(x, y));
    }
  }
}

}  // namespace
}  // namespace lucerna
