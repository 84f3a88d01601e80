// The scenes that this version promises to read are read without an error, those that need more
// say what they need, and the project's own scenes hold what their first lines say.
#include <algorithm>
#include <filesystem>
#include <string>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

#include "render/formats/read_scene.h"
#include "render/scene/render_settings.h"

namespace lucerna {
namespace {

ParsedScene ParseAt(const std::string& path) {
  const std::filesystem::path whole(path);
  DirectoryFiles files(whole.parent_path().string());
  return ReadScene(files, whole.filename().string());
}

ParsedScene ParseOwn(const std::string& name) {
  return ParseAt(std::string(LUCERNA_SOURCE_DIR) + "/tests/scenes/" + name);
}

class SharedScenesTest : public testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(folder_))
      GTEST_SKIP() << "the shared scenes are not beside the source folder";
  }
  ParsedScene Parse(const std::string& path) { return ParseAt(folder_ + path); }

  const std::string folder_ = std::string(LUCERNA_SOURCE_DIR) + "/../shared/scenes/";
};

TEST_F(SharedScenesTest, ReadsWhatIsPromised) {
  const struct {
    const char* path;
    std::size_t triangles, spheres, area_lights;
  } kExpected[] = {
      {"cornell-box/scene-v4.pbrt", 36, 0, 1},
      {"cornell-box-variants/cornell-box.pbrt", 32, 0, 1},
      {"cornell-box-variants/cornell-box-instance.pbrt", 12, 2, 1},
      {"cornell-box-variants/cornell-box-silver.pbrt", 32, 0, 1},
      {"cornell-box-variants/cornell-box-specular.pbrt", 22, 1, 1},
      {"cornell-box-variants/smallpt.pbrt", 10, 3, 1},
      {"water-caustic/scene-v4.pbrt", 103487, 0, 1},
      {"veach-bidir/scene-v4.pbrt", 11544, 0, 2},
      {"veach-mis/scene-v4.pbrt", 52, 3, 3},
      {"sphere-box/scene.pbrt", 12, 2, 1},
      {"sphere-caustic/scene.pbrt", 4, 1, 1},
      {"veach-ajar/scene-v4.pbrt", 382628, 0, 1},
  };
  for (const auto& expected : kExpected) {
    const ParsedScene parsed = Parse(expected.path);
    EXPECT_TRUE(parsed.ok()) << parsed.ToStatus();
    EXPECT_EQ(parsed.scene.TriangleCount(), expected.triangles) << expected.path;
    EXPECT_EQ(parsed.scene.spheres.size(), expected.spheres) << expected.path;
    EXPECT_EQ(parsed.scene.area_lights.size(), expected.area_lights) << expected.path;
    EXPECT_TRUE(ResolveSettings({}, parsed.scene).ok()) << expected.path;
  }
}

TEST_F(SharedScenesTest, LightsFaceTheRoom) {
  // The light under the ceiling of the Cornell box shines down.
  const Scene scene = Parse("cornell-box/scene-v4.pbrt").scene;
  for (const TriangleMesh& mesh : scene.meshes) {
    if (mesh.traits.area_light == kNoAreaLight) continue;
    const auto p = [&](std::size_t i) { return mesh.positions[mesh.indices[i]]; };
    EXPECT_LT(Normalize(Cross(p(1) - p(0), p(2) - p(0))).y, -0.99F);
  }
}

TEST_F(SharedScenesTest, ReadsThoseWithCoatsAndSheets) {
  for (const char* path :
       {"coffee/scene-v4.pbrt", "classroom/scene-v4.pbrt", "lamp/scene-v4.pbrt",
        "bedroom/scene-v4.pbrt", "material-testball/scene-v4.pbrt", "staircase2/scene-v4.pbrt"}) {
    EXPECT_TRUE(Parse(path).ok()) << path << ": " << Parse(path).ToStatus();
  }
}

TEST(OwnScenesTest, AllAreReadWithoutErrorsOrWarnings) {
  int count = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator(std::string(LUCERNA_SOURCE_DIR) + "/tests/scenes")) {
    if (!entry.is_regular_file()) continue;
    ++count;
    for (const Diagnostic& diagnostic : ParseAt(entry.path().string()).diagnostics) {
      EXPECT_EQ(diagnostic.severity, Diagnostic::Severity::kNote) << diagnostic.ToString();
    }
  }
  EXPECT_GE(count, 12);
}

// What a texture or a map names belongs to the scene, and is sent with it.
TEST(OwnScenesTest, PicturesAreOfTheScenesFiles) {
  DirectoryFiles files(std::string(LUCERNA_SOURCE_DIR) + "/tests/scenes");
  const Scene scene = ReadScene(files, "textured.pbrt").scene;
  const SceneManifest manifest = files.Manifest("textured.pbrt");
  EXPECT_EQ(manifest.entries.size(), 3U);
  EXPECT_TRUE(manifest.entries.contains("textures/bricks.png"));
  EXPECT_TRUE(manifest.entries.contains("textures/sky.pfm"));
  ASSERT_EQ(scene.infinite_lights.size(), 1U);
  EXPECT_EQ(scene.infinite_lights[0].map->At(9, 10), (Rgb{90, 75, 50}));
  // The corner of the bricks that tells up from down: red at the top left.
  const auto wall = static_cast<std::size_t>(scene.meshes.at(1).traits.material);
  const Rgb corner =
      TextureColor(scene.textures, scene.materials[wall].texture, {{0.05F, 0.95F}, {}, {}});
  EXPECT_GT(corner.r, 0.9F);
  EXPECT_LT(corner.g, 0.05F);
}

TEST(OwnScenesTest, BuffersAndImagesOfGltfAreOfTheScenesFiles) {
  DirectoryFiles files(std::string(LUCERNA_SOURCE_DIR) + "/tests/scenes");
  const ParsedScene parsed = ReadScene(files, "still-life.gltf");
  ASSERT_TRUE(parsed.ok()) << parsed.ToStatus();
  const SceneManifest manifest = files.Manifest("still-life.gltf");
  EXPECT_EQ(manifest.entries.size(), 3U);
  EXPECT_TRUE(manifest.entries.contains("meshes/still-life.bin"));
  EXPECT_TRUE(manifest.entries.contains("textures/bricks.png"));
  // The same from those files alone, as the coordinator and workers read them.
  ManifestFiles sent(manifest, [&](const Digest& digest) -> StatusOr<std::string> {
    for (const auto& [path, entry] : manifest.entries) {
      if (entry.digest == digest) return files.Read(path);
    }
    return absl::NotFoundError("no such file");
  });
  const ParsedScene again = ReadScene(sent, "still-life.gltf");
  ASSERT_TRUE(again.ok()) << again.ToStatus();
  EXPECT_EQ(again.scene.TriangleCount(), parsed.scene.TriangleCount());
  // Of nine nodes with meshes one has seven instances.
  EXPECT_EQ(parsed.scene.meshes.size(), 15U);
  EXPECT_EQ(parsed.scene.spot_lights.size(), 1U);
  EXPECT_EQ(parsed.scene.area_lights.size(), 1U);
  EXPECT_EQ(parsed.scene.media.size(), 1U);
}

TEST(OwnScenesTest, TheFurnaceEmitsInward) {
  const Scene scene = ParseOwn("furnace.pbrt").scene;
  ASSERT_EQ(scene.spheres.size(), 1U);
  EXPECT_TRUE(scene.spheres[0].inward);
  EXPECT_EQ(scene.area_lights.at(0).radiance, Gray(1));
  EXPECT_FALSE(scene.area_lights.at(0).two_sided);
}

TEST(OwnScenesTest, TheLightIsInsideItsGlass) {
  const Scene scene = ParseOwn("lamp-in-glass.pbrt").scene;
  ASSERT_EQ(scene.spheres.size(), 2U);
  EXPECT_EQ(scene.spheres[0].center, scene.spheres[1].center);
  EXPECT_GT(scene.spheres[0].radius, scene.spheres[1].radius);
  EXPECT_EQ(scene.spheres[1].traits.area_light, 0);
}

TEST(OwnScenesTest, MeshesOfTheScenesAreSmooth) {
  for (const char* name : {"water-sun.pbrt", "water-lamp.pbrt", "cardioid.pbrt"}) {
    const Scene scene = ParseOwn(name).scene;
    const auto smooth = std::find_if(scene.meshes.begin(), scene.meshes.end(),
                                     [](const TriangleMesh& m) { return !m.normals.empty(); });
    ASSERT_NE(smooth, scene.meshes.end()) << name;
    EXPECT_EQ(smooth->normals.size(), smooth->positions.size()) << name;
  }
}

TEST(OwnScenesTest, TheLocksAreHair) {
  const ParsedScene parsed = ParseOwn("locks.pbrt");
  ASSERT_TRUE(parsed.ok()) << parsed.ToStatus();
  EXPECT_GT(parsed.scene.curve_pieces.size(), 1000U);
  for (const CurvePiece& piece : parsed.scene.curve_pieces) {
    const Material& material =
        parsed.scene.materials[static_cast<std::size_t>(piece.traits.material)];
    ASSERT_EQ(material.kind, Material::Kind::kHair);
    ASSERT_FALSE(Gathers(material));
  }
}

TEST(OwnScenesTest, TheLightsOfTheShadowsAreHiddenFromTheFloor) {
  // In glass: the light is within the box that the fourth mesh is.
  const Scene penumbra = ParseOwn("penumbra.pbrt").scene;
  ASSERT_EQ(penumbra.meshes.size(), 4U);
  const TriangleMesh& light = penumbra.meshes[2];
  ASSERT_NE(light.traits.area_light, kNoAreaLight);
  EXPECT_LT(
      Cross(light.positions[1] - light.positions[0], light.positions[2] - light.positions[0]).z, 0);
  Bounds box;
  for (const Vec3 p : penumbra.meshes[3].positions)
    box.Add(p);
  for (const Vec3 p : light.positions) {
    EXPECT_GT(p.z, box.low.z);
    EXPECT_LT(p.z, box.high.z);
  }
  // Turned away.
  EXPECT_GT(ParseOwn("hard-shadow.pbrt").scene.spot_lights.at(0).direction.z, 0.99F);
}

TEST(OwnScenesTest, TheLightOfTheCausticFacesTheRing) {
  const Scene scene = ParseOwn("caustic.pbrt").scene;
  const TriangleMesh& light = scene.meshes.at(0);
  ASSERT_EQ(light.traits.area_light, 0);
  const auto p = [&](std::size_t i) { return light.positions[light.indices[i]]; };
  EXPECT_GT(Dot(Normalize(Cross(p(1) - p(0), p(2) - p(0))), Normalize(-p(0))), 0.9F);
}

}  // namespace
}  // namespace lucerna
