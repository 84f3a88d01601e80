// Whose tokens does a coordinator know, and what may each do?
//
// One token a line, comments after #:
//
//   # name   roles         SHA-256 of the token
//   alice    submit        5e884898da28047151d0e56f8dc6292773603d0d6aabbdd62a11ef721d1542d8
//   farm     work          ...
//   root     admin         ...
//
// The file holds digests only, so reading it gives nobody access. Two tokens may have one name, so
// that one can be replaced while both are good.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "render/base/digest.h"
#include "render/base/status.h"

namespace lucerna {

// What a caller may do; a set of them.
enum class Role : std::uint8_t {
  kSubmit = 1,  // send jobs, follow all, and change their own
  kWork = 2,    // what workers do
  kAdmin = 4,   // everything
};
using Roles = std::uint8_t;  // bits of Role
inline constexpr Roles kAllRoles = 7;

[[nodiscard]] constexpr bool Has(Roles roles, Role role) {
  return (roles & static_cast<Roles>(role)) != 0;
}

struct TokenEntry {
  std::string name;
  Roles roles = 0;
  Digest digest;
};

// "submit,admin". Errors: INVALID_ARGUMENT for another word, or none.
[[nodiscard]] StatusOr<Roles> ParseRoles(std::string_view text);

// A name is 1 to 64 letters, digits and any of "._@-".
[[nodiscard]] bool IsTokenName(std::string_view name);

// `path` is for messages. Errors: INVALID_ARGUMENT, with the line's number.
[[nodiscard]] StatusOr<std::vector<TokenEntry>> ParseTokens(std::string_view text,
                                                            const std::string& path);

// The entry of this token; nullptr: none. Takes the same time whichever it is.
[[nodiscard]] const TokenEntry* FindToken(const std::vector<TokenEntry>& entries,
                                          std::string_view token);

}  // namespace lucerna
