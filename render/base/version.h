// Which release is this?
#pragma once

#include <string>

namespace lucerna {

// Like "0.1.0"; the version of the CMake project.
[[nodiscard]] std::string Version();

}  // namespace lucerna
