// The image does not depend on who rendered it.
//
// Real programs on loopback: one digest for one worker with one thread, one with two, and three
// with one, and for batches of several sizes, down to some that cut a pass into dozens of ranges;
// over few passes, and over so many that rounds of two and four passes are lent as slices; with
// workers that are killed; and for a job that goes on after an end in the middle of a round.
// One scene has smooth glass and a mirror, another rough metal, whose hitpoints travel with their
// BSDF, and one moves: each pass is at its own time, whoever traces it.
#include <chrono>
#include <memory>
#include <ostream>
#include <string>
#include <thread>
#include <vector>

#include "gtest/gtest.h"
#include <signal.h>

#include "tests/end_to_end/programs.h"
#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace {

struct Fleet {
  int workers;
  int threads;
  int batch_photons;        // 0: the coordinator's choice
  int killed_after_ms = 0;  // the first worker, and replaced; 0: none is
};

struct Work {
  const char* scene;
  const char* controller;
  int passes;
  int photons_per_pass;
  const char* size;
};

// A coordinator and its workers.
class Farm {
 public:
  explicit Farm(const Fleet& fleet)
      : fleet_(fleet),
        server_({kBin + "/lucerna-server", "--listen", "127.0.0.1:0", "--batch-photons",
                 std::to_string(fleet.batch_photons)}) {
    const std::string greeting = "listening on ";
    EXPECT_TRUE(server_.WaitForText("\n", std::chrono::seconds(60)));
    const std::string line = server_.Output();
    address_ = line.substr(greeting.size(), line.find('\n') - greeting.size());
    for (int i = 0; i < fleet.workers; ++i)
      workers_.push_back(NewWorker());
    // The first round is planned for as many workers as there are.
    for (const auto& worker : workers_)
      EXPECT_TRUE(worker->WaitForText("joined", std::chrono::seconds(60)));
  }

  [[nodiscard]] std::string Submit(const Work& work) {
    const Finished submitted = RunProgram(
        {kBin + "/lucerna", "submit",
         std::string(LUCERNA_SOURCE_DIR) + "/tests/scenes/" + work.scene, "--server", address_,
         "--passes", std::to_string(work.passes), "--size", work.size, "--photons-per-pass",
         std::to_string(work.photons_per_pass), "--radius-controller", work.controller, "--quiet"});
    EXPECT_EQ(submitted.exit_code, 0) << submitted.errors;
    return submitted.output.substr(0, submitted.output.find('\n'));
  }

  void Extend(const std::string& job, int passes) {
    const Finished extended = RunProgram({kBin + "/lucerna", "extend", job, "--passes",
                                          std::to_string(passes), "--server", address_, "--quiet"});
    EXPECT_EQ(extended.exit_code, 0) << extended.errors;
  }

  // The digest of the job's image at its end.
  [[nodiscard]] std::string DigestAtEnd(const std::string& job) {
    if (fleet_.killed_after_ms > 0) {
      std::this_thread::sleep_for(std::chrono::milliseconds(fleet_.killed_after_ms));
      workers_.front()->Signal(SIGKILL);
      EXPECT_EQ(workers_.front()->WaitForExit(std::chrono::seconds(5)), 128 + SIGKILL);
      workers_.front() = NewWorker();
    }
    const Finished waited = RunProgram({kBin + "/lucerna", "wait", job, "--server", address_},
                                       std::chrono::seconds(120));
    EXPECT_EQ(waited.exit_code, 0) << waited.errors;
    const TemporaryFolder folder;
    const std::string image = folder.At("image.exr");
    const Finished fetched =
        RunProgram({kBin + "/lucerna", "fetch", job, "-o", image, "--server", address_});
    EXPECT_EQ(fetched.exit_code, 0) << fetched.errors;
    return RunProgram({kBin + "/lucerna", "digest", image}).output;
  }

 private:
  [[nodiscard]] std::unique_ptr<ChildProcess> NewWorker() const {
    return std::make_unique<ChildProcess>(
        std::vector<std::string>{kBin + "/lucerna-worker", "--server", address_, "--threads",
                                 std::to_string(fleet_.threads)});
  }

  const Fleet fleet_;
  ChildProcess server_;
  std::string address_;
  std::vector<std::unique_ptr<ChildProcess>> workers_;
};

std::string DigestOf(const Work& work, const Fleet& fleet) {
  Farm farm(fleet);
  return farm.DigestAtEnd(farm.Submit(work));
}

void ExpectEqual(const Work& work, const std::vector<Fleet>& fleets) {
  const std::string expected = DigestOf(work, {1, 1, 0});
  ASSERT_GE(expected.size(), 64U) << expected;
  for (const Fleet& fleet : fleets) {
    EXPECT_EQ(DigestOf(work, fleet), expected)
        << fleet.workers << " workers with " << fleet.threads << " threads, batches of "
        << fleet.batch_photons << ", killed after " << fleet.killed_after_ms << " ms";
  }
}

struct Case {
  const char* scene;
  const char* controller;
};
void PrintTo(const Case& c, std::ostream* out) {
  *out << c.scene << " " << c.controller;
}

class SameBitsTest : public testing::TestWithParam<Case> {};

TEST_P(SameBitsTest, ForAnyWorkersThreadsAndBatches) {
  ExpectEqual({GetParam().scene, GetParam().controller, 4, 30'000, "96x72"},
              {{1, 2, 0}, {3, 1, 0}, {1, 1, 1000}, {3, 1, 7777}, {2, 2, 30000}});
}

class SameBitsOfRoundsTest : public testing::TestWithParam<Case> {};

// Passes 16 to 31 are in rounds of two and those from 32 on in rounds of four, of which the last is
// not whole. With five workers the passes up to 32 are split by photons.
TEST_P(SameBitsOfRoundsTest, ForAnyWorkersThreadsBatchesAndKills) {
  ExpectEqual({GetParam().scene, GetParam().controller, 38, 6000, "48x36"}, {{1, 2, 0},
                                                                             {2, 1, 0},
                                                                             {5, 1, 0},
                                                                             {7, 2, 777},
                                                                             {2, 1, 0, 150},
                                                                             {2, 1, 0, 400},
                                                                             {5, 1, 1000, 250}});
}

INSTANTIATE_TEST_SUITE_P(Scenes, SameBitsOfRoundsTest,
                         testing::Values(Case{"glass-box.pbrt", "appm"},
                                         Case{"rough-metal.pbrt", "cppm"},
                                         Case{"textured.pbrt", "frequency-mse"},
                                         Case{"motion.pbrt", "frequency-mse"}));

// Pass 21 ends in the middle of a round, and so does pass 45.
TEST(SameBitsAfterExtendTest, AJobThatGoesOnIsOneThatNeverStopped) {
  const char* const scene = "glass-box.pbrt";
  const char* const controller = "appm";
  const std::string short_digest = DigestOf({scene, controller, 21, 9000, "48x36"}, {1, 1, 0});
  const std::string long_digest = DigestOf({scene, controller, 45, 9000, "48x36"}, {1, 1, 0});
  ASSERT_NE(short_digest, long_digest);
  for (const Fleet& fleet : {Fleet{1, 1, 0}, Fleet{3, 1, 0}, Fleet{5, 1, 1000}}) {
    Farm farm(fleet);
    const std::string job = farm.Submit({scene, controller, 21, 9000, "48x36"});
    EXPECT_EQ(farm.DigestAtEnd(job), short_digest) << fleet.workers << " workers";
    farm.Extend(job, 45);
    EXPECT_EQ(farm.DigestAtEnd(job), long_digest) << fleet.workers << " workers";
  }
}

INSTANTIATE_TEST_SUITE_P(
    Scenes, SameBitsTest,
    testing::Values(Case{"glass-box.pbrt", "appm"}, Case{"glass-box.pbrt", "ppm"},
                    Case{"rough-metal.pbrt", "ppm"}, Case{"rough-metal.pbrt", "cppm"},
                    Case{"textured.pbrt", "frequency-mse"}, Case{"glass-box.pbrt", "frequency-mse"},
                    Case{"motion.pbrt", "appm"}));

}  // namespace
}  // namespace lucerna
