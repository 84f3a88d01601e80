// A scene is read by the reader of its format, which the name or the first bytes of its main file
// tell; a file of no known format is refused in one sentence that names the formats.
#include "render/formats/read_scene.h"

#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

#include "tests/support/memory_files.h"

namespace lucerna {
namespace {

constexpr std::string_view kText = "# a comment\n\nCamera \"perspective\" WorldBegin\n";

ParsedScene ReadNamed(const std::string& name, const std::string& bytes) {
  std::map<std::string, std::string> named;
  named[name] = bytes;
  MemoryFiles files(std::move(named));
  return ReadScene(files, name);
}

TEST(ReadSceneTest, TheNameTellsTheFormat) {
  EXPECT_TRUE(ReadNamed("scene.pbrt", std::string(kText)).ok());
  // What is wrong with it is said by the format's own reader.
  EXPECT_THAT(std::string(ReadNamed("scene.pbrt", "<scene/>").ToStatus().message()),
              ::testing::HasSubstr("scene.pbrt:1:1: error: unknown directive"));
}

TEST(ReadSceneTest, WithoutAKnownNameTheFirstWordDoes) {
  EXPECT_TRUE(ReadNamed("scene.txt", std::string(kText)).ok());
  EXPECT_TRUE(ReadNamed("scene", std::string(kText)).ok());
}

TEST(ReadSceneTest, AFileOfNoKnownFormatIsRefused) {
  for (const std::string bytes : {"<scene version=\"3.0.0\"/>", "", "ply\nformat ascii 1.0\n",
                                  "# only a comment", "\"Camera\""}) {
    EXPECT_EQ(ReadNamed("scene.xml", bytes).ToStatus().message(),
              "scene.xml: error: this is no scene in a format that is read here; there is pbrt-v4 "
              "(.pbrt)")
        << bytes;
  }
}

TEST(ReadSceneTest, AFileThatIsNotThereIsMissing) {
  MemoryFiles none({});
  const ParsedScene parsed = ReadScene(none, "scene.xml");
  EXPECT_FALSE(parsed.ok());
  EXPECT_THAT(parsed.diagnostics.at(0).message, ::testing::Not(::testing::HasSubstr("format")));
}

}  // namespace
}  // namespace lucerna
