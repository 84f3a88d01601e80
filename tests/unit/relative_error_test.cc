// The floor of relative errors follows the light that fills the image: no factor on all light, no
// emitter in view and no black background may decide it.
#include "render/estimate/relative_error.h"

#include <cmath>
#include <vector>

#include "gtest/gtest.h"

namespace lucerna {
namespace {

TEST(RelativeErrorFloorTest, IsAHundredthOfTheSquaredMean) {
  EXPECT_DOUBLE_EQ(RelativeErrorFloor(std::vector<double>{1, 3}), 0.04);
  EXPECT_DOUBLE_EQ(RelativeErrorFloor(std::vector<double>(500, 7)), 0.49);
}

// One pixel in two hundred shines a thousand, a million or 1e30 times as bright as the others.
TEST(RelativeErrorFloorTest, EmittersInViewDoNotCount) {
  std::vector<double> luminances(10'000, 2);
  const double without = RelativeErrorFloor(luminances);
  for (const double emitter : {2e3, 2e6, 2e30}) {
    for (std::size_t i = 0; i < luminances.size(); i += 200)
      luminances[i] = emitter;
    EXPECT_EQ(RelativeErrorFloor(luminances), without) << emitter;
  }
}

TEST(RelativeErrorFloorTest, MostlyBlackImagesHaveAFloor) {
  std::vector<double> luminances(10'000, 0);
  EXPECT_EQ(RelativeErrorFloor(luminances), 0);
  // One pixel alone, whatever share of them all it is.
  luminances[17] = 5;
  EXPECT_DOUBLE_EQ(RelativeErrorFloor(luminances), 0.01 * std::pow(5.0 / 10'000, 2));
  // A hundredth of less than a hundred lit pixels is none of them.
  for (std::size_t i = 0; i < 50; ++i)
    luminances[i] = 1;
  luminances[17] = 5e6;
  EXPECT_DOUBLE_EQ(RelativeErrorFloor(luminances), 0.01 * std::pow((49 + 5e6) / 10'000, 2));
  for (std::size_t i = 50; i < 100; ++i)
    luminances[i] = 1;
  EXPECT_DOUBLE_EQ(RelativeErrorFloor(luminances), 0.01 * std::pow(99.0 / 9'999, 2));
}

TEST(RelativeErrorFloorTest, NegativePixelsCountAsBlack) {
  EXPECT_DOUBLE_EQ(RelativeErrorFloor(std::vector<double>{-4, 2}), 0.01);
  EXPECT_EQ(RelativeErrorFloor(std::vector<double>{-4, -2}), 0);
}

TEST(RelativeErrorFloorTest, NoImageHasNoFloor) {
  EXPECT_EQ(RelativeErrorFloor({}), 0);
}

TEST(RelativeSquareTest, NoErrorIsNoneAlsoRelativeToNothing) {
  EXPECT_EQ(RelativeSquare(0, 0, 0), 0);
  EXPECT_EQ(RelativeSquare(1, 0, 0), HUGE_VAL);
  EXPECT_DOUBLE_EQ(RelativeSquare(1, 2, 1), 0.2);
}

}  // namespace
}  // namespace lucerna
