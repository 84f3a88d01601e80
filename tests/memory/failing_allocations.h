// Allocations of this program that fail when a test says so.
#pragma once

#include <limits>

namespace lucerna {

inline constexpr int kNever = std::numeric_limits<int>::max();

// So many allocations of this thread by operator new succeed, and the next one does not.
extern thread_local int allocations_left;

}  // namespace lucerna
