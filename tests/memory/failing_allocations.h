// Allocations of this program that fail when a test says so, and are counted.
#pragma once

#include <cstddef>
#include <limits>

namespace lucerna {

inline constexpr int kNever = std::numeric_limits<int>::max();

// So many allocations of this thread by operator new succeed, and the next one does not.
extern thread_local int allocations_left;

// Bytes that operator new has given and that have not been freed.
[[nodiscard]] std::size_t LiveBytes();
// The most that there have been since the last call of ForgetMostLiveBytes.
[[nodiscard]] std::size_t MostLiveBytes();
void ForgetMostLiveBytes();

}  // namespace lucerna
