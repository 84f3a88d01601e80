// A bright light counts for every pixel whose filter reaches it, by the filter's weight and with
// little noise, whatever the crop window.
#include "render/tracing/film_spread.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "gtest/gtest.h"

#include "render/tracing/hitpoint_pass.h"
#include "render/transport/working_space.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

constexpr int kSize = 16;
constexpr float kRadiance = 1000;

// A rectangle of the film [pixels].
struct FilmRectangle {
  double x0, y0, x1, y1;
};

// Lights that fill rectangles of a film of `size` pixels, in front of nothing. A wall behind the
// camera makes the scene large, so that lights are much brighter than the image's white.
Scene SceneWithLights(std::span<const FilmRectangle> lights, const PixelFilter& filter, int size) {
  Scene scene;
  // With a field of view of 90 degrees the plane at this distance is the film.
  const auto distance = static_cast<float>(size) / 2;
  SetCamera(scene, {0, 0, 0}, {0, 0, distance}, {0, 1, 0}, 90, size);
  scene.filter = filter;
  // A lens, so that no pass uses the eye paths of another: deviations are of independent passes.
  scene.camera.lens_radius = 1e-6F;
  scene.camera.focal_distance = distance;
  const Scene at_camera = scene;
  const int material = AddMaterial(scene, DiffuseMaterial(0));
  // The camera's own axes say which way the film's x grows.
  const Vec3 right = at_camera.camera.camera_to_world.Vector({1, 0, 0});
  for (const FilmRectangle& light : lights) {
    const auto corner_x = static_cast<float>(light.x0 - size / 2.0);
    const auto corner_y = static_cast<float>(size / 2.0 - light.y1);
    const auto width = static_cast<float>(light.x1 - light.x0);
    const auto height = static_cast<float>(light.y1 - light.y0);
    const Vec3 corner = right * corner_x + Vec3{0, corner_y, distance};
    const int emitter = AddAreaLight(scene, kRadiance, true);
    AddQuad(scene, corner, right * width, {0, height, 0}, material, emitter);
  }
  AddQuad(scene, {-100, -100, -1}, {200, 0, 0}, {0, 200, 0}, material);
  return InWorkingSpace(scene);
}

Scene SceneWithLight(const FilmRectangle& light, const PixelFilter& filter) {
  return SceneWithLights({&light, 1}, filter, kSize);
}

PixelFilter Filter(PixelFilter::Kind kind, float radius) {
  PixelFilter filter;
  filter.kind = kind;
  filter.radius_x = radius;
  filter.radius_y = radius;
  return filter;
}

// The integral of the filter of a pixel, alike along both axes, over [low, high] of the film.
double FilterOver(const FilterSampler& filter, int pixel, double low, double high) {
  constexpr int kSteps = 20000;
  const auto radius = static_cast<double>(filter.radius_x());
  low = std::max(low, pixel + 0.5 - radius);
  high = std::min(high, pixel + 0.5 + radius);
  if (!(high > low)) return 0;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double x = low + (high - low) * (i + 0.5) / kSteps;
    const FilterSampler::Parts parts = filter.AlongX(static_cast<float>(x - pixel - 0.5));
    sum += static_cast<double>(parts.positive - parts.negative);
  }
  return sum * (high - low) / kSteps;
}

struct Traced {
  std::vector<double> mean, deviation;  // [pixels] over passes, of the green channel
};

Traced TraceManyPasses(const Scene& scene, const RenderSettings& settings, int passes,
                       const Glints& glints = {}) {
  const SceneNeeds needs = NeedsOf(scene, settings);
  const auto intersector = Intersector::Create(scene).value();
  const LightSet lights(scene, *intersector);
  const EyePathTracer tracer(scene, settings, needs, *intersector, lights);
  FilmSpread spread(tracer, glints);
  EXPECT_TRUE(spread.is_needed());
  ThreadTeam team(1);
  const auto pixels = static_cast<std::size_t>(settings.crop_width() * settings.crop_height());
  std::vector<double> sum(pixels);
  std::vector<double> squares(pixels);
  for (int pass = 0; pass < passes; ++pass) {
    const EyePass traced =
        TraceHitpointPass(tracer, static_cast<std::uint64_t>(pass), nullptr, spread, team);
    for (std::size_t i = 0; i < pixels; ++i) {
      const auto value = static_cast<double>(traced.direct[i].g);
      sum[i] += value;
      squares[i] += value * value;
    }
  }
  Traced result;
  for (std::size_t i = 0; i < pixels; ++i) {
    result.mean.push_back(sum[i] / passes);
    result.deviation.push_back(
        std::sqrt(std::max(0.0, squares[i] / passes - result.mean[i] * result.mean[i])));
  }
  return result;
}

const PixelFilter kFilters[] = {
    Filter(PixelFilter::Kind::kBox, 0.5F), Filter(PixelFilter::Kind::kTriangle, 1),
    Filter(PixelFilter::Kind::kGaussian, 1.5F), Filter(PixelFilter::Kind::kMitchell, 2),
    Filter(PixelFilter::Kind::kSinc, 4)};

// Each pixel's mean over many passes is the integral of its filter over the light. Passes are
// stratified, so that the deviation of a mean is at most that of independent ones.
void ExpectIntegrals(const PixelFilter& filter, const FilmRectangle& light, const Glints& glints) {
  constexpr int kPasses = 512;
  const Scene scene = SceneWithLight(light, filter);
  const RenderSettings settings = TestSettings(scene, 1000, 0.1, 4);
  const Traced traced = TraceManyPasses(scene, settings, kPasses, glints);
  const FilterSampler sampler(filter);
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      const auto i = static_cast<std::size_t>(y * kSize + x);
      const double expected = kRadiance * FilterOver(sampler, x, light.x0, light.x1) *
                              FilterOver(sampler, y, light.y0, light.y1);
      const double standard_error = traced.deviation[i] / std::sqrt(kPasses);
      ASSERT_NEAR(traced.mean[i], expected, 5 * standard_error + 2e-4 * kRadiance)
          << x << ' ' << y << " filter " << static_cast<int>(filter.kind) << " light at "
          << light.x0;
    }
  }
}

TEST(FilmSpreadTest, GivesEveryPixelTheIntegralOfItsFilterOverTheLight) {
  const FilmRectangle lights[] = {
      {5.6, 7.1, 6.0, 7.3},    // a part of one pixel
      {6.4, 6.45, 6.6, 6.55},  // around the centre of one
      {2.3, 3.8, 12.1, 9.4},   // many pixels
      {0, 0, 2.5, 16},         // at the image's edge
  };
  for (const PixelFilter& filter : kFilters) {
    for (const FilmRectangle& light : lights)
      ExpectIntegrals(filter, light, {});
  }
}

// Wherever paths are drawn, across the light's edges, beside it, several times over, beyond the
// image, and however the place depends on the lens: the means are the same.
TEST(FilmSpreadTest, HasTheSameMeansWithGlintsThatAreWrong) {
  const auto glint = [](Glint::FilmPoint middle, Glint::Matrix axes, Glint::Matrix from_lens,
                        int paths) {
    return Glint{.middle = middle,
                 .axes = axes,
                 .from_lens = from_lens,
                 .key = static_cast<std::uint64_t>(100 * middle.x + middle.y),
                 .paths = paths};
  };
  const Glints glints({
      glint({6.05, 7.2}, {.xx = 0.3, .xy = 0.1, .yx = 0, .yy = 0.2}, {}, 8),
      glint({6.05, 7.3}, {.xx = 0.1, .xy = 0.7, .yx = 1.2, .yy = 0}, {}, 3),
      glint({6.5, 6.5}, {.xx = 0.02, .xy = 0, .yx = 0, .yy = 0.4}, {}, 8),
      glint({2.3, 4.1}, {.xx = 0.3, .xy = 0.2, .yx = -0.2, .yy = 0.3},
            {.xx = 1, .xy = 0, .yx = 0.5, .yy = 0.2}, 16),
      glint({0, 8}, {.xx = 0.5, .xy = 0, .yx = 0, .yy = 0.5}, {}, 4),
      // Wide enough for the light between them, which every pass then finds.
      glint({9.5, 9.5}, {.xx = 0.3, .xy = 0, .yx = 0, .yy = 0.15}, {}, 16),
      glint({9.5, 9.5}, {.xx = 0.25, .xy = 0, .yx = 0, .yy = 0.25},
            {.xx = 0.3, .xy = 0, .yx = 0, .yy = 0.3}, 16),
      glint({11.5, 12}, {.xx = 1e-3, .xy = 0, .yx = 0, .yy = 1e-3}, {}, 1),
  });
  const FilmRectangle lights[] = {
      {5.6, 7.1, 6.0, 7.3}, {2.3, 3.8, 12.1, 9.4}, {0, 0, 2.5, 16}, {9.4, 9.45, 9.6, 9.55}};
  for (const PixelFilter& filter : kFilters) {
    for (const FilmRectangle& light : lights)
      ExpectIntegrals(filter, light, glints);
  }
}

TEST(FilmSpreadTest, LeavesTheInsideOfALightWithoutNoise) {
  const Scene scene = SceneWithLight({1, 1, 15, 15}, Filter(PixelFilter::Kind::kGaussian, 1.5F));
  const RenderSettings settings = TestSettings(scene, 1000, 0.1, 4);
  const Traced traced = TraceManyPasses(scene, settings, 16);
  for (int y = 5; y < 11; ++y) {
    for (int x = 5; x < 11; ++x) {
      const auto i = static_cast<std::size_t>(y * kSize + x);
      EXPECT_NEAR(traced.mean[i], kRadiance, 1e-3 * kRadiance);
      EXPECT_LT(traced.deviation[i], 1e-4 * kRadiance);
    }
  }
}

// A light of 0.2 × 0.1 pixels two pixels from the centre: a pixel's own paths, drawn by a filter
// that has a ten-thousandth of its mass there, would deviate by a hundred times the mean and more.
TEST(FilmSpreadTest, SeesALightInTheTailOfAFilterInMostPasses) {
  const FilmRectangle light = {9.7, 8.45, 9.9, 8.55};
  const PixelFilter filter = Filter(PixelFilter::Kind::kGaussian, 1.5F);
  const Scene scene = SceneWithLight(light, filter);
  const RenderSettings settings = TestSettings(scene, 1000, 0.1, 4);
  const FilterSampler sampler(filter);
  const double mass =
      FilterOver(sampler, 8, light.x0, light.x1) * FilterOver(sampler, 8, light.y0, light.y1);
  const Traced traced = TraceManyPasses(scene, settings, 4096);
  const double own_deviation = 1 / std::sqrt(mass);  // over the mean, of paths of its own
  ASSERT_GT(own_deviation, 30);
  const std::size_t i = 8 * kSize + 8;
  EXPECT_LT(traced.deviation[i] / traced.mean[i], own_deviation / 3);
}

TEST(FilmSpreadTest, GivesACropWindowWhatTheWholeImageHas) {
  const Scene scene =
      SceneWithLight({2.3, 3.8, 12.1, 9.4}, Filter(PixelFilter::Kind::kGaussian, 1.5F));
  const RenderSettings whole = TestSettings(scene, 1000, 0.1, 4);
  RenderSettings crop = whole;
  crop.crop_x0 = 4;
  crop.crop_y0 = 6;
  crop.crop_x1 = 13;
  crop.crop_y1 = 11;
  const Traced of_whole = TraceManyPasses(scene, whole, 4);
  const Traced of_crop = TraceManyPasses(scene, crop, 4);
  for (int y = 0; y < crop.crop_height(); ++y) {
    for (int x = 0; x < crop.crop_width(); ++x) {
      EXPECT_EQ(of_crop.mean[static_cast<std::size_t>(y * crop.crop_width() + x)],
                of_whole.mean[static_cast<std::size_t>((y + 6) * kSize + x + 4)])
          << x << ' ' << y;
    }
  }
}

// Between the lights there is nothing to keep. The crop window begins within one of them and ends
// within the other.
TEST(FilmSpreadTest, KeepsTheInsidesOfLightsThatAreFarApart) {
  constexpr int kWide = 80;
  // Further from a light's outline than the filter reaches.
  constexpr double kBeyond = 2;
  const FilmRectangle lights[] = {{3, 2, 21, 9}, {58, 43, 77, 75}};
  const Scene scene = SceneWithLights(lights, Filter(PixelFilter::Kind::kGaussian, 1.5F), kWide);
  const RenderSettings whole = TestSettings(scene, 1000, 0.1, 4);
  RenderSettings crop = whole;
  crop.crop_x0 = 7;
  crop.crop_y0 = 4;
  crop.crop_x1 = 75;
  crop.crop_y1 = 71;
  const Traced of_whole = TraceManyPasses(scene, whole, 4);
  const Traced of_crop = TraceManyPasses(scene, crop, 4);
  int inside = 0;
  int outside = 0;
  for (int y = 0; y < kWide; ++y) {
    for (int x = 0; x < kWide; ++x) {
      const auto i = static_cast<std::size_t>(y * kWide + x);
      const auto is_in = [&](const FilmRectangle& light, double margin) {
        return x + 0.5 > light.x0 + margin && x + 0.5 < light.x1 - margin &&
               y + 0.5 > light.y0 + margin && y + 0.5 < light.y1 - margin;
      };
      if (is_in(lights[0], kBeyond) || is_in(lights[1], kBeyond)) {
        ++inside;
        EXPECT_NEAR(of_whole.mean[i], kRadiance, 1e-3 * kRadiance) << x << ' ' << y;
        EXPECT_LT(of_whole.deviation[i], 1e-4 * kRadiance) << x << ' ' << y;
      }
      if (!is_in(lights[0], -kBeyond) && !is_in(lights[1], -kBeyond)) {
        ++outside;
        EXPECT_EQ(of_whole.mean[i], 0) << x << ' ' << y;
      }
      if (x < crop.crop_x0 || x >= crop.crop_x1 || y < crop.crop_y0 || y >= crop.crop_y1) continue;
      EXPECT_EQ(of_crop.mean[static_cast<std::size_t>((y - crop.crop_y0) * crop.crop_width() + x -
                                                      crop.crop_x0)],
                of_whole.mean[i])
          << x << ' ' << y;
    }
  }
  EXPECT_EQ(inside, 14 * 3 + 15 * 28);
  EXPECT_GT(outside, kWide * kWide / 2);
}

// A corner of the light covers a thousandth of a pixel: a single path a pass would meet it in one
// of two passes of 1000. Outlines are near four pixels of 256, which leaves four paths for each.
TEST(FilmSpreadTest, KnowsHowMuchOfAPixelTheCornerOfALightCovers) {
  constexpr int kPasses = 512;
  constexpr int kPaths = 4;
  const FilmRectangle light = {5.97, 7.2, 6.2, 7.2333};
  const Scene scene = SceneWithLight(light, Filter(PixelFilter::Kind::kBox, 0.5F));
  const RenderSettings settings = TestSettings(scene, 1000, 0.1, 4);
  const Traced traced = TraceManyPasses(scene, settings, kPasses);
  const double share = 0.03 * 0.0333;
  const double deviation = kRadiance * std::sqrt(share / kPaths);
  EXPECT_NEAR(traced.mean[7 * kSize + 5], kRadiance * share, 3 * deviation / std::sqrt(kPasses));
  EXPECT_LT(traced.deviation[7 * kSize + 5], 1.2 * deviation);
}

TEST(FilmSpreadTest, IsTooDearWhereFiltersAreVeryWide) {
  const auto is_needed = [](const PixelFilter& filter) {
    const Scene scene = SceneWithLight({5.6, 7.1, 6.0, 7.3}, filter);
    const RenderSettings settings = TestSettings(scene, 1000, 0.1, 4);
    const auto intersector = Intersector::Create(scene).value();
    const LightSet lights(scene, *intersector);
    const EyePathTracer tracer(scene, settings, NeedsOf(scene, settings), *intersector, lights);
    return FilmSpread(tracer).is_needed();
  };
  EXPECT_TRUE(is_needed(Filter(PixelFilter::Kind::kBox, 0.5F)));
  EXPECT_TRUE(is_needed(Filter(PixelFilter::Kind::kTriangle, 4)));
  EXPECT_FALSE(is_needed(Filter(PixelFilter::Kind::kTriangle, 5)));
}

}  // namespace
}  // namespace lucerna
