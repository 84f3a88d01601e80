// Text of a manual page is shown as it is, never obeyed. tests/tools/check_manuals.sh has whole
// pages checked by groff and mandoc.
#include "render/base/manual_page.h"

#include <algorithm>
#include <string>

#include "gtest/gtest.h"

namespace lucerna {
namespace {

TEST(ManualPageTest, EscapesWhatManWouldObey) {
  EXPECT_EQ(ManualText(".SH NAME"), "\\&.SH NAME");
  EXPECT_EQ(ManualText("'quoted'"), "\\(aqquoted\\(aq");
  EXPECT_EQ(ManualText("a\\fBb"), "a\\efBb");
  EXPECT_EQ(ManualText("--size"), "\\-\\-size");
  EXPECT_EQ(ManualText("sr⁻¹"), "sr\\[u207B]\\[u00B9]");
  EXPECT_EQ(ManualText("\U0001F4A1"), "\\[u1F4A1]");
}

TEST(ManualPageTest, WrapsWordsAndProtectsEachLine) {
  ManualPage page("p", "does it");
  std::string text;
  for (int i = 0; i < 100; ++i)
    text += ".ab 'cd ";
  page.Item("--flag X", text);
  std::size_t begin = page.text().find(".TP");
  ASSERT_NE(begin, std::string::npos);
  begin = page.text().find('\n', page.text().find(".B ", begin)) + 1;
  while (begin < page.text().size()) {
    const std::size_t end = page.text().find('\n', begin);
    const std::string line = page.text().substr(begin, end - begin);
    EXPECT_LE(line.size(), 80U);
    EXPECT_NE(line.front(), '.');
    EXPECT_NE(line.front(), '\'');
    begin = end + 1;
  }
}

}  // namespace
}  // namespace lucerna
