// Can text of others move a cursor, end a line, or hide itself?
#include "render/base/escape.h"

#include <cstdint>
#include <string>

#include <gtest/gtest.h>

#include "render/base/random_id.h"
#include "tests/fuzz/mutation.h"

namespace lucerna {
namespace {

std::string Utf8(std::uint32_t code) {
  std::string bytes;
  if (code < 0x80) {
    bytes += static_cast<char>(code);
  } else if (code < 0x800) {
    bytes += static_cast<char>(0xc0U | code >> 6U);
    bytes += static_cast<char>(0x80U | (code & 0x3fU));
  } else if (code < 0x10000) {
    bytes += static_cast<char>(0xe0U | code >> 12U);
    bytes += static_cast<char>(0x80U | (code >> 6U & 0x3fU));
    bytes += static_cast<char>(0x80U | (code & 0x3fU));
  } else {
    bytes += static_cast<char>(0xf0U | code >> 18U);
    bytes += static_cast<char>(0x80U | (code >> 12U & 0x3fU));
    bytes += static_cast<char>(0x80U | (code >> 6U & 0x3fU));
    bytes += static_cast<char>(0x80U | (code & 0x3fU));
  }
  return bytes;
}

TEST(EscapeTest, PrintableTextStays) {
  for (const std::string text : {"", "scene.pbrt", "models/caf\u00e9 \u56fd \u03b1\u0301.ply",
                                 "C:\\scenes\\a", "\U0001f469\u200d\U0001f52c"}) {
    EXPECT_EQ(Escaped(text), text);
    EXPECT_EQ(EscapedLines(text), text);
  }
}

TEST(EscapeTest, ControlCharactersAreShownAsNumbers) {
  EXPECT_EQ(Escaped("\x1b[2Jgone"), "\\x1b[2Jgone");
  EXPECT_EQ(Escaped("a\r\n2026 [info] forged\tb\x7f"), "a\\x0d\\x0a2026 [info] forged\\x09b\\x7f");
  EXPECT_EQ(Escaped(std::string("a\0b", 3)), "a\\x00b");
  EXPECT_EQ(EscapedLines("one\ntwo\r\x1b]0;title\a"), "one\ntwo\\x0d\\x1b]0;title\\x07");
}

TEST(EscapeTest, EveryControlCharacterIsEscaped) {
  for (std::uint32_t code = 0; code < 0xa0; ++code) {
    if (code >= 0x20 && code < 0x7f) continue;
    const std::string shown = Escaped(Utf8(code));
    EXPECT_EQ(shown.front(), '\\') << code;
    EXPECT_EQ(shown.find(Utf8(code)), std::string::npos) << code;
  }
}

TEST(EscapeTest, CharactersThatHideOrTurnTextAreShownAsNumbers) {
  // "photo[override]gpj.exe" would read as photoexe.jpg.
  EXPECT_EQ(Escaped("photo\u202egpj.exe"), "photo\\u{202e}gpj.exe");
  for (const std::uint32_t code : {0x200eU, 0x200fU, 0x202aU, 0x2066U, 0x2069U, 0x61cU, 0x2028U,
                                   0x2029U, 0xfeffU, 0x200bU, 0xe0041U, 0xadU, 0x9bU}) {
    EXPECT_EQ(Escaped(Utf8(code)).substr(0, 3), "\\u{") << code;
  }
}

TEST(EscapeTest, BytesThatAreNoUtf8AreShownAsNumbers) {
  EXPECT_EQ(Escaped("\xff\xfe"), "\\xff\\xfe");
  EXPECT_EQ(Escaped("a\xc3"), "a\\xc3");                           // cut off
  EXPECT_EQ(Escaped("\xc0\xaf"), "\\xc0\\xaf");                    // '/' in two bytes
  EXPECT_EQ(Escaped("\xe0\x80\x9b"), "\\xe0\\x80\\x9b");           // a control in three bytes
  EXPECT_EQ(Escaped("\xed\xa0\x80"), "\\xed\\xa0\\x80");           // a surrogate
  EXPECT_EQ(Escaped("\xf4\x90\x80\x80"), "\\xf4\\x90\\x80\\x80");  // above U+10FFFF
  EXPECT_EQ(Escaped("\x80z"), "\\x80z");
}

// Whatever the bytes: no control byte comes out, and escaping again changes nothing, which also
// says that what came out is UTF-8.
TEST(EscapeTest, RandomBytesComeOutHarmless) {
  for (std::uint64_t key = 0; key < 20'000; ++key) {
    // Every third is a long character, so that well-formed ones occur too.
    std::string bytes;
    for (std::uint64_t i = 0; i < key % 40; ++i) {
      const std::uint64_t draw = Mixed(key << 8U | i);
      if (i % 3 == 0) {
        bytes += Utf8(static_cast<std::uint32_t>(draw >> 8U) % (i % 2 == 0 ? 0x110000 : 0x3000));
      } else {
        bytes += static_cast<char>(draw);
      }
    }
    const std::string shown = Escaped(bytes);
    for (const char c : shown)
      ASSERT_FALSE((c >= 0 && c < 0x20) || c == 0x7f) << shown;
    ASSERT_EQ(Escaped(shown), shown);
    ASSERT_LE(shown.size(), 4 * bytes.size());
  }
}

TEST(RandomIdTest, IdsAreLongAndNeverTheSame) {
  const std::string first = RandomId();
  EXPECT_EQ(first.size(), 32U);
  EXPECT_EQ(first.find_first_not_of("0123456789abcdef"), std::string::npos);
  EXPECT_NE(first, RandomId());
  EXPECT_EQ(RandomBytes(0), "");
  EXPECT_EQ(RandomBytes(1000).size(), 1000U);
}

}  // namespace
}  // namespace lucerna
