#include "render/base/escape.h"

#include <array>
#include <cstddef>
#include <cstdint>

#include "absl/strings/str_cat.h"

#include "render/base/utf8.h"

namespace lucerna {
namespace {

struct Range {
  std::uint32_t first, last;
};

// Characters that show nothing by themselves, or that change how others are shown. Joiners (U+200C,
// U+200D) are needed by scripts and emoji, and stay.
constexpr std::array<Range, 14> kHidden = {{
    {0x80, 0x9f},        // controls of ISO 8859, among them another "escape ["
    {0xad, 0xad},        // soft hyphen
    {0x61c, 0x61c},      // Arabic letter mark
    {0x180e, 0x180e},    // Mongolian vowel separator
    {0x200b, 0x200b},    // zero width space
    {0x200e, 0x200f},    // direction marks
    {0x2028, 0x202e},    // line and paragraph separators, embeddings and overrides of direction
    {0x2060, 0x206f},    // invisible operators, isolates of direction
    {0xfdd0, 0xfdef},    // no characters
    {0xfeff, 0xfeff},    // byte order mark
    {0xfff0, 0xfffb},    // not assigned, and annotations
    {0xfffe, 0xffff},    // no characters
    {0xe0000, 0xe0fff},  // tags
    {0xf0000, 0x10ffff}  // private use
}};

bool IsHidden(std::uint32_t code) {
  for (const Range& range : kHidden) {
    if (code >= range.first && code <= range.last) return true;
  }
  return false;
}

std::string EscapedBut(std::string_view text, char kept) {
  std::string shown;
  shown.reserve(text.size());
  while (!text.empty()) {
    const Utf8Character character = FirstCharacter(text);
    std::size_t size = character.size_bytes;
    const bool is_control = character.code < 0x20 || character.code == 0x7f;
    if (size == 0 || (is_control && (kept == 0 || text[0] != kept))) {
      size = 1;
      absl::StrAppend(&shown, "\\x",
                      absl::Hex(static_cast<unsigned char>(text[0]), absl::kZeroPad2));
    } else if (IsHidden(character.code)) {
      absl::StrAppend(&shown, "\\u{", absl::Hex(character.code), "}");
    } else {
      shown += text.substr(0, size);
    }
    text.remove_prefix(size);
  }
  return shown;
}

}  // namespace

std::string Escaped(std::string_view text) {
  return EscapedBut(text, '\0');
}

std::string EscapedLines(std::string_view text) {
  return EscapedBut(text, '\n');
}

}  // namespace lucerna
