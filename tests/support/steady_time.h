// Moments of a clock that a test moves.
#pragma once

#include <chrono>

#include "render/base/clock.h"

namespace lucerna {

// So many seconds after the clock's beginning.
inline SteadyTime At(double seconds) {
  return SteadyTime(
      std::chrono::duration_cast<SteadyTime::duration>(std::chrono::duration<double>(seconds)));
}

}  // namespace lucerna
