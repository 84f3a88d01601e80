#include "render/math/power_law.h"

#include <cmath>

namespace lucerna {

double PowerLaw::At(double x) const {
  return factor * std::pow(x, exponent);
}

std::optional<PowerLaw> PowerLawThrough(std::span<const PowerLawPoint> points) {
  const auto count = static_cast<double>(points.size());
  double mean_x = 0;
  double mean_y = 0;
  for (const PowerLawPoint& point : points) {
    mean_x += std::log(point.x) / count;
    mean_y += std::log(point.y) / count;
  }
  double xx = 0;
  double xy = 0;
  for (const PowerLawPoint& point : points) {
    const double x = std::log(point.x) - mean_x;
    xx += x * x;
    xy += x * (std::log(point.y) - mean_y);
  }
  // Spread over less than a millionth of x is none: the slope would be rounding.
  if (!(xx > 1e-12 * count)) return std::nullopt;
  return PowerLaw{std::exp(mean_y - xy / xx * mean_x), xy / xx};
}

}  // namespace lucerna
