// What users of other renderers expect of files and viewers, with the real programs: tiles that
// stitch to the bit, coverage, a timeline, live tiles in tev, false colours, photons as points and
// lines, comparisons of several scenes.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <numbers>
#include <set>
#include <string>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include <nlohmann/json.hpp>

#include "render/base/files.h"
#include "render/image/exr_file.h"
#include "tests/end_to_end/programs.h"
#include "tests/support/process.h"
#include "tests/support/small_tev.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace {

using nlohmann::json;
using testing::HasSubstr;

Finished Lucerna(std::vector<std::string> words) {
  words.insert(words.begin(), kBin + "/lucerna");
  return RunProgram(std::move(words), kPatience);
}

Image Read(const std::string& path) {
  const StatusOr<std::string> bytes = ReadFile(path);
  StatusOr<Image> image = bytes.ok() ? DecodeExr(*bytes) : StatusOr<Image>(bytes.status());
  EXPECT_TRUE(image.ok()) << image.status();
  return image.ok() ? *std::move(image) : Image();
}

Image Render(const TemporaryFolder& folder, const std::string& scene,
             const std::vector<std::string>& flags) {
  std::vector<std::string> words = {"render", scene, "-o", folder.At("image.exr"), "--quiet"};
  words.insert(words.end(), flags.begin(), flags.end());
  const Finished ran = Lucerna(words);
  EXPECT_EQ(ran.exit_code, 0) << ran.errors;
  return Read(folder.At("image.exr"));
}

class TilesTest : public testing::TestWithParam<const char*> {};

constexpr int kWidth = 48;
constexpr int kHeight = 32;

// The image of `flags` put together from three tiles.
Image Stitched(const TemporaryFolder& folder, const std::string& scene,
               const std::vector<std::string>& flags, const Image& whole) {
  Image stitched = whole;
  for (ImageChannel& channel : stitched.channels)
    std::fill(channel.pixels.begin(), channel.pixels.end(), -1.0F);
  for (const char* crop : {"0,20,0,32", "20,48,0,10", "20,48,10,32"}) {
    std::vector<std::string> of_tile = flags;
    of_tile.insert(of_tile.end(), {"--crop", crop});
    const Image tile = Render(folder, scene, of_tile);
    EXPECT_EQ(tile.whole_width, kWidth);
    EXPECT_EQ(tile.whole_height, kHeight);
    for (ImageChannel& channel : stitched.channels) {
      const ImageChannel* const of_channel = tile.Find(channel.name);
      EXPECT_NE(of_channel, nullptr) << channel.name;
      if (of_channel == nullptr) continue;
      for (int y = 0; y < tile.height; ++y) {
        for (int x = 0; x < tile.width; ++x) {
          channel.pixels[static_cast<std::size_t>((tile.y0 + y) * kWidth + tile.x0 + x)] =
              of_channel->pixels[static_cast<std::size_t>(y * tile.width + x)];
        }
      }
    }
  }
  return stitched;
}

// With as many photons as the whole has, drawn alike, all but what photons bring is that of the
// whole to the last bit.
TEST_P(TilesTest, StitchToTheWholeImage) {
  const TemporaryFolder folder;
  const std::string scene = SceneOfTests(GetParam());
  const std::vector<std::string> flags = {"--size",     "48x32",      "--passes",           "20",
                                          "--coverage", "--unguided", "--photons-per-pass", "3000"};
  const Image whole = Render(folder, scene, flags);
  EXPECT_EQ(whole.whole_width, 0);
  const Image stitched = Stitched(folder, scene, flags, whole);
  for (std::size_t c = 0; c < whole.channels.size(); ++c) {
    const std::string& name = whole.channels[c].name;
    if (name.size() == 1 && name != "Z" && name != "A") continue;
    if (name.starts_with("photons") || name == "noise") continue;
    // What is left of blur follows from what photons brought, which differs by their rounding.
    const float tolerance = name == "bias" ? 1e-3F : 0;
    std::size_t different = 0;
    for (std::size_t i = 0; i < whole.channels[c].pixels.size(); ++i) {
      const float a = stitched.channels[c].pixels[i];
      const float b = whole.channels[c].pixels[i];
      const bool is_same =
          a == b || (std::isnan(a) && std::isnan(b)) || std::abs(a - b) <= tolerance * std::abs(b);
      different += is_same ? 0 : 1;
    }
    EXPECT_EQ(different, 0U) << "channel " << name;
  }
}

// Contributions of photons are rounded to quanta with random bits that belong to the photon and the
// hitpoint's number, which is another in a tile. So what they bring differs by a quantum for each
// photon at most. The sums are then rounded by chances that belong to the number of the pixel,
// which is another in a tile too.
TEST(TilesOfPhotonsTest, DifferByTheirRounding) {
  const TemporaryFolder folder;
  constexpr double kAlbedo = 0.5;
  constexpr double kRadius = 0.2;
  constexpr double kPhotons = 3000;
  constexpr double kPasses = 20;
  const std::string scene = folder.At("rooms.pbrt");
  ASSERT_TRUE(WriteFile(scene,
                        "LookAt 0 0 2 0 0 0 0 1 0\n"
                        "Camera \"perspective\" \"float fov\" 60\n"
                        "WorldBegin\n"
                        "LightSource \"point\" \"rgb I\" [1 1 1] \"point3 from\" [0 0 1]\n"
                        "Material \"diffuse\" \"rgb reflectance\" [.5 .5 .5]\n"
                        "Shape \"bilinearmesh\" \"point3 P\" [-9 -9 0 9 -9 0 -9 9 0 9 9 0]\n"
                        "Shape \"bilinearmesh\" \"point3 P\" [-9 -9 3 9 -9 3 -9 9 3 9 9 3]\n")
                  .ok());
  const std::vector<std::string> flags = {"--size",     "48x32",
                                          "--passes",   "20",
                                          "--unguided", "--photons-per-pass",
                                          "3000",       "--radius-controller",
                                          "fixed",      "--kernel",
                                          "constant",   "--initial-radius",
                                          "0.2"};
  const Image whole = Render(folder, scene, flags);
  const Image stitched = Stitched(folder, scene, flags, whole);
  // 2^-18 of the power of two above the light's 4 pi watts [W] (render/math/fixed_point.h).
  constexpr double kQuantum = 16.0 / (1 << 18);
  // From watts of one photon to the pixel: albedo over pi, over the disc, in the mean of all
  // photons.
  constexpr double kPi = std::numbers::pi;
  const double to_pixel = kAlbedo / kPi / (kPi * kRadius * kRadius) / kPhotons / kPasses;
  // One rounding of a sum of n photons has less than a thousandth of the variance of n independent
  // ones (PhotonBits), and so has each level of the tree together: a pass and four steps, and the
  // image's own, in either image. Five standard deviations.
  constexpr double kRoundings = 6;
  const double sums_rounding = 5 * std::sqrt(2 * kRoundings * 1e-3);
  // Of a row of the matrix from the working space, P3, to Rec. 709 the coefficients' sizes
  // together.
  constexpr double kToRec709 = 1.5;
  int lit = 0;
  for (const char* name : {"photons.R", "photons.G", "photons.B"}) {
    const ImageChannel& counts = *whole.Find("photon_count");
    for (std::size_t i = 0; i < counts.pixels.size(); ++i) {
      const auto value = static_cast<double>(whole.Find(name)->pixels[i]);
      const auto count = static_cast<double>(counts.pixels[i]);
      const double quanta = count * kQuantum * to_pixel;
      ASSERT_NEAR(static_cast<double>(stitched.Find(name)->pixels[i]), value,
                  kToRec709 * (quanta + sums_rounding / std::sqrt(std::max(count, 1.0)) * value))
          << name << " " << i;
      lit += value > 0 ? 1 : 0;
    }
  }
  EXPECT_GT(lit, kWidth * kHeight);
}

INSTANTIATE_TEST_SUITE_P(Scenes, TilesTest, testing::Values("caustic.pbrt", "textured.pbrt"),
                         [](const auto& scene) {
                           const std::string name = scene.param;
                           return name.substr(0, name.find('.'));
                         });

TEST(CropTest, WhatLiesOutsideIsASentence) {
  const Finished ran = Lucerna({"render", SceneOfTests("caustic.pbrt"), "--size", "48x32", "--crop",
                                "0,49,0,32", "-o", "/dev/null"});
  EXPECT_EQ(ran.exit_code, 2);
  EXPECT_THAT(ran.errors, HasSubstr("--crop must lie within the image of 48x32 pixels"));
}

// A square that covers the left half of the view: what meets it in a pixel on its edge is a
// binomial count of 16 passes.
TEST(CoverageTest, IsTheShareOfAPixelThatMeetsASurface) {
  const TemporaryFolder folder;
  const std::string scene = folder.At("half.pbrt");
  ASSERT_TRUE(WriteFile(scene,
                        "Film \"rgb\" \"integer xresolution\" 33 \"integer yresolution\" 33\n"
                        "PixelFilter \"box\"\n"
                        "LookAt 0 0 1 0 0 0 0 1 0\n"
                        "Camera \"orthographic\"\n"
                        "WorldBegin\n"
                        "LightSource \"infinite\"\n"
                        "Shape \"bilinearmesh\" \"point3 P\" [-9 -9 0 0 -9 0 -9 9 0 0 9 0]\n")
                  .ok());
  const std::vector<std::string> flags = {"--passes", "16"};
  const Image without = Render(folder, scene, flags);
  EXPECT_EQ(without.Find("A"), nullptr) << "unless it is asked for";
  const Image with = Render(folder, scene, {"--passes", "16", "--coverage"});
  const ImageChannel* const coverage = with.Find("A");
  ASSERT_NE(coverage, nullptr);
  // The camera looks along -z with x to the left or to the right: one side is covered, the other
  // not.
  const float left = coverage->pixels[0];
  EXPECT_EQ(std::abs(coverage->pixels[32] - left), 1);
  double edge = 0;
  for (std::size_t y = 0; y < 33; ++y) {
    for (std::size_t x = 0; x < 33; ++x) {
      const float value = coverage->pixels[33 * y + x];
      if (x == 16) {
        edge += static_cast<double>(value) / 33;
      } else {
        EXPECT_EQ(value, x < 16 ? left : 1 - left);
      }
    }
  }
  // Five standard deviations of a mean of 33 x 16 independent halves; the samples are stratified,
  // and vary less.
  EXPECT_NEAR(edge, 0.5, 5 * 0.5 / std::sqrt(33.0 * 16));
  for (const ImageChannel& channel : without.channels)
    EXPECT_EQ(with.Find(channel.name)->pixels, channel.pixels) << channel.name;
}

// The job says how wrong both images are; all else is as without.
TEST(DenoiseTest, TheLayerIsNearerToTheReferenceAndSaysHowNear) {
  const TemporaryFolder folder;
  const std::string scene = SceneOfTests("glass-box.pbrt");
  const std::vector<std::string> size = {"--size", "64x64", "--photons-per-pass", "4096"};
  const auto with_size = [&](std::vector<std::string> flags) {
    flags.insert(flags.end(), size.begin(), size.end());
    return flags;
  };
  const Image plain = Render(folder, scene, with_size({"--passes", "32"}));
  EXPECT_EQ(plain.Find("denoised.G"), nullptr) << "unless it is asked for";
  ASSERT_EQ(Lucerna(with_size({"render", scene, "--passes", "2048", "--seed", "9", "-o",
                               folder.At("reference.exr"), "--quiet"}))
                .exit_code,
            0);
  std::string digest;
  for (const char* workers : {"1", "2"}) {
    const Finished ran = Lucerna(with_size(
        {"render", scene, "--passes", "32", "--denoise", "--workers", workers, "--reference",
         folder.At("reference.exr"), "-o", folder.At("denoised.exr"), "--json", "--quiet"}));
    ASSERT_EQ(ran.exit_code, 0) << ran.errors;
    const json image = json::parse(ran.output)["relative_error"];
    const json denoised = json::parse(ran.output)["denoised_error"];
    EXPECT_LT(denoised["estimate"].get<double>(), 0.9 * image["estimate"].get<double>());
    EXPECT_LT(denoised["true"].get<double>(), 0.9 * image["true"].get<double>());
    EXPECT_GT(denoised["true"].get<double>(), denoised["low"].get<double>());
    EXPECT_LT(denoised["true"].get<double>(), denoised["high"].get<double>());
    const std::string of_workers = json::parse(ran.output)["image_digest"];
    EXPECT_EQ(digest.empty() ? of_workers : digest, of_workers) << "the same bits";
    digest = of_workers;
  }
  const Image with = DecodeExr(*ReadFile(folder.At("denoised.exr"))).value();
  ASSERT_NE(with.Find("denoised.G"), nullptr);
  for (const ImageChannel& channel : plain.channels)
    EXPECT_EQ(with.Find(channel.name)->pixels, channel.pixels) << channel.name;
  // Nothing is known of the noise of one pass.
  const Image single = Render(folder, scene, with_size({"--passes", "1", "--denoise"}));
  EXPECT_EQ(single.Find("denoised.G"), nullptr);
}

TEST(TraceFlagTest, TheTimelineHasLeasesOfEachWorkerMergesEstimatesAndImages) {
  const TemporaryFolder folder;
  const Finished ran = Lucerna({"render", SceneOfTests("caustic.pbrt"), "--size", "64x48",
                                "--passes", "64", "--workers", "2", "-o", folder.At("a.exr"),
                                "--trace", folder.At("trace.json"), "--quiet"});
  ASSERT_EQ(ran.exit_code, 0) << ran.errors;
  const json file = json::parse(*ReadFile(folder.At("trace.json")));
  EXPECT_EQ(file.at("otherData").at("spans_dropped"), 0);
  std::map<std::pair<int, int>, std::string> rows;
  for (const json& event : file.at("traceEvents")) {
    if (event.at("ph") == "M" && event.at("name") == "thread_name")
      rows[{event.at("pid"), event.at("tid")}] = event.at("args").at("name");
  }
  std::map<std::string, int> spans;  // by row
  std::set<std::string> workers;
  std::map<int, double> free_at;
  std::set<std::string> endings;
  for (const json& event : file.at("traceEvents")) {
    ASSERT_TRUE(event.at("ph") == "X" || event.at("ph") == "M") << event;
    if (event.at("ph") != "X") continue;
    const double begin_us = event.at("ts");
    const double length_us = event.at("dur");
    EXPECT_GE(begin_us, 0) << event;
    EXPECT_GE(length_us, 0) << event;
    const std::string& row = rows.at({event.at("pid"), event.at("tid")});
    ++spans[row];
    if (event.at("pid") == 2) {
      workers.insert(row);
      endings.insert(event.at("args").at("ending"));
    }
    double& at = free_at[event.at("tid")];
    EXPECT_GE(begin_us, at) << "spans of a thread overlap: " << event;
    at = begin_us + length_us;
  }
  EXPECT_EQ(workers.size(), 2U);
  EXPECT_THAT(endings, testing::Contains("delivered"));
  for (const char* row : {"merge", "estimate", "image", "rounds", "job"})
    EXPECT_GE(spans[row], 1) << row;
}

TEST(TraceFlagTest, AFileOfSomethingElseIsNotReplaced) {
  const TemporaryFolder folder;
  ASSERT_TRUE(WriteFile(folder.At("mine.json"), "{\"mine\": 1}").ok());
  const Finished ran = Lucerna({"render", SceneOfTests("caustic.pbrt"), "-o", folder.At("a.exr"),
                                "--trace", folder.At("mine.json")});
  EXPECT_EQ(ran.exit_code, 2);
  EXPECT_THAT(ran.errors, HasSubstr("was not written by lucerna"));
}

TEST(TraceFlagTest, SubmitMustWaitForTheEnd) {
  const TemporaryFolder folder;
  const Finished ran =
      Lucerna({"submit", SceneOfTests("caustic.pbrt"), "--trace", folder.At("t.json")});
  EXPECT_EQ(ran.exit_code, 2);
  EXPECT_THAT(ran.errors, HasSubstr("-o"));
}

TEST(TevFlagTest, TheLastImageIsTheOneInTheFile) {
  const TemporaryFolder folder;
  SmallTev tev;
  const Finished ran =
      Lucerna({"render", SceneOfTests("caustic.pbrt"), "--size", "64x48", "--passes", "32", "-o",
               folder.At("a.exr"), "--tev", tev.address(), "--quiet"});
  ASSERT_EQ(ran.exit_code, 0) << ran.errors;
  const auto packets = tev.Packets();
  ASSERT_EQ(packets.at(4).size(), 1U) << "one image";
  ASSERT_GE(packets.at(5).size(), 1U);
  const Image image = Read(folder.At("a.exr"));
  std::string red(64U * 48 * 4, '\0');
  std::memcpy(red.data(), image.Find("R")->pixels.data(), red.size());
  EXPECT_NE(packets.at(5).back().find(red), std::string::npos);
  for (const auto& [operation, all] : packets)
    EXPECT_TRUE(operation == 4 || operation == 5) << operation;
}

TEST(TevFlagTest, WithoutAViewerNothingIsRendered) {
  const TemporaryFolder folder;
  const Finished ran = Lucerna(
      {"render", SceneOfTests("caustic.pbrt"), "-o", folder.At("a.exr"), "--tev", "127.0.0.1:1"});
  EXPECT_EQ(ran.exit_code, 1);
  EXPECT_THAT(ran.errors, HasSubstr("cannot reach tev at 127.0.0.1:1"));
  EXPECT_FALSE(ReadFile(folder.At("a.exr")).ok());
}

TEST(FalseColorFlagTest, ALayerBecomesAPictureAndItsScaleIsSaid) {
  const TemporaryFolder folder;
  Render(folder, SceneOfTests("caustic.pbrt"), {"--size", "32x24", "--passes", "4"});
  for (const char* layer : {"radius", "density", "photon_count", "noise"}) {
    const Finished ran = Lucerna(
        {"png", folder.At("image.exr"), folder.At("layer.png"), "--layer", layer, "--false-color"});
    ASSERT_EQ(ran.exit_code, 0) << ran.errors;
    EXPECT_THAT(ran.output, HasSubstr(std::string(layer) + ": dark blue is "));
    EXPECT_THAT(*ReadFile(folder.At("layer.png")), testing::StartsWith("\x89PNG"));
  }
  const Finished missing = Lucerna({"png", folder.At("image.exr"), folder.At("layer.png"),
                                    "--layer", "bandwidth", "--false-color"});
  EXPECT_EQ(missing.exit_code, 1);
  EXPECT_THAT(missing.errors, HasSubstr("there is no layer bandwidth"));
  EXPECT_EQ(
      Lucerna({"png", folder.At("image.exr"), folder.At("layer.png"), "--range", "0,1"}).exit_code,
      2)
      << "a range is of false colours";
}

TEST(TracePhotonsTest, SeveralPhotonsAreAFileOfPointsOrLinesAndShapesHaveTheirLines) {
  const TemporaryFolder folder;
  ChildProcess server({kBin + "/lucerna-server", "--listen", "127.0.0.1:0"});
  ASSERT_TRUE(server.WaitForText("listening on ", kPatience));
  const std::string said = server.Output();
  const std::string address = said.substr(said.find("127."), said.find('\n') - said.find("127."));
  ChildProcess worker({kBin + "/lucerna-worker", "--server", address, "--threads", "1"});
  const Finished submitted = Lucerna({"submit", SceneOfTests("caustic.pbrt"), "--size", "32x24",
                                      "--passes", "2", "--photons-per-pass", "5000", "-o",
                                      folder.At("a.exr"), "--json", "--server", address});
  ASSERT_EQ(submitted.exit_code, 0) << submitted.errors;
  const std::string job = json::parse(submitted.output).at("job_id");
  const auto trace = [&](const std::string& photons, const std::vector<std::string>& more) {
    std::vector<std::string> words = {"trace-photon", job, photons, "--server", address};
    words.insert(words.end(), more.begin(), more.end());
    return Lucerna(words);
  };
  const Finished one = trace("1:3", {});
  ASSERT_EQ(one.exit_code, 0) << one.errors;
  EXPECT_THAT(one.output, HasSubstr("(caustic.pbrt:"));
  const Finished three = trace("1:2-4", {});
  EXPECT_THAT(three.output, HasSubstr("photon 1:2"));
  EXPECT_THAT(three.output, HasSubstr(one.output)) << "the same photon among others";
  EXPECT_THAT(three.output, HasSubstr("photon 1:4"));

  ASSERT_EQ(trace("0:0-4999", {"-o", folder.At("photons.ply")}).exit_code, 0);
  EXPECT_THAT(*ReadFile(folder.At("photons.ply")), HasSubstr("element vertex "));
  ASSERT_EQ(trace("0:0-199", {"-o", folder.At("ways.obj")}).exit_code, 0);
  const std::string lines = *ReadFile(folder.At("ways.obj"));
  EXPECT_GT(std::count(lines.begin(), lines.end(), 'l'), 100);

  ASSERT_EQ(trace("0:0-9", {"-o", folder.At("ways.obj")}).exit_code, 0) << "over its own file";
  ASSERT_TRUE(WriteFile(folder.At("mine.obj"), "v 0 0 0\n").ok());
  EXPECT_EQ(trace("0:0-9", {"-o", folder.At("mine.obj")}).exit_code, 2) << "not over a user's";
  EXPECT_EQ(*ReadFile(folder.At("mine.obj")), "v 0 0 0\n");

  EXPECT_EQ(trace("0:0-5000", {}).exit_code, 2) << "beyond the last photon";
  EXPECT_EQ(trace("0:5-4", {}).exit_code, 2);
  EXPECT_EQ(trace("0:0-60000", {}).exit_code, 2);
  EXPECT_EQ(trace("0:0-9", {"-o", folder.At("ways.txt")}).exit_code, 2);
}

TEST(CompareScenesTest, EachSceneHasItsTableItsPlotAndItsRows) {
  const TemporaryFolder folder;
  const std::vector<std::string> scenes = {SceneOfTests("caustic.pbrt"),
                                           SceneOfTests("corner.pbrt")};
  std::vector<std::string> words = {"compare",
                                    scenes[0],
                                    scenes[1],
                                    "--size",
                                    "24x16",
                                    "--times",
                                    "0.2,0.4",
                                    "--repetitions",
                                    "1",
                                    "--settings",
                                    "a: --alpha 0.5",
                                    "--settings",
                                    "k: --kernel constant",
                                    "--csv",
                                    folder.At("all.csv"),
                                    "-o",
                                    folder.At("all.md"),
                                    "--plot",
                                    folder.At("plot-##.svg")};
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    const std::string reference = folder.At("ref" + std::to_string(i) + ".exr");
    ASSERT_EQ(Lucerna({"render", scenes[i], "--size", "24x16", "--passes", "64", "--seed", "9",
                       "-o", reference, "--quiet"})
                  .exit_code,
              0);
    words.insert(words.end(), {"--reference", reference});
  }
  const Finished ran = Lucerna(words);
  ASSERT_EQ(ran.exit_code, 0) << ran.errors;
  const std::string table = *ReadFile(folder.At("all.md"));
  EXPECT_THAT(table, HasSubstr("caustic.pbrt"));
  EXPECT_THAT(table, HasSubstr("corner.pbrt"));
  EXPECT_TRUE(ReadFile(folder.At("plot-01.svg")).ok());
  EXPECT_TRUE(ReadFile(folder.At("plot-02.svg")).ok());
  const std::string csv = *ReadFile(folder.At("all.csv"));
  EXPECT_THAT(csv,
              testing::StartsWith("scene,reference,setting,flags,seed,cores,cpu_s_over_cores,"));
  for (const std::string& scene : scenes) {
    for (const char* setting : {",a,--alpha 0.5,", ",k,--kernel constant,"}) {
      EXPECT_THAT(csv, HasSubstr(scene + ",")) << csv;
      EXPECT_THAT(csv, HasSubstr(setting));
    }
  }
  std::size_t columns = 0;
  for (std::size_t at = 0; at < csv.size();) {
    const std::size_t end = csv.find("\r\n", at);
    ASSERT_NE(end, std::string::npos);
    const std::string row = csv.substr(at, end - at);
    const auto of_row = static_cast<std::size_t>(std::count(row.begin(), row.end(), ','));
    if (at == 0) columns = of_row;
    EXPECT_EQ(of_row, columns) << row;
    at = end + 2;
  }
  words.resize(words.size() - 2);
  const Finished fewer = Lucerna(words);
  EXPECT_EQ(fewer.exit_code, 2);
  EXPECT_THAT(fewer.errors, HasSubstr("there are 2 scenes and 1 references"));
}

}  // namespace
}  // namespace lucerna
