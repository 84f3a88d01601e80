// A job whose image does not fit is refused in one sentence, before anything is allocated.
#include "server/memory_need.h"

#include "gmock/gmock.h"
#include "gtest/gtest.h"

#include "render/analysis/expected_cost.h"
#include "render/base/memory.h"

namespace lucerna {
namespace {

RenderSettings Sized(int width, int height) {
  RenderSettings settings;
  settings.width = settings.crop_x1 = width;
  settings.height = settings.crop_y1 = height;
  return settings;
}

double MemoryNeeded(const RenderSettings& settings) {
  return ExpectedCostOf(SceneNeeds(), settings).coordinator;
}

TEST(MemoryNeedTest, GrowsWithPixelsAndEvidence) {
  EXPECT_EQ(MemoryNeeded(Sized(200, 100)), 2 * MemoryNeeded(Sized(100, 100)));
  RenderSettings frequency = Sized(100, 100);
  frequency.radius_controller = RadiusControllerKind::kFrequencyMse;
  EXPECT_GT(MemoryNeeded(frequency), MemoryNeeded(Sized(100, 100)));
}

TEST(MemoryNeedTest, OfTheLargestFilmIsNotFoundOnASmallMachine) {
  const RenderSettings largest = Sized(16384, 16384);
  EXPECT_GT(MemoryNeeded(largest), 100e9);
  const Status refused = CheckMemory(SceneNeeds(), largest, SceneMemory(), std::uint64_t{16} << 30);
  EXPECT_TRUE(absl::IsResourceExhausted(refused));
  EXPECT_THAT(std::string(refused.message()),
              testing::AllOf(testing::HasSubstr("16384x16384"), testing::HasSubstr("17.2 GB"),
                             testing::HasSubstr("cropwindow")));
  EXPECT_TRUE(CheckMemory(SceneNeeds(), largest, SceneMemory(), std::uint64_t{1} << 40).ok());
}

TEST(MemoryNeedTest, OfASceneCountsBesideTheImageAndByItself) {
  SceneMemory scene;
  scene.shapes = 1e9;
  scene.acceleration = 3e9;
  scene.textures = 2e9;
  const RenderSettings small = Sized(100, 100);
  EXPECT_TRUE(CheckMemory(SceneNeeds(), small, scene, 6'700'000'000).ok());
  const Status refused = CheckMemory(SceneNeeds(), small, scene, 6'500'000'000);
  EXPECT_TRUE(absl::IsResourceExhausted(refused));
  EXPECT_THAT(std::string(refused.message()),
              testing::AllOf(testing::HasSubstr("the scene takes 6.60 GB"),
                             testing::HasSubstr("6.50 GB are free"),
                             testing::HasSubstr("--max-job-bytes")));
  // Each alone would fit.
  const RenderSettings large = Sized(2000, 1000);
  EXPECT_TRUE(CheckMemory(SceneNeeds(), large, SceneMemory(), 6'700'000'000).ok());
  EXPECT_THAT(std::string(CheckMemory(SceneNeeds(), large, scene, 6'700'000'000).message()),
              testing::HasSubstr("its scene 6.0 GB"));
}

TEST(MemoryNeedTest, OfACropWindowIsThatOfItsPixels) {
  RenderSettings crop = Sized(16384, 16384);
  crop.crop_x0 = 8000;
  crop.crop_x1 = 8010;
  crop.crop_y1 = 10;
  EXPECT_EQ(MemoryNeeded(crop), MemoryNeeded(Sized(10, 10)));
}

TEST(AvailableMemoryTest, IsKnownHere) {
  EXPECT_GT(AvailableMemory(), std::uint64_t{1} << 20);
  EXPECT_LT(AvailableMemory(), std::uint64_t{1} << 50);
}

}  // namespace
}  // namespace lucerna
