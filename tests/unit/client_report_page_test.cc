// A page must say what the job says, stand alone, and not be taken over by a worker's name.
#include "gtest/gtest.h"

#include "render/report/report_page.h"
#include "tests/support/converging_job.h"

namespace lucerna {
namespace {

bool Has(const std::string& page, const std::string& text) {
  return page.find(text) != std::string::npos;
}

TEST(ReportPageTest, TellsTheFacts) {
  const std::string page = ReportPage(ConvergingJob(), PageImage{"png bytes", Digest()});
  for (const char* text :
       {"sphere-caustic.pbrt", "its error target reached", "640 × 480 pixels", "2.96 %",
        "target 3.50 %", "ppm, alpha 0.667", "render-2:4212", "−0.67", "5a5a5a5a",
        "Error against time", "Error against photons", "true error", "Warnings", "roughness 0.01",
        "src=\"data:image/png;base64,cG5nIGJ5dGVz\"", "<table>"}) {
    EXPECT_TRUE(Has(page, text)) << text;
  }
}

TEST(ReportPageTest, TellsTheEnergyOfPassesAndWhetherItBalances) {
  v1::Job job = ConvergingJob();
  EXPECT_FALSE(Has(ReportPage(job, std::nullopt), "<h2>Energy"));
  v1::PassEnergy& part = *job.add_energy_of_passes();
  part.set_first_pass(4);
  part.set_passes(2);
  part.mutable_energy()->set_emitted(1000);
  part.mutable_energy()->set_absorbed(600);
  part.mutable_energy()->set_escaped(400);
  const std::string balanced = ReportPage(job, std::nullopt);
  EXPECT_TRUE(Has(balanced, "The counters of every pass balance"));
  EXPECT_TRUE(Has(balanced, "4 to 5</th><td>0.00 %</td><td>60.00 %</td><td>40.00 %</td>"));
  part.mutable_energy()->set_escaped(390);
  const std::string off = ReportPage(job, std::nullopt);
  EXPECT_TRUE(Has(off, "The counters of some passes do not balance"));
  EXPECT_TRUE(Has(off, "<td>1.00 %</td></tr>"));
}

TEST(ReportPageTest, LightThatWasNotFoundIsNamed) {
  v1::Job job = ConvergingJob(12);
  job.mutable_convergence(11)->set_missing_relative(1);
  v1::LightFinding& light = *job.add_lights();
  light.set_name("light 1 (a <disk>)");
  light.set_photons_sent(1234);
  light.set_missing_share(0.25);
  const std::string page = ReportPage(job, std::nullopt);
  EXPECT_NE(page.find("light 1 (a &lt;disk&gt;): no photon of 1234 has reached the view"),
            std::string::npos);
  EXPECT_NE(page.find("<td>25.0 %</td>"), std::string::npos);
  job.mutable_convergence(11)->set_nothing_found(true);
  EXPECT_NE(ReportPage(job, std::nullopt).find("Nothing found yet"), std::string::npos);
}

TEST(ReportPageTest, StandsAlone) {
  const std::string page = ReportPage(ConvergingJob(), PageImage{"png bytes", Digest()});
  for (const char* text : {"http:", "https:", "//", "url(", "@import", "<script", "<iframe"}) {
    EXPECT_FALSE(Has(page, text)) << text;
  }
  EXPECT_TRUE(Has(page, "default-src 'none'"));
}

TEST(ReportPageTest, NothingFromOutsideBecomesMarkup) {
  const std::string bad = "\"><script>alert('x')</script><img src=x onerror=y>&\xff";
  v1::Job job = ConvergingJob();
  job.set_job_id(bad);
  job.set_name(bad);
  job.set_warnings(0, bad);
  job.mutable_worker_shares(0)->set_name(bad);
  job.mutable_worker_shares(1)->clear_name();
  job.mutable_worker_shares(1)->set_worker_id(bad);
  for (v1::Setting& setting : *job.mutable_settings()->mutable_settings())
    setting.set_value("\"><script>alert('x')</script>");
  for (const v1::JobState state : {v1::JOB_STATE_SUCCEEDED, v1::JOB_STATE_FAILED}) {
    job.set_state(state);
    job.set_failure(bad);
    const std::string page = ReportPage(job, std::nullopt);
    EXPECT_FALSE(Has(page, "<script"));
    EXPECT_FALSE(Has(page, "<img"));
    EXPECT_FALSE(Has(page, "\xff"));
    EXPECT_TRUE(Has(page, "&lt;script&gt;alert(&#39;x&#39;)&lt;/script&gt;"));
  }
}

TEST(ReportPageTest, AJobWithNothingYetIsAPageToo) {
  const std::string page = ReportPage(v1::Job(), std::nullopt);
  EXPECT_TRUE(Has(page, "There is no image."));
  EXPECT_TRUE(Has(page, "There are no samples of the error yet."));
  EXPECT_TRUE(Has(page, "No worker has delivered photons yet."));
  EXPECT_FALSE(Has(page, "Warnings"));
  EXPECT_FALSE(Has(page, "nan"));
  EXPECT_FALSE(Has(page, "<h2>Samples"));
}

TEST(ReportPageTest, OneSampleIsADotWithoutASlope) {
  v1::Job job = ConvergingJob(1);
  job.mutable_convergence(0)->clear_true_relative();
  const std::string page = ReportPage(job, std::nullopt);
  EXPECT_TRUE(Has(page, "<circle class=\"dot c0\""));
  EXPECT_TRUE(Has(page, "A slope needs three samples at least."));
  EXPECT_FALSE(Has(page, "<th scope=\"col\" class=\"\">true error"));
}

TEST(ReportPageTest, AWorkerWithoutPhotonsOrTimeHasNoRate) {
  v1::Job job;
  job.add_worker_shares()->set_name("idle");
  const std::string page = ReportPage(job, std::nullopt);
  EXPECT_TRUE(Has(page, "idle"));
  EXPECT_FALSE(Has(page, "nan"));
  EXPECT_FALSE(Has(page, "inf"));
}

}  // namespace
}  // namespace lucerna
