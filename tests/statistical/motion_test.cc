// A picture of what moves is the mean of pictures of what stands still.
//
// What is emitted and hidden has a closed form: the share of the time for which a place is covered.
// Each half of n passes has one time in each n-th of the shutter's time, so of a place that is
// covered from one time to another it misjudges less than one pass at each of these two times: less
// than 2/n of the radiance, whatever the seed. Scattered light is compared with renders of scenes
// that stand still.
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "gtest/gtest.h"

#include "render/analysis/pass_time.h"
#include "render/formats/read_scene.h"
#include "render/scene/scene_at_time.h"
#include "tests/support/chi_square.h"
#include "tests/support/local_render.h"
#include "tests/support/measure.h"
#include "tests/support/memory_files.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

Scene SceneOf(const std::string& text) {
  std::map<std::string, std::string> files;
  files["s.pbrt"] = text;
  MemoryFiles all(std::move(files));
  ParsedScene parsed = ReadScene(all, "s.pbrt");
  EXPECT_TRUE(parsed.ok()) << parsed.ToStatus();
  return std::move(parsed.scene);
}

// Everything as it is at one time.
Scene StillAt(const Scene& scene, double time) {
  Scene still = scene;
  SceneMover(scene).MoveTo(time, still);
  ForgetMotion(still);
  return still;
}

// A row of pixels, each of which sees next to nothing but its centre: on the plane z = 0 the pixels
// lie at x = (i + 0.5) / 16 - 1.
constexpr int kPixels = 32;
constexpr double kFilter = 0.01;  // [pixels], half of its width
std::string Row(const std::string& before_camera = "") {
  return "LookAt 0 0 -5 0 0 0 0 1 0 " + before_camera +
         "Camera \"orthographic\" \"float screenwindow\" [-1 1 -.03125 .03125] Film \"rgb\" "
         "\"integer xresolution\" 32 \"integer yresolution\" 1 PixelFilter \"box\" \"float "
         "xradius\" "
         ".01 \"float yradius\" .01 WorldBegin ";
}
double PlaceOf(int pixel) {
  return (pixel + 0.5) / 16 - 1;
}

const std::string kBright =
    "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [1 1 1] \"bool twosided\" true Shape "
    "\"trianglemesh\" \"point3 P\" [-3 -3 1 3 -3 1 3 3 1 -3 3 1] \"integer indices\" [0 1 2 0 2 3] "
    "AttributeEnd Material \"diffuse\" \"rgb reflectance\" [0 0 0] ";
// Dark, from x = 0 to 0.4.
const std::string kDark =
    "Shape \"trianglemesh\" \"point3 P\" [0 -1 0 .4 -1 0 .4 1 0 0 1 0] \"integer indices\" "
    "[0 1 2 0 2 3] ";

constexpr int kPasses = 256;

void ExpectShares(const Scene& scene, double (*share_of_time)(double x)) {
  constexpr double kOfHalf = 2.0 / (kPasses / 2);
  // What a pixel sees is 2 kFilter / 16 wide, and each edge takes so long to pass half of it.
  constexpr double kEdge = kFilter / 16 / 0.8;
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const Image image = RenderLocally(scene, TestSettings(scene, 10, 1, 2, seed), kPasses, 1);
    const std::vector<float>& pixels = image.Find("R")->pixels;
    ASSERT_EQ(pixels.size(), std::size_t{kPixels});
    int passed = 0;
    for (int i = 0; i < kPixels; ++i) {
      const double expected = 1 - share_of_time(PlaceOf(i));
      const auto found = static_cast<double>(pixels[static_cast<std::size_t>(i)]);
      EXPECT_NEAR(found, expected, kOfHalf + 2 * kEdge) << "pixel " << i << " seed " << seed;
      passed += expected > 0 && expected < 1 ? 1 : 0;
    }
    EXPECT_GT(passed, 8) << "what moves passes few pixels: nothing is tested";
  }
}

// Of the interval of time [from, to) the part in the shutter's, which is [0, 1).
double Within(double from, double to) {
  return std::max(0.0, std::min(1.0, to) - std::max(0.0, from));
}

// It moves by 0.8 to the left: x is covered while 0 <= x + 0.8 t < 0.4.
double CoveredByMoving(double x) {
  return Within(-x / 0.8, (0.4 - x) / 0.8);
}

TEST(MotionBlurTest, ASquareHidesABrightGroundForAShareOfTheTime) {
  ExpectShares(SceneOf(Row() + kBright + "ActiveTransform EndTime Translate -.8 0 0 " + kDark),
               &CoveredByMoving);
}

// The camera moves to the right instead, and all else with it in the picture.
TEST(MotionBlurTest, ACameraThatMovesSeesTheSame) {
  ExpectShares(SceneOf(Row("ActiveTransform EndTime Translate -.8 0 0 ActiveTransform All ") +
                       kBright + kDark),
               &CoveredByMoving);
}

TEST(MotionBlurTest, AnInstanceThatMovesHidesTheSame) {
  ExpectShares(SceneOf(Row() + kBright + "ObjectBegin \"o\" " + kDark +
                       "ObjectEnd ActiveTransform EndTime Translate -.8 0 0 ObjectInstance \"o\""),
               &CoveredByMoving);
}

// Around the origin by a quarter turn, from below the row of pixels: the strip |y| < 0.1 of a frame
// that turns reaches from 0 to 0.9. At x > 0.1 it covers the row while its angle is within
// asin(0.1 / x) of it, and the row lies in the middle of the turn.
double CoveredByTurning(double x) {
  if (x <= 0.1 || x >= 0.9) return 0;
  const double angle = std::asin(0.1 / x) / (std::numbers::pi / 2);
  return Within(0.5 - angle, 0.5 + angle);
}

TEST(MotionBlurTest, ABarThatTurnsHidesForAShareOfTheTime) {
  const Scene scene =
      SceneOf(Row() + kBright +
              "Rotate -45 0 0 1 ActiveTransform EndTime Rotate 90 0 0 1 ActiveTransform All Shape "
              "\"trianglemesh\" \"point3 P\" [.1 -.1 0 .9 -.1 0 .9 .1 0 .1 .1 0] \"integer "
              "indices\" [0 1 2 0 2 3] ");
  constexpr double kOfHalf = 2.0 / (kPasses / 2);
  // Within half a pixel's width the angle changes by 3.3e-3 quarter turns at most, at x = 0.15.
  constexpr double kEdge = 3.3e-3;
  const Image image = RenderLocally(scene, TestSettings(scene, 10, 1, 2), kPasses, 1);
  int compared = 0;
  for (int i = 0; i < kPixels; ++i) {
    const double x = PlaceOf(i);
    // Its ends are straight: near them the angle is another.
    if (std::abs(x - 0.1) < 0.05 || std::abs(x - 0.9) < 0.02) continue;
    ++compared;
    EXPECT_NEAR(static_cast<double>(image.Find("R")->pixels[static_cast<std::size_t>(i)]),
                1 - CoveredByTurning(x), kOfHalf + 2 * kEdge)
        << i;
  }
  EXPECT_GT(compared, 25);
}

// --- light that moves what is in its way ---------------------------------------------------------

// A floor whose middle the camera sees from the side, a point light above, and a strip that passes
// between them: each point of the floor is dark while the strip's shadow, twice as wide and as
// fast, is over it. The strip is 0.3 wide and passes by 2 in all, so that is 0.15 of the time.
constexpr double kDarkShare = 0.15;
std::string Floor(const std::string& between) {
  return "LookAt 0 -2 .4 0 0 0 0 0 1 Camera \"perspective\" \"float fov\" .3 Film \"rgb\" "
         "\"integer xresolution\" 4 \"integer yresolution\" 4 WorldBegin "
         "AttributeBegin Translate 0 0 2 LightSource \"point\" \"rgb I\" [1 1 1] AttributeEnd "
         "AttributeBegin Material \"diffuse\" \"rgb reflectance\" [.5 .5 .5] Shape "
         "\"trianglemesh\" "
         "\"point3 P\" [-3 -3 0 3 -3 0 3 3 0 -3 3 0] \"integer indices\" [0 1 2 0 2 3] "
         "AttributeEnd Material \"diffuse\" \"rgb reflectance\" [0 0 0] " +
         between;
}
const std::string kStrip =
    "AttributeBegin ActiveTransform EndTime Translate 2 0 0 ActiveTransform All Shape "
    "\"trianglemesh\" \"point3 P\" [-1.15 -1 1 -.85 -1 1 -.85 1 1 -1.15 1 1] \"integer indices\" "
    "[0 1 2 0 2 3] AttributeEnd ";
// A sheet that lets all light through, and that eye paths from the floor do not see through: behind
// it all light comes by photons. Within it the strip passes.
const std::string kSheet =
    "Material \"thindielectric\" \"float eta\" 1 Shape \"trianglemesh\" \"point3 P\" [-3 -3 .5 3 "
    "-3 "
    ".5 3 3 .5 -3 3 .5] \"integer indices\" [0 1 2 0 2 3] ";

// The radiance of the floor under the light: 1 / 2² · 0.5 / π.
constexpr double kLit = 0.125 / std::numbers::pi;

TEST(MotionBlurTest, TheShadowOfWhatMovesIsAShareOfTheTime) {
  const Scene scene = SceneOf(Floor(kStrip));
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const Image image = RenderLocally(scene, TestSettings(scene, 10, .01, 1, seed), kPasses, 1);
    // The floor that is seen is 0.06 long: the light on it is less than 1e-3 weaker than in its
    // middle.
    EXPECT_NEAR(ChannelMean(image, "R") / kLit, 1 - kDarkShare, 2.0 / (kPasses / 2) + 1e-3);
  }
}

constexpr int kParts = 10;
constexpr int kComparisons = 4;

// Two independent means agree.
void ExpectEqual(const MeasuredMean& a, const MeasuredMean& b, double rounding) {
  const double quantile = StudentQuantile(SidakLevel(1e-3, kComparisons), kParts);
  const double bound = quantile * std::hypot(a.standard_error, b.standard_error) + rounding;
  EXPECT_NEAR(a.mean, b.mean, bound);
  EXPECT_LT(bound, kDarkShare / 3 * b.mean) << "the bound would let a wrong result pass";
}

// Photons and hitpoints are of the same time: the strip stops photons for the share of the time for
// which its shadow passes, and the kernel, which blurs over the floor, does not change that.
TEST(MotionBlurTest, PhotonsPassForTheSameShare) {
  const Scene scene = SceneOf(Floor(kStrip + kSheet));
  const Scene open = SceneOf(Floor(kSheet));
  const MeasuredMean blurred = Measure(scene, TestSettings(scene, 20000, .15, 4), 64, kParts, "R");
  MeasuredMean all = Measure(open, TestSettings(open, 20000, .15, 4), 64, kParts, "R");
  EXPECT_NEAR(all.mean / kLit, 1, 0.02) << "the light is not that of photons through the sheet";
  all.mean *= 1 - kDarkShare;
  all.standard_error *= 1 - kDarkShare;
  // A half of 32 passes misjudges less than two of them.
  ExpectEqual(blurred, all, 2.0 / 32 * kLit / std::sqrt(kParts));
}

// A floor that rises by four times the width of a hitpoint's disc, in parallel light: photons of
// another time than the hitpoint's would land below or above it, and count for nothing.
TEST(MotionBlurTest, PhotonsLandOnWhatMoves) {
  const std::string floor =
      "Material \"diffuse\" \"rgb reflectance\" [.5 .5 .5] Shape \"trianglemesh\" \"point3 P\" [-3 "
      "-3 0 3 -3 0 3 3 0 -3 3 0] \"integer indices\" [0 1 2 0 2 3] AttributeEnd ";
  const std::string around =
      "LookAt 0 -2 .45 0 0 .2 0 0 1 Camera \"perspective\" \"float fov\" .3 Film \"rgb\" \"integer "
      "xresolution\" 4 \"integer yresolution\" 4 WorldBegin LightSource \"distant\" \"rgb L\" [1 1 "
      "1] "
      "\"point3 from\" [0 0 1] \"point3 to\" [0 0 0] " +
      kSheet + "AttributeBegin ";
  const Scene rising =
      SceneOf(around + "ActiveTransform EndTime Translate 0 0 .4 ActiveTransform All " + floor);
  const Scene still = SceneOf(around + floor);
  const MeasuredMean a = Measure(rising, TestSettings(rising, 60000, .05, 4), 16, kParts, "R");
  const MeasuredMean b = Measure(still, TestSettings(still, 60000, .05, 4), 16, kParts, "R");
  const double lit = 0.5 / std::numbers::pi;
  EXPECT_NEAR(b.mean / lit, 1, 0.1) << "the light is not that of photons through the sheet";
  const double quantile = StudentQuantile(SidakLevel(1e-3, kComparisons), kParts);
  const double bound = quantile * std::hypot(a.standard_error, b.standard_error);
  EXPECT_NEAR(a.mean, b.mean, bound);
  EXPECT_LT(bound, 0.15 * lit) << "the bound would let a wrong result pass";
}

// All at once: a glass ball, its caustic, a metal ball that grows, a bar that turns and a camera
// that drifts, against the mean of renders of scenes that stand still.
TEST(MotionBlurTest, AWholeSceneIsTheMeanOfItsMoments) {
  Scene scene = LoadScene("motion.pbrt");
  RenderOverrides overrides;
  overrides.width = 24;
  overrides.height = 18;
  overrides.photons_per_pass = 20000;
  overrides.radius_controller = RadiusControllerKind::kFixed;
  overrides.initial_radius = .05;
  RenderSettings settings = SettingsFor(scene, overrides);
  constexpr int kMoments = 32;
  // Blocks of the image, so that motion shows: means of 6 x 6 pixels.
  constexpr int kBlocks = 12;
  const auto blocks_of = [&](const Image& image) {
    std::array<double, kBlocks> blocks{};
    const std::vector<float>& pixels = image.Find("G")->pixels;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      const std::size_t block = i / 24 / 6 * 4 + i % 24 / 6;
      blocks[block] += static_cast<double>(pixels[i]) / 36;
    }
    return blocks;
  };
  constexpr int kRepeats = 12;
  std::array<std::vector<double>, kBlocks> moving;
  std::array<std::vector<double>, kBlocks> still;
  for (int repeat = 0; repeat < kRepeats; ++repeat) {
    settings.seed = 100 + static_cast<std::uint64_t>(repeat);
    const auto found = blocks_of(RenderLocally(scene, settings, 2 * kMoments));
    std::array<double, kBlocks> mean{};
    for (int moment = 0; moment < kMoments; ++moment) {
      const Scene then = StillAt(scene, (moment + 0.5) / kMoments);
      settings.seed = 1000 + static_cast<std::uint64_t>(repeat * kMoments + moment);
      const auto of_moment = blocks_of(RenderLocally(then, settings, 2));
      for (std::size_t b = 0; b < kBlocks; ++b)
        mean[b] += of_moment[b] / kMoments;
    }
    for (std::size_t b = 0; b < kBlocks; ++b) {
      moving[b].push_back(found[b]);
      still[b].push_back(mean[b]);
    }
  }
  const double quantile = StudentQuantile(SidakLevel(1e-3, kBlocks), kRepeats);
  for (std::size_t b = 0; b < kBlocks; ++b) {
    const MeasuredMean a = MeanOf(moving[b]);
    const MeasuredMean c = MeanOf(still[b]);
    // Midpoints of 32 parts of the time are off by 1/24 of a part's change squared; times of passes
    // by chance, which is in the spread.
    const double bound = quantile * std::hypot(a.standard_error, c.standard_error) + 2e-3 * c.mean;
    EXPECT_NEAR(a.mean, c.mean, bound) << "block " << b;
    EXPECT_LT(bound, 0.08 * c.mean) << "block " << b;
  }
}

// --- same bits -----------------------------------------------------------------------------------

TEST(MotionBlurTest, TheSameBitsHoweverPassesAreTraced) {
  const Scene scene = LoadScene("motion.pbrt");
  for (const RadiusControllerKind controller :
       {RadiusControllerKind::kAppm, RadiusControllerKind::kFrequencyMse}) {
    RenderOverrides overrides;
    overrides.width = 32;
    overrides.height = 24;
    overrides.photons_per_pass = 4000;
    overrides.radius_controller = controller;
    const RenderSettings settings = SettingsFor(scene, overrides);
    const auto render = [&](int batches, int threads) {
      LocalRender local(scene, settings, threads);
      for (int pass = 0; pass < 6; ++pass)
        local.AddPass(batches);
      return local.MakeImage();
    };
    const Image expected = render(1, 1);
    for (const auto& [batches, threads] : {std::pair{1, 2}, std::pair{0, 2}, std::pair{3, 2}}) {
      const Image image = render(batches, threads);
      for (const char* channel : {"R", "G", "B"})
        EXPECT_EQ(image.Find(channel)->pixels, expected.Find(channel)->pixels)
            << batches << " batches, " << threads << " threads, " << channel;
    }
  }
}

}  // namespace
}  // namespace lucerna
