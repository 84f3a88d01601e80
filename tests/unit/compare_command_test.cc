// What is compared must be what was typed, and what the coordinator recorded.
#include "client/commands/compare_command.h"

#include <chrono>
#include <string>
#include <vector>

#include "gtest/gtest.h"

#include "client/exit_code.h"
#include "render/wire/messages.h"

namespace lucerna {
namespace {

TEST(CompareCommandTest, SettingsHaveNamesAndTheirOwnFlags) {
  RenderOverrides common;
  common.alpha = 0.5;
  const auto settings =
      ParseSettings({"plain:", " wide : --alpha 0.9 --initial-radius 4px "}, common);
  ASSERT_TRUE(settings.ok()) << settings.status();
  ASSERT_EQ(settings->size(), 2U);
  EXPECT_EQ((*settings)[0].name, "plain");
  EXPECT_EQ((*settings)[0].overrides.alpha, 0.5);
  EXPECT_EQ((*settings)[1].name, "wide");
  EXPECT_EQ((*settings)[1].words, "--alpha 0.9 --initial-radius 4px");
  EXPECT_EQ((*settings)[1].overrides.alpha, 0.9);
}

TEST(CompareCommandTest, WithoutSettingsEachControllerIsOne) {
  const auto settings = ParseSettings({}, {});
  ASSERT_TRUE(settings.ok());
  EXPECT_EQ(settings->size(), RadiusControllerNames().size());
  EXPECT_EQ(settings->front().name, "ppm");
  EXPECT_EQ(settings->front().overrides.radius_controller, RadiusControllerKind::kPpm);
}

TEST(CompareCommandTest, SettingsThatMakeNoSenseAreRefused) {
  for (const std::vector<std::string>& typed : {std::vector<std::string>{"a:", "a:"},
                                                {"a"},
                                                {"alpha 0.5"},
                                                {""},
                                                {": --alpha 0.5"},
                                                {"--alpha 0.5"},
                                                {"a: --nonsense"},
                                                {"a: --time 5"}}) {
    EXPECT_EQ(ExitCodeOf(ParseSettings(typed, {}).status()), ExitCode::kUsage) << typed[0];
  }
}

TEST(CompareCommandTest, TimesGrow) {
  EXPECT_EQ(*ParseTimes("1,2.5,10"), (std::vector<double>{1, 2.5, 10}));
  for (const char* typed : {"", "1,", "0,1", "2,1", "1,1", "one", "1 2", "inf", "nan", "-1"}) {
    EXPECT_EQ(ExitCodeOf(ParseTimes(typed).status()), ExitCode::kUsage) << typed;
  }
}

TEST(CompareCommandTest, ARecordIsACurveOfProcessorTimeOverCores) {
  v1::Job job;
  job.add_convergence()->set_passes(1);  // no true error yet
  v1::ErrorSample& sample = *job.add_convergence();
  *sample.mutable_cpu() = ToProto(Duration(std::chrono::seconds(6)));
  *sample.mutable_running() = ToProto(Duration(std::chrono::seconds(4)));
  sample.set_photons(1000);
  sample.set_true_relative(0.25);
  sample.set_true_relative_untrimmed(0.5);
  const std::vector<ErrorPoint> curve = CurveOf(job, 2, 0.01, 0.02);
  ASSERT_EQ(curve.size(), 1U);
  EXPECT_EQ(curve[0].seconds, 3);
  EXPECT_EQ(curve[0].wall_s, 4);
  EXPECT_EQ(curve[0].photons, 1000);
  EXPECT_EQ(curve[0].rel_mse, 0.25);
  EXPECT_EQ(curve[0].reference_noise, 0.01);
  EXPECT_EQ(curve[0].untrimmed, 0.5);
  EXPECT_EQ(curve[0].untrimmed_reference_noise, 0.02);
}

}  // namespace
}  // namespace lucerna
