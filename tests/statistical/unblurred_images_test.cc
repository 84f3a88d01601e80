// Are images that others are measured by exact, at edges too?

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <utility>
#include <vector>

#include "gtest/gtest.h"

#include "tests/support/chi_square.h"
#include "tests/support/closed_form_render.h"
#include "tests/support/fine_render.h"
#include "tests/support/light_tracer.h"
#include "tests/support/local_render.h"
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

constexpr double kLit = kReflectance * kIrradiance / std::numbers::pi;
constexpr int kRenders = 8;

using OfRenders = std::array<std::vector<double>, kSize>;  // [columns][renders]

// Each column is `lit` times what `share` says of it, or off by `most_off` at most.
template <typename Share>
void ExpectColumns(const OfRenders& of_renders, double most_off, const Share& share) {
  for (std::size_t x = 0; x < kSize; ++x) {
    const MeasuredMean mean = MeanOf(of_renders[x]);
    EXPECT_NEAR(mean.mean, kLit * share(x),
                kLit * most_off + StudentQuantile(1e-6, kRenders) * mean.standard_error)
        << x;
    EXPECT_LT(mean.standard_error, 0.003 * kLit) << x;
  }
}

// What of a column of pixels is lit.
double LitShare(std::size_t x) {
  if (x < kSize / 2) return 0;
  return x == kSize / 2 ? 1 - kEdge * kSize / 2 : 1;
}

TEST(LightTracerTest, RendersAnEdgeWithoutBlur) {
  const Scene scene = HalfShadedFloor();
  OfRenders of_renders;
  for (std::uint64_t seed = 1; seed <= kRenders; ++seed) {
    const RenderSettings settings = TestSettings(scene, 4096, /*initial_radius=*/0.3, 4, seed);
    const LightTracedImage traced = TraceLight(scene, settings, /*passes=*/40, /*threads=*/1);
    EXPECT_EQ(traced.traced_pixels, std::size_t{kSize} * kSize);
    const std::vector<double> columns = ColumnsOf(traced.image);
    for (std::size_t x = 0; x < kSize; ++x)
      of_renders[x].push_back(columns[x]);
  }
  for (std::size_t x = 0; x < kSize / 2; ++x)
    EXPECT_EQ(*std::ranges::max_element(of_renders[x]), 0) << x;
  ExpectColumns(of_renders, 0, LitShare);
}

OfRenders FineRenders(const Scene& scene, int passes) {
  OfRenders of_renders;
  for (std::uint64_t seed = 1; seed <= kRenders; ++seed) {
    RenderOverrides overrides;
    overrides.width = kSize;
    overrides.height = kSize;
    overrides.photons_per_pass = 16384;
    overrides.max_depth = 4;
    overrides.seed = seed;
    const std::vector<double> columns =
        ColumnsOf(RenderFinely(scene, overrides, /*times=*/8, passes, /*threads=*/1));
    for (std::size_t x = 0; x < kSize; ++x)
      of_renders[x].push_back(columns[x]);
  }
  return of_renders;
}

// The edge is farther from the borders of its pixel than a disc is wide.
TEST(FineRenderTest, BlursNoEdgeBeyondItsPixel) {
  ExpectColumns(FineRenders(HalfShadedFloor(), /*passes=*/20), 0, LitShare);
}

// A step is filtered. Discs of radius 1/8 have a variance of 1/384 along an axis and small pixels
// one of 1/768, in pixels; half of that times the largest slope of the filter, 1.1, is what they
// change of it.
TEST(FineRenderTest, WeighsSmallPixelsByTheFilter) {
  Scene scene = HalfShadedFloor();
  scene.filter = {
      .kind = PixelFilter::Kind::kGaussian, .radius_x = 1.5F, .radius_y = 1.5F, .sigma = 0.5F};
  const auto lit_share = [](std::size_t x) {
    constexpr int kSteps = 3000;
    const double edge = kSize / 2.0 * (1 + kEdge);  // [pixels] from the left
    double lit = 0;
    double all = 0;
    for (int i = 0; i < kSteps; ++i) {
      const double off = 3 * (i + 0.5) / kSteps - 1.5;
      const double weight = std::exp(-2 * off * off) - std::exp(-2 * 1.5 * 1.5);
      all += weight;
      if (static_cast<double>(x) + 0.5 + off > edge) lit += weight;
    }
    return lit / all;
  };
  ExpectColumns(FineRenders(scene, /*passes=*/20), 0.5 * 1.1 / 256, lit_share);
}

// Direct light that shadow rays find, of two lights and through the gap of two boards.
TEST(ClosedFormRenderTest, IsTheMeanOfSampledLight) {
  Scene scene;
  const std::int32_t floor = AddMaterial(scene, DiffuseMaterial(kReflectance));
  const std::int32_t black = AddMaterial(scene, DiffuseMaterial(0));
  AddQuad(scene, {-4, -4, 0}, {8, 0, 0}, {0, 8, 0}, floor);
  AddQuad(scene, {-3, -3, 2.5F}, {2.9F, 0, 0}, {0, 6, 0}, black);
  AddQuad(scene, {0.2F, -3, 2.5F}, {3, 0.4F, 0}, {0, 6, 0.2F}, black);
  AddQuad(scene, {-0.3F, -0.5F, 4}, {0, 1, 0}, {0.7F, 0, 0}, black, AddAreaLight(scene, 3));
  AddQuad(scene, {1, -0.5F, 4}, {0, 1, 0.3F}, {0.7F, 0, 0}, black, AddAreaLight(scene, 2));
  SetCamera(scene, {0, 0, 2}, {0, 0, 0}, {0, 1, 0}, 2 * std::atan(0.5) * 180 / std::numbers::pi,
            kSize);
  constexpr int kSampled = 24;
  std::array<std::vector<double>, kSize> sampled;
  for (std::uint64_t seed = 1; seed <= kSampled; ++seed) {
    const std::vector<double> columns =
        ColumnsOf(RenderLocally(scene, TestSettings(scene, 1, /*initial_radius=*/0.3, 4, seed),
                                /*passes=*/96, /*threads=*/1));
    for (std::size_t x = 0; x < kSize; ++x)
      sampled[x].push_back(columns[x]);
  }
  const std::vector<double> exact =
      ColumnsOf(RenderClosedForm(scene, TestSettings(scene, 1, /*initial_radius=*/0.3, 4)));
  const auto [darkest, brightest] = std::ranges::minmax(exact);
  EXPECT_LT(darkest, 0.1 * brightest);
  for (std::size_t x = 0; x < kSize; ++x) {
    const MeasuredMean mean = MeanOf(sampled[x]);
    EXPECT_NEAR(mean.mean, exact[x], StudentQuantile(1e-6, kSampled) * mean.standard_error) << x;
    EXPECT_LT(mean.standard_error, 0.005 * brightest) << x;
  }
}

}  // namespace
}  // namespace lucerna
