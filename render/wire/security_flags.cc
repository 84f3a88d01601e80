#include "render/wire/security_flags.h"

#include <cstdint>
#include <string_view>

#include "render/base/files.h"
#include "render/base/secret.h"

namespace lucerna {

StatusOr<std::string> ReadToken(const std::string& path, const char* otherwise) {
  constexpr std::string_view kSpaces = " \t\r\n";
  constexpr std::uint64_t kLongest = 65536;
  std::string text = otherwise == nullptr ? "" : otherwise;
  if (!path.empty()) {
    LUCERNA_RETURN_IF_ERROR(CheckPrivate(path));
    LUCERNA_ASSIGN_OR_RETURN(text, ReadFile(path, kLongest));
  }
  const std::size_t first = text.find_first_not_of(kSpaces);
  if (first == std::string::npos) {
    if (path.empty()) return std::string();
    return absl::InvalidArgumentError(absl::StrCat(path, ": there is no token in this file"));
  }
  return text.substr(first, text.find_last_not_of(kSpaces) - first + 1);
}

}  // namespace lucerna
