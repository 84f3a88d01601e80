#include "render/base/token_file.h"

#include <algorithm>
#include <cctype>

#include "absl/strings/escaping.h"

#include "render/base/escape.h"
#include "render/base/secret.h"
#include "render/base/text.h"

namespace lucerna {
namespace {

bool IsHexDigest(std::string_view text) {
  return text.size() == 2 * Digest::kSize &&
         std::ranges::all_of(text, [](unsigned char c) { return std::isxdigit(c) != 0; });
}

}  // namespace

StatusOr<Roles> ParseRoles(std::string_view text) {
  Roles roles = 0;
  while (true) {
    const std::size_t comma = text.find(',');
    const std::string_view word = text.substr(0, comma);
    if (word == "submit") {
      roles |= static_cast<Roles>(Role::kSubmit);
    } else if (word == "work") {
      roles |= static_cast<Roles>(Role::kWork);
    } else if (word == "admin") {
      roles |= static_cast<Roles>(Role::kAdmin);
    } else {
      return absl::InvalidArgumentError(
          absl::StrCat("\"", Escaped(word),
                       "\" is no role; give submit, work or admin, or several "
                       "with commas between them"));
    }
    if (comma == std::string_view::npos) return roles;
    text.remove_prefix(comma + 1);
  }
}

bool IsTokenName(std::string_view name) {
  constexpr std::size_t kLongest = 64;
  return !name.empty() && name.size() <= kLongest && std::ranges::all_of(name, [](unsigned char c) {
    return c < 0x80 &&
           (std::isalnum(c) != 0 ||
            std::string_view("._@-").find(static_cast<char>(c)) != std::string_view::npos);
  });
}

StatusOr<std::vector<TokenEntry>> ParseTokens(std::string_view text, const std::string& path) {
  std::vector<TokenEntry> entries;
  for (int line = 1; !text.empty(); ++line) {
    const std::size_t end = text.find('\n');
    std::string_view content = text.substr(0, end);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    if (content.ends_with('\r')) content.remove_suffix(1);
    const std::vector<std::string_view> words = WordsOf(content.substr(0, content.find('#')));
    if (words.empty()) continue;
    const auto error = [&](const std::string& what) {
      return absl::InvalidArgumentError(absl::StrCat(path, ":", line, ": ", what));
    };
    if (words.size() != 3) {
      return error("a line is NAME ROLES SHA-256, as lucerna token new prints it");
    }
    TokenEntry entry;
    entry.name = words[0];
    if (!IsTokenName(entry.name)) {
      return error("a name is 1 to 64 letters, digits and any of . _ @ -");
    }
    const StatusOr<Roles> roles = ParseRoles(words[1]);
    if (!roles.ok()) return error(std::string(roles.status().message()));
    entry.roles = *roles;
    // The token itself here would be a secret in the wrong file.
    if (!IsHexDigest(words[2])) return error("the third word is not 64 hexadecimal digits");
    LUCERNA_ASSIGN_OR_RETURN(entry.digest,
                             Digest::FromBytes(absl::HexStringToBytes(ToAbsl(words[2]))));
    entries.push_back(std::move(entry));
  }
  return entries;
}

const TokenEntry* FindToken(const std::vector<TokenEntry>& entries, std::string_view token) {
  const Digest digest = Sha256(token);
  const TokenEntry* found = nullptr;
  for (const TokenEntry& entry : entries) {
    if (IsSameSecret(entry.digest.Bytes(), digest.Bytes())) found = &entry;
  }
  return found;
}

}  // namespace lucerna
