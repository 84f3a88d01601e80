// Are the scenes and images of several frames found as the command line names them?
#include "gtest/gtest.h"

#include "client/exit_code.h"
#include "client/frames.h"

namespace lucerna {
namespace {

std::string TextOf(const std::vector<SceneFrame>& frames) {
  std::string text;
  for (const SceneFrame& frame : frames)
    text += frame.scene + "=" + std::to_string(frame.number) + " ";
  return text;
}

TEST(FramesTest, NumbersReplaceTheLastRunOfSigns) {
  EXPECT_EQ(WithFrameNumber("out.####.exr", 7), "out.0007.exr");
  EXPECT_EQ(WithFrameNumber("####", 123), "0123");
  EXPECT_EQ(WithFrameNumber("a#b/c##.png", 5), "a#b/c05.png");
  EXPECT_EQ(WithFrameNumber("out.##.exr", 1234), "out.1234.exr") << "never cut off";
  EXPECT_EQ(WithFrameNumber("out.exr", 7), "out.exr");
}

TEST(FramesTest, ScenesAreNumberedByTheirNamesOrTheirPlaces) {
  EXPECT_EQ(TextOf(FramesOf({"a/room12.pbrt", "hall.pbrt", "x.0040.pbrt.gz", "7.glb"}, "").value()),
            "a/room12.pbrt=12 hall.pbrt=2 x.0040.pbrt.gz=40 7.glb=7 ");
}

TEST(FramesTest, RangesNameEachSceneOnceANumber) {
  EXPECT_EQ(TextOf(FramesOf({"r.##.pbrt"}, "8-10,3").value()),
            "r.08.pbrt=8 r.09.pbrt=9 r.10.pbrt=10 r.03.pbrt=3 ");
  EXPECT_EQ(TextOf(FramesOf({"a#.pbrt", "b#.pbrt"}, "1").value()), "a1.pbrt=1 b1.pbrt=1 ");
}

TEST(FramesTest, WhatNamesNoFramesIsWrongUsage) {
  for (const char* frames : {"x", "3-1", "1-", "-1", "1,,2", "1-99999999", "99999999999", "1.5"}) {
    const auto found = FramesOf({"r.#.pbrt"}, frames);
    EXPECT_EQ(ExitCodeOf(found.status()), ExitCode::kUsage) << frames;
  }
  EXPECT_EQ(ExitCodeOf(FramesOf({"r.pbrt"}, "1-3").status()), ExitCode::kUsage);
  EXPECT_EQ(ExitCodeOf(FramesOf({"r.#.pbrt"}, "").status()), ExitCode::kUsage);
}

}  // namespace
}  // namespace lucerna
