// Unpacks gzip streams.
#pragma once

#include <string>
#include <string_view>

#include "render/base/status.h"

namespace lucerna {

[[nodiscard]] bool IsGzip(std::string_view bytes);

// Errors: INVALID_ARGUMENT for a stream that is damaged, cut off or unpacks to more than 200 times
// its size.
[[nodiscard]] StatusOr<std::string> Gunzip(std::string_view bytes);

}  // namespace lucerna
