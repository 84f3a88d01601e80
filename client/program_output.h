// What does another of our programs answer?
#pragma once

#include <string>
#include <vector>

#include "render/base/status.h"

namespace lucerna {

// What `program` writes to its standard output until it ends; its standard error is ours.
// Errors: NOT_FOUND when it cannot be run, INTERNAL when it fails or writes more than 64 MiB.
[[nodiscard]] StatusOr<std::string> OutputOf(const std::string& program,
                                             std::vector<std::string> flags);

}  // namespace lucerna
