// The power law through points: a straight line on logarithmic axes.
#pragma once

#include <optional>
#include <span>

namespace lucerna {

struct PowerLawPoint {
  double x = 0, y = 0;
};

// y = factor · x^exponent.
struct PowerLaw {
  double factor = 0;
  double exponent = 0;

  [[nodiscard]] double At(double x) const;
};

// By least squares of logarithms. Absent for points without spread in x. Requires finite points
// above 0.
[[nodiscard]] std::optional<PowerLaw> PowerLawThrough(std::span<const PowerLawPoint> points);

}  // namespace lucerna
