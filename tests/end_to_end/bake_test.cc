// `lucerna bake` leaves the mesh that it promises, with the same bytes whoever traces the photons.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include <nlohmann/json.hpp>

#include "render/base/files.h"
#include "render/formats/ply_file.h"
#include "render/image/exr_file.h"
#include "render/image/image.h"
#include "tests/end_to_end/programs.h"
#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace {

using nlohmann::json;
using std::chrono::seconds;
using testing::HasSubstr;

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
        kBin + "/lucerna", "bake", Path("scene.pbrt"), "-o", Path(out), "--seed", "7"};
    // Flags are given once.
    const auto add_unless_given = [&](const std::string& flag, const std::string& value) {
      if (std::ranges::count(more, flag) == 0) words.insert(words.end(), {flag, value});
    };
    add_unless_given("--passes", "4");
    add_unless_given("--spacing", "0.02");
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

TEST_F(BakeTest, GoesOnAfterItWasKilled) {
  const std::string alone = Bake("alone.ply");
  ChildProcess killed(Command("out.ply", {}));
  ASSERT_TRUE(killed.WaitForText("round 2", seconds(120))) << killed.Errors();
  killed.Signal(SIGKILL);
  killed.WaitForExit(seconds(60));
  EXPECT_FALSE(ReadFile(Path("out.ply")).ok());
  ASSERT_TRUE(std::filesystem::exists(Path("out.ply.checkpoints")));
  // Of other settings there is none to go on with.
  EXPECT_EQ(RunProgram(Command("out.ply", {"--resume", "--max-depth", "3"}), seconds(60)).exit_code,
            1);
  EXPECT_EQ(RunProgram(Command("out.ply", {"--resume", "--indirect-only"}), seconds(60)).exit_code,
            1);
  const Finished run = RunProgram(Command("out.ply", {"--resume", "--json"}), seconds(300));
  ASSERT_EQ(run.exit_code, 0) << run.errors;
  EXPECT_TRUE(ReadFile(Path("out.ply")).value_or("") == alone);
  EXPECT_FALSE(std::filesystem::exists(Path("out.ply.checkpoints")));
  EXPECT_EQ(RunProgram(Command("out.ply", {"--resume"}), seconds(60)).exit_code, 1);
}

// A coordinator with a state, and a worker, and commands for them.
class BakeOnServerTest : public BakeTest {
 protected:
  BakeOnServerTest() {
    StartServer("127.0.0.1:0");
    const std::string said = server_->Output() + server_->Errors();
    const std::size_t at = said.find("127.0.0.1:");
    address_ = said.substr(at, said.find_first_not_of("0123456789.:", at) - at);
    worker_ = std::make_unique<ChildProcess>(
        std::vector<std::string>{kBin + "/lucerna-worker", "--server", address_});
  }
  void StartServer(const std::string& address, const std::string& fail_point = "") {
    server_ = std::make_unique<ChildProcess>(std::vector<std::string>{
        "/usr/bin/env", "LUCERNA_FAIL_POINT=" + fail_point, kBin + "/lucerna-server", "--listen",
        address, "--state", Path("state")});
    ASSERT_TRUE(server_->WaitForText("listening on 127.0.0.1:", seconds(60)));
  }
  [[nodiscard]] Finished Run(std::vector<std::string> words) const {
    words.insert(words.begin(), kBin + "/lucerna");
    words.insert(words.end(), {"--server", address_});
    return RunProgram(words, seconds(120));
  }
  // The id of a new job.
  [[nodiscard]] std::string Submit(std::vector<std::string> more) const {
    std::vector<std::string> words = {"bake", Path("scene.pbrt"), "--on-server", "--seed", "7"};
    words.insert(words.end(), more.begin(), more.end());
    const Finished run = Run(words);
    EXPECT_EQ(run.exit_code, 0) << run.errors;
    return run.output.substr(0, run.output.find('\n'));
  }
  // What it made, once it has ended.
  [[nodiscard]] std::string Made(const std::string& job, const std::string& name) const {
    const Finished waited = Run({"wait", job});
    EXPECT_EQ(waited.exit_code, 0) << waited.errors;
    const Finished fetched = Run({"fetch", job, "-o", Path(name)});
    EXPECT_EQ(fetched.exit_code, 0) << fetched.errors;
    return ReadFile(Path(name)).value_or("");
  }

  std::string address_;
  std::unique_ptr<ChildProcess> server_, worker_;
};

TEST_F(BakeOnServerTest, IsAJobLikeAnyOther) {
  const std::string eight = Bake("8.ply", {"--passes", "8"});
  const std::string job = Submit({"--passes", "4", "--spacing", "0.02"});
  EXPECT_TRUE(Made(job, "4.ply") == Bake("alone.ply"));
  // With another end it is what it would have been with that from the start.
  EXPECT_EQ(Run({"extend", job, "--passes", "8"}).exit_code, 0);
  EXPECT_TRUE(Made(job, "longer.ply") == eight);
  EXPECT_THAT(Run({"jobs"}).output, HasSubstr(job));
  // The last bits of the estimate are in a .glb, and that of a job that was extended while it ran.
  const std::string running = Submit({"--passes", "100000", "--spacing", "0.02"});
  EXPECT_EQ(Run({"fetch", running, "-o", Path("early.glb")}).exit_code, 1);
  EXPECT_EQ(Run({"pause", running}).exit_code, 0);
  EXPECT_EQ(Run({"extend", running, "--passes", "8"}).exit_code, 0);
  EXPECT_EQ(Run({"resume", running}).exit_code, 0);
  EXPECT_TRUE(Made(running, "running.glb") == Bake("8.glb", {"--passes", "8"}));
}

TEST_F(BakeOnServerTest, GoesOnAfterTheCoordinatorWasKilled) {
  const std::string alone = Bake("alone.glb", {"--passes", "48"});
  const std::string job = Submit({"--passes", "48", "--spacing", "0.02"});
  ChildProcess watch({kBin + "/lucerna", "watch", job, "--server", address_});
  // In the middle of a round after some that have ended.
  ASSERT_TRUE(server_->WaitForText("round 2 at", seconds(120)));
  server_->Signal(SIGKILL);
  server_->WaitForExit(seconds(60));
  StartServer(address_);
  EXPECT_TRUE(server_->WaitForText("goes on after round 1 of its bake", seconds(60)));
  EXPECT_TRUE(Made(job, "killed.glb") == alone);
  EXPECT_EQ(watch.WaitForExit(seconds(60)), 0);
}

// It is killed when all is measured, and nothing written yet.
TEST_F(BakeOnServerTest, GoesOnAfterItsLastRound) {
  const std::vector<std::string> flags = {"--passes",    "4",         "--spacing", "0.05",
                                          "--estimator", "histogram", "--sides",   "front"};
  const std::string alone = Bake("alone.glb", flags);
  server_->Signal(SIGTERM);
  server_->WaitForExit(seconds(60));
  StartServer(address_, "bake.round_ended");
  const std::string job = Submit(flags);
  EXPECT_NE(server_->WaitForExit(seconds(120)), 0);
  StartServer(address_);
  EXPECT_TRUE(Made(job, "killed.glb") == alone);
}

TEST_F(BakeOnServerTest, StopsWithTheMeshThatThereIs) {
  const std::string job = Submit({"--passes", "1000000", "--spacing", "0.02"});
  ASSERT_TRUE(server_->WaitForText("round 1 at", seconds(120)));
  Finished stopped = Run({"stop", job});
  for (int i = 0; i < 100 && stopped.exit_code != 0; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    stopped = Run({"stop", job});
  }
  EXPECT_EQ(stopped.exit_code, 0) << stopped.errors;
  EXPECT_TRUE(ParsePly(Made(job, "stopped.ply")).ok());
  const Finished page = Run({"report", job, "-o", Path("page.html")});
  EXPECT_EQ(page.exit_code, 0) << page.errors;
}

TEST_F(BakeOnServerTest, FetchesLightMapsWithTheirMesh) {
  const std::string map = Bake("map.exr", {"--uv-mesh", Path("uv.glb"), "--spacing", "0.05"});
  const std::string job = Submit({"--passes", "4", "--spacing", "0.05", "--light-map"});
  EXPECT_TRUE(Made(job, "map2.exr") == map);
  EXPECT_EQ(Run({"fetch", job, "-o", Path("map3.exr"), "--uv-mesh", Path("uv3.glb")}).exit_code, 0);
  EXPECT_TRUE(ReadFile(Path("uv3.glb")).value_or("1") == ReadFile(Path("uv.glb")).value_or("2"));
  EXPECT_THAT(Run({"fetch", job, "-o", Path("mesh.glb")}).errors, HasSubstr("made a light map"));
  EXPECT_EQ(Run({"fetch", job, "-o", Path("map4.exr"), "--png", Path("map.png")}).exit_code, 2);
}

TEST_F(BakeOnServerTest, SaysWhatToMend) {
  std::vector<std::string> words = {"bake", Path("scene.pbrt"), "--on-server"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), words.begin(), words.end());
    return Run(more);
  };
  EXPECT_EQ(with({"--plan", Path("plan.svg")}).exit_code, 2);
  EXPECT_EQ(with({"--resume"}).exit_code, 2);
  EXPECT_THAT(with({"--material", "glass"}).errors, HasSubstr("there are floor"));
  // Of an image there is no mesh.
  const Finished image = Run({"submit", Path("scene.pbrt"), "--size", "8x8", "--passes", "1"});
  const std::string job = image.output.substr(0, image.output.find('\n'));
  EXPECT_EQ(Run({"wait", job}).exit_code, 0);
  EXPECT_THAT(Run({"fetch", job, "-o", Path("mesh.glb")}).errors, HasSubstr("no mesh"));
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

// What a render of the scene sees, with or without photons.
class FromMeshTest : public BakeTest {
 protected:
  FromMeshTest() {
    // The camera sees the floor, some of it through the glass ball, and no other side.
    const Finished run =
        RunProgram({kBin + "/lucerna", "render", Path("scene.pbrt"), "-o", Path("photons.exr"),
                    "--size", "64x64", "--passes", "64", "--photons-per-pass", "65536", "--quiet"},
                   seconds(300));
    EXPECT_EQ(run.exit_code, 0) << run.errors;
  }
  [[nodiscard]] Finished Draw(const std::string& mesh, const std::string& out,
                              const std::vector<std::string>& more = {}) const {
    std::vector<std::string> words = {
        kBin + "/lucerna", "render", Path("scene.pbrt"), "--from-mesh", Path(mesh), "-o", Path(out),
        "--size",          "64x64",  "--passes",         "16",          "--json"};
    words.insert(words.end(), more.begin(), more.end());
    return RunProgram(words, seconds(300));
  }
  // Means of the luminance over blocks of 8 x 8 pixels.
  [[nodiscard]] std::vector<double> BlocksOf(const std::string& name) const {
    const Image image = DecodeExr(ReadFile(Path(name)).value_or("")).value();
    std::vector<double> blocks(64);
    for (std::size_t i = 0; i < 64 * 64; ++i)
      blocks[i / 512 * 8 + i % 64 / 8] += static_cast<double>(image.Find("G")->pixels[i]) / 64;
    return blocks;
  }
  [[nodiscard]] static double MeanOf(const std::vector<double>& values) {
    double sum = 0;
    for (const double value : values)
      sum += value / static_cast<double>(values.size());
    return sum;
  }
};

TEST_F(FromMeshTest, DrawsWhatPhotonsWouldShow) {
  const std::vector<double> truth = BlocksOf("photons.exr");
  const double mean = MeanOf(truth);
  ASSERT_GT(mean, 0);
  for (const std::vector<std::string>& flags :
       std::vector<std::vector<std::string>>{{},
                                             {"--indirect-only"},
                                             {"--elements", "quadratic"},
                                             {"--spacing", "0.05", "--estimator", "histogram"}}) {
    std::vector<std::string> more = {"--passes", "16", "--photons-per-pass", "65536"};
    more.insert(more.end(), flags.begin(), flags.end());
    (void)Bake("mesh.glb", more);
    const Finished run = Draw("mesh.glb", "drawn.exr");
    ASSERT_EQ(run.exit_code, 0) << run.errors;
    EXPECT_EQ(json::parse(run.output)["share_unknown"], 0);
    const std::vector<double> drawn = BlocksOf("drawn.exr");
    const std::string what = flags.empty() ? "linear" : flags.back();
    EXPECT_NEAR(MeanOf(drawn), mean, 0.02 * mean) << what;
    // The tolerance of the mesh, and a block at the caustic's rim may differ by its width.
    for (std::size_t i = 0; i < truth.size(); ++i) {
      EXPECT_NEAR(drawn[i], truth[i], 0.1 * std::max(truth[i], mean)) << what << ", block " << i;
    }
  }
}

TEST_F(FromMeshTest, TakesReflectanceFromTheScene) {
  (void)Bake("mesh.glb");
  ASSERT_EQ(Draw("mesh.glb", "grey.exr").exit_code, 0);
  std::string scene = kScene;
  scene.replace(scene.find("[.5 .5 .5]"), 10, "[.1 .2 .1]");
  std::ofstream(Path("scene.pbrt")) << scene;
  ASSERT_EQ(Draw("mesh.glb", "painted.exr").exit_code, 0);
  const std::vector<double> grey = BlocksOf("grey.exr");
  const std::vector<double> painted = BlocksOf("painted.exr");
  for (std::size_t i = 0; i < grey.size(); ++i)
    EXPECT_NEAR(painted[i], 0.4 * grey[i], 1e-4 * grey[i]);
  // The same image on any number of threads.
  ASSERT_EQ(Draw("mesh.glb", "again.exr", {"--threads", "3"}).exit_code, 0);
  EXPECT_TRUE(ReadFile(Path("again.exr")).value_or("1") ==
              ReadFile(Path("painted.exr")).value_or("2"));
}

TEST_F(FromMeshTest, SaysWhatToMend) {
  (void)Bake("mesh.glb");
  const Finished photons = Draw("mesh.glb", "out.exr", {"--photons", "1k"});
  EXPECT_EQ(photons.exit_code, 2);
  EXPECT_THAT(photons.errors, HasSubstr("--photons has no meaning with --from-mesh"));
  EXPECT_EQ(Draw("mesh.glb", "out.exr", {"--reference", "x.exr"}).exit_code, 2);
  EXPECT_THAT(Draw("none.glb", "out.exr").errors, HasSubstr("none.glb"));
  const Finished other = Draw("photons.exr", "out.exr");
  EXPECT_EQ(other.exit_code, 1);
  EXPECT_FALSE(ReadFile(Path("out.exr")).ok());
}

TEST_F(BakeTest, LightMapsHoldTheSameLight) {
  const Finished run =
      RunProgram(Command("out.exr", {"--json", "--max-depth", "1", "--uv-mesh", Path("uv.glb")}),
                 seconds(300));
  ASSERT_EQ(run.exit_code, 0) << run.errors;
  const json report = json::parse(run.output);
  const json& floor = report["surfaces"][0];
  EXPECT_NEAR(floor["area_m2"].get<double>(), 16, 1e-4);
  EXPECT_NEAR(floor["max_w_m2"].get<double>(), 10.0 / 4, 1e-3);
  const Image image = DecodeExr(ReadFile(Path("out.exr")).value_or("")).value();
  // The floor is 200 texels wide.
  double area = 0;
  for (std::size_t i = 0; i < image.Find("R")->pixels.size(); ++i) {
    if (image.Find("inside")->pixels[i] == 0) continue;
    area += 0.02 * 0.02;
    const auto at = [&](const char* name) {
      return static_cast<double>(image.Find(name)->pixels[i]);
    };
    const double x = at("P.X");
    const double y = at("P.Y");
    EXPECT_EQ(at("N.Z"), 1);
    // But for the shadow of the ball.
    if (x > 0 && y > 0) continue;
    const double expected = 10 * 2 / std::pow(x * x + y * y + 4, 1.5);
    ASSERT_NEAR(at("R"), expected, 1e-3 * expected) << x << " " << y;
  }
  EXPECT_NEAR(area, 16, 0.05);
  const Finished valid = RunProgram({kBin + "/lucerna", "validate", Path("uv.glb")}, seconds(60));
  EXPECT_EQ(valid.exit_code, 0) << valid.errors;
  EXPECT_EQ(RunProgram(Command("out.exr", {"--estimator", "histogram"}), seconds(60)).exit_code, 2);
  EXPECT_EQ(RunProgram(Command("out.glb", {"--uv-mesh", "x.glb"}), seconds(60)).exit_code, 2);
}

TEST_F(BakeTest, FindsASpotWithinAFaceOfTheFirstMesh) {
  // A narrow cone of light: 0.3 wide on the floor, within a face with edges of 4.
  std::ofstream(Path("cone.pbrt")) << R"(
LookAt 2 2 2  0 0 0  0 0 1
Camera "perspective"
WorldBegin
LightSource "spot" "rgb I" [10 10 10] "point3 from" [1.1 -.47 3] "point3 to" [1.1 -.47 0]
  "float coneangle" 3 "float conedeltaangle" 0.1
LightSource "point" "rgb I" [.01 .01 .01] "point3 from" [0 0 3]
Material "diffuse" "rgb reflectance" [.5 .5 .5]
Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point3 P" [-2 -2 0 2 -2 0 2 2 0 -2 2 0]
)";
  const Finished run =
      RunProgram({kBin + "/lucerna", "bake", Path("cone.pbrt"), "-o", Path("cone.ply"), "--passes",
                  "4", "--spacing", ".25", "--sides", "front", "--max-depth", "1", "--json"},
                 seconds(300));
  ASSERT_EQ(run.exit_code, 0) << run.errors;
  // 10 / 3^2 in the middle of the spot, and 0.0011 of the other light.
  const json floor = json::parse(run.output)["surfaces"][0];
  EXPECT_GT(floor["max_w_m2"].get<double>(), 1.0);
}

TEST_F(BakeTest, SaysWhatToMend) {
  const auto run = [&](const std::string& out, const std::vector<std::string>& more) {
    return RunProgram(Command(out, more), seconds(60));
  };
  EXPECT_EQ(run("out.obj", {}).exit_code, 2);
  EXPECT_EQ(run("out.glb", {"--light-map"}).exit_code, 2);
  EXPECT_THAT(run("out.obj", {}).errors, HasSubstr(".ply or .glb"));
  EXPECT_EQ(run("out.glb", {"--elements", "cubic"}).exit_code, 2);
  EXPECT_EQ(run("out.glb", {"--elements", "quadratic", "--estimator", "histogram"}).exit_code, 2);
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
