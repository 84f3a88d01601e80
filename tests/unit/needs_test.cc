// A scene's plan: what one more feature turns on, and nothing else.
#include "render/scene/needs.h"

#include <set>
#include <string>

#include "gtest/gtest.h"

#include "render/scene/pbrt_parser.h"
#include "tests/support/memory_files.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

constexpr const char* kHead =
    "Film \"rgb\" \"integer xresolution\" [64] \"integer yresolution\" [64]\n";
constexpr const char* kCamera = "Camera \"perspective\" \"float fov\" [40]\n";
constexpr const char* kFloor =
    "Shape \"trianglemesh\" \"point3 P\" [-1 -1 4  1 -1 4  1 -1 6  -1 -1 6]\n"
    "  \"integer indices\" [0 1 2  0 2 3]\n";

Scene Parsed(const std::string& before_world, const std::string& world) {
  MemoryFiles files(
      {{"scene.pbrt", kHead + before_world +
                          "WorldBegin\nLightSource \"point\" \"point3 from\" [0 2 4]\n"
                          "Material \"diffuse\" \"rgb reflectance\" [.5 .5 .5]\n" +
                          kFloor + world}});
  ParsedScene parsed = ParsePbrt(files, "scene.pbrt");
  EXPECT_TRUE(parsed.ok()) << parsed.ToStatus();
  return parsed.scene;
}

SceneNeeds NeedsWith(const Scene& scene, const RenderOverrides& overrides = {}) {
  return NeedsOf(scene, ResolveSettings(overrides, scene).value());
}

std::set<std::string> Used(const SceneNeeds& needs) {
  std::set<std::string> used;
  for (const Part part : AllParts()) {
    EXPECT_FALSE(needs.ReasonOf(part).empty()) << NameOf(part);
    if (needs.Uses(part)) used.insert(std::string(NameOf(part)));
  }
  return used;
}

using Names = std::set<std::string>;

// With what every scene needs in which light is gathered.
Names WithAlways(Names names) {
  names.insert({"photons", "direct-sampling", "photon-normals", "robust-rays"});
  return names;
}

TEST(SceneNeedsTest, AFloorUnderAPointLightNeedsNextToNothing) {
  const SceneNeeds needs = NeedsWith(Parsed(kCamera, ""));
  EXPECT_EQ(Used(needs), (WithAlways({"delta-lights"})));
  EXPECT_EQ(needs.eye_sample_sets(), 64);
}

TEST(SceneNeedsTest, TheTreeIsThatOfTheTriangles) {
  Scene balls;
  AddSphere(balls, {0, 0, 4}, 1, AddMaterial(balls, DiffuseMaterial(0.5F)));
  SetCamera(balls, {0, 0, 0}, {0, 0, 1}, {0, 1, 0}, 40, 8);
  EXPECT_FALSE(NeedsWith(balls).Uses(Part::kRobustRays));
  EXPECT_FALSE(NeedsWith(balls).Uses(Part::kSplitTriangles));

  Scene many = balls;
  TriangleMesh mesh;
  mesh.positions = {{0, 0, 3}, {1, 0, 3}, {0, 1, 3}};
  for (int i = 0; i < 999; ++i)
    mesh.indices.insert(mesh.indices.end(), {0, 1, 2});
  many.meshes = {mesh};
  EXPECT_TRUE(NeedsWith(many).Uses(Part::kRobustRays));
  EXPECT_FALSE(NeedsWith(many).Uses(Part::kSplitTriangles));
  many.meshes[0].indices.insert(many.meshes[0].indices.end(), {0, 1, 2});
  EXPECT_TRUE(NeedsWith(many).Uses(Part::kSplitTriangles));
}

struct Feature {
  const char* name;
  const char* camera;
  const char* world;
  Names turned_on;
};

class FeatureTest : public testing::TestWithParam<Feature> {};

TEST_P(FeatureTest, TurnsOnOnlyWhatItNeeds) {
  Names expected = WithAlways(GetParam().turned_on);
  expected.insert("delta-lights");
  EXPECT_EQ(Used(NeedsWith(Parsed(GetParam().camera, GetParam().world))), expected);
}

INSTANTIATE_TEST_SUITE_P(
    Features, FeatureTest,
    testing::Values(
        Feature{
            "glass_sphere",
            kCamera,
            "Material \"dielectric\"\nTranslate 0 0 5\nShape \"sphere\" \"float radius\" [.3]\n",
            {"specular-surfaces", "round-shapes", "fresh-eye-paths"}},
        Feature{"diffuse_sphere",
                kCamera,
                "Translate 0 0 5\nShape \"sphere\" \"float radius\" [.3]\n",
                {"round-shapes"}},
        Feature{"texture",
                kCamera,
                "Texture \"squares\" \"spectrum\" \"checkerboard\"\n"
                "Material \"diffuse\" \"texture reflectance\" \"squares\"\n"
                "Shape \"trianglemesh\" \"point3 P\" [-1 0 4  1 0 4  1 0 6]\n",
                {"textures"}},
        Feature{"texture_on_nothing",
                kCamera,
                "Texture \"squares\" \"spectrum\" \"checkerboard\"\n"
                "Material \"diffuse\" \"texture reflectance\" \"squares\"\n",
                {}},
        Feature{"rough_metal",
                kCamera,
                "Material \"conductor\" \"float roughness\" [.4] \"bool remaproughness\" false\n"
                "Shape \"trianglemesh\" \"point3 P\" [-1 0 4  1 0 4  1 0 6]\n",
                {"glossy-hitpoints"}},
        Feature{"vertex_normals",
                kCamera,
                "Shape \"trianglemesh\" \"point3 P\" [-1 0 4  1 0 4  1 0 6]\n"
                "  \"normal N\" [0 1 0  0 1 0  0 1 0]\n",
                {"shading-normals"}},
        Feature{"sky", kCamera, "LightSource \"infinite\"\n", {"environment"}},
        Feature{"lamp",
                kCamera,
                "AreaLightSource \"diffuse\"\n"
                "Shape \"trianglemesh\" \"point3 P\" [-1 3 4  1 3 4  1 3 6]\n",
                {"area-lights"}},
        Feature{"lens",
                "Camera \"perspective\" \"float lensradius\" [.1] \"float focaldistance\" [5]\n",
                "",
                {"lens", "fresh-eye-paths"}}),
    [](const auto& test) { return std::string(test.param.name); });

TEST(SceneNeedsTest, FrequencyPhotonsBringOnlyTheirParts) {
  RenderOverrides overrides;
  overrides.radius_controller = RadiusControllerKind::kFrequencyMse;
  EXPECT_EQ(Used(NeedsWith(Parsed(kCamera, ""), overrides)),
            (WithAlways({"delta-lights", "frequency-photons", "occluder-edges"})));
  EXPECT_EQ(Used(NeedsWith(Parsed(kCamera, "Translate 0 0 5\nShape \"sphere\"\n"), overrides)),
            (WithAlways({"delta-lights", "frequency-photons", "occluder-edges", "curvature",
                         "round-shapes"})));
}

TEST(SceneNeedsTest, OnlyMirrorsNeedNoPhotons) {
  Scene scene = Parsed(kCamera, "");
  for (Material& material : scene.materials)
    material = ConductorMaterial({1, 1, 1}, {3, 3, 3}, 0, 0);
  EXPECT_FALSE(NeedsWith(scene).Uses(Part::kPhotons));
}

TEST(SceneNeedsTest, FacesOfLampsThatShineOnNothingAreCounted) {
  Scene scene = Parsed(kCamera, "");
  EXPECT_EQ(NeedsWith(scene).ReasonOf(Part::kLampsFacingAway),
            "every face of a lamp has something in front of it");
  const std::int32_t light = AddAreaLight(scene, 1);
  // Above the floor, facing up: two triangles; and one more quad facing down on it.
  AddQuad(scene, {-1, 2, 4}, {0, 0, 1}, {1, 0, 0}, 0, light);
  AddQuad(scene, {-1, 1.5F, 4}, {1, 0, 0}, {0, 0, 1}, 0, light);
  EXPECT_EQ(NeedsWith(scene).ReasonOf(Part::kLampsFacingAway),
            "faces of lamps that nothing lies in front of: 2");
}

TEST(SceneNeedsTest, SetsOfEyePathsMustFit) {
  const Scene scene = Parsed(kCamera, "");
  RenderOverrides overrides;
  overrides.width = 1920;
  overrides.height = 1080;
  EXPECT_EQ(NeedsWith(scene, overrides).eye_sample_sets(), 0);
  overrides = {};
  overrides.use_everything = true;
  EXPECT_EQ(NeedsWith(scene, overrides).eye_sample_sets(), 0);
}

TEST(EyeSetOfTest, SetsTakeTurnsAndAreRenewed) {
  EXPECT_EQ(EyeSetOf(123, 0), 123U);
  EXPECT_EQ(EyeSetOf(3, 64), 3U);
  EXPECT_EQ(EyeSetOf(64 + 3, 64), 3U);
  EXPECT_EQ(EyeSetOf(64 * kRoundsOfSets - 1, 64), 63U);
  EXPECT_EQ(EyeSetOf(64 * kRoundsOfSets, 64), 64U);
  // Even passes use even sets: the halves of a render stay independent.
  for (std::uint64_t pass = 0; pass < 5000; ++pass)
    EXPECT_EQ(EyeSetOf(pass, 64) % 2, pass % 2);
}

}  // namespace
}  // namespace lucerna
