// When memory runs out while a scene is read, that is an error of the scene with a sentence.
//
// Every allocation of the reading of a small scene is made to fail, one after the other.
#include <map>
#include <string>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

#include "render/formats/read_scene.h"
#include "tests/memory/failing_allocations.h"
#include "tests/support/memory_files.h"

namespace lucerna {
namespace {

constexpr const char* kScene = R"(
LookAt 0 -3 1  0 0 0  0 0 1
Camera "perspective" "float fov" [50]
WorldBegin
LightSource "point" "point3 from" [0 0 2]
Texture "t" "spectrum" "constant" "rgb value" [0.5 0.5 0.5]
MakeNamedMaterial "m" "string type" "diffuse" "texture reflectance" "t"
ObjectBegin "o"
NamedMaterial "m"
Shape "trianglemesh" "point3 P" [-2 -2 0  2 -2 0  2 2 0] "integer indices" [0 1 2]
ObjectEnd
ObjectInstance "o"
Shape "sphere" "float nosuch" 1
)";

TEST(SceneReadingMemoryTest, EachAllocationMayFail) {
  int failures = 0;
  int refused = 0;
  for (bool has_failed = true; has_failed; ++failures) {
    SCOPED_TRACE(failures);
    MemoryFiles files(std::map<std::string, std::string>{{"scene.pbrt", kScene}});
    const std::string name = "scene.pbrt";
    allocations_left = failures;
    const ParsedScene parsed = ReadScene(files, name);
    has_failed = allocations_left == kNever;
    allocations_left = kNever;
    ASSERT_EQ(parsed.diagnostics.size(), 1U);
    // The standard library's sort does without its buffer: then the scene is as ever.
    if (parsed.ok()) {
      EXPECT_THAT(parsed.diagnostics[0].message, testing::HasSubstr("nosuch"));
      EXPECT_EQ(parsed.scene.meshes.size(), 1U);
      continue;
    }
    ++refused;
    EXPECT_TRUE(has_failed);
    EXPECT_THAT(parsed.diagnostics[0].message, testing::HasSubstr("more memory than there is"));
    EXPECT_TRUE(parsed.scene.meshes.empty());
  }
  EXPECT_GT(refused, 100) << "reading allocates";
}

}  // namespace
}  // namespace lucerna
