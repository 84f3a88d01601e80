// How much does each pass count in the image?
//
// What photons brought is the weighted mean of the passes: the newest weigh 1 each, earlier ones
// that had fewer photons weigh in proportion to their photons, so that every photon counts alike.
// Of direct light all passes weigh the same: its samples are spaced evenly over the passes, which
// other weights would lose.
#pragma once

#include "render/estimate/rounds.h"

namespace lucerna {

struct PassWeights {
  // Sums of the weights of even passes and of odd ones, which are independent of each other.
  double even = 0, odd = 0;
  // The sum of the squares of all weights. Where passes scatter alike whatever their weight, their
  // weighted mean scatters as that of all()² / squares passes.
  double squares = 0;

  [[nodiscard]] constexpr double all() const { return even + odd; }
  constexpr PassWeights& operator+=(const PassWeights& other) {
    even += other.even;
    odd += other.odd;
    squares += other.squares;
    return *this;
  }
  bool operator==(const PassWeights&) const = default;
};

// Of passes that weigh 1 each.
[[nodiscard]] constexpr PassWeights WeightsOf(const PassRange& passes) {
  const std::uint64_t even = (passes.last + 1) / 2 - (passes.first + 1) / 2;
  return {.even = static_cast<double>(even),
          .odd = static_cast<double>(passes.size() - even),
          .squares = static_cast<double>(passes.size())};
}

}  // namespace lucerna
