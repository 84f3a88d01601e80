// The image does not depend on who rendered it.
//
// Real programs on loopback: one digest for one worker with one thread, one with two, and three
// with one, and for batches of several sizes, down to some that cut a pass into dozens of ranges.
// The scene has smooth glass and a mirror, the other has rough metal, whose hitpoints travel with
// their BSDF.
#include <memory>
#include <ostream>
#include <string>
#include <vector>

#include "gtest/gtest.h"

#include "tests/support/process.h"

namespace lucerna {
namespace {

const std::string kBin = LUCERNA_BIN_DIR;

struct Fleet {
  int workers;
  int threads;
  int batch_photons;  // 0: the coordinator's choice
};

std::string DigestOf(const std::string& scene, const std::string& controller, const Fleet& fleet) {
  ChildProcess server({kBin + "/lucerna-server", "--listen", "127.0.0.1:0", "--batch-photons",
                       std::to_string(fleet.batch_photons)});
  const std::string greeting = "listening on ";
  EXPECT_TRUE(server.WaitForText("\n", std::chrono::seconds(60)));
  const std::string line = server.Output();
  const std::string address = line.substr(greeting.size(), line.find('\n') - greeting.size());
  std::vector<std::unique_ptr<ChildProcess>> workers;
  for (int i = 0; i < fleet.workers; ++i) {
    workers.push_back(std::make_unique<ChildProcess>(
        std::vector<std::string>{kBin + "/lucerna-worker", "--server", address, "--threads",
                                 std::to_string(fleet.threads)}));
  }
  const std::string image = testing::TempDir() + "same_bits.exr";
  const Finished submitted = RunProgram(
      {kBin + "/lucerna", "submit", std::string(LUCERNA_SOURCE_DIR) + "/tests/scenes/" + scene,
       "--server", address, "-o", image, "--passes", "4", "--size", "96x72", "--photons-per-pass",
       "60000", "--radius-controller", controller, "--quiet"});
  EXPECT_EQ(submitted.exit_code, 0) << submitted.errors;
  return RunProgram({kBin + "/lucerna", "digest", image}).output;
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
  const std::string expected = DigestOf(GetParam().scene, GetParam().controller, {1, 1, 0});
  ASSERT_GE(expected.size(), 64U) << expected;
  for (const Fleet& fleet :
       {Fleet{1, 2, 0}, Fleet{3, 1, 0}, Fleet{1, 1, 1000}, Fleet{3, 1, 7777}, Fleet{2, 2, 60000}}) {
    EXPECT_EQ(DigestOf(GetParam().scene, GetParam().controller, fleet), expected)
        << fleet.workers << " workers with " << fleet.threads << " threads, batches of "
        << fleet.batch_photons;
  }
}

INSTANTIATE_TEST_SUITE_P(Scenes, SameBitsTest,
                         testing::Values(Case{"glass-box.pbrt", "appm"},
                                         Case{"glass-box.pbrt", "ppm"},
                                         Case{"rough-metal.pbrt", "ppm"},
                                         Case{"rough-metal.pbrt", "cppm"},
                                         Case{"textured.pbrt", "frequency-mse"},
                                         Case{"glass-box.pbrt", "frequency-mse"}));

}  // namespace
}  // namespace lucerna
