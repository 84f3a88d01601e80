// A flag must mean exactly what was typed, or be refused by name with the exit code for misuse.
#include <optional>
#include <string>

#include "gtest/gtest.h"

#include "client/exit_code.h"
#include "client/render_flags.h"

namespace lucerna {
namespace {

TEST(RenderFlagsTest, WhatIsNotGivenStaysOpen) {
  const auto overrides = ToOverrides({});
  ASSERT_TRUE(overrides.ok());
  EXPECT_FALSE(overrides->width || overrides->height || overrides->passes ||
               overrides->photons_per_pass || overrides->time_s || overrides->seed ||
               overrides->radius_controller || overrides->alpha || overrides->kernel ||
               overrides->initial_radius || overrides->max_depth);
}

TEST(RenderFlagsTest, EveryFlagArrives) {
  RenderFlags flags;
  flags.size = "640x360";
  flags.passes = 3;
  flags.photons_per_pass = 4;
  flags.time_s = 5.5;
  flags.seed = 18'446'744'073'709'551'615U;
  flags.radius_controller = "pppm";
  flags.alpha = 0.7;
  flags.kernel = "constant";
  flags.initial_radius = "0.25";
  flags.max_depth = 8;
  const auto overrides = ToOverrides(flags);
  ASSERT_TRUE(overrides.ok()) << overrides.status();
  EXPECT_EQ(overrides->width, 640);
  EXPECT_EQ(overrides->height, 360);
  EXPECT_EQ(overrides->passes, 3);
  EXPECT_EQ(overrides->photons_per_pass, 4);
  EXPECT_EQ(overrides->time_s, 5.5);
  EXPECT_EQ(overrides->seed, 18'446'744'073'709'551'615U);
  EXPECT_EQ(overrides->radius_controller, RadiusControllerKind::kPppm);
  EXPECT_EQ(overrides->alpha, 0.7);
  EXPECT_EQ(overrides->kernel, KernelKind::kConstant);
  EXPECT_EQ(overrides->initial_radius, 0.25);
  EXPECT_EQ(overrides->max_depth, 8);
}

// "3" is hardly ever meant as 300 %.
TEST(RenderFlagsTest, AShareAboveOneNeedsItsPercentSign) {
  RenderFlags flags;
  flags.error = "3";
  const auto refused = ToOverrides(flags);
  EXPECT_EQ(ExitCodeOf(refused.status()), ExitCode::kUsage);
  EXPECT_NE(refused.status().message().find("write 3% for 3 percent, or 300%"),
            std::string_view::npos)
      << refused.status();
  flags.error = "300%";
  EXPECT_EQ(ToOverrides(flags)->error, 3);
  flags.error = "1";
  EXPECT_EQ(ToOverrides(flags)->error, 1);
  flags.error = "3%";
  EXPECT_EQ(ToOverrides(flags)->error, 0.03);
}

TEST(RenderFlagsTest, AutoIsARadiusOfZero) {
  RenderFlags flags;
  flags.initial_radius = "auto";
  const auto overrides = ToOverrides(flags);
  ASSERT_TRUE(overrides.ok());
  EXPECT_EQ(overrides->initial_radius, 0);
}

TEST(RenderFlagsTest, ARadiusInPixelsIsAnAutomaticOneOfThatManyFootprints) {
  RenderFlags flags;
  flags.initial_radius = "1.5px";
  const auto overrides = ToOverrides(flags);
  ASSERT_TRUE(overrides.ok()) << overrides.status();
  EXPECT_EQ(overrides->initial_radius, 0) << "also where the scene gives a radius";
  EXPECT_EQ(overrides->initial_footprints, 1.5);
}

TEST(RenderFlagsTest, WordsChangeWhatTheyNameAndNothingElse) {
  RenderFlags common;
  common.seed = 7;
  common.alpha = 0.5;
  const auto flags = WithImageFlags(common, " --alpha 0.7 --bias 1% --initial-radius 2px ");
  ASSERT_TRUE(flags.ok()) << flags.status();
  EXPECT_EQ(flags->seed, 7U);
  EXPECT_EQ(flags->alpha, 0.7);
  EXPECT_EQ(flags->bias, "1%");
  EXPECT_EQ(flags->initial_radius, "2px");
  EXPECT_FALSE(flags->kernel);
  EXPECT_EQ(WithImageFlags(common, "")->alpha, 0.5);
  for (const char* words : {"--alpha", "--alpha x", "--unknown 3", "word", "--passes 3"}) {
    EXPECT_EQ(ExitCodeOf(WithImageFlags(common, words).status()), ExitCode::kUsage) << words;
  }
}

void ExpectMisuse(std::optional<std::string> RenderFlags::*flag, const char* typed,
                  const std::string& name) {
  RenderFlags flags;
  flags.*flag = typed;
  const Status status = ToOverrides(flags).status();
  EXPECT_EQ(ExitCodeOf(status), ExitCode::kUsage) << typed << ": " << status;
  EXPECT_NE(std::string(status.message()).find(name), std::string::npos) << status;
}

TEST(RenderFlagsTest, RefusesWhatMakesNoSense) {
  for (const char* size : {"", "x", "640", "640x", "x480", "640*480", "0x1", "-1x5", "1x1x1",
                           "1 x 1", "99999999999x1"}) {
    ExpectMisuse(&RenderFlags::size, size, "--size");
  }
  for (const char* radius : {"", "automatic", "0", "-1", "nan", "inf", "1m", "px", "0px", "-1px"}) {
    ExpectMisuse(&RenderFlags::initial_radius, radius, "--initial-radius");
  }
  ExpectMisuse(&RenderFlags::radius_controller, "sppm", "--radius-controller");
  ExpectMisuse(&RenderFlags::kernel, "box", "--kernel");
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
