// Is a light-traced image exact at an edge? Other images are measured by it.
#include "tests/support/light_tracer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <utility>
#include <vector>

#include "gtest/gtest.h"

#include "tests/support/chi_square.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

constexpr int kSize = 16;  // [pixels], of 1/8 on the floor
constexpr double kIrradiance = 2;
constexpr double kReflectance = 0.5;
constexpr double kEdge = 0.03;  // in the column of pixels from 0 to 1/8

// Sunlight straight down through a pane that bends nothing on a floor, of which a board shades all
// where x < kEdge. No light is direct.
Scene HalfShadedFloor() {
  Scene scene;
  const std::int32_t floor = AddMaterial(scene, DiffuseMaterial(kReflectance));
  const std::int32_t board = AddMaterial(scene, DiffuseMaterial(0));
  const std::int32_t pane = AddMaterial(scene, DielectricMaterial(1.0001F));
  AddQuad(scene, {-4, -4, 0}, {8, 0, 0}, {0, 8, 0}, floor);
  AddBox(scene, {-5, -5, 3}, {5, 5, 3.1F}, pane);
  AddQuad(scene, {-5, -5, 4}, {5 + static_cast<float>(kEdge), 0, 0}, {0, 10, 0}, board);
  scene.distant_lights.push_back({{0, 0, -1}, Gray(static_cast<float>(kIrradiance))});
  // The floor is seen from below the pane, from -1 to 1.
  SetCamera(scene, {0, 0, 2}, {0, 0, 0}, {0, 1, 0}, 2 * std::atan(0.5) * 180 / std::numbers::pi,
            kSize);
  return scene;
}

// Means over columns of pixels, the dark ones first.
std::vector<double> ColumnsOf(const Image& image) {
  std::vector<double> columns(kSize);
  for (std::size_t i = 0; i < image.channels[0].pixels.size(); ++i)
    columns[i % kSize] += static_cast<double>(image.Find("G")->pixels[i]) / kSize;
  if (columns.front() > columns.back()) std::ranges::reverse(columns);
  return columns;
}

TEST(LightTracerTest, RendersAnEdgeWithoutBlur) {
  const Scene scene = HalfShadedFloor();
  constexpr int kRenders = 8;
  std::array<std::vector<double>, kSize> of_renders;
  for (std::uint64_t seed = 1; seed <= kRenders; ++seed) {
    const RenderSettings settings = TestSettings(scene, 4096, /*initial_radius=*/0.3, 4, seed);
    const LightTracedImage traced = TraceLight(scene, settings, /*passes=*/40, /*threads=*/1);
    EXPECT_EQ(traced.traced_pixels, std::size_t{kSize} * kSize);
    const std::vector<double> columns = ColumnsOf(traced.image);
    for (std::size_t x = 0; x < kSize; ++x)
      of_renders[x].push_back(columns[x]);
  }
  const double lit = kReflectance * kIrradiance / std::numbers::pi;
  for (std::size_t x = 0; x < kSize / 2; ++x)
    EXPECT_EQ(*std::ranges::max_element(of_renders[x]), 0) << x;
  for (std::size_t x = kSize / 2; x < kSize; ++x) {
    const MeasuredMean mean = MeanOf(of_renders[x]);
    const double expected = x == kSize / 2 ? lit * (1 - kEdge * kSize / 2) : lit;
    EXPECT_NEAR(mean.mean, expected, StudentQuantile(1e-6, kRenders) * mean.standard_error) << x;
    EXPECT_LT(mean.standard_error, 0.003 * lit) << x;
  }
}

}  // namespace
}  // namespace lucerna
