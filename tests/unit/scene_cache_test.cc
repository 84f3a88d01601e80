// A worker keeps the last scenes, and refuses one that its memory would not hold before it builds
// anything of it.
#include "worker/scene_cache.h"

#include <map>
#include <memory>
#include <string>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

#include "render/wire/block_codec.h"

namespace lucerna {
namespace {

constexpr const char* kScene =
    "LookAt 0 0 5  0 0 0  0 1 0\nCamera \"perspective\"\nWorldBegin\nLightSource \"point\"\n"
    "Shape \"sphere\" \"float radius\" ";

class SceneCacheTest : public testing::Test {
 protected:
  SceneManifest SceneOf(const std::string& radius, const std::string& more = "") {
    const std::string text = kScene + radius + "\n" + more;
    files_[Sha256(text)] = text;
    SceneManifest manifest;
    manifest.main_path = "scene.pbrt";
    manifest.entries["scene.pbrt"] = {Sha256(text), text.size()};
    return manifest;
  }

  std::uint64_t available_ = std::uint64_t{1} << 40;
  std::map<Digest, std::string> files_;
  int fetched_ = 0;
  SceneCache cache_{1,
                    [this](const Digest& digest, std::uint64_t /*max_bytes*/) {
                      ++fetched_;
                      return StatusOr<std::string>(files_.at(digest));
                    },
                    [this] { return available_; }};
};

TEST_F(SceneCacheTest, KeepsTwoScenes) {
  ASSERT_TRUE(cache_.TracerFor(SceneOf("1")).ok());
  ASSERT_TRUE(cache_.TracerFor(SceneOf("2")).ok());
  ASSERT_TRUE(cache_.TracerFor(SceneOf("1")).ok());
  EXPECT_EQ(fetched_, 2);
  ASSERT_TRUE(cache_.TracerFor(SceneOf("3")).ok());
  ASSERT_TRUE(cache_.TracerFor(SceneOf("1")).ok());
  EXPECT_EQ(fetched_, 3) << "2 went";
  ASSERT_TRUE(cache_.TracerFor(SceneOf("2")).ok());
  EXPECT_EQ(fetched_, 4);
}

// Leases of two jobs that alternate fetch their radii once; when a job's next round begins, those
// of its last one go.
TEST_F(SceneCacheTest, KeepsTwoColumnsOfRadii) {
  const auto radii = [&](float radius) {
    const RadiusColumn column = {radius, 2 * radius};
    const std::string bytes = EncodeRadii(column);
    files_[Sha256(bytes)] = bytes;
    const auto kept = cache_.RadiiFor(Sha256(bytes), column.size());
    EXPECT_EQ(*kept.value(), column);
    return std::weak_ptr(kept.value());
  };
  const auto first = radii(1);
  radii(2);
  radii(1);
  radii(2);
  EXPECT_EQ(fetched_, 2);
  EXPECT_FALSE(first.expired());
  radii(3);
  EXPECT_TRUE(first.expired());
  radii(2);
  EXPECT_EQ(fetched_, 3);
}

TEST_F(SceneCacheTest, RefusesASceneThatDoesNotFitAndDropsOthersForIt) {
  const SceneManifest small = SceneOf("1");
  std::string meshes;
  for (int i = 0; i < 10'000; ++i)
    meshes += "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0]\n";
  const SceneManifest large = SceneOf("2", meshes);
  ASSERT_TRUE(cache_.TracerFor(small).ok());
  // Its meshes fit, what is built of them does not.
  available_ = 6 << 20;
  const Status refused = cache_.TracerFor(large).status();
  EXPECT_TRUE(absl::IsResourceExhausted(refused)) << refused;
  EXPECT_THAT(std::string(refused.message()),
              testing::AllOf(testing::HasSubstr("the scene takes about"),
                             testing::HasSubstr("use a machine with more memory")));
  fetched_ = 0;
  ASSERT_TRUE(cache_.TracerFor(small).ok());
  EXPECT_EQ(fetched_, 1) << "it was dropped in the attempt";
  available_ = 64 << 20;
  EXPECT_TRUE(cache_.TracerFor(large).ok());
}

}  // namespace
}  // namespace lucerna
