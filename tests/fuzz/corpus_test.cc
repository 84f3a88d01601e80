// What the fuzzers found worth keeping is read again in every run, and their seeds are good.
#include <string>

#include "gtest/gtest.h"

#include "tests/fuzz/fuzz_targets.h"
#include "tests/fuzz/scene_from_bytes.h"

namespace lucerna {
namespace {

TEST(FuzzCorpusTest, EveryTargetAcceptsItsSeeds) {
  for (const FuzzTarget& target : AllFuzzTargets()) {
    const std::vector<std::string> seeds = target.seeds();
    EXPECT_FALSE(seeds.empty()) << target.name;
    for (std::size_t i = 0; i < seeds.size(); ++i)
      EXPECT_TRUE(target.read(seeds[i])) << target.name << ", seed " << i;
  }
}

// The targets themselves end the process when what they accept does not hold what it must.
TEST(FuzzCorpusTest, EveryTargetReadsItsCorpusWithoutHarm) {
  for (const FuzzTarget& target : AllFuzzTargets()) {
    SCOPED_TRACE(target.name);
    const std::vector<NamedBytes> corpus = FilesOf(std::string("fuzz/corpus/found/") + target.name);
    EXPECT_FALSE(corpus.empty());
    std::size_t accepted = 0;
    for (const NamedBytes& input : corpus)
      accepted += target.read(input.bytes) ? 1 : 0;
    // Some get through the first checks and some do not, unless the format has changed: then the
    // corpus is of no use, and docs/reliability.md says how to make another.
    EXPECT_GT(accepted, 0U);
    EXPECT_LT(accepted, corpus.size());
  }
}

}  // namespace
}  // namespace lucerna
