// Which machines and builds give the same bits as this one?
#pragma once

#include <string>

namespace lucerna {

// Build, compiler, Embree version and pinned instruction set, C library: two processes with equal
// profiles give equal bits for equal jobs.
[[nodiscard]] std::string NumericProfile();

}  // namespace lucerna
