// A photon's way must read the same to people and to programs, with all digits, and a job must say
// which photon to replay.
#include <cmath>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include <nlohmann/json.hpp>

#include "client/view/report.h"
#include "render/report/photon_view.h"
#include "render/report/report_page.h"

namespace lucerna {
namespace {

using testing::HasSubstr;
using testing::Not;

void Set(v1::Triple& triple, float x, float y, float z) {
  triple.set_x(x);
  triple.set_y(y);
  triple.set_z(z);
}

// Down onto a wall, back by a diffuse reflection, and lost.
v1::PhotonPath LostPhoton() {
  v1::PhotonPath path;
  path.mutable_key()->set_pass(12);
  path.mutable_key()->set_index(3456);
  path.mutable_emission()->set_light("point light 0");
  Set(*path.mutable_emission()->mutable_direction(), 0, 0, -1);
  Set(*path.mutable_emission()->mutable_flux(), 1, 0.1F, 2);
  v1::PhotonPath::Landing& landing = *path.add_landings();
  landing.set_shape("triangle 3 of mesh 0");
  landing.set_material("1 (diffuse)");
  landing.set_distance(2);
  *landing.mutable_flux_arriving() = path.emission().flux();
  *landing.mutable_flux_landed() = path.emission().flux();
  landing.set_deposit(v1::DEPOSIT_FATE_DIRECT);
  landing.mutable_scattering()->set_chosen("diffuse reflection");
  landing.mutable_scattering()->set_survival(0.25F);
  Set(*landing.mutable_scattering()->mutable_flux(), 0.25F, 0.025F, 0.5F);
  path.set_end(v1::PHOTON_END_ROULETTE);
  return path;
}

TEST(PhotonPathTextTest, TellsEveryStepAndTheEnd) {
  EXPECT_EQ(PhotonPathText(LostPhoton()),
            "photon 12:3456 from point light 0\n"
            "  from       (0, 0, 0)\n"
            "  towards    (0, 0, -1)\n"
            "  flux       1 0.100000001 2 W\n"
            "landing 1 on triangle 3 of mesh 0, material 1 (diffuse), after 2\n"
            "  at         (0, 0, 0)\n"
            "  normal     (0, 0, 0)\n"
            "  flux       1 0.100000001 2 W\n"
            "  deposit    none: the light of a first landing is direct, and sampled by the "
            "coordinator\n"
            "  scattered  diffuse reflection towards (0, 0, 0)\n"
            "  flux       0.25 0.0250000004 0.5 W\n"
            "  roulette   lost, with a probability of 0.25 to go on\n"
            "the photon was lost at the roulette\n");
}

TEST(PhotonPathTextTest, ShowsNumbersThatAreNone) {
  v1::PhotonPath path = LostPhoton();
  Set(*path.mutable_landings(0)->mutable_scattering()->mutable_flux(), NAN, HUGE_VALF, 0);
  path.mutable_landings(0)->mutable_scattering()->set_survival(0);
  path.set_end(v1::PHOTON_END_NOT_FINITE);
  const std::string text = PhotonPathText(path);
  EXPECT_THAT(text, HasSubstr("flux       nan inf 0 W\n"));
  EXPECT_THAT(text, Not(HasSubstr("roulette")));
  EXPECT_THAT(text, HasSubstr("was left out: a number was not finite"));
}

TEST(PhotonReportTest, SaysTheSameToAProgram) {
  const auto json = nlohmann::json::parse(PhotonReport(LostPhoton()));
  EXPECT_EQ(json["pass"], 12);
  EXPECT_EQ(json["index"], 3456);
  EXPECT_EQ(json["emission"]["light"], "point light 0");
  EXPECT_EQ(json["landings"][0]["deposit"], "DIRECT");
  EXPECT_EQ(json["landings"][0]["scattering"]["survival"], 0.25);
  EXPECT_EQ(json["landings"][0]["scattering"]["survived"], false);
  EXPECT_EQ(json["end"], "ROULETTE");
}

TEST(DroppedLineTest, NamesTheFirstPhotonAndIsOtherwiseEmpty) {
  v1::Job job;
  job.set_job_id("abc-1");
  EXPECT_EQ(DroppedLine(job), "");
  EXPECT_THAT(ReportPage(job, {}), Not(HasSubstr("trace-photon")));
  job.mutable_progress()->mutable_tally()->set_dropped(3);
  v1::PhotonKey& key = *job.add_dropped_photons();
  key.set_pass(12);
  key.set_index(3456);
  EXPECT_EQ(DroppedLine(job),
            "3 photons were not finite and left out; the first: lucerna trace-photon abc-1 "
            "12:3456");
  EXPECT_THAT(ReportPage(job, {}), HasSubstr("lucerna trace-photon abc-1 12:3456"));
  EXPECT_EQ(nlohmann::json::parse(JobReport(job, JsonDetail::kFull))["dropped_photons"][0]["index"],
            3456);
}

TEST(EnergyInWordsTest, GivesSharesAndSaysWhenTheBooksAreOff) {
  v1::Job job;
  v1::Energy& energy = *job.mutable_progress()->mutable_tally()->mutable_energy();
  EXPECT_EQ(EnergyInWords(energy), "");
  energy.set_emitted(400);
  energy.set_absorbed(300);
  energy.set_escaped(90);
  energy.set_roulette_loss(20);
  energy.set_roulette_gain(10);
  EXPECT_EQ(EnergyImbalance(energy), 0);
  EXPECT_EQ(EnergyInWords(energy),
            "of what was emitted 75.00 % was absorbed, 22.50 % escaped, roulette took 5.00 % and "
            "gave 2.50 %");
  const auto json = nlohmann::json::parse(JobReport(job, JsonDetail::kFull))["energy"];
  EXPECT_EQ(json["absorbed"], 0.75);
  EXPECT_EQ(json["balance"], 0);
  energy.set_cut_off(-4);
  EXPECT_EQ(EnergyImbalance(energy), 4);
  EXPECT_THAT(EnergyInWords(energy), HasSubstr("the counters do not balance"));
  energy.set_absorbed(INT64_MIN);
  energy.set_escaped(INT64_MIN);
  EXPECT_EQ(EnergyImbalance(energy), INT64_MAX) << "does not wrap";
}

}  // namespace
}  // namespace lucerna
