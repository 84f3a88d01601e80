// A scene's plan: what one more feature turns on, and nothing else.
#include "render/analysis/needs.h"

#include <cstdint>
#include <set>
#include <string>
#include <utility>

#include "gtest/gtest.h"

#include "render/formats/read_scene.h"
#include "tests/support/memory_files.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

constexpr const char* kHead =
    "Film \"rgb\" \"integer xresolution\" [64] \"integer yresolution\" [64]\n";
constexpr const char* kNarrowCamera = "Camera \"perspective\" \"float fov\" [40]\n";
constexpr const char* kFloor =
    "Shape \"trianglemesh\" \"point3 P\" [-1 -1 4  1 -1 4  1 -1 6  -1 -1 6]\n"
    "  \"integer indices\" [0 1 2  0 2 3]\n";

Scene Parsed(const std::string& before_world, const std::string& world) {
  MemoryFiles files(
      {{"scene.pbrt", kHead + before_world +
                          "WorldBegin\nLightSource \"point\" \"point3 from\" [0 2 4]\n"
                          "Material \"diffuse\" \"rgb reflectance\" [.5 .5 .5]\n" +
                          kFloor + world}});
  ParsedScene parsed = ReadScene(files, "scene.pbrt");
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
  names.insert({"photons", "direct-sampling", "robust-rays"});
  return names;
}

TEST(SceneNeedsTest, AFloorUnderAPointLightNeedsNextToNothing) {
  const SceneNeeds needs = NeedsWith(Parsed(kNarrowCamera, ""));
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
            kNarrowCamera,
            "Material \"dielectric\"\nTranslate 0 0 5\nShape \"sphere\" \"float radius\" [.3]\n",
            {"specular-surfaces", "round-shapes", "fresh-eye-paths"}},
        Feature{"diffuse_sphere",
                kNarrowCamera,
                "Translate 0 0 5\nShape \"sphere\" \"float radius\" [.3]\n",
                {"round-shapes", "photon-normals"}},
        Feature{"texture",
                kNarrowCamera,
                "Texture \"squares\" \"spectrum\" \"checkerboard\"\n"
                "Material \"diffuse\" \"texture reflectance\" \"squares\"\n"
                "Shape \"trianglemesh\" \"point3 P\" [-1 0 4  1 0 4  1 0 6]\n",
                {"textures", "photon-normals"}},
        Feature{"texture_on_nothing",
                kNarrowCamera,
                "Texture \"squares\" \"spectrum\" \"checkerboard\"\n"
                "Material \"diffuse\" \"texture reflectance\" \"squares\"\n",
                {}},
        Feature{"rough_metal",
                kNarrowCamera,
                "Material \"conductor\" \"float roughness\" [.4] \"bool remaproughness\" false\n"
                "Shape \"trianglemesh\" \"point3 P\" [-1 0 4  1 0 4  1 0 6]\n",
                {"glossy-hitpoints", "photon-directions", "photon-normals"}},
        Feature{"vertex_normals",
                kNarrowCamera,
                "Shape \"trianglemesh\" \"point3 P\" [-1 0 4  1 0 4  1 0 6]\n"
                "  \"normal N\" [0 1 0  0 1 0  0 .8 .6]\n",
                {"shading-normals", "photon-normals"}},
        Feature{"normals_of_flat_triangles",
                kNarrowCamera,
                "Shape \"trianglemesh\" \"point3 P\" [-1 0 4  1 0 4  1 0 6]\n"
                "  \"normal N\" [0 1 0  0 -1 0  2e-7 1 0]\n",
                {"photon-normals"}},
        Feature{"sky", kNarrowCamera, "LightSource \"infinite\"\n", {"environment"}},
        Feature{"light",
                kNarrowCamera,
                "AreaLightSource \"diffuse\"\n"
                "Shape \"trianglemesh\" \"point3 P\" [-1 3 4  1 3 4  1 3 6]\n",
                {"area-lights", "photon-normals"}},
        Feature{"lens",
                "Camera \"perspective\" \"float lensradius\" [.1] \"float focaldistance\" [5]\n",
                "",
                {"lens", "fresh-eye-paths"}}),
    [](const auto& test) { return std::string(test.param.name); });

TEST(SceneNeedsTest, FrequencyPhotonsBringOnlyTheirParts) {
  RenderOverrides overrides;
  overrides.radius_controller = RadiusControllerKind::kFrequencyMse;
  EXPECT_EQ(Used(NeedsWith(Parsed(kNarrowCamera, ""), overrides)),
            (WithAlways({"delta-lights", "frequency-photons", "occluder-edges"})));
  EXPECT_EQ(
      Used(NeedsWith(Parsed(kNarrowCamera, "Translate 0 0 5\nShape \"sphere\"\n"), overrides)),
      (WithAlways({"delta-lights", "frequency-photons", "occluder-edges", "curvature",
                   "round-shapes", "photon-normals"})));
  EXPECT_EQ(
      Used(NeedsWith(Parsed(kNarrowCamera,
                            "Material \"dielectric\"\nTranslate 0 0 5\n"
                            "Shape \"sphere\" \"float radius\" [.3]\n"),
                     overrides)),
      (WithAlways({"delta-lights", "frequency-photons", "occluder-edges", "curvature",
                   "curved-mirrors", "round-shapes", "specular-surfaces", "fresh-eye-paths"})));
}

TEST(SceneNeedsTest, OnlyMirrorsNeedNoPhotons) {
  Scene scene = Parsed(kNarrowCamera, "");
  for (Material& material : scene.materials)
    material = ConductorMaterial({1, 1, 1}, {3, 3, 3}, 0, 0);
  EXPECT_FALSE(NeedsWith(scene).Uses(Part::kPhotons));
}

TEST(SceneNeedsTest, FacesOfLightsThatShineOnNothingAreCounted) {
  Scene scene = Parsed(kNarrowCamera, "");
  EXPECT_EQ(NeedsWith(scene).ReasonOf(Part::kUnreachableLights),
            "every light may reach what the camera sees");
  const std::int32_t light = AddAreaLight(scene, 1);
  // Above the floor, facing up: two triangles; and one more quad facing down on it.
  AddQuad(scene, {-1, 2, 4}, {0, 0, 1}, {1, 0, 0}, 0, light);
  AddQuad(scene, {-1, 1.5F, 4}, {1, 0, 0}, {0, 0, 1}, 0, light);
  EXPECT_EQ(NeedsWith(scene).ReasonOf(Part::kUnreachableLights),
            "faces of lights that nothing lies in front of: 2");
}

// A floor seen from above keeps its photons to itself until something lies on its other side, or
// the camera does.
TEST(SceneNeedsTest, OneFloorNeedsNoNormalsOfPhotons) {
  const auto needs_normals = [](Scene scene) {
    return NeedsWith(scene).Uses(Part::kPhotonNormals);
  };
  const Scene floor = Parsed(kNarrowCamera, "");
  EXPECT_FALSE(needs_normals(floor));
  Scene with_glass = floor;
  const std::int32_t glass = AddMaterial(with_glass, DielectricMaterial(1.5F));
  AddSphere(with_glass, {0, -0.4F, 5}, 0.5F, glass);
  EXPECT_FALSE(needs_normals(with_glass));
  Scene sunk = with_glass;
  sunk.spheres[0].center.y = -0.8F;
  EXPECT_TRUE(needs_normals(sunk)) << "light could come from below";
  Scene from_below = floor;
  SetCamera(from_below, {0, -3, 0}, {0, -1, 5}, {0, 1, 0}, 40, 8);
  EXPECT_FALSE(needs_normals(from_below)) << "then that is the front";
  SetCamera(from_below, {0, -1, 0}, {0, -1, 5}, {0, 1, 0}, 40, 8);
  EXPECT_TRUE(needs_normals(from_below)) << "the camera lies in the floor";
  Scene with_lens = floor;
  with_lens.camera.lens_radius = 0.5;
  EXPECT_FALSE(needs_normals(with_lens));
  with_lens.camera.lens_radius = 2;
  EXPECT_TRUE(needs_normals(with_lens)) << "the lens reaches under the floor";
  Scene tilted = floor;
  AddDisk(tilted, {0, -1, 5}, {0, 0.99995F, 0.01F}, 0.5F, 0);
  EXPECT_TRUE(needs_normals(tilted));
  Scene flat = floor;
  AddDisk(flat, {3, -1, 5}, {0, -1, 0}, 0.5F, 0);
  EXPECT_FALSE(needs_normals(flat));
}

// A light behind closed walls sends nothing, and one inside glass is not sampled.
TEST(SceneNeedsTest, LightsThatAreSeparatedOrEnclosedAreLeftOut) {
  Scene scene = Parsed(kNarrowCamera, "");
  AddBox(scene, {5, 0, 5}, {7, 2, 7}, 0);
  const std::int32_t light = AddAreaLight(scene, 1);
  AddSphere(scene, {6, 1, 6}, 0.2F, 0, light);
  const SceneNeeds hidden = NeedsWith(scene);
  EXPECT_FALSE(hidden.Uses(Part::kUnreachableLights));
  EXPECT_EQ(hidden.ReasonOf(Part::kUnreachableLights),
            "lights that opaque closed geometry separates from the view: 1");
  const LightNumbers numbers(scene);
  EXPECT_EQ(hidden.unreachable_lights().of_photons, std::vector<std::uint32_t>{numbers.spheres});
  EXPECT_FALSE(hidden.Uses(Part::kAreaLights));
  EXPECT_EQ(hidden.ReasonOf(Part::kAreaLights),
            "opaque closed geometry separates these lights from the view");
  EXPECT_TRUE(hidden.Uses(Part::kDirectSampling)) << "of the point light";

  Scene in_glass = scene;
  in_glass.meshes.pop_back();
  in_glass.point_lights.clear();
  const std::int32_t glass = AddMaterial(in_glass, DielectricMaterial(1.5F));
  AddSphere(in_glass, {6, 1, 6}, 0.5F, glass);
  const SceneNeeds enclosed = NeedsWith(in_glass);
  EXPECT_TRUE(enclosed.unreachable_lights().of_photons.empty());
  EXPECT_FALSE(enclosed.Uses(Part::kDirectSampling));
  EXPECT_EQ(enclosed.ReasonOf(Part::kDirectSampling),
            "smooth surfaces enclose every light: all light comes by photons");

  Scene dark = scene;
  dark.point_lights.clear();
  EXPECT_FALSE(NeedsWith(dark).Uses(Part::kPhotons));
  EXPECT_FALSE(NeedsWith(dark).Uses(Part::kDirectSampling));
  EXPECT_EQ(NeedsWith(dark).ReasonOf(Part::kPhotons), "no light reaches what the camera can see");

  RenderOverrides overrides;
  overrides.use_everything = true;
  EXPECT_TRUE(NeedsWith(dark, overrides).Uses(Part::kPhotons));
  const SceneNeeds forced = NeedsWith(scene, overrides);
  EXPECT_TRUE(forced.Uses(Part::kUnreachableLights));
  EXPECT_TRUE(forced.unreachable_lights().of_photons.empty());
  EXPECT_TRUE(NeedsWith(in_glass, overrides).Uses(Part::kDirectSampling));
}

// What has been built, and the scene only does not ask for, can be forced on.
TEST(SceneNeedsTest, EverythingIsAllThatCanBeForced) {
  RenderOverrides overrides;
  overrides.use_everything = true;
  overrides.radius_controller = RadiusControllerKind::kFrequencyMse;
  Names left_out;
  const SceneNeeds needs = NeedsWith(Parsed(kNarrowCamera, ""), overrides);
  for (const Part part : AllParts()) {
    if (!needs.Uses(part)) left_out.insert(std::string(NameOf(part)));
  }
  EXPECT_EQ(left_out,
            (Names{"round-shapes", "environment", "area-lights", "lens", "motion", "media",
                   "alpha-masks", "instances", "caustic-hitpoints", "dispersion", "spectra"}));
}

TEST(SceneNeedsTest, CausticPhotonsAreForNarrowSurfacesBehindSmoothOnes) {
  const std::string narrow =
      "Material \"conductor\" \"float roughness\" [.1] \"bool remaproughness\" [false]\n";
  const std::string wide =
      "Material \"conductor\" \"float roughness\" [.3] \"bool remaproughness\" [false]\n";
  const std::string glass = "Material \"dielectric\"\n";
  const auto uses = [&](const std::string& world) {
    return NeedsWith(Parsed(kNarrowCamera, world)).Uses(Part::kCausticHitpoints);
  };
  EXPECT_TRUE(uses(narrow + kFloor + glass + kFloor));
  EXPECT_FALSE(uses(wide + kFloor + glass + kFloor));
  EXPECT_FALSE(uses(narrow + kFloor));
  EXPECT_FALSE(uses(glass + kFloor));
}

// Every eye path finds the same light from all around, and hardly one a small light.
TEST(SceneNeedsTest, CausticPhotonsAreForLightsThatRaysMissOrFindByChance) {
  Scene scene;
  AddQuad(scene, {0, 0, 4}, {1, 0, 0}, {0, 1, 0},
          AddMaterial(scene, ConductorMaterial(Gray(0.2F), Gray(3), 0.1F, 0.1F)));
  AddQuad(scene, {0, 0, 3}, {1, 0, 0}, {0, 1, 0}, AddMaterial(scene, DielectricMaterial(1.5F, 0)));
  scene.infinite_lights.push_back({Gray(1)});
  SetCamera(scene, {0, 0, 0}, {0, 0, 1}, {0, 1, 0}, 40, 8);
  const auto uses = [](const Scene& lit) { return NeedsWith(lit).Uses(Part::kCausticHitpoints); };
  EXPECT_FALSE(uses(scene));
  Scene with_area = scene;
  AddQuad(with_area, {0, 0, -2}, {1, 0, 0}, {0, 1, 0}, AddMaterial(with_area, DiffuseMaterial(0)),
          AddAreaLight(with_area, 0.5F, true));
  EXPECT_TRUE(uses(with_area));
  Scene with_sun = scene;
  with_sun.distant_lights.push_back({{0, 0, 1}, Gray(1e-3F)});
  EXPECT_TRUE(uses(with_sun));
  // Where no surface gathers the other photons, these are all there are.
  EXPECT_TRUE(NeedsWith(with_sun).Uses(Part::kPhotons));
}

TEST(SceneNeedsTest, SetsOfEyePathsMustFit) {
  const Scene scene = Parsed(kNarrowCamera, "");
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
  EXPECT_EQ(EyeSetOf(64 + 3, 64), 1U);
  EXPECT_EQ(EyeSetOf(64 * kRoundsOfSets - 1, 64), 33U);
  EXPECT_EQ(EyeSetOf(64 * kRoundsOfSets, 64), 64U);
  // Even passes use even sets: the halves of a render stay independent.
  for (std::uint64_t pass = 0; pass < 5000; ++pass)
    EXPECT_EQ(EyeSetOf(pass, 64) % 2, pass % 2);
}

// The photons of a pass are a part of a sequence in which every 64th part is alike in its first
// digits: a set must not meet those alone.
TEST(EyeSetOfTest, ASetMeetsOtherPartsOfTheLightEachTime) {
  std::set<std::pair<std::uint64_t, std::uint64_t>> met;  // sets and passes within 64
  for (std::uint64_t pass = 0; pass < 64 * kRoundsOfSets; ++pass) {
    EXPECT_LT(EyeSetOf(pass, 64), 64U);
    met.emplace(EyeSetOf(pass, 64), pass % 64);
  }
  EXPECT_EQ(met.size(), 64 * kRoundsOfSets);
}

}  // namespace
}  // namespace lucerna
