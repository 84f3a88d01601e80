// The image of a small light in a mirror or glass ball has the radiance that quadrature gives, with
// little noise, and is looked for only where there can be one.
#include "render/tracing/glints.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <optional>
#include <vector>

#include "gtest/gtest.h"

#include "render/math/double3.h"
#include "render/tracing/hitpoint_pass.h"
#include "render/transport/bsdf.h"
#include "render/transport/working_space.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

constexpr int kImageSide = 16;
constexpr float kLightRadiance = 1e6F;
constexpr float kIndex = 1.5F;  // of glass
constexpr double kFocus = 3;    // distance
constexpr int kDepth = 12;      // reflections and refractions

struct Ball {
  Vec3 center;
  float radius;
};

// A smooth ball and a light, seen from the origin along z. A black wall behind the camera makes the
// scene large, so that the light is much brighter than the image's white.
struct BallAndLight {
  Ball ball = {{0.3F, 0.2F, 8}, 4};
  Ball light = {{5, 4, 2}, 0.02F};
  bool is_glass = false;
  float radiance = kLightRadiance;
  double lens_radius = 0;
};

Scene SceneOf(const BallAndLight& parts) {
  Scene scene;
  SetCamera(scene, {0, 0, 0}, {0, 0, 8}, {0, 1, 0}, 90, kImageSide);
  scene.camera.lens_radius = parts.lens_radius;
  scene.camera.focal_distance = kFocus;
  const int smooth =
      AddMaterial(scene, parts.is_glass ? DielectricMaterial(kIndex)
                                        : ConductorMaterial(Gray(0.2F), Gray(4), 0, 0));
  const int black = AddMaterial(scene, DiffuseMaterial(0));
  AddSphere(scene, parts.ball.center, parts.ball.radius, smooth);
  AddSphere(scene, parts.light.center, parts.light.radius, black,
            AddAreaLight(scene, parts.radiance));
  AddQuad(scene, {-100, -100, -1}, {200, 0, 0}, {0, 200, 0}, black);
  return InWorkingSpace(scene);
}

struct Line {
  Double3 from, along;  // unit
};

double Square(double x) {
  return x * x;
}

Double3 Unit(Double3 v) {
  return v * (1 / Length(v));
}

// The first place at which a line meets the sphere, a little way on.
std::optional<double> Meets(const Line& line, Double3 center, double radius) {
  const Double3 to = line.from - center;
  const double b = Dot(to, line.along);
  const double root = b * b - Dot(to, to) + radius * radius;
  if (root < 0) return std::nullopt;
  for (const double t : {-b - std::sqrt(root), -b + std::sqrt(root)}) {
    if (t > 1e-6) return t;
  }
  return std::nullopt;
}

double FresnelOf(double cos_i, double index_ratio, double& cos_t) {
  const double sin2_t = (1 - cos_i * cos_i) / Square(index_ratio);
  if (sin2_t >= 1) return 1;
  cos_t = std::sqrt(1 - sin2_t);
  return 0.5 * (Square((cos_i - index_ratio * cos_t) / (cos_i + index_ratio * cos_t)) +
                Square((index_ratio * cos_i - cos_t) / (index_ratio * cos_i + cos_t)));
}

// What a line from the camera finds of the light by way of the ball, in light of radiance 1.
// `light_radius`: of the light, or of a larger one.
double SeenBy(const BallAndLight& parts, Line line, double light_radius) {
  const Double3 center(parts.ball.center);
  const auto radius = static_cast<double>(parts.ball.radius);
  const auto light_seen = [&](const Line& by) {
    const std::optional<double> light = Meets(by, Double3(parts.light.center), light_radius);
    return light && !Meets(by, center, radius);
  };
  const std::optional<double> first = Meets(line, center, radius);
  if (!first) return 0;
  line.from = line.from + line.along * *first;
  Double3 normal = Unit(line.from - center);
  const double cos_o = -Dot(line.along, normal);
  const Line reflected = {line.from, line.along + normal * (2 * cos_o)};
  if (!parts.is_glass) {
    const auto reflectance =
        static_cast<double>(FresnelConductor(static_cast<float>(cos_o), Gray(0.2F), Gray(4)).g);
    return light_seen(reflected) ? reflectance : 0;
  }
  const auto index = static_cast<double>(kIndex);
  double cos_t = 0;
  const double outside = FresnelOf(cos_o, index, cos_t);
  double sum = light_seen(reflected) ? outside : 0;
  line.along = line.along * (1 / index) + normal * (cos_o / index - cos_t);
  double weight = 1 - outside;
  for (int hit = 1; hit < kDepth; ++hit) {
    line.from = line.from + line.along * *Meets(line, center, radius);
    normal = Unit(line.from - center) * -1;
    const double cos_i = -Dot(line.along, normal);
    double cos_out = 0;
    const double inside = FresnelOf(cos_i, 1 / index, cos_out);
    const Line leaving = {line.from, line.along * index + normal * (cos_i * index - cos_out)};
    if (light_seen(leaving)) sum += weight * (1 - inside);
    weight *= inside;
    line.along = line.along + normal * (2 * cos_i);
  }
  return sum;
}

// Radiance of each pixel by quadrature over the film, with a box filter, for one point of the lens
// [its radii].
std::vector<double> ImageOf(const BallAndLight& parts, double lens_x, double lens_y) {
  const Transform camera = SceneOf(parts).camera.camera_to_world;
  const Double3 right(camera.Vector({1, 0, 0}));
  const Double3 up(camera.Vector({0, 1, 0}));
  const Double3 ahead(camera.Vector({0, 0, 1}));
  const auto line_at = [&](double x, double y) {
    const Double3 from = right * (lens_x * parts.lens_radius) + up * (lens_y * parts.lens_radius);
    const Double3 focus = (right * ((x - 8) / 8) + up * ((8 - y) / 8) + ahead) * kFocus;
    return Line{from, Unit(focus - from)};
  };
  constexpr int kCells = 32;  // along the side of a pixel
  constexpr int kFine = 48;   // along the side of a cell
  const auto radius = static_cast<double>(parts.light.radius);
  std::vector<double> image(kImageSide * kImageSide);
  for (int cell_y = 0; cell_y < kImageSide * kCells; ++cell_y) {
    for (int cell_x = 0; cell_x < kImageSide * kCells; ++cell_x) {
      const double x = static_cast<double>(cell_x) / kCells;
      const double y = static_cast<double>(cell_y) / kCells;
      // A light so large that no cell misses it that the small one is in.
      if (SeenBy(parts, line_at(x + 0.5 / kCells, y + 0.5 / kCells), 12 * radius) == 0) continue;
      double sum = 0;
      for (int i = 0; i < kFine * kFine; ++i) {
        sum += SeenBy(parts,
                      line_at(x + (i % kFine + 0.5) / (kFine * kCells),
                              y + (i / kFine + 0.5) / (kFine * kCells)),
                      radius);
      }
      image[static_cast<std::size_t>(cell_y / kCells * kImageSide + cell_x / kCells)] +=
          static_cast<double>(parts.radiance) * sum / (kFine * kFine * kCells * kCells);
    }
  }
  return image;
}

struct Job {
  Scene scene;
  RenderSettings settings;
  SceneNeeds needs;
  std::unique_ptr<Intersector> intersector;
  LightSet lights;
  EyePathTracer tracer;

  explicit Job(Scene of, int max_depth = kDepth)
      : scene(std::move(of)),
        settings(TestSettings(scene, 1000, 0.1, max_depth)),
        needs(NeedsOf(scene, settings)),
        intersector(Intersector::Create(scene).value()),
        lights(scene, *intersector),
        tracer(scene, settings, needs, *intersector, lights) {}
};

Glints GlintsOf(const Job& job) {
  ThreadTeam team(1);
  return Glints(job.tracer, FilmRegion{0, 0, kImageSide, kImageSide}, team);
}

struct PixelStudy {
  std::vector<double> mean, deviation;           // [pixels] over passes
  double mean_of_all = 0, deviation_of_all = 0;  // of the sum over pixels
};

PixelStudy TraceManyPasses(const Job& job, FilmSpread& spread, int passes) {
  ThreadTeam team(1);
  constexpr std::size_t kPixels = kImageSide * kImageSide;
  std::vector<double> squares(kPixels);
  PixelStudy result = {std::vector<double>(kPixels), std::vector<double>(kPixels)};
  const auto deviation = [&](double mean, double square) {
    return std::sqrt(std::max(0.0, square - mean * mean));
  };
  double square_of_all = 0;
  for (int pass = 0; pass < passes; ++pass) {
    const EyePass traced =
        TraceHitpointPass(job.tracer, static_cast<std::uint64_t>(pass), nullptr, spread, team);
    double all = 0;
    for (std::size_t i = 0; i < kPixels; ++i) {
      const auto value = static_cast<double>(traced.direct[i].g);
      result.mean[i] += value / passes;
      squares[i] += value * value / passes;
      all += value;
    }
    result.mean_of_all += all / passes;
    square_of_all += all * all / passes;
  }
  for (std::size_t i = 0; i < kPixels; ++i)
    result.deviation[i] = deviation(result.mean[i], squares[i]);
  result.deviation_of_all = deviation(result.mean_of_all, square_of_all);
  return result;
}

// Pixels that the image of the light covers by less than a hundredth would deviate by ten times
// their mean and more with one path a pass. A fifth of the paths meets the image, or more, where
// they are drawn around it: with 8 or more the deviation is below the mean.
void ExpectImage(const BallAndLight& parts, int least_pixels) {
  constexpr int kPasses = 256;
  const Job job(SceneOf(parts));
  FilmSpread spread(job.tracer);
  const PixelStudy traced = TraceManyPasses(job, spread, kPasses);
  const std::vector<double> expected = ImageOf(parts, 0, 0);
  int pixels = 0;
  double all = 0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    all += expected[i];
    // The outline of what quadrature counts is off by a part of a step, 1 in 48 · 32 of a pixel,
    // and chains of more than eight hits carry a billionth of the light.
    ASSERT_NEAR(traced.mean[i], expected[i],
                5 * traced.deviation[i] / std::sqrt(kPasses) + 0.01 * expected[i] +
                    1e-9 * static_cast<double>(kLightRadiance))
        << i % kImageSide << ' ' << i / kImageSide;
    if (expected[i] > 0) ++pixels;
  }
  EXPECT_GE(pixels, least_pixels);
  EXPECT_LT(traced.deviation_of_all, all);
}

TEST(GlintsTest, AMirrorBallShowsTheLightAsBrightAsQuadratureSays) {
  ExpectImage({}, 1);
  // Behind the ball's edge: reflected at a grazing angle, in an image that is narrow.
  ExpectImage({.light = {{-16, 0.5F, 12}, 0.05F}}, 1);
}

TEST(GlintsTest, AGlassBallShowsTheLightByEachChain) {
  ExpectImage({.light = {{5, 4, 2}, 0.01F}, .is_glass = true}, 3);
}

// Depth of field spreads the image over several pixels.
TEST(GlintsTest, ALensBlursTheImageWithoutNoise) {
  constexpr int kPasses = 256;
  const BallAndLight parts = {.lens_radius = 0.6};
  const Job job(SceneOf(parts));
  FilmSpread spread(job.tracer);
  const PixelStudy traced = TraceManyPasses(job, spread, kPasses);
  double expected = 0;
  constexpr int kRings = 3;
  constexpr int kSectors = 6;
  for (int i = 0; i < kRings * kSectors; ++i) {
    const double radius = std::sqrt((i % kRings + 0.5) / kRings);
    const double angle = 2 * std::numbers::pi * (i / kRings + 0.5) / kSectors;
    for (const double pixel : ImageOf(parts, radius * std::cos(angle), radius * std::sin(angle)))
      expected += pixel / (kRings * kSectors);
  }
  EXPECT_NEAR(traced.mean_of_all, expected,
              5 * traced.deviation_of_all / std::sqrt(kPasses) + 0.01 * expected);
  EXPECT_LT(traced.deviation_of_all, expected);
  EXPECT_GE(std::ranges::count_if(traced.mean, [](double mean) { return mean > 0; }), 4);
}

TEST(GlintsTest, AreWhereTheLightIsSmallAndBrightAndSeen) {
  EXPECT_EQ(GlintsOf(Job(SceneOf({}))).all().size(), 1U);
  // As wide as the ball: its image covers many pixels.
  EXPECT_TRUE(GlintsOf(Job(SceneOf({.light = {{5, 4, 2.5F}, 3}}))).all().empty());
  // In the shadow of the ball.
  EXPECT_TRUE(GlintsOf(Job(SceneOf({.light = {{0.3F, 0.2F, 14}, 0.02F}}))).all().empty());
  // Behind something black.
  Scene hidden = SceneOf({});
  AddDisk(hidden, {4.933F, 3.945F, 2.049F}, {-0.67F, -0.55F, 0.49F}, 0.09F, 1);
  EXPECT_TRUE(GlintsOf(Job(hidden)).all().empty());
  // Nothing smooth to be seen in.
  Scene rough = SceneOf({});
  for (Material& material : rough.materials)
    material = DiffuseMaterial(0);
  EXPECT_TRUE(GlintsOf(Job(rough)).all().empty());
  // Where another light has so much power it is no brighter than the image's white.
  Scene dim = SceneOf({});
  AddQuad(dim, {-100, -100, -2}, {200, 0, 0}, {0, 200, 0}, 1,
          AddAreaLight(dim, 10 * kLightRadiance));
  EXPECT_TRUE(GlintsOf(Job(dim)).all().empty());
  // The reflection, and what needs more than one hit.
  EXPECT_EQ(GlintsOf(Job(SceneOf({.is_glass = true}), 1)).all().size(), 1U);
  EXPECT_GE(GlintsOf(Job(SceneOf({.is_glass = true}))).all().size(), 2U);
}

TEST(GlintsTest, GiveTheSameBitsWhateverTheThreadsAndTheCropWindow) {
  constexpr int kWide = 80;  // five tiles of the search
  Scene scene = SceneOf({.light = {{5, 4, 2}, 0.004F}, .is_glass = true});
  SetCamera(scene, {0, 0, 0}, {0, 0, 8}, {0, 1, 0}, 50, kWide);
  scene.filter = {PixelFilter::Kind::kGaussian, 1.5F, 1.5F};
  const Job whole(scene);
  scene.film.crop_x0 = 42;
  scene.film.crop_y0 = 24;
  scene.film.crop_x1 = 77;
  scene.film.crop_y1 = 51;
  const Job crop(scene);
  ThreadTeam one(1);
  ThreadTeam many(3);
  EXPECT_GE(Glints(whole.tracer, FilmRegion{42, 24, 77, 51}, one).all().size(), 3U);
  FilmSpread of_whole(whole.tracer);
  FilmSpread by_many(whole.tracer);
  FilmSpread of_crop(crop.tracer);
  int bright = 0;
  for (std::uint64_t pass = 0; pass < 4; ++pass) {
    const EyePass traced = TraceHitpointPass(whole.tracer, pass, nullptr, of_whole, one);
    const EyePass again = TraceHitpointPass(whole.tracer, pass, nullptr, by_many, many);
    const EyePass part = TraceHitpointPass(crop.tracer, pass, nullptr, of_crop, many);
    for (int y = 0; y < kWide; ++y) {
      for (int x = 0; x < kWide; ++x) {
        const float value = traced.direct[static_cast<std::size_t>(y * kWide + x)].g;
        EXPECT_EQ(again.direct[static_cast<std::size_t>(y * kWide + x)].g, value);
        const RenderSettings& window = crop.settings;
        if (x < window.crop_x0 || x >= window.crop_x1) continue;
        if (y < window.crop_y0 || y >= window.crop_y1) continue;
        const auto i = static_cast<std::size_t>((y - window.crop_y0) * window.crop_width() + x -
                                                window.crop_x0);
        EXPECT_EQ(part.direct[i].g, value) << x << ' ' << y;
        if (value > 0) ++bright;
      }
    }
  }
  EXPECT_GE(bright, 8);
}

}  // namespace
}  // namespace lucerna
