// How is a secret kept, and compared?
#pragma once

#include <string>
#include <string_view>

#include "render/base/status.h"

namespace lucerna {

// Whether both are the same. The time it takes depends on their lengths alone.
[[nodiscard]] bool IsSameSecret(std::string_view a, std::string_view b);

// Errors: INVALID_ARGUMENT when users other than the file's owner and group may read or write the
// file, NOT_FOUND.
[[nodiscard]] Status CheckPrivate(const std::string& path);

}  // namespace lucerna
