// The standard output and error, in the characters of the locale.
//
// Text for people is UTF-8 inside the programs. Where the locale's character set is another one, it
// is printed in ASCII. JSON and files are UTF-8 in every locale, and numbers have a point in every
// locale.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace lucerna {

enum class Charset : std::uint8_t { kUtf8, kAscii };

// `codeset` is a name that nl_langinfo(CODESET) gives. ASCII is a part of every other set.
[[nodiscard]] Charset CharsetOf(std::string_view codeset);

// Takes the character set from LC_ALL, LC_CTYPE or LANG, and nothing else of the locale. For the
// beginning of a main, before there are threads.
void ReadLocale();

// What ReadLocale found; UTF-8 before.
[[nodiscard]] Charset LocaleCharset();

// In ASCII the program's own signs become what people type for them ("2⁻⁷" is "2^-7"), and other
// characters \u{NNNN}, bytes that are not UTF-8 \xNN, as escape.h has them.
[[nodiscard]] std::string InCharset(std::string_view text, Charset charset);

// Text for people, in the locale's characters.
void PrintText(std::string_view text);   // to the standard output
void PrintError(std::string_view text);  // to the standard error

// JSON, scripts and manual pages: to the standard output as they are.
void PrintData(std::string_view text);

}  // namespace lucerna
