// Every token is what the text says, at the line and column where it stands.
#include <string>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

#include "render/formats/pbrt/tokenizer.h"

namespace lucerna {
namespace {

using ::testing::ElementsAre;

struct Read {
  std::vector<std::string> tokens;  // "line:column kind text"
  std::vector<Diagnostic> diagnostics;
};

Read ReadAll(const std::string& text) {
  const std::string file = "t.pbrt";
  Diagnostics diagnostics;
  Tokenizer tokenizer(&file, text, diagnostics);
  Read read;
  for (Token token = tokenizer.Next(); token.kind != Token::Kind::kEnd; token = tokenizer.Next()) {
    const char kind = "EWS[]"[static_cast<int>(token.kind)];
    read.tokens.push_back(std::to_string(token.location.line) + ":" +
                          std::to_string(token.location.column) + " " + kind + " " +
                          std::string(token.text));
  }
  read.diagnostics = diagnostics.Take();
  return read;
}

TEST(PbrtTokenizerTest, SplitsWordsStringsAndBracketsWithTheirPlaces) {
  const Read read = ReadAll("Shape \"sphere\"# a comment \"\n  \"float radius\"[1.5]\r\n-2e3");
  EXPECT_THAT(read.tokens, ElementsAre("1:1 W Shape", "1:7 S sphere", "2:3 S float radius",
                                       "2:17 [ [", "2:18 W 1.5", "2:21 ] ]", "3:1 W -2e3"));
  EXPECT_TRUE(read.diagnostics.empty());
}

TEST(PbrtTokenizerTest, LinesMayEndByACarriageReturnAlone) {
  EXPECT_THAT(ReadAll("a # comment\rb\r\nc\r\rd").tokens,
              ElementsAre("1:1 W a", "2:1 W b", "3:1 W c", "5:1 W d"));
}

TEST(PbrtTokenizerTest, ResolvesEscapesAlsoWhilePeeking) {
  const std::string file = "t.pbrt";
  Diagnostics diagnostics;
  Tokenizer tokenizer(&file, R"("a\"b" "c\\d\te")", diagnostics);
  const Token first = tokenizer.Next();
  EXPECT_EQ(tokenizer.Peek().text, "c\\d\te");
  EXPECT_EQ(first.text, "a\"b");
  EXPECT_FALSE(diagnostics.has_error());
}

TEST(PbrtTokenizerTest, AStringEndsWithItsLine) {
  const Read read = ReadAll("\"open\nScale");
  EXPECT_THAT(read.tokens, ElementsAre("1:1 S open", "2:1 W Scale"));
  ASSERT_EQ(read.diagnostics.size(), 1U);
  EXPECT_EQ(read.diagnostics[0].ToString(),
            "t.pbrt:1:1: error: this string has no closing quote on its line");
  EXPECT_EQ(ReadAll("\"a\\").diagnostics.size(), 1U);
  EXPECT_EQ(ReadAll("\"a\\q\"").diagnostics.size(), 1U);
}

TEST(DiagnosticsTest, KeepsAHundredErrorsAndCountsTheRest) {
  const std::string file = "t.pbrt";
  Diagnostics diagnostics;
  for (int line = 1; line <= 250; ++line)
    diagnostics.Error({&file, line, 1}, "wrong");
  const std::vector<Diagnostic> kept = diagnostics.Take();
  ASSERT_EQ(kept.size(), 100U);
  EXPECT_EQ(kept[98].line, 99);
  EXPECT_EQ(kept[99].ToString(), "t.pbrt: error: and 151 more errors");
}

TEST(DiagnosticsTest, CountsEqualWarningsOnce) {
  const std::string file = "t.pbrt";
  Diagnostics diagnostics;
  for (int line = 1; line <= 3; ++line)
    diagnostics.Warning({&file, line, 1}, "odd");
  diagnostics.Error({&file, 9, 2}, "wrong");
  const std::vector<Diagnostic> kept = diagnostics.Take();
  ASSERT_EQ(kept.size(), 2U);
  EXPECT_EQ(kept[0].ToString(), "t.pbrt:9:2: error: wrong");
  EXPECT_EQ(kept[1].ToString(), "t.pbrt:1:1: warning: odd (and at 2 more places)");
}

}  // namespace
}  // namespace lucerna
