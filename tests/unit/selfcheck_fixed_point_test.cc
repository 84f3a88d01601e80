// Integer sums must be as near to real ones as the variance of their rounding allows, whatever lies
// between the strongest and the weakest photon.
#include "client/selfcheck/selfcheck_fixed_point.h"

#include <cmath>

#include "gtest/gtest.h"

namespace lucerna {
namespace {

class FixedPointRangeTest : public testing::TestWithParam<double> {};

TEST_P(FixedPointRangeTest, ErrorsAreWhatRoundingAllows) {
  for (const RangeLies lies : {RangeLies::kWithinHitpoints, RangeLies::kBetweenHitpoints})
    EXPECT_LE(MeasureFixedPoint(GetParam(), lies).worst_of_allowed, 1);
}

// A quantum is 2^-18 of the scene's power, a thousand photons round it by half each at most as a
// random walk of 16, and five times that must be little against the sum. Between hitpoints, half of
// them lie within the root of the range of the brightest.
TEST_P(FixedPointRangeTest, TheMedianSumHasManyDigits) {
  constexpr double kWalk = 5 * 16.0;
  constexpr double kLeastQuanta = 1000 * 0x1p17;
  // The logarithm takes so much of the mean.
  const double mean_within = GetParam() > 1 ? 1 / std::log(GetParam()) : 1;
  EXPECT_LE(MeasureFixedPoint(GetParam(), RangeLies::kWithinHitpoints).median,
            kWalk / (kLeastQuanta * mean_within));
  EXPECT_LE(MeasureFixedPoint(GetParam(), RangeLies::kBetweenHitpoints).median,
            kWalk / (kLeastQuanta / std::sqrt(GetParam())));
}

INSTANTIATE_TEST_SUITE_P(From1To1e12, FixedPointRangeTest,
                         testing::Values(1.0, 1e3, 1e6, 1e9, 1e12));

}  // namespace
}  // namespace lucerna
