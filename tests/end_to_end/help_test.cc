// All three programs say which release they are and how they are called.
#include <algorithm>
#include <string>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

#include "tests/end_to_end/programs.h"
#include "tests/support/process.h"

namespace lucerna {
namespace {

class HelpTest : public testing::TestWithParam<const char*> {};

TEST_P(HelpTest, SaysTheVersionAndTheUsage) {
  const std::string program = kBin + "/" + GetParam();
  const auto version = RunProgram({program, "--version"});
  EXPECT_EQ(version.exit_code, 0);
  EXPECT_THAT(version.output, testing::MatchesRegex(std::string(GetParam()) + " [0-9.]+\n"));
  const auto help = RunProgram({program, "help"});
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_THAT(help.output, testing::HasSubstr("Usage: "));
  EXPECT_EQ(help.output, RunProgram({program, "--help"}).output);
}

TEST(HelpOfCommandsTest, ExplainsOneCommandOrSaysThatThereIsNone) {
  const std::string program = kBin + "/lucerna";
  EXPECT_EQ(RunProgram({program, "help", "render"}).output,
            RunProgram({program, "render", "--help"}).output);
  const auto unknown = RunProgram({program, "help", "paint"});
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_THAT(unknown.errors, testing::HasSubstr("there is no command paint"));
}

TEST(HelpOfCommandsTest, AValueThatAFlagDoesNotHaveIsMetWithThoseThatItHas) {
  const auto wrong = RunProgram({kBin + "/lucerna", "completion", "csh"});
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_THAT(wrong.errors, testing::HasSubstr("must be bash, fish or zsh, not csh"));
}

TEST(HelpOfCommandsTest, ShowsTheDefaultsThatACommandHasAlone) {
  const std::string program = kBin + "/lucerna";
  const std::string render = RunProgram({program, "help", "render"}).output;
  EXPECT_THAT(render, testing::HasSubstr("(default: appm)"));
  const std::string reference = RunProgram({program, "help", "reference"}).output;
  for (const char* fallback : {"pppm", "0.5px", "4 for each pixel"}) {
    EXPECT_THAT(reference, testing::HasSubstr(std::string("(default: ") + fallback + ")"));
  }
  EXPECT_THAT(reference, testing::Not(testing::HasSubstr("appm)")));
}

// Values of a flag are shown by their names, not by what they are inside.
TEST(HelpOfCommandsTest, IsTextAlone) {
  for (const char* command : {"render", "bake", "completion", "settings", "man"}) {
    const std::string help = RunProgram({kBin + "/lucerna", "help", command}).output;
    EXPECT_GT(help.size(), 100U) << command;
    EXPECT_TRUE(std::ranges::all_of(help, [](char c) { return c >= ' ' || c == '\n'; })) << command;
  }
}

INSTANTIATE_TEST_SUITE_P(Programs, HelpTest,
                         testing::Values("lucerna", "lucerna-server", "lucerna-worker"),
                         [](const auto& program) {
                           std::string name = program.param;
                           std::erase(name, '-');
                           return name;
                         });

}  // namespace
}  // namespace lucerna
