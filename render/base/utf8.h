// Characters of a text in UTF-8.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace lucerna {

struct Utf8Character {
  std::uint32_t code = 0;
  std::size_t size_bytes = 0;  // 0: the bytes are not UTF-8
};

// The first character of `text`, which is not empty (RFC 3629: no overlong forms, no surrogates).
[[nodiscard]] Utf8Character FirstCharacter(std::string_view text);

}  // namespace lucerna
