#include "tests/support/chi_square.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include "render/math/rng.h"

namespace lucerna {
namespace {

// Q(a, x), the upper regularised incomplete gamma function: a series below the mean, Lentz's
// continued fraction above it.
double UpperGamma(double a, double x) {
  if (x <= 0) return 1;
  const double front = std::exp(a * std::log(x) - x - std::lgamma(a));
  if (x < a + 1) {
    double term = 1 / a;
    double sum = term;
    for (int n = 1; n < 100000 && term > sum * 1e-16; ++n) {
      term *= x / (a + n);
      sum += term;
    }
    return 1 - front * sum;
  }
  double b = x + 1 - a;
  double c = 1e300;
  double d = 1 / b;
  double fraction = d;
  for (int i = 1; i < 100000; ++i) {
    const double an = -i * (i - a);
    b += 2;
    d = 1 / (an * d + b);
    c = b + an / c;
    fraction *= c * d;
    if (std::abs(c * d - 1) < 1e-15) break;
  }
  return front * fraction;
}

// The chance that |T| is below t, by Simpson's rule over the angle atan(T / sqrt(freedom)).
double StudentInside(double t, int freedom) {
  const double end = std::atan(t / std::sqrt(freedom));
  constexpr int kSteps = 2000;
  const double step = end / kSteps;
  double sum = 0;
  for (int i = 0; i <= kSteps; ++i) {
    const double weight = i == 0 || i == kSteps ? 1 : i % 2 == 1 ? 4 : 2;
    sum += weight * std::pow(std::cos(i * step), freedom - 1);
  }
  const double norm = std::exp(std::lgamma(0.5 * (freedom + 1)) - std::lgamma(0.5 * freedom)) /
                      std::sqrt(std::numbers::pi);
  return 2 * norm * sum * step / 3;
}

}  // namespace

double SidakLevel(double alpha, int tests) {
  return -std::expm1(std::log1p(-alpha) / tests);
}

double ChiSquarePValue(std::span<const double> observed, std::span<const double> expected) {
  std::vector<std::size_t> order(expected.size());
  for (std::size_t i = 0; i < order.size(); ++i)
    order[i] = i;
  std::ranges::sort(order, {}, [&](std::size_t i) { return expected[i]; });
  double statistic = 0;
  int cells = 0;
  double pooled_observed = 0;
  double pooled_expected = 0;
  const auto close = [&] {
    if (pooled_expected == 0) return;
    const double difference = pooled_observed - pooled_expected;
    statistic += difference * difference / pooled_expected;
    ++cells;
    pooled_observed = 0;
    pooled_expected = 0;
  };
  for (const std::size_t i : order) {
    // Integration by midpoints sees no part of a cell that is almost empty.
    if (expected[i] == 0 && observed[i] > 2) return 0;
    pooled_observed += observed[i];
    pooled_expected += expected[i];
    if (pooled_expected >= 5) close();
  }
  close();
  return cells < 2 ? 1 : UpperGamma(0.5 * (cells - 1), 0.5 * statistic);
}

double DirectionsPValue(
    const std::function<bool(float u_lobe, float u1, float u2, Vec3& direction)>& draw,
    const std::function<double(Vec3)>& pdf_solid_angle, int samples, std::uint64_t key, int fine) {
  constexpr int kRows = 24;
  constexpr int kColumns = 32;
  constexpr double kTwoPi = 2 * std::numbers::pi;
  constexpr std::size_t kCells = kRows * kColumns;
  // The last cell takes the samples that give no direction.
  std::vector<double> observed(kCells + 1);
  std::vector<double> expected(kCells + 1);
  double total = 0;
  for (int row = 0; row < kRows; ++row) {
    // A narrow lobe around a pole lies in one row alone, which is cut finer.
    const int slices = row == 0 || row == kRows - 1 ? 16 * fine : fine;
    for (int slice = 0; slice < slices; ++slice) {
      const double z = 2 * (row + (slice + 0.5) / slices) / kRows - 1;
      const double radius = std::sqrt(1 - z * z);
      for (int column = 0; column < kColumns * fine; ++column) {
        const double phi = kTwoPi * (column + 0.5) / (kColumns * fine);
        const double mass =
            pdf_solid_angle({static_cast<float>(radius * std::cos(phi)),
                             static_cast<float>(radius * std::sin(phi)), static_cast<float>(z)}) *
            2 * kTwoPi / (kRows * slices * kColumns * fine);
        expected[static_cast<std::size_t>(row * kColumns + column / fine)] += mass * samples;
        total += mass;
      }
    }
  }
  // A density that integrates to more than one leaves nothing for the last cell, and is refused
  // by the others.
  expected[kCells] = std::max(0.0, 1 - total) * samples;
  KeyedRng rng(key);
  for (int i = 0; i < samples; ++i) {
    const float u_lobe = rng.Uniform();
    const float u1 = rng.Uniform();
    const float u2 = rng.Uniform();
    Vec3 direction;
    if (!draw(u_lobe, u1, u2, direction)) {
      observed[kCells] += 1;
      continue;
    }
    const double z = std::clamp(static_cast<double>(direction.z), -1.0, 1.0);
    double phi = std::atan2(static_cast<double>(direction.y), static_cast<double>(direction.x));
    if (phi < 0) phi += kTwoPi;
    const int row = std::min(kRows - 1, static_cast<int>((z + 1) / 2 * kRows));
    const int column = std::min(kColumns - 1, static_cast<int>(phi / kTwoPi * kColumns));
    observed[static_cast<std::size_t>(row * kColumns + column)] += 1;
  }
  // A share of a thousandth is below what the midpoints can tell.
  if (observed[kCells] < 1e-3 * samples && expected[kCells] < 1e-3 * samples) {
    observed.pop_back();
    expected.pop_back();
  }
  return ChiSquarePValue(observed, expected);
}

MeasuredMean MeanOf(std::span<const double> parts) {
  const auto count = static_cast<double>(parts.size());
  double sum = 0;
  for (const double part : parts)
    sum += part;
  const double mean = sum / count;
  double squares = 0;
  for (const double part : parts)
    squares += (part - mean) * (part - mean);
  return {mean, std::sqrt(squares / (count * (count - 1)))};
}

double StudentQuantile(double level, int parts) {
  double low = 0;
  double high = 1e4;
  for (int i = 0; i < 200; ++i) {
    const double middle = 0.5 * (low + high);
    (StudentInside(middle, parts - 1) < 1 - level ? low : high) = middle;
  }
  return high;
}

}  // namespace lucerna
