// A user types a command, and image, words and exit code must be what the manual says: with the
// real programs, from the first flag to the last byte on disk.
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "gtest/gtest.h"
#include <nlohmann/json.hpp>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include "client/local_cluster.h"
#include "client/render_flags.h"
#include "render/base/files.h"
#include "render/film/reference.h"
#include "render/image/exr_file.h"
#include "tests/end_to_end/programs.h"

namespace lucerna {
namespace {

using nlohmann::json;

struct Ran {
  int code = 0;
  std::string out;
  std::string err;
};

class ClientCommandsTest : public testing::Test {
 protected:
  ClientCommandsTest() {
    std::string pattern = testing::TempDir() + "clientXXXXXX";
    folder_ = mkdtemp(pattern.data());
  }
  ~ClientCommandsTest() override { std::filesystem::remove_all(folder_); }

  [[nodiscard]] std::string In(const std::string& name) const { return folder_ + "/" + name; }
  static std::string Contents(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  // The files in the test's folder that are or could become an image.
  [[nodiscard]] std::vector<std::string> Images() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder_)) {
      // Checkpoints of a render that was interrupted.
      if (entry.is_directory()) continue;
      const std::string name = entry.path().filename();
      if (name.find(".exr") != std::string::npos || name.find(".png") != std::string::npos) {
        names.push_back(name);
      }
    }
    return names;
  }

  // Starts `lucerna` with the words, in the test's folder; its output goes to files there.
  [[nodiscard]] pid_t Start(std::vector<std::string> words) const {
    words.insert(words.begin(), std::string(LUCERNA_BIN_DIR) + "/lucerna");
    std::vector<char*> argv;
    for (std::string& word : words)
      argv.push_back(word.data());
    argv.push_back(nullptr);
    const std::string out = In("stdout.txt");
    const std::string err = In("stderr.txt");
    // A test that waits for words must not find those of the program before.
    std::filesystem::remove(err);
    const pid_t pid = ::fork();
    if (pid == 0) {
      if (::chdir(folder_.c_str()) != 0 || std::freopen(out.c_str(), "w", stdout) == nullptr ||
          std::freopen(err.c_str(), "w", stderr) == nullptr) {
        ::_exit(125);
      }
      ::execv(argv[0], argv.data());
      ::_exit(127);
    }
    return pid;
  }
  [[nodiscard]] Ran Finish(pid_t pid) const {
    int status = 0;
    ::waitpid(pid, &status, 0);
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status), Contents(In("stdout.txt")),
            Contents(In("stderr.txt"))};
  }
  [[nodiscard]] Ran Run(const std::vector<std::string>& words) const {
    return Finish(Start(words));
  }

  // Until the program that was started last says that a pass is done: "pass 0" is said before there
  // is an image.
  void WaitForAPass() const {
    const auto has_passes = [&] {
      const std::string lines = Contents(In("stderr.txt"));
      for (std::size_t at = lines.find("pass "); at != std::string::npos;
           at = lines.find("pass ", at + 1)) {
        if (at + 5 < lines.size() && lines[at + 5] >= '1' && lines[at + 5] <= '9') return true;
      }
      return false;
    };
    for (int i = 0; i < 6000 && !has_passes(); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }

  // A render of a second or less.
  [[nodiscard]] std::vector<std::string> SmallRender(const std::vector<std::string>& more) const {
    std::vector<std::string> words = {
        "render", SceneOfTests("caustic.pbrt"), "--size", "32x24", "--passes",
        "3",      "--photons-per-pass",         "20000"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }

  std::string folder_;
};

// Processes that the program `parent` has started and that still run.
std::vector<pid_t> ChildrenOf(pid_t parent) {
  std::vector<pid_t> children;
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    std::ifstream file(entry.path() / "stat");
    pid_t pid = 0;
    std::string name;
    std::string state;
    pid_t of = 0;
    if (file >> pid >> name >> state >> of && of == parent) children.push_back(pid);
  }
  return children;
}

// Kills the processes of `parent` that run the program.
void KillProgram(const std::string& program, pid_t parent) {
  for (const pid_t child : ChildrenOf(parent)) {
    std::error_code error;
    const auto runs =
        std::filesystem::read_symlink("/proc/" + std::to_string(child) + "/exe", error);
    if (runs.filename() == program) ::kill(child, SIGKILL);
  }
}

TEST_F(ClientCommandsTest, RenderLeavesAnImageAPreviewAndTheFigures) {
  const Ran ran = Run(SmallRender({"-o", In("a.exr"), "--png", In("a.png"), "--json", "--full"}));
  ASSERT_EQ(ran.code, 0) << ran.err;
  const json report = json::parse(ran.out);
  EXPECT_EQ(report["state"], "SUCCEEDED");
  EXPECT_EQ(report["stop_reason"], "PASSES");
  EXPECT_EQ(report["passes"], 3);
  EXPECT_EQ(report["photons"], 60000);
  EXPECT_GT(report["running_s"].get<double>(), 0);
  EXPECT_GT(report["to_first_photons_s"].get<double>(), 0);

  const StatusOr<Image> image = DecodeExr(Contents(In("a.exr")));
  ASSERT_TRUE(image.ok()) << image.status();
  EXPECT_EQ(image->width, 32);
  EXPECT_EQ(image->height, 24);
  for (const char* layer :
       {"R", "direct.G", "photons.B", "albedo.R", "N.X", "Z", "radius", "photon_count"}) {
    EXPECT_NE(image->Find(layer), nullptr) << layer;
  }
  EXPECT_EQ(report["image_digest"], image->PixelDigest().Hex());
  EXPECT_EQ(Contents(In("a.png")).substr(1, 3), "PNG");
  EXPECT_EQ(Run({"digest", In("a.exr")}).out, image->PixelDigest().Hex() + "\n");
  EXPECT_EQ(Images().size(), 2U) << "and nothing else";
}

TEST_F(ClientCommandsTest, TheDigestDoesNotDependOnWorkersOrThreadsAndDoesOnTheSeed) {
  ASSERT_EQ(Run(SmallRender({"-o", In("a.exr"), "--workers", "1", "--threads", "1"})).code, 0);
  ASSERT_EQ(Run(SmallRender({"-o", In("b.exr"), "--workers", "3", "--threads", "2"})).code, 0);
  ASSERT_EQ(Run(SmallRender({"-o", In("c.exr"), "--seed", "5"})).code, 0);
  const std::string digest = Run({"digest", In("a.exr")}).out;
  EXPECT_EQ(Run({"digest", In("b.exr")}).out, digest);
  EXPECT_NE(Run({"digest", In("c.exr")}).out, digest);
  const Ran diff = Run({"diff", In("a.exr"), In("b.exr"), "--json"});
  ASSERT_EQ(diff.code, 0) << diff.err;
  EXPECT_EQ(json::parse(diff.out)["rmse"], 0);
}

// After the first pass, whose hitpoints the coordinator traces if no worker has come yet, only
// radii go out: one column a round, from pass 64 to 128 eight of them.
TEST_F(ClientCommandsTest, WholePassesAreLentWithOneColumnOfRadiiARound) {
  const auto sent = [&](const std::string& passes, std::vector<std::string> more) {
    std::vector<std::string> words = {"render",   SceneOfTests("corner.pbrt"),
                                      "--size",   "48x48",
                                      "--passes", passes,
                                      "--json",   "--full",
                                      "-o",       In("a.exr")};
    words.insert(words.end(), more.begin(), more.end());
    const Ran ran = Run(words);
    EXPECT_EQ(ran.code, 0) << ran.err;
    const json report = json::parse(ran.out);
    return std::pair(report["hitpoints_sent"].get<double>(), report["sent_bytes"].get<double>());
  };
  // Bytes by hitpoints: none are sent where the worker comes before the job.
  std::map<double, double> once;
  std::map<double, double> again;
  const auto of_both = [&] {
    return std::ranges::find_if(once, [&](const auto& run) { return again.contains(run.first); });
  };
  for (int i = 0; i < 20 && of_both() == once.end(); ++i) {
    once.insert(sent("64", {}));
    again.insert(sent("128", {}));
  }
  ASSERT_NE(of_both(), once.end());
  const auto [hitpoints, bytes_once] = *of_both();
  const double bytes_again = again.at(hitpoints);
  EXPECT_LE(hitpoints, 48 * 48);
  EXPECT_LE(sent("128", {"--use-everything"}).first, 48 * 48);
  // A radius is four bytes before compression. Each of the eight columns may be fetched by a slice
  // of its own.
  constexpr double kColumn = 4.0 * 48 * 48;
  EXPECT_LT(bytes_again - bytes_once, 8 * 2 * kColumn);
  EXPECT_GT(bytes_again, bytes_once);
}

TEST_F(ClientCommandsTest, PlanSaysWhatIsLeftOut) {
  const Ran plan = Run({"plan", SceneOfTests("corner.pbrt"), "--json"});
  ASSERT_EQ(plan.code, 0) << plan.err;
  int used = 0;
  const json report = json::parse(plan.out);
  for (const json& part : report["parts"]) {
    used += part["is_used"].get<bool>() ? 1 : 0;
    EXPECT_FALSE(part["reason"].get<std::string>().empty()) << part["part"];
  }
  EXPECT_GT(used, 1);
  const Ran words = Run({"plan", SceneOfTests("corner.pbrt")});
  EXPECT_NE(words.out.find("left out"), std::string::npos) << words.out;
  EXPECT_EQ(Run({"plan", In("absent.pbrt")}).code, 1);
}

TEST_F(ClientCommandsTest, SpeaksOneLineAndIsQuietWhenTold) {
  const Ran plain = Run(SmallRender({"-o", In("a.exr")}));
  ASSERT_EQ(plain.code, 0) << plain.err;
  EXPECT_EQ(plain.out.find("3 passes, 60.0 k photons in "), 0U) << plain.out;
  EXPECT_NE(plain.out.find(In("a.exr") + "\n"), std::string::npos) << plain.out;
  EXPECT_EQ(plain.err.find('\r'), std::string::npos) << "not a terminal: plain lines";
  const Ran quiet = Run(SmallRender({"-o", In("a.exr"), "--quiet"}));
  EXPECT_EQ(quiet.code, 0);
  EXPECT_EQ(quiet.out + quiet.err, "");
}

TEST_F(ClientCommandsTest, AllErrorsOfASceneComeAtOnceAndNothingIsLeftBehind) {
  std::ofstream(In("bad.pbrt")) << "Camera \"perspective\"\nWorldBegin\nShape \"hair\"\nNonsense\n";
  const Ran ran = Run({"render", In("bad.pbrt"), "-o", In("a.exr")});
  EXPECT_EQ(ran.code, 1);
  EXPECT_NE(ran.err.find("bad.pbrt:3:"), std::string::npos) << ran.err;
  EXPECT_NE(ran.err.find("bad.pbrt:4:"), std::string::npos) << ran.err;
  EXPECT_TRUE(Images().empty());
  EXPECT_EQ(Run({"validate", In("bad.pbrt")}).code, 1);
  const Ran report = Run({"validate", In("bad.pbrt"), "--json"});
  EXPECT_EQ(report.code, 1);
  EXPECT_EQ(json::parse(report.out)["ok"], false);
  EXPECT_EQ(Run({"validate", SceneOfTests("caustic.pbrt")}).code, 0);
}

TEST_F(ClientCommandsTest, AMissingSceneIsNamed) {
  const Ran ran = Run({"render", In("none.pbrt"), "-o", In("a.exr")});
  EXPECT_EQ(ran.code, 1);
  EXPECT_NE(ran.err.find("none.pbrt"), std::string::npos) << ran.err;
}

TEST_F(ClientCommandsTest, ReadingASceneEndsAtOnceWhenToldTo) {
  {
    std::ofstream file(In("long.pbrt"));
    file << "Camera \"perspective\" WorldBegin\n";
    // Takes seconds to read.
    for (int i = 0; i < 3'000'000; ++i)
      file << "Shape \"sphere\"\n";
  }
  const pid_t pid = Start({"validate", In("long.pbrt")});
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  ::kill(pid, SIGTERM);
  EXPECT_EQ(Finish(pid).code, -SIGTERM);
}

TEST_F(ClientCommandsTest, MisuseIsRefusedWithCodeTwo) {
  EXPECT_EQ(Run({}).code, 2);
  EXPECT_EQ(Run({"paint"}).code, 2);
  EXPECT_EQ(Run({"fetch", "j"}).code, 2) << "no output";
  EXPECT_EQ(Run(SmallRender({"-o", In("a.exr"), "--workers", "0"})).code, 2);
  EXPECT_EQ(Run(SmallRender({"-o", In("a.exr"), "--alpha", "1.5"})).code, 2);
  EXPECT_EQ(Run({"diff", "a", "b", "--crop", "--scale"}).code, 2);
  EXPECT_EQ(Run({"jobs", "--server", "no-port"}).code, 2);
  EXPECT_EQ(Run({"report", "j"}).code, 2) << "no output";
  EXPECT_EQ(Run({"validate", SceneOfTests("")}).code, 2) << "a folder";
  const Ran too_large =
      Run({"render", SceneOfTests("caustic.pbrt"), "-o", In("a.exr"), "--size", "50000x50000"});
  EXPECT_EQ(too_large.code, 2);
  EXPECT_NE(too_large.err.find("2500000000 pixels"), std::string::npos) << too_large.err;
  EXPECT_EQ(Run({"render", "--help"}).code, 0);
}

TEST_F(ClientCommandsTest, ASceneAloneIsRenderedToAnImageOfItsName) {
  const Ran ran = Run({SceneOfTests("caustic.pbrt"), "--size", "16x12", "--photons", "2k"});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_EQ(Images(), std::vector<std::string>{"caustic.exr"});
}

TEST_F(ClientCommandsTest, FramesAreRenderedToImagesOfTheirNumbers) {
  // Frames 7 and 8 have other seeds.
  for (const std::string seed : {"7", "8"}) {
    std::string scene = Contents(SceneOfTests("corner.pbrt"));
    const std::string integrator = "Integrator \"sppm\"";
    const std::size_t at = scene.find(integrator);
    ASSERT_NE(at, std::string::npos);
    scene.insert(at + integrator.size(), " \"integer seed\" [" + seed + "]");
    std::ofstream(In("room.000" + seed + ".pbrt")) << scene;
  }
  const std::vector<std::string> small = {"--size", "16x16", "--passes", "2", "--quiet"};
  const auto with_small = [&](std::vector<std::string> words) {
    words.insert(words.end(), small.begin(), small.end());
    return Run(words);
  };
  const Ran frames =
      with_small({"render", "room.####.pbrt", "--frames", "7-8", "-o", "out.###.exr"});
  ASSERT_EQ(frames.code, 0) << frames.err;
  const auto digest = [&](const std::string& file) { return Run({"digest", file}).out; };
  EXPECT_NE(digest("out.007.exr"), digest("out.008.exr"));
  ASSERT_EQ(with_small({"render", "room.0008.pbrt", "-o", "alone.exr"}).code, 0);
  EXPECT_EQ(digest("out.008.exr").substr(0, 64), digest("alone.exr").substr(0, 64));
  // Scenes by their names, to images of their names.
  ASSERT_EQ(with_small({"render", "room.0007.pbrt", "room.0008.pbrt"}).code, 0);
  EXPECT_TRUE(std::filesystem::exists(In("room.0007.exr")));
  EXPECT_EQ(digest("room.0008.exr").substr(0, 64), digest("alone.exr").substr(0, 64));

  const Ran one_file = with_small({"render", "room.0007.pbrt", "room.0008.pbrt", "-o", "x.exr"});
  EXPECT_EQ(one_file.code, 2);
  EXPECT_NE(one_file.err.find("two scenes would be written to x.exr"), std::string::npos)
      << one_file.err;
  EXPECT_EQ(with_small({"render", "room.####.pbrt"}).code, 2);
}

TEST_F(ClientCommandsTest, TheImageSoFarIsSavedFromTimeToTime) {
  const Ran nowhere = Run({"submit", SceneOfTests("corner.pbrt"), "--save-every", "5m"});
  EXPECT_EQ(nowhere.code, 2);
  EXPECT_NE(nowhere.err.find("--save-every needs a file"), std::string::npos) << nowhere.err;
  const pid_t pid = Start({"render", SceneOfTests("corner.pbrt"), "--size", "16x16", "--passes",
                           "1000000", "--save-every", "50ms", "-o", "out.exr", "--quiet"});
  // An image is there while the render goes on.
  bool is_there = false;
  for (int i = 0; i < 600 && !is_there; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    const StatusOr<std::string> bytes = ReadFile(In("out.exr"));
    is_there = bytes.ok() && DecodeExr(*bytes).ok();
  }
  EXPECT_TRUE(is_there);
  EXPECT_EQ(::waitpid(pid, nullptr, WNOHANG), 0) << "it goes on";
  ::kill(pid, SIGINT);
  EXPECT_EQ(Finish(pid).code, 130);
}

TEST_F(ClientCommandsTest, TheNameOfTheImageIsItsFormat) {
  for (const char* name : {"a.png", "a.pfm", "a.hdr", "a.exr"})
    EXPECT_EQ(Run(SmallRender({"-o", name})).code, 0) << name;
  EXPECT_EQ(Contents(In("a.png")).substr(1, 3), "PNG");
  EXPECT_EQ(Contents(In("a.pfm")).substr(0, 3), "PF\n");
  EXPECT_EQ(Contents(In("a.hdr")).substr(0, 10), "#?RADIANCE");
  const Ran other = Run(SmallRender({"-o", "a.jpg"}));
  EXPECT_EQ(other.code, 2);
  EXPECT_NE(other.err.find("a.jpg: its name must end with .exr, .png, .pfm or .hdr"),
            std::string::npos)
      << other.err;
}

TEST_F(ClientCommandsTest, AFileOfSomethingElseIsReplacedOnlyByForce) {
  std::ofstream(In("notes.png")) << "my notes";
  const Ran refused = Run(SmallRender({"--png", "notes.png"}));
  EXPECT_EQ(refused.code, 2);
  EXPECT_NE(refused.err.find("notes.png exists, and was not written by lucerna; --force"),
            std::string::npos)
      << refused.err;
  EXPECT_EQ(Contents(In("notes.png")), "my notes");
  EXPECT_EQ(Run(SmallRender({"--png", "notes.png", "--force"})).code, 0);
  EXPECT_EQ(Run(SmallRender({"--png", "notes.png"})).code, 0) << "its own now";
  EXPECT_EQ(Run(SmallRender({"-o", "a.exr"})).code, 0);
  EXPECT_EQ(Run(SmallRender({"-o", "a.exr"})).code, 0);
}

TEST_F(ClientCommandsTest, FlagsMayComeFromAFile) {
  std::ofstream(In("flags.toml")) << "[render]\nsize = \"20x10\"\npasses = 2\nquiet = true\n";
  const auto render = [&](const std::vector<std::string>& more) {
    std::vector<std::string> words = {
        "--config", "flags.toml", "render", SceneOfTests("caustic.pbrt"), "-o", "a.exr"};
    words.insert(words.end(), more.begin(), more.end());
    return Run(words);
  };
  const Ran ran = render({});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_EQ(ran.out + ran.err, "");
  EXPECT_EQ(DecodeExr(Contents(In("a.exr")))->width, 20);
  EXPECT_EQ(render({"--size", "30x10"}).code, 0) << "those of the command line come first";
  EXPECT_EQ(DecodeExr(Contents(In("a.exr")))->width, 30);
  std::ofstream(In("flags.toml")) << "[render]\nsiz = 3\n";
  const Ran unknown = render({});
  EXPECT_EQ(unknown.code, 2);
  EXPECT_NE(unknown.err.find("siz"), std::string::npos) << unknown.err;
}

// One may be gone: the others are changed all the same.
TEST_F(ClientCommandsTest, SeveralJobsAreChangedByOneCommand) {
  const auto cluster = LocalCluster::Start({LUCERNA_BIN_DIR, 1, 1});
  ASSERT_TRUE(cluster.ok()) << cluster.status();
  const std::string server = (*cluster)->address();
  const auto submit = [&](const std::string& seed) {
    const Ran submitted = Run({"submit", SceneOfTests("caustic.pbrt"), "--size", "32x24", "--seed",
                               seed, "--time", "1h", "--server", server});
    return submitted.out.substr(0, submitted.out.find('\n'));
  };
  const std::string first = submit("1");
  const std::string second = submit("2");
  EXPECT_EQ(Run({"cancel", first, "nobodys", second, "--server", server}).code, 1);
  const Ran jobs = Run({"jobs", "--state", "cancelled", "--json", "--server", server});
  EXPECT_EQ(json::parse(jobs.out).size(), 2U) << jobs.out;
  EXPECT_EQ(Run({"delete", first, second, "--server", server}).code, 0);
}

// Below the client a setting is named by its name, which is no flag.
TEST_F(ClientCommandsTest, AValueOutOfRangeIsRefusedByTheFlag) {
  const std::string scene = SceneOfTests("caustic.pbrt");
  const Ran alpha = Run(SmallRender({"-o", In("a.exr"), "--alpha", "1.5"}));
  EXPECT_EQ(alpha.code, 2);
  EXPECT_TRUE(alpha.err.ends_with("lucerna: --alpha must be above 0 and below 1, not 1.5\n"))
      << alpha.err;
  const Ran endless = Run({"render", scene, "-o", In("a.exr"), "--time", "0"});
  EXPECT_EQ(endless.code, 2);
  EXPECT_TRUE(endless.err.ends_with("lucerna: --time must be above 0, not 0\n")) << endless.err;
}

TEST_F(ClientCommandsTest, HelpPrintsTheTableOfSettings) {
  const Ran ran = Run({"help", "settings"});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_EQ(ran.out, SettingsTable());
  EXPECT_EQ(Run({"help", "everything"}).code, 2);
}

// A light behind the floor, one without area, and a target: nothing is found, nothing is claimed.
TEST_F(ClientCommandsTest, ABlackImageIsSaidToBeOneAndReachesNoTarget) {
  std::ofstream(In("black.pbrt"))
      << "LookAt 0 0 1  0 0 0  0 1 0\nCamera \"perspective\" \"float fov\" [40]\n"
         "WorldBegin\nLightSource \"point\" \"point3 from\" [0 0 -2]\n"
         "AttributeBegin\nAreaLightSource \"diffuse\"\n"
         "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 2 0 0] \"integer indices\" [0 1 2]\n"
         "AttributeEnd\nShape \"disk\" \"float radius\" [9]\n";
  const Ran ran = Run({"render", In("black.pbrt"), "-o", In("a.exr"), "--size", "8x8", "--error",
                       "3%", "--passes", "40", "--json"});
  ASSERT_EQ(ran.code, 0) << ran.err;
  const json report = json::parse(ran.out);
  EXPECT_EQ(report["stop_reason"], "PASSES") << "not by its error";
  EXPECT_FALSE(report.contains("relative_error"));
  EXPECT_EQ(report["nothing_found"], true);
  EXPECT_NE(ran.err.find("black.pbrt:7:1: warning: Shape \"trianglemesh\" has no area"),
            std::string::npos)
      << ran.err;
  EXPECT_NE(ran.err.find("warning: the image is black after 2560 photons"), std::string::npos)
      << ran.err;
  EXPECT_NE(ran.err.find("light 1 (a point light at (0, 0, -2)): no photon of 2560"),
            std::string::npos)
      << ran.err;
}

TEST_F(ClientCommandsTest, ARendersReportCarriesItsErrorAndTheTrueOne) {
  ASSERT_EQ(Run(SmallRender({"-o", In("a.exr")})).code, 0);
  const Ran ran =
      Run(SmallRender({"-o", In("b.exr"), "--seed", "5", "--reference", In("a.exr"), "--json"}));
  ASSERT_EQ(ran.code, 0) << ran.err;
  const json error = json::parse(ran.out)["relative_error"];
  EXPECT_GT(error["estimate"].get<double>(), 0);
  EXPECT_GT(error["high"].get<double>(), error["estimate"].get<double>());
  EXPECT_GT(error["true"].get<double>(), 0);
}

TEST_F(ClientCommandsTest, FlagsThatAControllerIgnoresAreWarnedOf) {
  const Ran ignored = Run(SmallRender({"-o", In("a.exr"), "--bias", "1%"}));
  EXPECT_EQ(ignored.code, 0);
  EXPECT_NE(ignored.err.find("--bias has no effect"), std::string::npos) << ignored.err;
  const Ran used =
      Run(SmallRender({"-o", In("a.exr"), "--bias", "1%", "--radius-controller", "frequency-mse"}));
  EXPECT_EQ(used.err.find("no effect"), std::string::npos) << used.err;
  EXPECT_EQ(Run(SmallRender({"-o", In("a.exr"), "--error", "3"})).code, 2);
}

TEST_F(ClientCommandsTest, OneFileCannotBeBothImages) {
  const std::string name = In("a.exr");
  for (const std::string& other : {name, In("./a.exr"), In("no/../a.exr")}) {
    const Ran ran = Run(SmallRender({"-o", name, "--png", other, "--time", "1000"}));
    EXPECT_EQ(ran.code, 2) << other;
    EXPECT_NE(ran.err.find("-o and --png both name " + name), std::string::npos) << ran.err;
  }
  EXPECT_TRUE(Images().empty());
  ASSERT_EQ(Run(SmallRender({"-o", name})).code, 0);
  EXPECT_EQ(Run({"png", name, In("./a.exr")}).code, 2);
  EXPECT_EQ(Run({"digest", name}).code, 0) << "still an EXR";
}

TEST_F(ClientCommandsTest, AnOutputThatCannotBeWrittenIsFoundBeforeRendering) {
  const Ran ran = Run(SmallRender({"-o", In("no/such/folder/a.exr"), "--time", "1000"}));
  EXPECT_EQ(ran.code, 1);
  EXPECT_NE(ran.err.find("no/such/folder"), std::string::npos) << ran.err;
}

TEST_F(ClientCommandsTest, AFullDiskIsReported) {
  const Ran ran = Run(SmallRender({"-o", "/dev/full"}));
  EXPECT_EQ(ran.code, 1);
  EXPECT_NE(ran.err.find("/dev/full: cannot write: No space left"), std::string::npos) << ran.err;
}

// The folder of the image is gone when the render ends.
TEST_F(ClientCommandsTest, AnImageWithoutItsPlaceIsKeptElsewhere) {
  std::filesystem::create_directory(In("gone"));
  std::filesystem::create_directory(In("other"));
  ::setenv("TMPDIR", In("other").c_str(), 1);
  const pid_t pid = Start({"render", SceneOfTests("caustic.pbrt"), "--size", "32x24", "--time",
                           "3s", "-o", "gone/a.exr", "--png", "b.png", "--no-checkpoints"});
  ::unsetenv("TMPDIR");
  // Its place was there when it began.
  for (int i = 0; i < 6000 && Contents(In("stderr.txt")).find("pass") == std::string::npos; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  std::filesystem::remove_all(In("gone"));
  const Ran ran = Finish(pid);
  EXPECT_EQ(ran.code, 1);
  EXPECT_NE(ran.err.find("gone/a.exr"), std::string::npos) << ran.err;
  EXPECT_NE(ran.err.find("; it is in " + In("other/a.exr") + " instead"), std::string::npos)
      << ran.err;
  EXPECT_TRUE(DecodeExr(Contents(In("other/a.exr"))).ok());
  EXPECT_TRUE(std::filesystem::exists(In("b.png"))) << "the other image is written all the same";
}

TEST_F(ClientCommandsTest, AnUnreachableCoordinatorIsNamedWithCodeThree) {
  const std::vector<std::vector<std::string>> commands = {
      {"jobs"}, {"fetch", "j", "-o", In("a.exr")}, {"submit", SceneOfTests("caustic.pbrt")}};
  for (std::vector<std::string> words : commands) {
    words.insert(words.end(), {"--server", "127.0.0.1:1"});
    const Ran ran = Run(words);
    EXPECT_EQ(ran.code, 3) << words[0];
    EXPECT_NE(ran.err.find("cannot reach the coordinator at 127.0.0.1:1"), std::string::npos)
        << words[0] << ": " << ran.err;
  }
}

TEST_F(ClientCommandsTest, AnInterruptionWithoutCheckpointsCleansUpAndLeavesNothing) {
  for (const int number : {SIGINT, SIGTERM}) {
    const pid_t client = Start({"render", SceneOfTests("caustic.pbrt"), "--size", "32x24", "--time",
                                "1000", "-o", In("a.exr"), "--no-checkpoints"});
    std::vector<pid_t> children;
    for (int i = 0; i < 6000 && Contents(In("stderr.txt")).find("pass") == std::string::npos; ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    children = ChildrenOf(client);
    EXPECT_EQ(children.size(), 2U) << "a coordinator and a worker";
    ::kill(client, number);
    const Ran ran = Finish(client);
    EXPECT_EQ(ran.code, 130) << ran.err;
    for (const pid_t child : children)
      EXPECT_NE(::kill(child, 0), 0) << "left running";
    EXPECT_TRUE(Images().empty());
    EXPECT_FALSE(std::filesystem::exists(In("a.exr.checkpoints")));
  }
}

// The first end is far away; the image of the whole is that of a render without an interruption.
TEST_F(ClientCommandsTest, AnInterruptedRenderWritesTheImageSoFarAndGoesOnWithTheSameBits) {
  const auto render = [&](const std::string& image, const std::string& end,
                          const std::string& value) {
    return std::vector<std::string>{
        "render", SceneOfTests("caustic.pbrt"), "--size", "32x24", end, value, "-o", In(image)};
  };
  const pid_t client = Start(render("a.exr", "--time", "1000"));
  WaitForAPass();
  const std::vector<pid_t> children = ChildrenOf(client);
  ::kill(client, SIGINT);
  const Ran interrupted = Finish(client);
  EXPECT_EQ(interrupted.code, 130) << interrupted.err;
  EXPECT_NE(interrupted.err.find("saving the image so far"), std::string::npos) << interrupted.err;
  EXPECT_NE(interrupted.err.find("the image so far is in " + In("a.exr")), std::string::npos)
      << interrupted.err;
  EXPECT_NE(interrupted.err.find("--resume"), std::string::npos) << interrupted.err;
  for (const pid_t child : children)
    EXPECT_NE(::kill(child, 0), 0) << "left running";
  EXPECT_TRUE(std::filesystem::exists(In("a.exr")));
  EXPECT_TRUE(std::filesystem::exists(In("a.exr.checkpoints")));

  std::vector<std::string> other = render("a.exr", "--alpha", "0.9");
  other.push_back("--resume");
  const Ran refused = Run(other);
  EXPECT_EQ(refused.code, 1);
  EXPECT_NE(refused.err.find("another value of --alpha"), std::string::npos) << refused.err;

  // More passes than there were.
  const std::string passes = "2000";
  std::vector<std::string> resume = render("a.exr", "--passes", passes);
  resume.push_back("--resume");
  const Ran resumed = Run(resume);
  EXPECT_EQ(resumed.code, 0) << resumed.err;
  EXPECT_FALSE(std::filesystem::exists(In("a.exr.checkpoints"))) << "not needed any more";
  ASSERT_EQ(Run(render("b.exr", "--passes", passes)).code, 0);
  EXPECT_EQ(Run({"digest", In("a.exr")}).out, Run({"digest", In("b.exr")}).out);

  const Ran nothing = Run(resume);
  EXPECT_EQ(nothing.code, 1);
  EXPECT_NE(nothing.err.find("no interrupted render"), std::string::npos) << nothing.err;
}

// The second one must not take the photons of the first from under it.
TEST_F(ClientCommandsTest, OfTwoRendersWithOneOutputTheSecondIsRefused) {
  const pid_t client = Start({"render", SceneOfTests("caustic.pbrt"), "--size", "32x24", "--time",
                              "1000", "-o", In("a.exr")});
  WaitForAPass();
  for (const char* const command : {"render", "reference"}) {
    const Ran second = Run({command, SceneOfTests("caustic.pbrt"), "--size", "32x24", "--passes",
                            "2", "-o", In("a.exr")});
    EXPECT_EQ(second.code, 1) << command;
    EXPECT_NE(second.err.find("a.exr.checkpoints"), std::string::npos) << second.err;
    EXPECT_NE(second.err.find("another file with -o"), std::string::npos) << second.err;
  }
  ::kill(client, SIGINT);
  EXPECT_EQ(Finish(client).code, 130);
  EXPECT_TRUE(std::filesystem::exists(In("a.exr.checkpoints")));
}

TEST_F(ClientCommandsTest, ADeadCoordinatorEndsTheRenderWithASentence) {
  const pid_t client = Start({"render", SceneOfTests("caustic.pbrt"), "--size", "32x24", "--time",
                              "1000", "-o", In("a.exr")});
  for (int i = 0; i < 6000 && Contents(In("stderr.txt")).find("pass") == std::string::npos; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  KillProgram("lucerna-server", client);
  const Ran ran = Finish(client);
  EXPECT_EQ(ran.code, 1);
  EXPECT_NE(ran.err.find("the coordinator was ended by signal 9"), std::string::npos) << ran.err;
  EXPECT_TRUE(Images().empty());
}

TEST_F(ClientCommandsTest, ADeadWorkerEndsTheRenderWithASentence) {
  const pid_t client = Start({"render", SceneOfTests("caustic.pbrt"), "--size", "32x24", "--time",
                              "1000", "-o", In("a.exr")});
  for (int i = 0; i < 6000 && Contents(In("stderr.txt")).find("pass") == std::string::npos; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  KillProgram("lucerna-worker", client);
  const Ran ran = Finish(client);
  EXPECT_EQ(ran.code, 1);
  EXPECT_NE(ran.err.find("no worker is left to render: the worker was ended by signal 9"),
            std::string::npos)
      << ran.err;
  EXPECT_TRUE(Images().empty());
}

// Ended after three passes and given a new end: the bits are those of one run to that end.
TEST_F(ClientCommandsTest, AnExtendedJobIsTheOneThatNeverStopped) {
  const auto cluster = LocalCluster::Start({LUCERNA_BIN_DIR, 1, 1});
  ASSERT_TRUE(cluster.ok()) << cluster.status();
  const std::string server = (*cluster)->address();
  const std::vector<std::string> scene = {SceneOfTests("caustic.pbrt"), "--size", "32x24",
                                          "--photons-per-pass", "5000"};
  const auto with = [&](std::vector<std::string> words, const std::vector<std::string>& more) {
    words.insert(words.end(), more.begin(), more.end());
    return words;
  };
  const Ran submitted = Run(with(with({"submit"}, scene), {"--passes", "3", "--server", server}));
  ASSERT_EQ(submitted.code, 0) << submitted.err;
  const std::string job = submitted.out.substr(0, submitted.out.find('\n'));
  ASSERT_EQ(Run({"wait", job, "--server", server}).code, 0);
  EXPECT_NE(Run({"extend", job, "--server", server}).code, 0);
  ASSERT_EQ(Run({"extend", job, "--passes", "9", "--server", server}).code, 0);
  const Ran waited = Run({"wait", job, "--server", server, "--json"});
  ASSERT_EQ(waited.code, 0) << waited.err;
  EXPECT_EQ(json::parse(waited.out)["passes"], 9);
  ASSERT_EQ(Run({"fetch", job, "-o", In("extended.exr"), "--server", server}).code, 0);
  ASSERT_EQ(Run(with(with({"render"}, scene), {"--passes", "9", "-o", In("once.exr")})).code, 0);
  EXPECT_EQ(Run({"digest", In("extended.exr")}).out, Run({"digest", In("once.exr")}).out);

  // The error so far as target: reached at the next estimate, or the photons' end.
  ASSERT_EQ(Run({"extend", job, "--error", "1000%", "--passes", "40", "--server", server}).code, 0);
  const Ran reached = Run({"wait", job, "--server", server, "--json"});
  ASSERT_EQ(reached.code, 0) << reached.err;
  EXPECT_EQ(json::parse(reached.out)["stop_reason"], "ERROR");
}

TEST_F(ClientCommandsTest, AJobIsSubmittedListedFollowedFetchedAndCancelled) {
  const auto cluster = LocalCluster::Start({LUCERNA_BIN_DIR, 1, 1});
  ASSERT_TRUE(cluster.ok()) << cluster.status();
  const std::string server = (*cluster)->address();
  const std::vector<std::string> small = {
      "submit", SceneOfTests("caustic.pbrt"), "--size", "32x24", "--server", server, "--passes",
      "3",      "--photons-per-pass",         "20000"};
  const Ran submitted = Run(small);
  ASSERT_EQ(submitted.code, 0) << submitted.err;
  const std::string job = submitted.out.substr(0, submitted.out.find('\n'));
  EXPECT_EQ(submitted.out, job + "\n");

  EXPECT_EQ(Run({"wait", job, "--server", server}).code, 0);
  const Ran watched = Run({"watch", job, "--server", server, "--json"});
  EXPECT_EQ(watched.code, 0) << watched.err;
  EXPECT_EQ(json::parse(watched.out)["state"], "SUCCEEDED");
  ASSERT_EQ(Run({"fetch", job, "-o", In("a.exr"), "--server", server}).code, 0);

  const Ran reported = Run({"report", job, "-o", In("page.html"), "--csv", In("error.csv"),
                            "--json", "--server", server});
  ASSERT_EQ(reported.code, 0) << reported.err;
  EXPECT_TRUE(json::parse(reported.out)["convergence"].is_array());
  EXPECT_NE(Contents(In("page.html")).find("data:image/png;base64,"), std::string::npos);
  EXPECT_EQ(Contents(In("error.csv")).find("row,worker_id,"), 0U);
  EXPECT_EQ(Run({"report", job, "-o", In("x"), "--csv", In("./x"), "--server", server}).code, 2);

  // The same image as by `render`, and as by a submission that waits.
  ASSERT_EQ(Run(SmallRender({"-o", In("b.exr")})).code, 0);
  EXPECT_EQ(Run({"digest", In("a.exr")}).out, Run({"digest", In("b.exr")}).out);
  std::vector<std::string> waiting = small;
  waiting.insert(waiting.end(), {"-o", In("c.exr")});
  ASSERT_EQ(Run(waiting).code, 0);
  EXPECT_EQ(Run({"digest", In("c.exr")}).out, Run({"digest", In("b.exr")}).out);

  const Ran endless = Run({"submit", SceneOfTests("caustic.pbrt"), "--size", "32x24", "--server",
                           server, "--time", "1000"});
  ASSERT_EQ(endless.code, 0) << endless.err;
  const std::string second = endless.out.substr(0, endless.out.find('\n'));
  EXPECT_EQ(Run({"cancel", second, "--server", server}).code, 0);
  EXPECT_EQ(Run({"wait", second, "--server", server}).code, 1) << "it did not succeed";
  EXPECT_EQ(Run({"fetch", second, "-o", In("d.exr"), "--server", server}).code, 1);
  EXPECT_FALSE(std::filesystem::exists(In("d.exr")));
  const Ran dropped = Run({"report", second, "-o", In("d.html"), "--server", server});
  EXPECT_EQ(dropped.code, 0) << dropped.err;
  EXPECT_NE(Contents(In("d.html")).find("There is no image."), std::string::npos);

  const json jobs = json::parse(Run({"jobs", "--json", "--server", server}).out);
  ASSERT_EQ(jobs.size(), 3U);
  EXPECT_EQ(jobs[0]["job_id"], second) << "newest first";
  EXPECT_EQ(jobs[0]["state"], "CANCELLED");
  EXPECT_EQ(jobs[2]["job_id"], job);

  const Ran unknown = Run({"watch", "no-such-job", "--server", server});
  EXPECT_EQ(unknown.code, 1);
  EXPECT_NE(unknown.err.find("no-such-job"), std::string::npos) << unknown.err;
}

// Half a second of rendering in two halves.
std::vector<std::string> SmallReference(const std::string& scene, const std::string& output) {
  return {"reference",          scene,   "--size", "32x24", "--passes", "9",
          "--photons-per-pass", "20000", "--seed", "7",     "-o",       output};
}

TEST_F(ClientCommandsTest, AReferenceTellsItsNoiseAndDiffTakesItOff) {
  std::vector<std::string> words = SmallReference(SceneOfTests("caustic.pbrt"), In("ref.exr"));
  words.emplace_back("--json");
  const Ran ran = Run(words);
  ASSERT_EQ(ran.code, 0) << ran.err;
  const json report = json::parse(ran.out);
  const json& metadata = report["metadata"];
  const auto [first, second] = SeedsOfHalves(7);
  EXPECT_EQ(metadata["lucerna.reference.seeds"], absl::StrCat(first, " ", second));
  EXPECT_EQ(metadata["lucerna.reference.passes"], "5 5");
  const std::string settings = metadata["lucerna.settings"];
  EXPECT_NE(settings.find("initial-radius=0.5px"), std::string::npos) << settings;
  EXPECT_NE(settings.find("radius-controller=pppm"), std::string::npos) << settings;
  const StatusOr<Image> image = DecodeExr(Contents(In("ref.exr")));
  ASSERT_TRUE(image.ok()) << image.status();
  EXPECT_EQ(report["image_digest"], image->PixelDigest().Hex());
  EXPECT_NE(image->Find("noise.G"), nullptr);
  EXPECT_EQ(Images().size(), 1U) << "and nothing else";

  ASSERT_EQ(Run(SmallRender({"-o", In("a.exr")})).code, 0);
  const Ran diff = Run({"diff", In("a.exr"), In("ref.exr"), "--json"});
  ASSERT_EQ(diff.code, 0) << diff.err;
  const json figures = json::parse(diff.out);
  const double noise = figures["reference_rel_mse"];
  EXPECT_NEAR(noise, std::stod(metadata["lucerna.reference.rel_mse"].get<std::string>()),
              1e-4 * noise)
      << "of all pixels it is the same";
  EXPECT_DOUBLE_EQ(figures["corrected_rel_mse"], figures["rel_mse"].get<double>() - noise);
  EXPECT_NE(Run({"diff", In("a.exr"), In("ref.exr")}).out.find("the reference's noise"),
            std::string::npos);
}

// Interrupted in its first half and in its second one.
TEST_F(ClientCommandsTest, AnInterruptedReferenceGoesOnWithTheSameBits) {
  const auto reference = [&](const std::string& image, const std::string& passes) {
    return std::vector<std::string>{
        "reference", SceneOfTests("caustic.pbrt"), "--size", "32x24", "--passes", passes, "-o",
        In(image)};
  };
  const std::string passes = "2000";
  ASSERT_EQ(Run(reference("whole.exr", passes)).code, 0);
  std::vector<std::string> resume = reference("a.exr", passes);
  resume.emplace_back("--resume");
  EXPECT_EQ(Run(resume).code, 1) << "there is nothing to go on with";

  pid_t client = Start(reference("a.exr", passes));
  for (const char* half : {"half 1 of 2", "half 2 of 2"}) {
    for (int i = 0; i < 6000 && Contents(In("stderr.txt")).find(half) == std::string::npos; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    ::kill(client, SIGINT);
    const Ran interrupted = Finish(client);
    EXPECT_EQ(interrupted.code, 130) << interrupted.err;
    EXPECT_NE(interrupted.err.find("--resume"), std::string::npos) << interrupted.err;
    EXPECT_FALSE(std::filesystem::exists(In("a.exr"))) << "it is written whole";
    EXPECT_TRUE(std::filesystem::exists(In("a.exr.checkpoints")));
    if (half == std::string("half 2 of 2")) {
      std::vector<std::string> longer = reference("a.exr", "3000");
      longer.emplace_back("--resume");
      const Ran refused = Run(longer);
      EXPECT_EQ(refused.code, 1);
      EXPECT_NE(refused.err.find("other stop criteria"), std::string::npos) << refused.err;
    }
    client = Start(resume);
  }
  const Ran resumed = Finish(client);
  ASSERT_EQ(resumed.code, 0) << resumed.err;
  EXPECT_FALSE(std::filesystem::exists(In("a.exr.checkpoints"))) << "not needed any more";
  EXPECT_EQ(Run({"digest", In("a.exr")}).out, Run({"digest", In("whole.exr")}).out);
}

TEST_F(ClientCommandsTest, AnInterruptedReferenceWithoutCheckpointsLeavesNothing) {
  const pid_t client = Start({"reference", SceneOfTests("caustic.pbrt"), "--size", "32x24",
                              "--time", "1000", "--no-checkpoints", "-o", In("ref.exr")});
  for (int i = 0; i < 6000 && Contents(In("stderr.txt")).find("pass") == std::string::npos; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  ::kill(client, SIGINT);
  EXPECT_EQ(Finish(client).code, 130);
  EXPECT_TRUE(Images().empty());
  EXPECT_FALSE(std::filesystem::exists(In("ref.exr.checkpoints")));
}

TEST_F(ClientCommandsTest, AReferenceNeedsAnEndAndAFileOfItsOwn) {
  const std::string scene = SceneOfTests("caustic.pbrt");
  EXPECT_EQ(Run({"reference", scene, "-o", In("ref.exr")}).code, 2);
  EXPECT_EQ(Run({"reference", scene, "-o", In("ref.exr"), "--time", "1", "--passes", "2"}).code, 2);
  EXPECT_EQ(Run({"reference", scene, "-o", In("ref.exr"), "--passes", "1"}).code, 2);
  EXPECT_EQ(Run({"reference", scene, "-o", scene, "--time", "1"}).code, 2);
}

// A photon of a job that is over takes its way again, the same every time, and as the counters of
// all photons say.
TEST_F(ClientCommandsTest, TracePhotonShowsTheWayOfAPhotonOfAJobThatIsOver) {
  const auto cluster = LocalCluster::Start({LUCERNA_BIN_DIR, 1, 1});
  ASSERT_TRUE(cluster.ok()) << cluster.status();
  const std::string server = (*cluster)->address();
  constexpr int kPhotons = 12;
  constexpr int kDepth = 4;
  const Ran submitted = Run({"submit", SceneOfTests("caustic.pbrt"), "--size", "32x24", "--server",
                             server, "--passes", "2", "--photons-per-pass",
                             std::to_string(kPhotons), "--max-depth", std::to_string(kDepth)});
  ASSERT_EQ(submitted.code, 0) << submitted.err;
  const std::string job = submitted.out.substr(0, submitted.out.find('\n'));
  const Ran waited = Run({"wait", job, "--server", server, "--json", "--full"});
  ASSERT_EQ(waited.code, 0) << waited.err;
  const json books = json::parse(waited.out);
  EXPECT_EQ(books["tally"]["dropped"], 0);
  EXPECT_EQ(books["energy"]["balance"], 0);
  ASSERT_EQ(books["energy_of_passes"].size(), 2U);
  for (int pass = 0; pass < 2; ++pass) {
    EXPECT_EQ(books["energy_of_passes"][pass]["first_pass"], pass);
    EXPECT_EQ(books["energy_of_passes"][pass]["passes"], 1);
    EXPECT_EQ(books["energy_of_passes"][pass]["balance"], 0);
  }
  EXPECT_FALSE(books.contains("dropped_photons"));

  // A ray for every landing, and one for every photon that met nothing.
  std::uint64_t rays = 0;
  int landed = -1;  // a photon of pass 1 that meets something
  for (int pass = 0; pass < 2; ++pass) {
    for (int index = 0; index < kPhotons; ++index) {
      const std::string key = std::to_string(pass) + ":" + std::to_string(index);
      const Ran ran = Run({"trace-photon", job, key, "--server", server, "--json"});
      ASSERT_EQ(ran.code, 0) << ran.err;
      const json path = json::parse(ran.out);
      EXPECT_EQ(path["pass"], pass);
      EXPECT_EQ(path["index"], index);
      EXPECT_LE(path["landings"].size(), std::size_t{kDepth});
      rays += path["landings"].size() + (path["end"] == "ESCAPED" ? 1 : 0);
      if (pass == 1 && !path["landings"].empty()) landed = index;
    }
  }
  EXPECT_EQ(rays, books["tally"]["rays"].get<std::uint64_t>());

  ASSERT_GE(landed, 0);
  const std::string index = std::to_string(landed);
  const Ran once = Run({"trace-photon", job, "1:" + index, "--server", server});
  ASSERT_EQ(once.code, 0) << once.err;
  EXPECT_EQ(once.out.rfind("photon 1:" + index + " from ", 0), 0U) << once.out;
  EXPECT_NE(once.out.find("landing 1 on "), std::string::npos) << once.out;
  EXPECT_NE(once.out.find("\nthe photon "), std::string::npos) << once.out;
  EXPECT_EQ(Run({"trace-photon", job, index, "--pass", "1", "--server", server}).out, once.out);
  EXPECT_NE(Run({"trace-photon", job, "0:" + index, "--server", server}).out, once.out);

  for (const char* nothing : {"7:", ":7", "x", "-1", "1:12", "1:7:2"}) {
    const Ran refused = Run({"trace-photon", job, nothing, "--server", server});
    EXPECT_EQ(refused.code, 2) << nothing << refused.err;
    EXPECT_EQ(refused.out, "");
  }
  EXPECT_EQ(Run({"trace-photon", "nobody", "1:7", "--server", server}).code, 1);
}

class CompareTest : public ClientCommandsTest {
 protected:
  // Two settings for a fifth of a second each time.
  [[nodiscard]] std::vector<std::string> SmallComparison(
      const std::vector<std::string>& more) const {
    std::vector<std::string> words = {"compare",
                                      SceneOfTests("caustic.pbrt"),
                                      "--reference",
                                      In("ref.exr"),
                                      "--size",
                                      "32x24",
                                      "--photons-per-pass",
                                      "5000",
                                      "--times",
                                      "0.1,0.4",
                                      "--repetitions",
                                      "2",
                                      "--settings",
                                      "wide: --initial-radius 4px",
                                      "--settings",
                                      "flat: --kernel constant --radius-controller pppm"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }

  // What both ways of measuring must give.
  void ExpectComparison(const Ran& ran) const {
    ASSERT_EQ(ran.code, 0) << ran.err;
    const json report = json::parse(ran.out);
    ASSERT_EQ(report["settings"].size(), 2U);
    EXPECT_GT(report["reference_rel_mse"].get<double>(), 0);
    for (const json& setting : report["settings"]) {
      ASSERT_EQ(setting["runs"].size(), 2U);
      EXPECT_NE(setting["runs"][0]["seed"], setting["runs"][1]["seed"]);
      for (const json& run : setting["runs"]) {
        ASSERT_GE(run["points"].size(), 2U);
        for (const json& point : run["points"]) {
          EXPECT_GT(point["measured_rel_mse"].get<double>(), 0);
          EXPECT_GT(point["time_s"].get<double>(), 0);
        }
      }
    }
    EXPECT_EQ(report["settings"][0]["name"], "wide");
    EXPECT_EQ(report["settings"][1]["flags"], "--kernel constant --radius-controller pppm");
    // In turn: the second repetition begins when all settings had their first.
    const std::size_t flat = ran.err.find("repetition 1 of 2, flat");
    EXPECT_LT(ran.err.find("repetition 1 of 2, wide"), flat);
    EXPECT_LT(flat, ran.err.find("repetition 2 of 2, wide")) << ran.err;
    const std::string table = Contents(In("table.md"));
    EXPECT_NE(table.find("| wide |"), std::string::npos) << table;
    EXPECT_EQ(Contents(In("plot.svg")).find("<svg xmlns="), 0U);
  }
};

TEST_F(CompareTest, SettingsAreComparedByTheirRecords) {
  ASSERT_EQ(Run(SmallReference(SceneOfTests("caustic.pbrt"), In("ref.exr"))).code, 0);
  ExpectComparison(
      Run(SmallComparison({"-o", In("table.md"), "--plot", In("plot.svg"), "--json", "--full"})));
}

TEST_F(CompareTest, SettingsAreComparedByTheirImagesWhenPixelsAreLeftOut) {
  ASSERT_EQ(Run(SmallReference(SceneOfTests("caustic.pbrt"), In("ref.exr"))).code, 0);
  ExpectComparison(Run(SmallComparison(
      {"-o", In("table.md"), "--plot", In("plot.svg"), "--json", "--full", "--trim", "0.01"})));
  EXPECT_NE(Contents(In("table.md")).find("without the worst 1 % of pixels"), std::string::npos);
}

TEST_F(CompareTest, MisuseIsRefusedBeforeAnythingIsRendered) {
  ASSERT_EQ(Run(SmallReference(SceneOfTests("caustic.pbrt"), In("ref.exr"))).code, 0);
  EXPECT_EQ(Run(SmallComparison({"--settings", "wide: --alpha 0.5"})).code, 2)
      << "the name is taken";
  EXPECT_EQ(Run(SmallComparison({"--settings", "end: --passes 3"})).code, 2);
  EXPECT_EQ(Run(SmallComparison({"-o", In("ref.exr")})).code, 2) << "the reference is not ours";
  EXPECT_EQ(Run(SmallComparison({"--settings", "large: --size 64x48"})).code, 2);
  std::vector<std::string> none = SmallComparison({});
  none[3] = In("none.exr");
  EXPECT_EQ(Run(none).code, 1);
}

}  // namespace
}  // namespace lucerna
