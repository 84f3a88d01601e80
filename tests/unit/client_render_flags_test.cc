// A flag must mean exactly what was typed, or be refused by name with the exit code for misuse.
#include <string>
#include <utility>

#include "gtest/gtest.h"
#include <CLI/CLI.hpp>

#include "client/exit_code.h"
#include "client/render_flags.h"
#include "render/base/files.h"

namespace lucerna {
namespace {

StatusOr<RenderOverrides> Parse(const std::string& words) {
  return WithImageFlags({}, words);
}

// Stop criteria are flags of other commands.
RenderOverrides ParseStop(const std::string& words) {
  CLI::App app;
  RenderOverrides overrides;
  AddSettingFlags(app, SettingRole::kStopsJob, overrides);
  app.parse(words);
  return overrides;
}

TEST(RenderFlagsTest, WhatIsNotGivenStaysOpen) {
  EXPECT_EQ(Parse("").value(), RenderOverrides());
}

TEST(RenderFlagsTest, EveryFlagArrives) {
  RenderOverrides expected;
  expected.width = 640;
  expected.height = 360;
  expected.photons_per_pass = 4;
  expected.seed = 18'446'744'073'709'551'615U;
  expected.radius_controller = RadiusControllerKind::kPppm;
  expected.alpha = 0.7;
  expected.kernel = KernelKind::kConstant;
  expected.initial_radius = 0.25;
  expected.max_depth = 8;
  expected.bias = 0.01;
  expected.frequency_share = 0.5;
  expected.use_everything = true;
  expected.spectral = true;
  const auto overrides = Parse(
      "--size 640x360 --photons-per-pass 4 --seed 18446744073709551615 "
      "--radius-controller pppm --alpha 0.7 --kernel constant --initial-radius 0.25 "
      "--max-depth 8 --bias 1% --frequency-share 0.5 --use-everything "
      "--spectral");
  ASSERT_TRUE(overrides.ok()) << overrides.status();
  EXPECT_EQ(*overrides, expected);
  RenderOverrides until;
  until.passes = 3;
  until.time_s = 5.5;
  until.error = 0.02;
  until.photons = 6;
  EXPECT_EQ(ParseStop("--passes 3 --time 5.5 --error 2% --photons 6"), until);
}

// A switch that is said to be off was taken for one that is on.
TEST(RenderFlagsTest, SwitchesMayBeTurnedOff) {
  RenderOverrides expected;
  expected.adaptive_photons = false;
  expected.spectral = false;
  expected.use_everything = true;
  EXPECT_EQ(Parse("--adaptive-photons=false --use-everything=true --spectral=false").value(),
            expected);
}

// "3" is hardly ever meant as 300 %.
TEST(RenderFlagsTest, AShareAboveOneNeedsItsPercentSign) {
  try {
    (void)ParseStop("--error 3");
    FAIL();
  } catch (const CLI::ParseError& error) {
    EXPECT_NE(std::string(error.what()).find("write 3% for 3 percent, or 300%"), std::string::npos)
        << error.what();
  }
  EXPECT_EQ(ParseStop("--error 300%").error, 3);
  EXPECT_EQ(ParseStop("--error 1").error, 1);
  EXPECT_EQ(ParseStop("--error 3%").error, 0.03);
}

TEST(RenderFlagsTest, WordsChangeWhatTheyNameAndNothingElse) {
  RenderOverrides common;
  common.seed = 7;
  common.alpha = 0.5;
  const auto changed = WithImageFlags(common, " --alpha 0.7 --bias 1% --initial-radius 2px ");
  ASSERT_TRUE(changed.ok()) << changed.status();
  RenderOverrides expected = common;
  expected.alpha = 0.7;
  expected.bias = 0.01;
  expected.initial_radius = 0;
  expected.initial_footprints = 2;
  EXPECT_EQ(*changed, expected);
  EXPECT_EQ(WithImageFlags(common, "").value(), common);
  for (const char* words : {"--alpha", "--alpha x", "--unknown 3", "word", "--passes 3"}) {
    EXPECT_EQ(ExitCodeOf(WithImageFlags(common, words).status()), ExitCode::kUsage) << words;
  }
}

TEST(RenderFlagsTest, WhatIsNotOfTheTypeIsRefusedByTheFlagsName) {
  for (const auto& [words, flag] : {std::pair{"--size 640", "--size must be"},
                                    std::pair{"--initial-radius 0", "--initial-radius must be"},
                                    std::pair{"--photons-per-pass x", "--photons-per-pass must be"},
                                    std::pair{"--radius-controller sppm", "--radius-controller: "},
                                    std::pair{"--kernel box", "--kernel: "}}) {
    const Status status = Parse(words).status();
    EXPECT_EQ(ExitCodeOf(status), ExitCode::kUsage) << words;
    EXPECT_NE(std::string(status.message()).find(flag), std::string::npos) << status;
  }
}

TEST(RenderFlagsTest, MessagesShowFlagsInPlaceOfNamesOfSettings) {
  EXPECT_EQ(WithFlagNames("setting \"time_s\" or setting \"photons_per_pass\" is wrong"),
            "--time or --photons-per-pass is wrong");
  EXPECT_EQ(WithFlagNames("a.pbrt:1:1: error: \"alpha\" of passes, unknown setting \"x\""),
            "a.pbrt:1:1: error: \"alpha\" of passes, unknown setting \"x\"");
}

// The manual holds what `lucerna help settings` prints, between two empty lines.
TEST(RenderFlagsTest, TheManualsTableOfSettingsIsUpToDate) {
  const StatusOr<std::string> manual = ReadFile(LUCERNA_SOURCE_DIR "/docs/manual.md");
  ASSERT_TRUE(manual.ok()) << manual.status();
  EXPECT_NE(manual->find("\n\n" + SettingsTable() + "\n"), std::string::npos)
      << "put the output of `lucerna help settings` into docs/manual.md:\n"
      << SettingsTable();
}

TEST(ExitCodeTest, AFailureKeepsItsCodeAndOthersAreOne) {
  for (const ExitCode code :
       {ExitCode::kFailed, ExitCode::kUsage, ExitCode::kUnreachable, ExitCode::kInterrupted}) {
    const Status status = Failure(code, "why");
    EXPECT_EQ(ExitCodeOf(status), code);
    EXPECT_EQ(status.message(), "why");
  }
  EXPECT_EQ(ExitCodeOf(absl::OkStatus()), ExitCode::kDone);
  // A disk can be "unavailable" too; that is not an unreachable coordinator.
  EXPECT_EQ(ExitCodeOf(absl::UnavailableError("disk")), ExitCode::kFailed);
}

}  // namespace
}  // namespace lucerna
