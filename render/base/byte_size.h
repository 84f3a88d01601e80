// Sizes as people type them.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace lucerna {

// "1000", "500k", "1.5G" (10^9 bytes each, as with counts), "8GiB" (2^30 bytes each); a B at the
// end says nothing more. Absent for what is none, or more than 2^53 bytes; fractions of a byte are
// cut.
[[nodiscard]] std::optional<std::uint64_t> ParseByteSize(std::string_view text);

}  // namespace lucerna
