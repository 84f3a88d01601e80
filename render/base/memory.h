// How much memory may this process still take?
#pragma once

#include <cstdint>

namespace lucerna {

// What is available on this machine, or within the limit of the process's control group where that
// is less [bytes]; UINT64_MAX when the system does not say.
[[nodiscard]] std::uint64_t AvailableMemory();

}  // namespace lucerna
