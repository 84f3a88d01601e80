// `lucerna bake` leaves the mesh that it promises, with the same bytes whoever traces the photons.
#include <chrono>
#include <cmath>
#include <csignal>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include <nlohmann/json.hpp>

#include "render/base/files.h"
#include "render/formats/ply_file.h"
#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace {

using nlohmann::json;
using std::chrono::seconds;
using testing::HasSubstr;

const std::string kBin = LUCERNA_BIN_DIR;

// A point light over a grey floor and a glass ball.
constexpr const char* kScene = R"(
LookAt 2 2 2  0 0 0  0 0 1
Camera "perspective"
WorldBegin
LightSource "point" "rgb I" [10 10 10] "point3 from" [0 0 2]
MakeNamedMaterial "floor" "string type" "diffuse" "rgb reflectance" [.5 .5 .5]
MakeNamedMaterial "glass" "string type" "dielectric"
NamedMaterial "floor"
Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point3 P" [-2 -2 0 2 -2 0 2 2 0 -2 2 0]
NamedMaterial "glass"
Translate 1 1 .5
Shape "sphere" "float radius" .3
)";

class BakeTest : public testing::Test {
 protected:
  BakeTest() { std::ofstream(Path("scene.pbrt")) << kScene; }
  [[nodiscard]] std::string Path(const std::string& name) const {
    return folder_.path() + "/" + name;
  }
  [[nodiscard]] std::vector<std::string> Command(const std::string& out,
                                                 const std::vector<std::string>& more) const {
    std::vector<std::string> words = {
        kBin + "/lucerna", "bake", Path("scene.pbrt"), "-o", Path(out), "--passes", "4",
        "--spacing",       "0.02", "--seed",           "7"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
  // Its file's bytes.
  [[nodiscard]] std::string Bake(const std::string& out,
                                 const std::vector<std::string>& more = {}) const {
    const Finished run = RunProgram(Command(out, more), seconds(300));
    EXPECT_EQ(run.exit_code, 0) << run.errors;
    return ReadFile(Path(out)).value_or("");
  }

  TemporaryFolder folder_;
};

TEST_F(BakeTest, HasTheSameBytesWhoeverTraces) {
  const std::string alone = Bake("1.ply");
  ASSERT_TRUE(ParsePly(alone).ok());
  EXPECT_TRUE(Bake("2.ply", {"--workers", "2", "--threads", "1"}) == alone);
  EXPECT_TRUE(Bake("3.ply", {"--workers", "3", "--threads", "2"}) == alone);

  // On a coordinator that loses a worker and gets another one.
  ChildProcess server({kBin + "/lucerna-server", "--listen", "127.0.0.1:0"});
  ASSERT_TRUE(server.WaitForText("listening on 127.0.0.1:", seconds(60)));
  const std::string said = server.Output() + server.Errors();
  const std::size_t at = said.find("127.0.0.1:");
  const std::string address = said.substr(at, said.find_first_not_of("0123456789.:", at) - at);
  const std::vector<std::string> worker = {kBin + "/lucerna-worker", "--server", address};
  ChildProcess lost(worker);
  ChildProcess bake(Command("4.ply", {"--on-server", "--server", address}));
  ASSERT_TRUE(bake.WaitForText("round 2", seconds(120))) << bake.Errors();
  lost.Signal(SIGKILL);
  ChildProcess other(worker);
  ASSERT_EQ(bake.WaitForExit(seconds(300)), 0) << bake.Errors();
  EXPECT_TRUE(ReadFile(Path("4.ply")).value_or("") == alone);
}

TEST_F(BakeTest, PrintsTheFiguresOfSurfaces) {
  const Finished run = RunProgram(Command("out.glb", {"--json", "--max-depth", "1"}), seconds(300));
  ASSERT_EQ(run.exit_code, 0) << run.errors;
  const json report = json::parse(run.output);
  ASSERT_EQ(report["surfaces"].size(), 1U);  // nothing is measured on glass
  const json& floor = report["surfaces"][0];
  EXPECT_EQ(floor["name"], "0 floor");
  EXPECT_NEAR(floor["area_m2"].get<double>(), 16, 1e-4);
  // Under the light, and in the corner that the ball does not shade.
  EXPECT_NEAR(floor["max_w_m2"].get<double>(), 10.0 / 4, 1e-4);
  EXPECT_LT(floor["min_w_m2"].get<double>(), 10 * 2 / std::pow(12, 1.5) + 1e-4);
  EXPECT_NEAR(floor["max_lx"].get<double>(), 683 * 10.0 / 4, 0.1);
  EXPECT_GT(report["rounds"].size(), 2U);
  EXPECT_LT(report["interpolation_error"].get<double>(), 0.05);
  // What is written is glTF.
  const Finished valid = RunProgram({kBin + "/lucerna", "validate", Path("out.glb")}, seconds(60));
  EXPECT_EQ(valid.exit_code, 0) << valid.errors;
}

TEST_F(BakeTest, LeavesOutDirectLightWhenTold) {
  const auto mean = [&](const std::vector<std::string>& more) {
    std::vector<std::string> words = Command("out.ply", more);
    words.emplace_back("--json");
    const Finished run = RunProgram(words, seconds(300));
    return json::parse(run.output)["surfaces"][0]["mean_w_m2"].get<double>();
  };
  const double all = mean({});
  const double indirect = mean({"--indirect-only"});
  // What the ball passes on.
  EXPECT_GT(indirect, 0);
  EXPECT_LT(indirect, 0.1 * all);
}

TEST_F(BakeTest, SaysWhatToMend) {
  const auto run = [&](const std::string& out, const std::vector<std::string>& more) {
    return RunProgram(Command(out, more), seconds(60));
  };
  EXPECT_EQ(run("out.obj", {}).exit_code, 2);
  EXPECT_THAT(run("out.obj", {}).errors, HasSubstr(".ply or .glb"));
  EXPECT_EQ(run("out.glb", {"--ascii"}).exit_code, 2);
  EXPECT_EQ(run("out.ply", {"--size", "8x8"}).exit_code, 2);
  EXPECT_EQ(run("out.ply", {"--spacing", "-1"}).exit_code, 2);
  EXPECT_EQ(run("out.ply", {"--sides", "left"}).exit_code, 2);
  const Finished none = run("out.ply", {"--material", "glass"});
  EXPECT_EQ(none.exit_code, 1);
  EXPECT_THAT(none.errors, HasSubstr("there are floor"));
  EXPECT_FALSE(ReadFile(Path("out.ply")).ok());
}

}  // namespace
}  // namespace lucerna
