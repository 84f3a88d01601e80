// Frames must stand over one another on terminals of any size: no line may wrap, no frame may
// scroll, and nothing of an old one may be left.
#include <algorithm>
#include <cmath>

#include "gtest/gtest.h"

#include "client/view/live_view.h"
#include "render/report/convergence.h"
#include "render/report/progress_view.h"
#include "tests/support/converging_job.h"

namespace lucerna {
namespace {

v1::Job RunningJob(int samples) {
  v1::Job job = ConvergingJob(samples);
  job.set_state(v1::JOB_STATE_RUNNING);
  return job;
}

Image GrayImage(int width, int height) {
  Image image{.width = width, .height = height, .channels = {}, .metadata = {}};
  for (const char* name : {"R", "G", "B"}) {
    image.channels.push_back(
        {name, std::vector<float>(static_cast<std::size_t>(width * height), 0.5F)});
  }
  return image;
}

TEST(CurveTest, AFallingPowerLawIsADiagonal) {
  // Two letters of 2 × 4 dots beside and under one another: (0, 0) to (3, 7).
  const std::vector<std::string> lines =
      DrawCurve({{1, 100}, {10, 10}, {100, 1}}, std::nullopt, 2, 2, Charset::kUtf8);
  EXPECT_EQ(lines, (std::vector<std::string>{"⢣⠀", "⠀⢣"}));
}

TEST(CurveTest, ALevelIsEveryOtherDotAndWidensTheRange) {
  const std::vector<std::string> lines = DrawCurve({{1, 100}, {100, 100}}, 1, 3, 1, Charset::kUtf8);
  EXPECT_EQ(lines, (std::vector<std::string>{"⡉⡉⡉"}));
}

TEST(CurveTest, FewerThanTwoPointsAreNoCurve) {
  EXPECT_TRUE(DrawCurve({}, 1, 5, 5, Charset::kUtf8).empty());
  EXPECT_TRUE(DrawCurve({{1, 1}, {0, 1}, {2, std::nan("")}}, 1, 5, 5, Charset::kUtf8).empty());
  EXPECT_EQ(DrawCurve({{1, 1}, {1, 1}}, std::nullopt, 5, 5, Charset::kUtf8).size(), 5U)
      << "no extent";
}

TEST(CurveTest, InAsciiHalvesOfLettersAreTheCurveAndTheLevelIsALine) {
  // Two letters under one another: 8 rows of dots. The curve falls from row 0 to row 7.
  EXPECT_EQ(DrawCurve({{1, 100}, {10, 10}, {100, 1}}, std::nullopt, 2, 2, Charset::kAscii),
            (std::vector<std::string>{": ", " :"}));
  EXPECT_EQ(DrawCurve({{1, 100}, {100, 100}}, 1, 3, 2, Charset::kAscii),
            (std::vector<std::string>{"'''", "---"}));
  EXPECT_EQ(DrawCurve({{1, 1}, {100, 1}}, 100, 3, 2, Charset::kAscii),
            (std::vector<std::string>{"---", "..."}));
  EXPECT_EQ(DrawCurve({{1, 1}, {100, 1}}, 1, 3, 1, Charset::kAscii),
            (std::vector<std::string>{"'''"}))
      << "where both are, the curve";
}

TEST(LiveViewTest, ColumnsAreLettersWithoutEscapes) {
  EXPECT_EQ(ColumnsOf("abc"), 3);
  EXPECT_EQ(ColumnsOf("\x1b[38;2;1;2;3m▀▀\x1b[0m"), 2);
  EXPECT_EQ(CutTo("abcdef", 4), "abcd");
  EXPECT_EQ(CutTo("⡉⡉⡉", 2), "⡉⡉");
  EXPECT_EQ(CutTo("\x1b[1m▀▀▀", 1), "\x1b[1m▀\x1b[0m");
  EXPECT_EQ(CutTo("\x1b[1m▀\x1b[0m", 1), "\x1b[1m▀\x1b[0m");
}

TEST(LiveViewTest, AFrameFitsItsTerminal) {
  const Image image = GrayImage(640, 480);
  for (const int samples : {0, 1, 2, 24}) {
    for (int columns = 1; columns < 200; columns += 7) {
      for (int rows = 1; rows < 60; rows += 3) {
        for (const Image* shown : {static_cast<const Image*>(nullptr), &image}) {
          const auto lines = LiveLines(RunningJob(samples), shown, {columns, rows}, Charset::kUtf8);
          ASSERT_LE(lines.size(), static_cast<std::size_t>(std::max(1, rows - 1)));
          for (const std::string& line : lines)
            ASSERT_LE(ColumnsOf(line), columns) << columns << " × " << rows;
        }
      }
    }
  }
}

TEST(LiveViewTest, ShowsProgressErrorCurveAndImage) {
  const v1::Job job = RunningJob(24);
  const Image image = GrayImage(640, 480);
  const std::vector<std::string> lines = LiveLines(job, &image, {120, 40}, Charset::kUtf8);
  EXPECT_EQ(lines[0], ProgressLine(job));
  EXPECT_EQ(lines[1], ErrorLine(job));
  ASSERT_EQ(lines.size(), 16U);
  EXPECT_EQ(lines[2].find("  22.1 % "), 0U) << lines[2];
  EXPECT_NE(lines[2].find("▀"), std::string::npos);
  EXPECT_NE(lines[15].find("3:29"), std::string::npos) << lines[15];
  for (const std::string& line : LiveLines(job, nullptr, {120, 40}, Charset::kUtf8))
    EXPECT_EQ(line.find('\x1b'), std::string::npos) << "no colours without an image";
}

TEST(LiveViewTest, InAsciiNoByteIsBeyondIt) {
  const Image image = GrayImage(640, 480);
  v1::Job job = RunningJob(24);
  v1::LightFinding& light = *job.add_lights();
  light.set_name("grüne Kugel");
  light.set_photons_sent(1000);
  light.set_missing_share(0.003);
  job.mutable_convergence(job.convergence_size() - 1)->set_missing_relative(1);
  for (int columns = 20; columns < 200; columns += 7) {
    const auto lines = LiveLines(job, &image, {columns, 40}, Charset::kAscii);
    for (const std::string& line : lines) {
      ASSERT_TRUE(std::ranges::all_of(line, [](char c) { return c >= 0; })) << line;
      ASSERT_LE(ColumnsOf(line), columns);
    }
  }
  const auto lines = LiveLines(job, &image, {200, 40}, Charset::kAscii);
  const auto has = [&](const std::string& text) {
    return std::ranges::any_of(
        lines, [&](const std::string& line) { return line.find(text) != std::string::npos; });
  };
  EXPECT_TRUE(has("gr\\u{fc}ne Kugel"));
  EXPECT_TRUE(has("\x1b[48;2;188;188;188m  ")) << "the image";
  EXPECT_TRUE(has("---")) << "the target";
}

TEST(LiveViewTest, LongLinesBreakBetweenTheirParts) {
  const std::vector<std::string> lines =
      LiveLines(RunningJob(24), nullptr, {46, 40}, Charset::kUtf8);
  EXPECT_EQ(lines[0], "[####################] 100 %  pass 418");
  EXPECT_EQ(lines[2], "error about 2.96 % (95 %: 2.65 % to 3.38 %)");
  EXPECT_EQ(lines[3], "untrimmed 3.28 %  target 3.50 %");
}

TEST(FramePainterTest, FramesReplaceOneAnother) {
  FramePainter painter;
  EXPECT_EQ(painter.Paint({"ab", "cd"}, {80, 24}),
            "\x1b[?2026h\rab\x1b[K\r\ncd\x1b[K\x1b[J\x1b[?2026l");
  EXPECT_EQ(painter.Paint({"ab", "cd"}, {80, 24}), "") << "nothing new";
  EXPECT_EQ(painter.Paint({"ab", "x"}, {80, 24}),
            "\x1b[?2026h\r\x1b[1A\r\nx\x1b[K\x1b[J\x1b[?2026l")
      << "only what changed";
  EXPECT_EQ(painter.Paint({"a", "x"}, {80, 24}),
            "\x1b[?2026h\r\x1b[1Aa\x1b[K\r\nx\x1b[K\x1b[J\x1b[?2026l")
      << "and the last line, which would be cleared";
  EXPECT_EQ(painter.Paint({"e"}, {80, 24}), "\x1b[?2026h\r\x1b[1Ae\x1b[K\x1b[J\x1b[?2026l");
  EXPECT_EQ(painter.Paint({"e"}, {81, 24}), "\x1b[?2026h\re\x1b[K\x1b[J\x1b[?2026l")
      << "all, when the window has changed";
  EXPECT_EQ(painter.Paint({"f"}, {80, 24}), "\x1b[?2026h\rf\x1b[K\x1b[J\x1b[?2026l");
  EXPECT_EQ(painter.Finish(), "\n");
  EXPECT_EQ(painter.Finish(), "") << "only once";
}

TEST(FramePainterTest, ANarrowerWindowHasWrappedTheLastFrame) {
  FramePainter painter;
  EXPECT_FALSE(painter.Paint({"0123456789", "abc"}, {10, 24}).empty());
  // At four columns the ten letters are three rows, and the cursor stands in the fourth.
  EXPECT_EQ(painter.Paint({"0123"}, {4, 24}).substr(0, 13), "\x1b[?2026h\r\x1b[3A");
}

}  // namespace
}  // namespace lucerna
