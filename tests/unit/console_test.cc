// Text for people has no byte that the terminal's character set does not have, and loses no
// meaning.
#include "render/base/console.h"

#include <algorithm>
#include <string>

#include "gtest/gtest.h"

namespace lucerna {
namespace {

bool IsAscii(const std::string& text) {
  return std::ranges::all_of(text, [](char c) { return static_cast<unsigned char>(c) < 0x80; });
}

TEST(CharsetTest, OnlyUtf8IsUtf8) {
  for (const char* name : {"UTF-8", "utf-8", "utf8", "UTF8"})
    EXPECT_EQ(CharsetOf(name), Charset::kUtf8) << name;
  for (const char* name : {"ANSI_X3.4-1968", "ISO-8859-1", "ISO-8859-15", "EUC-JP", "UTF-7", ""})
    EXPECT_EQ(CharsetOf(name), Charset::kAscii) << name;
}

TEST(CharsetTest, InUtf8AllStaysAsItIs) {
  const std::string text = "± † 2⁻⁷ größer 字 \x1b[1m \xff";
  EXPECT_EQ(InCharset(text, Charset::kUtf8), text);
}

TEST(CharsetTest, SignsBecomeWhatPeopleType) {
  EXPECT_EQ(InCharset("2.1e-03 ± 5e-05 †", Charset::kAscii), "2.1e-03 +- 5e-05 *");
  EXPECT_EQ(InCharset("640 × 480, error ≤ 2 %, −1 — or –", Charset::kAscii),
            "640 x 480, error <= 2 %, -1 - or -");
  EXPECT_EQ(InCharset("W/m², 2⁻⁷, 3·10⁻¹², x⁴", Charset::kAscii), "W/m^2, 2^-7, 3*10^-12, x^4")
      << "one ^ for all digits that are raised";
}

TEST(CharsetTest, OtherCharactersAreNamedByTheirNumbers) {
  EXPECT_EQ(InCharset("küche 字 💡.pbrt", Charset::kAscii), "k\\u{fc}che \\u{5b57} \\u{1f4a1}.pbrt");
  EXPECT_EQ(InCharset("a\xff\xc3", Charset::kAscii), "a\\xff\\xc3");
}

TEST(CharsetTest, EveryCharacterIsAsciiAndAsciiStays) {
  std::string ascii;
  for (char c = 0; c < 0x7f; ++c)
    ascii += c;
  ascii += '\x7f';
  EXPECT_EQ(InCharset(ascii, Charset::kAscii), ascii);
  std::string all;
  for (int lead = 0xc2; lead < 0xf5; ++lead) {
    for (int next = 0x80; next < 0xc0; ++next)
      all += {static_cast<char>(lead), static_cast<char>(next), '\x80', '\x80'};
  }
  EXPECT_TRUE(IsAscii(InCharset(all, Charset::kAscii)));
}

}  // namespace
}  // namespace lucerna
