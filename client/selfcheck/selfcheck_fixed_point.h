// How much do integer sums lose against real numbers?
//
// Contributions of known size are rounded and added as a worker does it (render/math/fixed_point.h)
// and in long double, for photons that differ in power within a hitpoint and for hitpoints that
// differ from one another.
#pragma once

namespace lucerna {

enum class RangeLies { kWithinHitpoints, kBetweenHitpoints };

struct FixedPointErrors {
  // Relative errors of the sums of all hitpoints.
  double worst = 0;
  double median = 0;
  // The largest error over what is allowed for its sum, by the variance of dithered rounding
  // (Bernstein's inequality at 1e-9), the 24 bits of a float and the 21 of the dither.
  double worst_of_allowed = 0;
};

// 1000 hitpoints of 1000 photons each, in a scene that emits 1 W; a photon adds from
// 1 / `dynamic_range` to 1 W, evenly over the logarithm. Requires dynamic_range >= 1.
[[nodiscard]] FixedPointErrors MeasureFixedPoint(double dynamic_range, RangeLies range_lies);

}  // namespace lucerna
