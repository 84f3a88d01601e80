// How long did the things of one kind take, as counts between bounds?
//
// Threads: any.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>

#include "render/base/clock.h"

namespace lucerna {

class LatencyCounts {
 public:
  // [s], rising. What took longer than the last is counted too.
  static constexpr std::array<double, 10> kBounds = {0.001, 0.003, 0.01, 0.03, 0.1,
                                                     0.3,   1,     3,    10,   30};

  void Count(Duration time) {
    const double seconds = std::chrono::duration<double>(time).count();
    std::size_t i = 0;
    while (i < kBounds.size() && seconds > kBounds[i])
      ++i;
    counts_[i].fetch_add(1, std::memory_order_relaxed);
    nanoseconds_.fetch_add(static_cast<std::uint64_t>(
                               std::chrono::duration_cast<std::chrono::nanoseconds>(time).count()),
                           std::memory_order_relaxed);
  }

  // Of the last bound those that took longer.
  [[nodiscard]] std::uint64_t CountBelow(std::size_t bound) const {
    return counts_[bound].load(std::memory_order_relaxed);
  }
  [[nodiscard]] double seconds() const {
    return static_cast<double>(nanoseconds_.load(std::memory_order_relaxed)) * 1e-9;
  }

 private:
  std::array<std::atomic<std::uint64_t>, kBounds.size() + 1> counts_{};
  std::atomic<std::uint64_t> nanoseconds_ = 0;
};

}  // namespace lucerna
