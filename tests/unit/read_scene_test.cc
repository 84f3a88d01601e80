// A scene is read by the reader of its format, which the name or the first bytes of its main file
// tell; a file of no known format is refused in one sentence that names the formats.
#include "render/formats/read_scene.h"

#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

#include "tests/support/gzip_text.h"
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
  for (const std::string bytes :
       {"{\"room\": 0}", "<room version=\"3.0.0\"/>", "", "# only a comment", "\"Camera\""}) {
    EXPECT_EQ(ReadNamed("scene.txt", bytes).ToStatus().message(),
              "scene.txt: error: this is no scene in a format that is read here; there are "
              "pbrt-v4 (.pbrt), glTF 2.0 (.gltf), binary glTF 2.0 (.glb), Mitsuba (.xml), "
              "a view of a scene (.view.json) and points to measure irradiance at (.ply)")
        << bytes;
  }
}

constexpr const char* kHead =
    "LookAt 0 0 5  0 0 0  0 1 0\nCamera \"perspective\"\nWorldBegin\nLightSource \"point\"\n";

// A program gets as many as it asks for.
TEST(ReadSceneTest, DiagnosticsAreKeptAsManyAsAreAskedFor) {
  std::string text = kHead;
  for (int i = 0; i < 250; ++i)
    text += "Directive" + std::to_string(i) + " 1 \"a\"\n";
  MemoryFiles files({{"s.pbrt", text}});
  EXPECT_EQ(ReadScene(files, "s.pbrt").diagnostics.size(), Diagnostics::kMaxOfEach);
  const ParsedScene all = ReadScene(files, "s.pbrt", {}, 1'000'000);
  ASSERT_EQ(all.diagnostics.size(), 250U);
  for (int i = 0; i < 250; ++i) {
    const Diagnostic& diagnostic = all.diagnostics[static_cast<std::size_t>(i)];
    EXPECT_EQ(diagnostic.line, 5 + i);
    EXPECT_EQ(diagnostic.message, "unknown directive \"Directive" + std::to_string(i) + "\"");
  }
}

TEST(ReadSceneTest, AMillionErrorsAreEnough) {
  std::string text = kHead;
  for (int i = 0; i < 1000; ++i)
    text += "Nothing\n";
  std::string main = kHead;
  for (int i = 0; i < 1100; ++i)
    main += "Include \"more.pbrt\"\n";
  MemoryFiles files({{"s.pbrt", main}, {"more.pbrt", text.substr(std::string(kHead).size())}});
  const ParsedScene parsed = ReadScene(files, "s.pbrt");
  ASSERT_EQ(parsed.diagnostics.size(), Diagnostics::kMaxOfEach);
  EXPECT_EQ(parsed.diagnostics.back().message, "and 999903 more errors")
      << "the one that is one too many, and the one that says so";
}

// A short text that is included often can name a billion of them.
TEST(ReadSceneTest, MaterialsTexturesAndLightsAreBounded) {
  SceneLimits limits;
  limits.max_shape_bytes = 1 << 20;
  for (const char* const directive :
       {"Material \"diffuse\"\n", "LightSource \"point\"\n",
        "LightSource \"infinite\" \"rgb L\" [0 0 0]\n",
        "AttributeBegin AreaLightSource \"diffuse\" Shape \"sphere\" AttributeEnd\n"}) {
    SCOPED_TRACE(directive);
    std::string more;
    for (int i = 0; i < 100; ++i)
      more += directive;
    std::string main = kHead;
    for (int i = 0; i < 1000; ++i)
      main += "Include \"more.pbrt\"\n";
    MemoryFiles files({{"s.pbrt", main}, {"more.pbrt", more}});
    const ParsedScene parsed = ReadScene(files, "s.pbrt", limits);
    ASSERT_FALSE(parsed.ok());
    EXPECT_THAT(parsed.diagnostics.front().message,
                ::testing::HasSubstr("bytes of memory that there are for them"));
  }
}

TEST(ReadSceneTest, AFileThatIsNotThereIsMissing) {
  MemoryFiles none({});
  const ParsedScene parsed = ReadScene(none, "scene.xml");
  EXPECT_FALSE(parsed.ok());
  EXPECT_THAT(parsed.diagnostics.at(0).message, ::testing::Not(::testing::HasSubstr("format")));
}

TEST(ReadSceneTest, AsManyErrorsAreKeptAsTheCallerTakes) {
  std::string text(kText);
  for (int i = 0; i < 150; ++i)
    text += "Unknown\n";
  MemoryFiles files({{"s.pbrt", text}});
  EXPECT_EQ(ReadScene(files, "s.pbrt").diagnostics.size(), 100U);
  EXPECT_EQ(ReadScene(files, "s.pbrt", {}, 1000).diagnostics.size(), 150U);
}

TEST(ReadSceneTest, TextsMayBePackedByGzip) {
  MemoryFiles files({{"scene.pbrt.gz", Gzip(std::string(kText) + "Include \"part.pbrt.gz\"")},
                     {"part.pbrt.gz", Gzip("Shape \"sphere\" Shape \"disk\"")},
                     {"cut.pbrt.gz", Gzip(std::string(kText)).substr(0, 30)},
                     {"bomb.pbrt.gz", Gzip(std::string(1 << 20, ' '))}});
  const ParsedScene scene = ReadScene(files, "scene.pbrt.gz");
  EXPECT_TRUE(scene.ok()) << scene.ToStatus();
  EXPECT_EQ(scene.scene.spheres.size(), 1U);
  EXPECT_EQ(scene.scene.disks.size(), 1U);
  EXPECT_THAT(std::string(ReadScene(files, "cut.pbrt.gz").ToStatus().message()),
              ::testing::HasSubstr("cut.pbrt.gz: its gzip stream is truncated"));
  EXPECT_THAT(std::string(ReadScene(files, "bomb.pbrt.gz").ToStatus().message()),
              ::testing::HasSubstr("unpacks to more than 200 times its size"));
  // What is unpacked counts against the limit.
  SceneLimits limits;
  limits.max_total_bytes = 200;
  const std::string many = Gzip(std::string(kText) + std::string(150, ' ') + kText.data());
  MemoryFiles large({{"s.pbrt", many}});
  EXPECT_LT(many.size(), 200U);
  EXPECT_THAT(std::string(ReadScene(large, "s.pbrt", limits).ToStatus().message()),
              ::testing::HasSubstr("the scene reads more than 200 bytes"));
}

}  // namespace
}  // namespace lucerna
