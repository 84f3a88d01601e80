#include "client/selfcheck/selfcheck_fixed_point.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "render/math/fixed_point.h"
#include "render/math/rng.h"

namespace lucerna {
namespace {

constexpr int kTestedHitpoints = 1000;
constexpr int kPhotons = 1000;
constexpr std::uint32_t kDithers = 1U << 21;

// What a sum of independent terms, each off by at most 1 and `variance` all together, may be off by
// with a chance of 1e-9 to exceed it.
double Bernstein(double variance) {
  const double log_chance = std::log(2 / 1e-9);
  const double third = log_chance / 3;
  return third + std::sqrt(third * third + 2 * log_chance * variance);
}

}  // namespace

FixedPointErrors MeasureFixedPoint(double dynamic_range, RangeLies range_lies) {
  const FluxScale scale = FluxScale::ForPower(Gray(1));
  KeyedRng rng(11);
  std::vector<double> relative;
  FixedPointErrors errors;
  for (int hitpoint = 0; hitpoint < kTestedHitpoints; ++hitpoint) {
    std::int64_t sum = 0;
    long double exact = 0;  // [quanta]
    double variance = 0;
    double allowed = 0;
    for (int photon = 0; photon < kPhotons; ++photon) {
      const double place = range_lies == RangeLies::kWithinHitpoints
                               ? static_cast<double>(rng.Uniform())
                               : static_cast<double>(hitpoint) / (kTestedHitpoints - 1);
      const auto flux_w = static_cast<float>(std::pow(dynamic_range, -place) *
                                             (0.5 + 0.5 * static_cast<double>(rng.Uniform())));
      const float quanta = flux_w * scale.quanta_per_watt.r;
      sum += RoundDithered(quanta, static_cast<std::uint32_t>(rng.Uniform() * kDithers));
      exact += static_cast<long double>(quanta);
      // Up by the chance of its fraction, which is at most the whole and varies by 1/4 at most.
      variance += std::min(static_cast<double>(quanta), 0.25);
      allowed += (static_cast<double>(quanta) + 1) * 0x1p-24 + 0x1p-21;
    }
    const auto error = static_cast<double>(std::abs(static_cast<long double>(sum) - exact));
    allowed += Bernstein(variance);
    errors.worst_of_allowed = std::max(errors.worst_of_allowed, error / allowed);
    relative.push_back(error / static_cast<double>(exact));
  }
  std::ranges::sort(relative);
  errors.worst = relative.back();
  errors.median = relative[relative.size() / 2];
  return errors;
}

}  // namespace lucerna
