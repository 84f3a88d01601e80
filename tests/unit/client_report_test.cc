// What programs read must be valid JSON that says what the job says, with units in the names.
#include "gtest/gtest.h"
#include <nlohmann/json.hpp>

#include "client/report.h"
#include "render/wire/messages.h"

namespace lucerna {
namespace {

using nlohmann::json;

TEST(ReportTest, AJobTellsItsFigures) {
  v1::Job job;
  job.set_job_id("j1");
  job.set_name("a \"quoted\"\nname \xff");
  job.set_state(v1::JOB_STATE_SUCCEEDED);
  job.set_stop_reason(v1::STOP_REASON_TIME);
  job.mutable_settings()->set_seed(18'446'744'073'709'551'615U);
  job.set_scene_digest(std::string(32, '\x01'));
  job.add_warnings("scene.pbrt:1:1: warning: something");
  job.mutable_progress()->set_photons(7);
  job.mutable_progress()->mutable_tally()->set_pairs(9);
  *job.mutable_progress()->mutable_running() = ToProto(Duration(std::chrono::milliseconds(1500)));
  SavedImage saved;
  saved.paths = {"out.exr", "out.png"};

  const json report = json::parse(JobReport(job, saved));
  EXPECT_EQ(report["job_id"], "j1");
  EXPECT_EQ(report["state"], "SUCCEEDED");
  EXPECT_EQ(report["stop_reason"], "TIME");
  EXPECT_EQ(report["running_s"], 1.5);
  EXPECT_EQ(report["photons"], 7);
  EXPECT_EQ(report["tally"]["pairs"], 9);
  EXPECT_EQ(report["settings"]["seed"], 18'446'744'073'709'551'615U);
  EXPECT_EQ(report["scene_digest"].get<std::string>().substr(0, 4), "0101");
  EXPECT_EQ(report["warnings"].size(), 1U);
  EXPECT_EQ(report["paths"], json({"out.exr", "out.png"}));
  EXPECT_EQ(report["image_digest"], Digest().Hex());
  EXPECT_FALSE(report.contains("failure"));
  EXPECT_FALSE(report.contains("to_first_photons_s")) << "absent until a batch came back";
}

TEST(ReportTest, NoJobsIsAnEmptyList) {
  EXPECT_EQ(json::parse(JobsReport({})), json::array());
}

TEST(ReportTest, DiagnosticsKeepTheirPlace) {
  const json report = json::parse(
      SceneReport({{Diagnostic::Severity::kWarning, "a b.pbrt", 3, 4, "bump is ignored"}}, true));
  EXPECT_EQ(report["ok"], true);
  EXPECT_EQ(report["diagnostics"][0]["severity"], "warning");
  EXPECT_EQ(report["diagnostics"][0]["file"], "a b.pbrt");
  EXPECT_EQ(report["diagnostics"][0]["line"], 3);
  EXPECT_EQ(report["diagnostics"][0]["column"], 4);
}

TEST(ReportTest, MetricsKeepTheirDigits) {
  ImageMetrics metrics;
  metrics.rel_mse = 0.1 + 0.2;
  metrics.channel_mean_ratio = {1, 2, 3};
  const json report = json::parse(MetricsReport(metrics));
  EXPECT_EQ(report["rel_mse"].get<double>(), 0.1 + 0.2);
  EXPECT_EQ(report["channel_mean_ratio"], json({1.0, 2.0, 3.0}));
}

}  // namespace
}  // namespace lucerna
