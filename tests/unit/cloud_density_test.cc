// A cloud of pbrt files has the densities of its function wherever a ray may be.
#include "render/formats/cloud_density.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

#include "render/math/rng.h"
#include "render/scene/density_grid.h"
#include "tests/support/pbrt_text.h"

namespace lucerna {
namespace {

using ::testing::HasSubstr;

Scene ReadCloudScene(const std::string& parameters) {
  return ReadWorld("MakeNamedMedium \"m\" \"string type\" \"cloud\" " + parameters +
                   " MediumInterface \"m\" \"\" Material \"interface\" Shape \"sphere\"");
}

// Without noise it is a floor that is 1 below y = 0 and falls to 0 at y = 0.5: polygons, whose
// columns are sums of areas.
TEST(CloudDensityTest, WithoutNoiseItIsAFloor) {
  const Scene scene = ReadCloudScene(
      "\"float density\" 0 \"float frequency\" 1 \"point3 p0\" [0 -1 0] \"rgb sigma_s\" [2 2 2] "
      "\"rgb sigma_a\" [0 0 0]");
  const Medium& medium = scene.media.at(0);
  ASSERT_NE(medium.density, nullptr);
  EXPECT_EQ(medium.scattering, Gray(2));
  // At its border a grid falls to half over the last half cell: of two ends, a quarter of a cell.
  const double cell = 2.0 / medium.density->size()[1];
  EXPECT_NEAR(medium.Column({0.5F, 2, 0.5F}, {0, -1, 0}, HUGE_VALF), 1 + 0.25, cell / 8 + 1e-3);
  EXPECT_NEAR(medium.Column({0.3F, 0.25F, -1}, {0, 0, 1}, HUGE_VALF), 0.5, 0.3 * cell);
  EXPECT_NEAR(medium.Column({0.3F, -0.7F, -1}, {0, 0, 1}, HUGE_VALF), 1, 0.3 * cell);
  EXPECT_EQ(medium.Column({0.3F, 0.7F, -1}, {0, 0, 1}, HUGE_VALF), 0);
}

// As the grid is built from. The noise is as often above 0 as below, and wisps move places; at the
// ends of the height there is none.
TEST(CloudDensityTest, PuffsFollowTheNoise) {
  CloudShape shape;
  shape.wispiness = 0;
  EXPECT_EQ(CloudDensityAt(shape, {7, 0, -3}), 1);
  EXPECT_EQ(CloudDensityAt(shape, {0.4F, 1, 0.3F}), 0);
  KeyedRng rng(81);
  int above = 0;
  int moved = 0;
  constexpr int kPlaces = 4000;
  for (int i = 0; i < kPlaces; ++i) {
    const float x = 100 * rng.Uniform();
    const float z = 100 * rng.Uniform();
    const Vec3 place = {x, 0.5F + 0.5F * rng.Uniform(), z};
    const float density = CloudDensityAt(shape, place);
    EXPECT_GE(density, 0);
    EXPECT_LE(density, 1);
    above += density > 0 ? 1 : 0;
    CloudShape wispy = shape;
    wispy.wispiness = 1;
    moved += CloudDensityAt(wispy, place) != density ? 1 : 0;
    // Twice the density, twice the puffs, up to 1.
    CloudShape dense = shape;
    dense.density = 2;
    EXPECT_NEAR(CloudDensityAt(dense, place), std::min(1.0F, 2 * density), 1e-5F);
  }
  EXPECT_NEAR(above / static_cast<double>(kPlaces), 0.5, 4.5 * 0.5 / std::sqrt(kPlaces));
  EXPECT_GT(moved, kPlaces / 3);
}

TEST(CloudDensityTest, TheGridHasTheFunctionsDensities) {
  const Scene scene = ReadCloudScene("\"float wispiness\" 0 \"float frequency\" 2");
  CloudShape shape;
  shape.wispiness = 0;
  shape.frequency = 2;
  KeyedRng rng(82);
  double sum = 0;
  double squares = 0;
  double of_function = 0;
  constexpr int kPlaces = 4000;
  for (int i = 0; i < kPlaces; ++i) {
    const float x = 0.05F + 0.9F * rng.Uniform();
    const float y = 0.05F + 0.9F * rng.Uniform();
    const Vec3 place = {x, y, 0.05F + 0.9F * rng.Uniform()};
    const auto expected = static_cast<double>(CloudDensityAt(shape, place));
    const double error = scene.media.at(0).density->At(place) - expected;
    sum += error;
    squares += error * error;
    of_function += expected;
  }
  EXPECT_GT(of_function / kPlaces, 0.2);
  EXPECT_NEAR(sum / of_function, 0, 2e-3);
  EXPECT_LT(std::sqrt(squares / kPlaces), 0.03);
}

TEST(CloudDensityTest, GridsAreBounded) {
  const auto points = [](float frequency, Vec3 high) {
    CloudShape shape;
    shape.frequency = frequency;
    const std::array<int, 3> size = CloudGridSize(shape, {0, 0, 0}, high);
    return static_cast<double>(size[0]) * size[1] * size[2];
  };
  EXPECT_EQ(points(5, {1, 1, 1}), 160.0 * 160 * 160);
  EXPECT_LE(points(1e4F, {1, 1, 1}), 0x1p24);
  EXPECT_GT(points(1e4F, {1, 1, 1}), 0x1p23);
  EXPECT_LE(points(5, {1e30F, 1e30F, 1e30F}), 0x1p24);
  EXPECT_EQ(points(0, {1, 1, 1}), 8);
  const std::string cloud = "MakeNamedMedium \"m\" \"string type\" \"cloud\" ";
  EXPECT_THAT(SaidOfWorld(cloud + "\"float density\" -1"), HasSubstr("density"));
  EXPECT_THAT(SaidOfWorld(cloud + "\"float frequency\" 1e5"), HasSubstr("frequency"));
  EXPECT_THAT(SaidOfWorld(cloud + "\"point3 p1\" [1 0 1]"), HasSubstr("flat"));
  for (const char* const far :
       {"\"point3 p1\" [1e35 1e35 1e35]", "\"point3 p0\" [-3e38 0 0] \"point3 p1\" [3e38 1 1]",
        "\"float frequency\" 0 \"point3 p1\" [1 1e7 1]"})
    EXPECT_THAT(SaidOfWorld(cloud + far), HasSubstr("of the origin")) << far;
  EXPECT_THAT(SaidOfWorld(cloud + "\"float density\" 1e38 \"float frequency\" 0"),
              HasSubstr("density"));
  EXPECT_THAT(SaidOfWorld(cloud + "\"float wispiness\" 3e38"), HasSubstr("wispiness"));
}

}  // namespace
}  // namespace lucerna
