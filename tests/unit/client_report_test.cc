// What programs read must be valid JSON that says what the job says, with units in the names.
#include <algorithm>
#include <cmath>

#include "gtest/gtest.h"
#include <nlohmann/json.hpp>

#include "client/view/report.h"
#include "render/wire/messages.h"
#include "tests/support/converging_job.h"
#include "tests/support/job_settings.h"

namespace lucerna {
namespace {

using nlohmann::json;

TEST(ReportTest, AJobTellsItsFigures) {
  v1::Job job;
  job.set_job_id("j1");
  job.set_name("a \"quoted\"\nname \xff");
  job.set_state(v1::JOB_STATE_SUCCEEDED);
  job.set_stop_reason(v1::STOP_REASON_TIME);
  SetSetting(job, &RenderSettings::seed, 18'446'744'073'709'551'615U);
  job.set_scene_digest(std::string(32, '\x01'));
  job.add_warnings("scene.pbrt:1:1: warning: something");
  job.mutable_progress()->set_photons(7);
  job.mutable_progress()->mutable_tally()->set_pairs(9);
  *job.mutable_progress()->mutable_running() = ToProto(Duration(std::chrono::milliseconds(1500)));
  SavedImage saved;
  saved.paths = {"out.exr", "out.png"};

  const json report = json::parse(JobReport(job, saved, JsonDetail::kFull));
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

// What `render --json` prints carries the estimate, and with a reference the truth.
TEST(ReportTest, AJobsReportCarriesItsError) {
  v1::Job job = ConvergingJob(12);
  json report = json::parse(JobReport(job, JsonDetail::kFull));
  EXPECT_DOUBLE_EQ(
      report["relative_error"]["estimate"].get<double>(),
      std::sqrt(job.convergence(11).relative().noise() + job.convergence(11).relative().bias()));
  EXPECT_DOUBLE_EQ(report["relative_error"]["true"].get<double>(),
                   std::sqrt(job.convergence(11).true_relative()));
  EXPECT_FALSE(report.contains("nothing_found"));

  v1::ErrorSample& newest = *job.mutable_convergence(11);
  newest.mutable_relative()->set_high(HUGE_VAL);
  newest.set_nothing_found(true);
  v1::LightFinding& light = *job.add_lights();
  light.set_name("light 1");
  light.set_photons_sent(5);
  light.set_missing_share(HUGE_VAL);
  report = json::parse(JobReport(job, JsonDetail::kFull));
  EXPECT_FALSE(report.contains("relative_error")) << "nothing is known, above all not 0";
  EXPECT_EQ(report["nothing_found"], true);
  EXPECT_EQ(report["lights"][0]["photons_sent"], 5);
  EXPECT_TRUE(report["lights"][0]["missing_share"].is_null());
}

// The properties that the manual promises, each as in the full value.
TEST(ReportTest, TheShortValueIsAPartOfTheFullOne) {
  v1::Job job = ConvergingJob(12);
  job.set_state(v1::JOB_STATE_SUCCEEDED);
  job.mutable_progress()->mutable_tally()->mutable_energy()->set_emitted(400);
  const SavedImage saved = {{"out.exr"}, Digest()};
  const json full = json::parse(JobReport(job, saved, JsonDetail::kFull));
  const json brief = json::parse(JobReport(job, saved, JsonDetail::kShort));
  for (const auto& [name, value] : brief.items())
    EXPECT_EQ(value, full[name]) << name;
  for (const char* name : {"job_id", "state", "stop_reason", "passes", "photons", "running_s",
                           "relative_error", "warnings", "paths", "image_digest"}) {
    EXPECT_TRUE(brief.contains(name)) << name;
  }
  for (const char* name : {"energy", "tally", "parts", "settings", "lights", "worker_cpu_s"}) {
    EXPECT_TRUE(full.contains(name)) << name;
    EXPECT_FALSE(brief.contains(name)) << name;
  }

  job.set_state(v1::JOB_STATE_PAUSED);
  job.set_pause_cause(v1::PAUSE_CAUSE_DISK);
  job.set_condition("paused: no room");
  job.mutable_convergence(11)->set_nothing_found(true);
  const json listed = json::parse(JobsReport({job}, JsonDetail::kShort))[0];
  EXPECT_EQ(listed["pause_cause"], "DISK");
  EXPECT_EQ(listed["condition"], "paused: no room");
  EXPECT_EQ(listed["nothing_found"], true) << "what is wrong is never left out";
  EXPECT_EQ(listed["warnings"].size(), static_cast<std::size_t>(job.warnings_size()));
  EXPECT_FALSE(listed.contains("energy"));
}

TEST(ReportTest, TheDenoisedImageHasAnErrorOfItsOwn) {
  v1::Job job = ConvergingJob(12);
  EXPECT_FALSE(json::parse(JobReport(job, JsonDetail::kShort)).contains("denoised_error"));
  v1::DenoisedError& denoised = *job.mutable_convergence(11)->mutable_denoised();
  denoised.mutable_relative()->set_noise(0.0003);
  denoised.mutable_relative()->set_bias(0.0001);
  denoised.mutable_relative()->set_low(0.0001);
  denoised.mutable_relative()->set_high(0.0009);
  denoised.set_relative_untrimmed(0.0016);
  denoised.set_true_relative(0.0025);
  denoised.set_true_relative_untrimmed(0.0036);
  const json error = json::parse(JobReport(job, JsonDetail::kShort))["denoised_error"];
  EXPECT_EQ(error.size(), 6U);
  EXPECT_DOUBLE_EQ(error["estimate"].get<double>(), 0.02);
  EXPECT_DOUBLE_EQ(error["low"].get<double>(), 0.01);
  EXPECT_DOUBLE_EQ(error["high"].get<double>(), 0.03);
  EXPECT_DOUBLE_EQ(error["untrimmed"].get<double>(), 0.04);
  EXPECT_DOUBLE_EQ(error["true"].get<double>(), 0.05);
  EXPECT_DOUBLE_EQ(error["true_untrimmed"].get<double>(), 0.06);
}

TEST(ReportTest, TheConvergenceRecordKeepsItsDigits) {
  const v1::Job job = ConvergingJob(12);
  const json report = json::parse(ConvergenceReport(job));
  ASSERT_EQ(report["convergence"].size(), 12U);
  const json& sample = report["convergence"][3];
  EXPECT_EQ(sample["photons"], job.convergence(3).photons());
  EXPECT_EQ(sample["relative"]["noise"].get<double>(), job.convergence(3).relative().noise());
  EXPECT_EQ(sample["true_relative_mse"].get<double>(), job.convergence(3).true_relative());
  EXPECT_EQ(sample["relative_mse_untrimmed"].get<double>(),
            job.convergence(3).relative_untrimmed());
  EXPECT_EQ(sample["true_relative_mse_untrimmed"].get<double>(),
            job.convergence(3).true_relative_untrimmed());
  EXPECT_EQ(sample["left_out_pixels"], 65);
  EXPECT_DOUBLE_EQ(report["relative_error"]["untrimmed"].get<double>(),
                   std::sqrt(job.convergence(11).relative_untrimmed()));
  EXPECT_EQ(json::parse(JobReport(job, JsonDetail::kFull))["relative_error"],
            report["relative_error"]);
  EXPECT_NEAR(report["mse_exponent_photons"].get<double>(), -2.0 / 3, 1e-4);
  EXPECT_DOUBLE_EQ(report["relative_error"]["high"].get<double>(),
                   std::sqrt(job.convergence(11).relative().high()));
  EXPECT_EQ(report["worker_shares"][2]["name"], "render-3:4213");
  EXPECT_EQ(report["settings"]["error"], 0.035);

  const json empty = json::parse(ConvergenceReport(v1::Job()));
  EXPECT_EQ(empty["convergence"], json::array());
  EXPECT_FALSE(empty.contains("relative_error"));
  EXPECT_FALSE(empty.contains("mse_exponent_time"));
}

std::vector<std::string> Lines(const std::string& csv) {
  std::vector<std::string> lines;
  for (std::size_t at = 0; at < csv.size();) {
    const std::size_t end = csv.find("\r\n", at);
    lines.push_back(csv.substr(at, end - at));
    at = end + 2;
  }
  return lines;
}

TEST(ReportTest, TheTableHasARowForEverySampleAndWorkerAndACellForEveryColumn) {
  v1::Job job = ConvergingJob(2);
  job.mutable_convergence(1)->clear_true_relative();
  job.mutable_worker_shares(0)->set_name("a \"b\", c");
  const std::vector<std::string> lines = Lines(ConvergenceCsv(job));
  ASSERT_EQ(lines.size(), 6U);
  EXPECT_EQ(lines[0].substr(0, 30), "row,worker_id,name,passes,batc");
  EXPECT_EQ(lines[1].substr(0, 30), "sample,,,1,,300000,0.5,2.89999");
  EXPECT_EQ(lines[3].substr(0, 22), "worker,w1,\"a \"\"b\"\", c\"");
  for (const std::size_t i : {1U, 2U, 4U, 5U}) {
    EXPECT_EQ(std::count(lines[i].begin(), lines[i].end(), ','),
              std::count(lines[0].begin(), lines[0].end(), ','))
        << lines[i];
  }
}

TEST(ReportTest, NoJobsIsAnEmptyList) {
  EXPECT_EQ(json::parse(JobsReport({}, JsonDetail::kShort)), json::array());
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
  metrics.rel_mse_trimmed = 0.1;
  metrics.rel_mse_untrimmed = 0.7;
  metrics.channel_mean_ratio = {1, 2, 3};
  const json report = json::parse(MetricsReport(metrics));
  EXPECT_EQ(report["rel_mse"].get<double>(), 0.1 + 0.2);
  EXPECT_EQ(report["rel_mse_trimmed"].get<double>(), 0.1);
  EXPECT_EQ(report["rel_mse_untrimmed"].get<double>(), 0.7);
  EXPECT_EQ(report["channel_mean_ratio"], json({1.0, 2.0, 3.0}));
}

}  // namespace
}  // namespace lucerna
