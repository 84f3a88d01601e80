// What time is it?
//
// The only file that reads the machine's clock. Everything that decides by time takes a
// Clock, so that a test can set it to the nanosecond.
#pragma once

#include <chrono>

namespace lucerna {

using Duration = std::chrono::nanoseconds;
// A moment on the steady clock, which no administrator can turn back.
using SteadyTime = std::chrono::time_point<std::chrono::steady_clock, Duration>;
// A moment on the calendar, for people to read.
using WallTime = std::chrono::time_point<std::chrono::system_clock, Duration>;

[[nodiscard]] inline double Seconds(Duration duration) {
  return std::chrono::duration<double>(duration).count();
}

// The sum of two durations that are not negative, at most 73 years: what others say of their time
// may be anything, and a few such sums still add up.
[[nodiscard]] inline Duration SaturatingSum(Duration a, Duration b) {
  constexpr Duration kLongest = Duration::max() / 4;
  return b >= kLongest || a >= kLongest - b ? kLongest : a + b;
}

class Clock {
 public:
  virtual ~Clock() = default;
  [[nodiscard]] virtual SteadyTime Steady() const = 0;
  [[nodiscard]] virtual WallTime Wall() const = 0;
};

// The machine's own clock. Threads: any.
[[nodiscard]] const Clock& SystemClock();

// Processor time used so far by this process, all threads together.
[[nodiscard]] Duration ProcessCpuTime();

}  // namespace lucerna
