// The rooms of `lucerna selfcheck` must be sound pbrt-v4: a scene with a warning, or one that is
// black, would agree with any other that is.
#include "client/selfcheck/selfcheck_scenes.h"

#include "gtest/gtest.h"

#include "render/formats/read_scene.h"
#include "tests/support/memory_files.h"

namespace lucerna {
namespace {

ParsedScene Parse(const CheckRoom& room) {
  MemoryFiles files({{"room.pbrt", TextOf(room)}});
  return ReadScene(files, "room.pbrt");
}

TEST(SelfcheckScenesTest, EveryObjectAndLightParsesWithoutAWord) {
  for (int object = 0; object <= static_cast<int>(CheckRoom::Object::kSmoothMesh); ++object) {
    for (int light = 0; light <= static_cast<int>(CheckRoom::Light::kSky); ++light) {
      const CheckRoom room = {.object = static_cast<CheckRoom::Object>(object),
                              .light = static_cast<CheckRoom::Light>(light),
                              .has_texture = true,
                              .turns = {0, 2},
                              .triangle_splits = 1,
                              .is_reversed = true,
                              .has_halved_light = true};
      for (const Diagnostic& diagnostic : Parse(room).diagnostics)
        ADD_FAILURE() << NameOf(room) << ": " << diagnostic.ToString();
    }
  }
}

TEST(SelfcheckScenesTest, APowerOfTwoScalesEveryPositionExactly) {
  const CheckRoom room = {.object = CheckRoom::Object::kSmoothMesh};
  CheckRoom scaled = room;
  scaled.scale = 0x1p-20;
  const ParsedScene base = Parse(room);
  const ParsedScene other = Parse(scaled);
  ASSERT_TRUE(base.ok() && other.ok());
  ASSERT_EQ(base.scene.meshes.size(), other.scene.meshes.size());
  const auto unit = static_cast<float>(other.scene.unit);
  for (std::size_t mesh = 0; mesh < base.scene.meshes.size(); ++mesh) {
    const auto& positions = base.scene.meshes[mesh].positions;
    ASSERT_EQ(positions.size(), other.scene.meshes[mesh].positions.size());
    for (std::size_t i = 0; i < positions.size(); ++i)
      EXPECT_EQ(positions[i] * 0x1p-20F, other.scene.meshes[mesh].positions[i] * unit);
  }
}

}  // namespace
}  // namespace lucerna
