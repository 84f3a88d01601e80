#include "render/base/console.h"

#include <array>
#include <atomic>
#include <clocale>
#include <cstddef>
#include <cstdio>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include <langinfo.h>

#include "render/base/text.h"
#include "render/base/utf8.h"

namespace lucerna {
namespace {

std::atomic<Charset> locale_charset = Charset::kUtf8;

// What the programs print beside ASCII.
constexpr std::array<std::pair<std::uint32_t, std::string_view>, 8> kSigns = {{
    {0xb1, "+-"},    // ±
    {0xb7, "*"},     // ·
    {0xd7, "x"},     // ×
    {0x2013, "-"},   // –
    {0x2014, "-"},   // —
    {0x2020, "*"},   // †
    {0x2212, "-"},   // −
    {0x2264, "<="},  // ≤
}};

// '0' to '9' or '-' that is raised; '\0' for another character.
char Raised(std::uint32_t code) {
  switch (code) {
    case 0xb9:
      return '1';
    case 0xb2:
      return '2';
    case 0xb3:
      return '3';
    case 0x207b:
      return '-';
    default:
      return code == 0x2070 || (code >= 0x2074 && code <= 0x2079)
                 ? static_cast<char>('0' + (code - 0x2070))
                 : '\0';
  }
}

std::string_view SignFor(std::uint32_t code) {
  for (const auto& [sign, ascii] : kSigns) {
    if (sign == code) return ascii;
  }
  return {};
}

void Print(std::string_view text, std::FILE* to) {
  std::fwrite(text.data(), 1, text.size(), to);
}

}  // namespace

Charset CharsetOf(std::string_view codeset) {
  const absl::string_view name = ToAbsl(codeset);
  return absl::EqualsIgnoreCase(name, "UTF-8") || absl::EqualsIgnoreCase(name, "UTF8")
             ? Charset::kUtf8
             : Charset::kAscii;
}

void ReadLocale() {
  // A locale that this machine does not have leaves "C".
  std::setlocale(LC_CTYPE, "");
  locale_charset = CharsetOf(::nl_langinfo(CODESET));
}

Charset LocaleCharset() {
  return locale_charset;
}

std::string InCharset(std::string_view text, Charset charset) {
  if (charset == Charset::kUtf8) return std::string(text);
  std::string ascii;
  bool was_raised = false;
  for (std::size_t at = 0; at < text.size();) {
    const Utf8Character character = FirstCharacter(text.substr(at));
    const char raised = Raised(character.code);
    if (raised != '\0') {
      if (!was_raised) ascii += '^';
      ascii += raised;
    } else if (character.size_bytes == 1) {
      ascii += text[at];
    } else if (character.size_bytes == 0) {
      absl::StrAppend(&ascii, "\\x",
                      absl::Hex(static_cast<unsigned char>(text[at]), absl::kZeroPad2));
    } else if (const std::string_view sign = SignFor(character.code); !sign.empty()) {
      ascii += sign;
    } else {
      absl::StrAppend(&ascii, "\\u{", absl::Hex(character.code), "}");
    }
    was_raised = raised != '\0';
    at += character.size_bytes == 0 ? 1 : character.size_bytes;
  }
  return ascii;
}

void PrintText(std::string_view text) {
  Print(InCharset(text, LocaleCharset()), stdout);
}

void PrintError(std::string_view text) {
  Print(InCharset(text, LocaleCharset()), stderr);
}

void PrintData(std::string_view text) {
  Print(text, stdout);
}

}  // namespace lucerna
