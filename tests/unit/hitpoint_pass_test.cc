// The rows of a pass must be what its eye paths brought, one after the other: tile by tile, first
// the ordinary ones, then the caustic ones, then the segments, whoever traced them.
#include "render/tracing/hitpoint_pass.h"

#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "gtest/gtest.h"

#include "render/analysis/needs.h"
#include "render/analysis/prepared_scene.h"
#include "render/math/octahedral.h"
#include "tests/support/local_render.h"

namespace lucerna {
namespace {

// No multiples of a tile's 16 pixels.
constexpr int kWidth = 45;
constexpr int kHeight = 37;
constexpr int kTile = 16;

class HitpointPassTest : public testing::TestWithParam<std::string> {
 protected:
  HitpointPassTest() {
    RenderOverrides overrides;
    overrides.width = kWidth;
    overrides.height = kHeight;
    overrides.initial_radius = 0;
    settings = SettingsFor(scene, overrides);
    const SceneNeeds needs = NeedsOf(scene, settings);
    EXPECT_TRUE(prepared.PrepareFor(needs).ok());
    tracer = std::make_unique<EyePathTracer>(prepared.scene(), settings, prepared.needs(),
                                             prepared.intersector(), prepared.lights());
  }

  static constexpr std::uint64_t kPass = 3;
  Scene scene = LoadScene(GetParam() + ".pbrt");
  PreparedScene prepared = PreparedScene(scene);
  RenderSettings settings;
  std::unique_ptr<EyePathTracer> tracer;
};

// All columns of a pass, from eye paths that are traced one by one.
EyePass ExpectedPass(const EyePathTracer& tracer, std::uint64_t pass) {
  EyePass expected;
  std::vector<EyePath> paths;
  std::vector<std::uint32_t> pixels;
  for (int y0 = 0; y0 < kHeight; y0 += kTile) {
    for (int x0 = 0; x0 < kWidth; x0 += kTile) {
      for (int y = y0; y < std::min(y0 + kTile, kHeight); ++y) {
        for (int x = x0; x < std::min(x0 + kTile, kWidth); ++x) {
          paths.push_back(tracer.Trace(x, y, pass, {}));
          pixels.push_back(static_cast<std::uint32_t>(y * kWidth + x));
          expected.rays += static_cast<std::uint64_t>(paths.back().rays);
        }
      }
    }
  }
  const auto add = [&](std::uint32_t pixel, Vec3 position, Vec3 normal, Rgb weight, float radius) {
    expected.block.positions.push_back(position);
    expected.block.normals_oct.push_back(EncodeOctahedral(normal));
    expected.pixels.push_back(pixel);
    expected.weights.push_back(weight);
    expected.unit_radii.push_back(radius);
  };
  const auto add_hitpoints = [&](EyeHitpoint EyePath::*kind) {
    for (std::size_t i = 0; i < paths.size(); ++i) {
      const EyeHitpoint& hitpoint = paths[i].*kind;
      if (IsBlack(hitpoint.weight)) continue;
      if (hitpoint.is_glossy) {
        expected.block.glossy.push_back({static_cast<std::uint32_t>(expected.block.size()),
                                         hitpoint.material, EncodeOctahedral(hitpoint.to_eye),
                                         EncodeOctahedral(hitpoint.shading_normal)});
      }
      add(pixels[i], hitpoint.position, hitpoint.normal, hitpoint.weight, hitpoint.footprint);
    }
  };
  add_hitpoints(&EyePath::hitpoint);
  const std::size_t ordinary = expected.block.size();
  add_hitpoints(&EyePath::caustic);
  expected.block.caustic_rows = expected.block.size() - ordinary;
  for (std::size_t i = 0; i < paths.size(); ++i) {
    const EyeSegment& segment = paths[i].segment;
    if (IsBlack(segment.weight)) continue;
    add(pixels[i], segment.from, {0, 0, 1}, segment.weight, segment.to_footprint / 2);
    expected.block.segments.push_back(
        {segment.to, static_cast<std::uint32_t>(segment.medium),
         std::clamp(segment.from_footprint / segment.to_footprint, 0.5F, 1.0F)});
  }
  return expected;
}

TEST_P(HitpointPassTest, RowsAreWhatEyePathsBrought) {
  const EyePass expected = ExpectedPass(*tracer, kPass);
  for (const int threads : {1, 3}) {
    SCOPED_TRACE(threads);
    ThreadTeam team(threads);
    FilmSpread spread(*tracer);
    const EyePass pass = TraceHitpointPass(*tracer, kPass, nullptr, spread, team);
    ASSERT_TRUE(pass.is_whole);
    EXPECT_EQ(pass.block.positions, expected.block.positions);
    EXPECT_EQ(pass.block.normals_oct, expected.block.normals_oct);
    EXPECT_EQ(pass.block.glossy, expected.block.glossy);
    EXPECT_EQ(pass.block.segments, expected.block.segments);
    EXPECT_EQ(pass.block.caustic_rows, expected.block.caustic_rows);
    EXPECT_EQ(pass.pixels, expected.pixels);
    EXPECT_EQ(pass.weights, expected.weights);
    EXPECT_EQ(pass.unit_radii, expected.unit_radii);
    EXPECT_EQ(pass.rays, expected.rays);
  }
  const std::size_t pixels = std::size_t{kWidth} * kHeight;
  if (GetParam() == "hard-shadow") {
    EXPECT_EQ(expected.block.first_caustic(), pixels) << "each pixel has a hitpoint";
  }
  if (GetParam() == "hair") {
    EXPECT_LT(expected.block.first_caustic(), pixels) << "pixels without a hitpoint";
  }
  EXPECT_EQ(expected.block.caustic_rows > 0, GetParam() == "screen");
  EXPECT_EQ(!expected.block.segments.empty(), GetParam() == "fog");
}
INSTANTIATE_TEST_SUITE_P(Scenes, HitpointPassTest,
                         testing::Values("hard-shadow", "hair", "glass-sphere", "screen", "fog"),
                         [](const auto& test) {
                           std::string name = test.param;
                           std::ranges::replace(name, '-', '_');
                           return name;
                         });

}  // namespace
}  // namespace lucerna
