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
#include "render/estimate/eye_path_counts.h"
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

// Pixels with one, two and five paths.
EyePathCounts UnlikeCounts() {
  EyePathCounts counts(std::size_t{kWidth} * kHeight, 1);
  for (std::size_t i = 0; i < counts.size(); ++i)
    counts[i] = i % 7 == 3 ? 5 : i % 3 == 0 ? 2 : 1;
  return counts;
}

// All columns of a pass, from eye paths that are traced one by one.
EyePass ExpectedPass(const EyePathTracer& tracer, std::uint64_t pass, const EyePathCounts& counts) {
  EyePass expected;
  expected.direct.resize(counts.size());
  std::vector<EyePath> paths;
  std::vector<std::uint32_t> pixels;
  for (int y0 = 0; y0 < kHeight; y0 += kTile) {
    for (int x0 = 0; x0 < kWidth; x0 += kTile) {
      for (int y = y0; y < std::min(y0 + kTile, kHeight); ++y) {
        for (int x = x0; x < std::min(x0 + kTile, kWidth); ++x) {
          const auto pixel = static_cast<std::uint32_t>(y * kWidth + x);
          const int more = counts[pixel] - 1;
          const float share = 1 / static_cast<float>(1 + more);
          for (int i = -1; i < more; ++i) {
            EyePath path =
                i < 0 ? tracer.Trace(x, y, pass, {}) : tracer.TraceMore(x, y, pass, i, more);
            for (Rgb* weight : {&path.hitpoint.weight, &path.caustic.weight, &path.segment.weight})
              *weight *= share;
            expected.direct[pixel] += path.direct;
            expected.rays += static_cast<std::uint64_t>(path.rays);
            paths.push_back(path);
            pixels.push_back(pixel);
          }
          expected.direct[pixel] *= share;
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
    add(pixels[i], segment.from, segment.border, segment.weight, segment.to_footprint / 2);
    expected.block.segments.push_back(
        {segment.to, static_cast<std::uint32_t>(segment.medium),
         std::clamp(segment.from_footprint / segment.to_footprint, 0.5F, 1.0F)});
  }
  return expected;
}

void ExpectTheSameRows(const EyePass& pass, const EyePass& expected) {
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

TEST_P(HitpointPassTest, RowsAreWhatEyePathsBrought) {
  const EyePass expected =
      ExpectedPass(*tracer, kPass, EyePathCounts(std::size_t{kWidth} * kHeight, 1));
  for (const int threads : {1, 3}) {
    SCOPED_TRACE(threads);
    ThreadTeam team(threads);
    FilmSpread spread(*tracer);
    const EyePass pass = TraceHitpointPass(*tracer, kPass, nullptr, spread, team);
    ASSERT_TRUE(pass.is_whole);
    ExpectTheSameRows(pass, expected);
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
// The rows of a pixel lie side by side, each with its share of the pixel.
TEST_P(HitpointPassTest, APixelOfSeveralPathsIsTheirMean) {
  const EyePathCounts counts = UnlikeCounts();
  const EyePass expected = ExpectedPass(*tracer, kPass, counts);
  for (const int threads : {1, 3}) {
    SCOPED_TRACE(threads);
    ThreadTeam team(threads);
    FilmSpread spread(*tracer);
    const EyePass pass = TraceHitpointPass(*tracer, kPass, nullptr, spread, team, nullptr, &counts);
    ExpectTheSameRows(pass, expected);
    EXPECT_TRUE(pass.paths.empty());
    if (!spread.is_needed()) {
      EXPECT_EQ(pass.direct, expected.direct);
    }
  }
}

// With one path each it is the pass without numbers, to the bit.
TEST_P(HitpointPassTest, OnePathEachIsNoNumberAtAll) {
  const EyePathCounts ones(std::size_t{kWidth} * kHeight, 1);
  ThreadTeam team(2);
  FilmSpread spread(*tracer);
  const EyePass plain = TraceHitpointPass(*tracer, kPass, nullptr, spread, team);
  const EyePass pass = TraceHitpointPass(*tracer, kPass, nullptr, spread, team, nullptr, &ones);
  EXPECT_EQ(pass.block, plain.block);
  EXPECT_EQ(pass.weights, plain.weights);
  EXPECT_EQ(pass.direct, plain.direct);
}

TEST_P(HitpointPassTest, ComparesTwoPathsOfEveryOtherPixel) {
  constexpr std::uint64_t kCompares = 5;
  ASSERT_TRUE(ComparesEyePaths(kCompares));
  const EyePathCounts counts = ComparedEyePaths(std::size_t{kWidth} * kHeight, kWidth, kCompares);
  ThreadTeam team(2);
  FilmSpread spread(*tracer);
  const EyePass pass =
      TraceHitpointPass(*tracer, kCompares, nullptr, spread, team, nullptr, &counts);
  ASSERT_EQ(pass.paths.size(), pass.pixels.size());
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const auto pixel = static_cast<std::size_t>(y * kWidth + x);
      Rgb difference;
      if (counts[pixel] == 2) {
        difference = tracer->Trace(x, y, kCompares, {}).direct -
                     tracer->TraceMore(x, y, kCompares, 0, 1).direct;
      }
      EXPECT_EQ(pass.direct_difference[pixel], difference);
    }
  }
  for (std::size_t row = 1; row < pass.block.first_caustic(); ++row) {
    if (pass.pixels[row] == pass.pixels[row - 1]) {
      EXPECT_EQ(pass.paths[row - 1], 0);
      EXPECT_EQ(pass.paths[row], 1);
    }
  }
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
