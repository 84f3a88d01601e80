// Textures of numbers, mixes, bumps and masks, as pbrt-v4 texts give them.
#include <cmath>
#include <cstring>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

#include "render/analysis/needs.h"
#include "render/formats/read_scene.h"
#include "render/geometry/intersector.h"
#include "render/math/color_space.h"
#include "render/scene/noise.h"
#include "render/scene/render_settings.h"
#include "render/scene/saturated_colors.h"
#include "render/scene/subsurface_table.h"
#include "render/transport/material_at.h"
#include "render/transport/working_space.h"
#include "tests/support/pbrt_text.h"

namespace lucerna {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

// Of numbers, in a row.
std::string Pfm(const std::vector<float>& values, int channels = 1) {
  std::string bytes = channels == 1 ? "Pf\n" : "PF\n";
  bytes += std::to_string(values.size() / static_cast<std::size_t>(channels)) + " 1\n-1\n";
  for (const float value : values) {
    char raw[4];
    std::memcpy(raw, &value, 4);
    bytes.append(raw, 4);
  }
  return bytes;
}

// The material of the first sphere, where a ray meets it that comes along -y.
Material MetOnSphere(const Scene& rec709, Vec3 from = {0.3F, -5, 0.4F}) {
  const Scene scene = InWorkingSpace(rec709);
  const std::unique_ptr<Intersector> intersector = Intersector::Create(scene).value();
  const Ray ray = {from, {0, 1, 0}, HUGE_VALF};
  Hit hit;
  EXPECT_TRUE(intersector->Intersect(ray, hit));
  SurfacePoint point = intersector->SurfaceAt(ray, hit);
  std::optional<Material> storage;
  return MaterialAt(scene, point, -ray.direction, storage);
}

constexpr const char* kPlanar =
    "Texture \"r\" \"float\" \"bilerp\" \"string mapping\" \"planar\" \"vector3 v1\" [1 0 0] "
    "\"vector3 v2\" [0 0 1] \"float v00\" 0 \"float v01\" 0.5 \"float v10\" 1 \"float v11\" 1.5\n";

TEST(PbrtMaterialsTest, RoughnessIsLookedUpBeforeItIsRemapped) {
  const std::string dielectric = "Material \"dielectric\" \"texture roughness\" \"r\" ";
  const Material remapped = MetOnSphere(ReadWorld(kPlanar + dielectric + "Shape \"sphere\""));
  // At x = 0.3, z = 0.4: 0.3 + 0.5 * 0.4.
  EXPECT_NEAR(remapped.alpha_u, std::sqrt(0.5F), 1e-5F);
  EXPECT_EQ(remapped.alpha_u, remapped.alpha_v);
  const Material plain = MetOnSphere(
      ReadWorld(kPlanar + dielectric + "\"bool remaproughness\" false Shape \"sphere\""));
  EXPECT_NEAR(plain.alpha_u, 0.5F, 1e-5F);
  const Material stretched = MetOnSphere(
      ReadWorld(std::string(kPlanar) + "Material \"conductor\" \"texture uroughness\" \"r\" "
                                       "\"float vroughness\" 0.04 Shape \"sphere\""));
  EXPECT_NEAR(stretched.alpha_u, std::sqrt(0.5F), 1e-5F);
  EXPECT_NEAR(stretched.alpha_v, 0.2F, 1e-6F);
}

// A texture in space stays where it is when the scene's unit is chosen.
TEST(PbrtMaterialsTest, TexturesInSpaceKeepTheirPlaceInAnyUnit) {
  const Scene scene =
      ReadWorld("Scale 1e9 1e9 1e9 " + std::string(kPlanar) +
                "Material \"dielectric\" \"texture roughness\" \"r\" Shape \"sphere\"");
  ASSERT_NE(scene.unit, 1);
  const auto size = static_cast<float>(1e9 / scene.unit);
  EXPECT_NEAR(MetOnSphere(scene, Vec3{0.3F, -5, 0.4F} * size).alpha_u, std::sqrt(0.5F), 1e-5F);
}

// What holds for the material as a whole follows from the smallest and the largest number.
TEST(PbrtMaterialsTest, ATextureOfRoughnessDecidesByItsRange) {
  const std::string picture =
      "Texture \"r\" \"float\" \"imagemap\" \"string filename\" \"r.pfm\"\n"
      "Material \"conductor\" \"texture roughness\" \"r\" Shape \"sphere\"";
  const Material patchy = ReadWorld(picture, {{"r.pfm", Pfm({0, 0.25F})}}).materials[1];
  EXPECT_EQ(patchy.alpha_u, 0.5F);
  EXPECT_FALSE(IsSmooth(patchy));
  EXPECT_TRUE(ScattersSmoothly(patchy));
  EXPECT_TRUE(GathersCaustics(patchy));
  const Material rough = ReadWorld(picture, {{"r.pfm", Pfm({0.09F, 0.25F})}}).materials[1];
  EXPECT_FALSE(ScattersSmoothly(rough));
  EXPECT_FALSE(Gathers(rough));
  // A picture of one number is that number: nothing is looked up.
  const Scene even = ReadWorld(picture, {{"r.pfm", Pfm({0.25F, 0.25F})}});
  EXPECT_FALSE(even.materials[1].DependsOnPlace());
  EXPECT_EQ(even.materials[1].alpha_u, 0.5F);
  EXPECT_TRUE(Gathers(even.materials[1]));
}

TEST(PbrtMaterialsTest, ACoatIsFittedToItsRoughness) {
  const Scene textured =
      ReadWorld(std::string(kPlanar) +
                "Texture \"small\" \"float\" \"scale\" \"texture tex\" \"r\" \"float scale\" 0.32\n"
                "Material \"coateddiffuse\" \"texture roughness\" \"small\" Shape \"sphere\"");
  const Material here = MetOnSphere(textured);
  EXPECT_NEAR(here.alpha_u, 0.4F, 1e-5F);
  ASSERT_NE(here.coat, nullptr);
  EXPECT_NE(here.coat_above, nullptr);
}

// Along u and v each a texture of its own, of the metal or of its coat.
TEST(PbrtMaterialsTest, ACoatedMetalMayHaveATextureForEachWidth) {
  const std::string textures =
      std::string(kPlanar) +
      "Texture \"u\" \"float\" \"scale\" \"texture tex\" \"r\" \"float scale\" 0.32\n"
      "Texture \"v\" \"float\" \"scale\" \"texture tex\" \"r\" \"float scale\" 0.08\n";
  for (const std::string part : {"conductor", "interface"}) {
    const Material here = MetOnSphere(ReadWorld(
        textures + "Material \"coatedconductor\" \"texture " + part +
        ".uroughness\" \"u\" \"texture " + part + ".vroughness\" \"v\" Shape \"sphere\""));
    const bool is_base = part == "conductor";
    // Roots of half of the scales.
    EXPECT_NEAR(is_base ? here.base_alpha_u : here.alpha_u, 0.4F, 1e-5F);
    EXPECT_NEAR(is_base ? here.base_alpha_v : here.alpha_v, 0.2F, 1e-5F);
    EXPECT_NE(here.coat, nullptr);
    EXPECT_NE(here.coat_above, nullptr);
  }
}

constexpr const char* kTwo =
    "MakeNamedMaterial \"a\" \"string type\" \"diffuse\" \"rgb reflectance\" [0.25 0.25 0.25]\n"
    "MakeNamedMaterial \"b\" \"string type\" \"conductor\" \"float roughness\" 0.01\n";

// Shares of rays that meet the first, the second and the third of materials by their kinds.
std::map<Material::Kind, double> SharesOf(const Scene& rec709) {
  const Scene scene = InWorkingSpace(rec709);
  const std::unique_ptr<Intersector> intersector = Intersector::Create(scene).value();
  std::map<Material::Kind, double> shares;
  constexpr int kRays = 10000;
  for (int i = 0; i < kRays; ++i) {
    const Ray ray = {{-0.5F + static_cast<float>(i) / kRays, -5, 0.1F}, {0, 1, 0}, HUGE_VALF};
    Hit hit;
    EXPECT_TRUE(intersector->Intersect(ray, hit));
    SurfacePoint point = intersector->SurfaceAt(ray, hit);
    SurfacePoint again = point;
    std::optional<Material> storage;
    const Material& chosen = MaterialAt(scene, point, -ray.direction, storage);
    EXPECT_EQ(&chosen, &scene.materials[point.material]);
    EXPECT_EQ(&chosen, &MaterialAt(scene, again, -ray.direction, storage));
    shares[chosen.kind] += 1.0 / kRays;
  }
  return shares;
}

// Five standard errors of 10,000 draws: 0.025.
TEST(PbrtMaterialsTest, AMixIsOneOfItsMaterialsForEachRay) {
  const Scene scene = ReadWorld(std::string(kTwo) +
                                "Material \"mix\" \"string materials\" [ \"a\" \"b\" ] "
                                "\"float amount\" 0.3 Shape \"sphere\"");
  const auto shares = SharesOf(scene);
  EXPECT_NEAR(shares.at(Material::Kind::kDiffuse), 0.7, 0.025);
  EXPECT_NEAR(shares.at(Material::Kind::kConductor), 0.3, 0.025);
  const auto mix = static_cast<std::size_t>(scene.spheres[0].traits.material);
  const MaterialProperties properties = PropertiesOf(scene.materials[mix]);
  EXPECT_TRUE(properties.gathers);
  EXPECT_TRUE(properties.gathers_caustics());
  EXPECT_FALSE(properties.is_smooth);
  EXPECT_TRUE(properties.needs_choice());
}

// Deposits of a mix are not weighed by one of its materials: each hitpoint does that by its own.
TEST(PbrtMaterialsTest, MaterialsOfAMixDoNotWeighPhotons) {
  const Scene scene =
      ReadWorld(std::string(kTwo) +
                "MakeNamedMaterial \"c\" \"string type\" \"coateddiffuse\"\n"
                "Material \"mix\" \"string materials\" [ \"a\" \"c\" ] Shape \"sphere\"\n"
                "NamedMaterial \"c\" Shape \"sphere\"");
  const auto properties_of = [&](std::int32_t material, Parts part) {
    MaterialNumbers numbers = scene.materials[static_cast<std::size_t>(material)];
    numbers.parts = part;
    return PropertiesOf(numbers);
  };
  const std::int32_t mix = scene.spheres[0].traits.material;
  EXPECT_FALSE(properties_of(mix, Parts::kAll).weighs_photons);
  const std::int32_t coat = scene.materials[static_cast<std::size_t>(mix)].mixed[1];
  EXPECT_FALSE(properties_of(coat, Parts::kAll).weighs_photons);
  EXPECT_FALSE(properties_of(coat, Parts::kSecond).is_separable);
  EXPECT_TRUE(properties_of(coat, Parts::kSecond).gathers);
  // The material itself, outside of a mix, is as it was.
  const std::int32_t own = scene.spheres[1].traits.material;
  EXPECT_NE(own, coat);
  EXPECT_TRUE(properties_of(own, Parts::kAll).weighs_photons);
  EXPECT_TRUE(properties_of(own, Parts::kSecond).is_separable);
}

TEST(PbrtMaterialsTest, MixesOfMixesMultiplyTheirShares) {
  const auto shares = SharesOf(ReadWorld(
      std::string(kTwo) +
      "MakeNamedMaterial \"c\" \"string type\" \"mix\" \"string materials\" [ \"a\" \"b\" ]\n"
      "MakeNamedMaterial \"d\" \"string type\" \"dielectric\"\n"
      "Material \"mix\" \"string materials\" [ \"c\" \"d\" ] \"float amount\" 0.2 "
      "Shape \"sphere\""));
  EXPECT_NEAR(shares.at(Material::Kind::kDiffuse), 0.4, 0.025);
  EXPECT_NEAR(shares.at(Material::Kind::kConductor), 0.4, 0.025);
  EXPECT_NEAR(shares.at(Material::Kind::kDielectric), 0.2, 0.025);
}

TEST(PbrtMaterialsTest, AMixFollowsATexture) {
  const auto shares = SharesOf(
      ReadWorld(std::string(kTwo) + kPlanar +
                "Material \"mix\" \"string materials\" [ \"a\" \"b\" ] \"texture amount\" \"r\" "
                "Shape \"sphere\""));
  // x + z / 2 over x from -0.5 to 0.5 at z = 0.1, held at 0.
  EXPECT_NEAR(shares.at(Material::Kind::kConductor), 0.55 * 0.55 / 2, 0.025);
}

TEST(PbrtMaterialsTest, MaterialsOfAMixAreInUse) {
  const Scene scene = ReadWorld(std::string(kTwo) +
                                "Material \"mix\" \"string materials\" [ \"a\" \"b\" ] Shape "
                                "\"sphere\" LightSource \"point\"");
  const SceneNeeds needs = NeedsOf(scene, RenderSettings());
  EXPECT_TRUE(needs.Uses(Part::kSpecular));
  EXPECT_TRUE(needs.Uses(Part::kTextures));
  EXPECT_TRUE(needs.Uses(Part::kPhotons));
  EXPECT_TRUE(needs.Uses(Part::kFreshEyePaths));
}

TEST(PbrtMaterialsTest, SaysWhatIsWrongWithAMix) {
  const std::string two(kTwo);
  EXPECT_THAT(SaidOfWorld("Material \"mix\""), HasSubstr("needs \"string materials\""));
  EXPECT_THAT(SaidOfWorld(two + "Material \"mix\" \"string materials\" [ \"a\" ]"),
              HasSubstr("must be the names of two materials"));
  EXPECT_THAT(SaidOfWorld(two + "MakeNamedMaterial \"c\" \"string type\" \"mix\" "
                                "\"string materials\" [ \"a\" \"c\" ]"),
              HasSubstr("refers to the material \"c\", which is not defined before it"));
  EXPECT_THAT(SaidOfWorld(two + "MakeNamedMaterial \"i\" \"string type\" \"interface\" "
                                "Material \"mix\" \"string materials\" [ \"a\" \"i\" ]"),
              HasSubstr("cannot be part of a mix"));
}

TEST(PbrtMaterialsTest, BumpsAndNormalMapsAreRead) {
  const Scene scene = ReadWorld(
      "Texture \"h\" \"float\" \"imagemap\" \"string filename\" \"h.pfm\" \"float scale\" -2\n"
      "Texture \"e\" \"float\" \"constant\" \"float value\" 3\n"
      "Material \"diffuse\" \"texture displacement\" \"h\" Shape \"sphere\"\n"
      "Material \"diffuse\" \"texture displacement\" \"e\" Shape \"sphere\"\n"
      "Material \"diffuse\" \"texture displacement\" \"h\" \"string normalmap\" \"n.pfm\" "
      "Shape \"sphere\"",
      {{"h.pfm", Pfm({-1, 1, 0, 0, 0})}, {"n.pfm", Pfm({0.5F, 0.5F, 1}, 3)}});
  const Material& bumpy = scene.materials[1];
  ASSERT_NE(bumpy.displacement, kNoTexture);
  EXPECT_FLOAT_EQ(TextureNumber(scene.textures, bumpy.displacement, {{0.1F, 0.5F}, {}, {}}), 2);
  EXPECT_GT(bumpy.slope_step.x, 0);
  EXPECT_FALSE(scene.materials[2].HasBumps());
  // The map counts, as in pbrt-v4.
  EXPECT_EQ(scene.materials[3].displacement, kNoTexture);
  EXPECT_NE(scene.materials[3].normal_map, kNoTexture);
  const SceneNeeds needs = NeedsOf(scene, RenderSettings());
  EXPECT_TRUE(needs.Uses(Part::kShadingNormals));
  EXPECT_THAT(SaidOfWorld("Material \"diffuse\" \"string normalmap\" \"none.png\""),
              HasSubstr("\"normalmap\" of Material \"diffuse\" cannot be read"));
  // The same everywhere is none.
  EXPECT_EQ(ReadWorld("Material \"diffuse\" \"float displacement\" 1 Shape \"sphere\"")
                .materials[1]
                .displacement,
            kNoTexture);
}

TEST(PbrtMaterialsTest, AColourAsAnIndexIsItsMean) {
  const std::string glass = "Material \"dielectric\" \"rgb eta\" ";
  EXPECT_FLOAT_EQ(ReadWorld(glass + "[1.25 1.5 1.75] Shape \"sphere\"").materials[1].ior, 1.5F);
  EXPECT_THAT(SaidOfWorld(glass + "[1.25 1.5 1.75]"),
              HasSubstr("warning: \"eta\" of Material \"dielectric\" is read as its mean, 1.5"));
  EXPECT_THAT(SaidOfWorld(glass + "[1.5 1.5 1.5]"), Not(HasSubstr("\"eta\"")));
  EXPECT_THAT(SaidOfWorld(glass + "[-1 -1 -1]"), HasSubstr("error: \"eta\""));
}

TEST(PbrtMaterialsTest, AParameterWithAnErrorIsNotUnknownToo) {
  const std::string textures = "Texture \"t\" \"spectrum\" \"constant\" ";
  for (const char* const material :
       {"\"subsurface\" \"rgb reflectance\" [.5 .5 .5] \"texture mfp\" \"t\"",
        "\"subsurface\" \"rgb sigma_a\" [1 1 1] \"texture sigma_s\" \"t\"",
        "\"coateddiffuse\" \"texture albedo\" \"t\""}) {
    const std::string said = SaidOfWorld(textures + "Material " + material);
    EXPECT_THAT(said, HasSubstr("must not be a texture"));
    EXPECT_THAT(said, Not(HasSubstr("unknown parameter")));
  }
}

TEST(PbrtMaterialsTest, OpacityOfAPictureIsItsNumber) {
  // PFM has none: the mean of the channels.
  const Scene scene = ReadWorld(
      "Texture \"m\" \"float\" \"imagemap\" \"string filename\" \"m.pfm\"\n"
      "Material \"conductor\" \"texture roughness\" \"m\" Shape \"sphere\"",
      {{"m.pfm", Pfm({0.3F, 0.6F, 0.9F, 0, 0, 0}, 3)}});
  EXPECT_FLOAT_EQ(scene.materials[1].alpha_u, std::sqrt(0.6F));
}

// Of rays through a mask, as many meet it as its texture says there.
TEST(PbrtMaterialsTest, AlphaMayBeATextureOnAnyShape) {
  const std::string textures =
      "Texture \"half\" \"float\" \"checkerboard\" \"float tex1\" 0.25 \"float tex2\" 1 "
      "\"string mapping\" \"planar\" \"vector3 v1\" [1 0 0] \"vector3 v2\" [0 0 0]\n";
  const std::string triangles =
      "Shape \"trianglemesh\" \"point3 P\" [-1 0 -1 1 0 -1 1 0 1 -1 0 1] "
      "\"integer indices\" [0 1 2 0 2 3] \"texture alpha\" \"half\"\n";
  const std::string instanced =
      "ObjectBegin \"o\" " + triangles + "ObjectEnd ObjectInstance \"o\"\n";
  for (const std::string& shape :
       {triangles, instanced, std::string("Shape \"sphere\" \"texture alpha\" \"half\"\n"),
        std::string("Rotate 90 1 0 0 Shape \"disk\" \"texture alpha\" \"half\"\n")}) {
    SCOPED_TRACE(shape);
    const Scene scene = ReadWorld(textures + shape);
    const std::unique_ptr<Intersector> intersector = Intersector::Create(scene).value();
    int met_left = 0;
    int met_right = 0;
    constexpr int kRays = 4000;
    for (int i = 0; i < kRays; ++i) {
      const float x = (static_cast<float>(i) + 0.5F) / kRays * 0.8F;
      for (const float side : {-1.0F, 1.0F}) {
        const Ray ray = {{side * x, -5, 0.01F}, {0, 1, 0}, HUGE_VALF};
        Hit hit;
        const bool is_met = intersector->Intersect(ray, hit) && hit.t < 5.1F;
        // The back of a sphere may be met where the front is not.
        if (scene.spheres.empty()) {
          EXPECT_EQ(intersector->Occluded(ray), is_met);
        }
        (side < 0 ? met_left : met_right) += is_met ? 1 : 0;
      }
    }
    // Left of x = 0 the square is odd. Five standard errors of 4,000 draws: 0.035.
    EXPECT_EQ(met_left, kRays);
    EXPECT_NEAR(met_right / static_cast<double>(kRays), 0.25, 0.035);
    EXPECT_FALSE(IsWhole(scene.meshes.empty() ? scene.spheres.empty() ? scene.disks[0].traits
                                                                      : scene.spheres[0].traits
                                              : scene.meshes[0].traits));
  }
}

// As in pbrt-v4: alpha 0 hides an emitter from rays alone, alpha below 0 its light, too.
TEST(PbrtMaterialsTest, AnEmitterWithAlphaBelowZeroEmitsNothing) {
  const std::string light = "AreaLightSource \"diffuse\" \"rgb L\" [1 1 1] ";
  const std::string texture =
      "Texture \"low\" \"float\" \"mix\" \"float amount\" 0.9 \"float tex1\" 0.5 "
      "\"float tex2\" -0.1 ";
  EXPECT_EQ(ReadWorld(light + "Shape \"sphere\" \"float alpha\" 0").spheres.size(), 1U);
  for (const std::string& shape :
       {light + "Shape \"sphere\" \"float alpha\" -0.01",
        texture + light + "Shape \"sphere\" \"texture alpha\" \"low\""}) {
    SCOPED_TRACE(shape);
    EXPECT_TRUE(ReadWorld(shape).spheres.empty());
    EXPECT_THAT(SaidOfWorld(shape), HasSubstr("is below 0 everywhere: it emits no light"));
  }
}

// What pbrt-v4 holds within a range is held, and said.
TEST(PbrtMaterialsTest, RoughnessOfHairIsHeldAtOne) {
  const std::string hair =
      "Material \"hair\" \"float beta_m\" 1.5 Shape \"curve\" \"point3 P\" [0 0 0 1 0 0 2 0 0 3 0 "
      "0]";
  EXPECT_EQ(ReadWorld(hair).materials.back().beta_m, 1);
  EXPECT_THAT(SaidOfWorld(hair), HasSubstr("\"hair\" is 1.5 and is held at 1"));
}

// Files of curves have any name, and a default of Attribute may be one.
TEST(PbrtMaterialsTest, CurvesOfFilesHaveAnyNameAndMayBeDefaults) {
  const std::map<std::string, std::string> files = {{"half.txt", "400 0.5 700 0.5\n"}};
  for (const std::string world :
       {"Material \"diffuse\" \"spectrum reflectance\" \"half.txt\" Shape \"sphere\"",
        "Attribute \"material\" \"spectrum reflectance\" \"half.txt\" "
        "Material \"diffuse\" Shape \"sphere\""}) {
    EXPECT_NEAR(ReadWorld(world, files).materials.back().reflectance.g, 0.5F, 1e-3F) << world;
  }
}

// What no shape has takes no part: a saturated metal does not make a job carry wavelengths, and no
// tables are made of coats. Parts of mixes on shapes stay.
TEST(PbrtMaterialsTest, MaterialsThatNoShapeHasAreDropped) {
  const Scene scene = ReadWorld(
      "MakeNamedMaterial \"gold\" \"string type\" \"conductor\" "
      "\"spectrum eta\" \"metal-Au-eta\" \"spectrum k\" \"metal-Au-k\" "
      "MakeNamedMaterial \"coat\" \"string type\" \"coateddiffuse\" "
      "MakeNamedMaterial \"part\" \"string type\" \"coateddiffuse\" \"float roughness\" 0.3 "
      "MakeNamedMaterial \"white\" \"string type\" \"diffuse\" "
      "MakeNamedMaterial \"mix\" \"string type\" \"mix\" "
      "\"string materials\" [\"part\" \"white\"] NamedMaterial \"mix\" Shape \"sphere\"");
  std::map<std::string, Material::Kind> kinds;
  for (const Material& material : scene.materials)
    kinds[material.name] = material.kind;
  EXPECT_EQ(kinds.at("gold"), Material::Kind::kDiffuse);
  EXPECT_EQ(kinds.at("coat"), Material::Kind::kDiffuse);
  EXPECT_EQ(kinds.at("part"), Material::Kind::kCoatedDiffuse);
  EXPECT_EQ(kinds.at("mix"), Material::Kind::kMix);
  EXPECT_FALSE(HasSaturatedColors(scene));
}

// A small file cannot keep a coordinator and its workers busy with tables for hours.
TEST(PbrtMaterialsTest, TooManyDifferentCoatsAreAnError) {
  const auto world = [](int coats, bool differ) {
    std::string text;
    for (int i = 0; i < coats; ++i) {
      text +=
          "Material \"coatedconductor\" \"bool remaproughness\" false "
          "\"float interface.roughness\" " +
          std::to_string(differ ? 0.1 + 1e-4 * i : 0.1) + " Shape \"sphere\"\n";
    }
    return text;
  };
  EXPECT_THAT(SaidOfWorld(world(600, true)), HasSubstr("error: the tables of so many different"));
  // Of coats that let little out again, light meets the metal a thousand times.
  std::string dense;
  for (int i = 0; i < 12; ++i) {
    dense +=
        "Material \"coatedconductor\" \"float interface.roughness\" 0 \"float "
        "conductor.roughness\" " +
        std::to_string(0.01 + 0.001 * i) +
        " \"float interface.eta\" 100 \"float thickness\" 0 \"integer maxdepth\" 1000000 Shape "
        "\"sphere\"\n";
  }
  EXPECT_THAT(SaidOfWorld(dense), HasSubstr("error: the tables of so many different"));
  EXPECT_THAT(SaidOfWorld(world(400, true)), Not(HasSubstr("error")));
  EXPECT_THAT(SaidOfWorld(world(400, true)), Not(HasSubstr("error")));
  EXPECT_THAT(SaidOfWorld(world(600, false)), Not(HasSubstr("error")));
}

// What a float texture that is declared by `text` as "t" is at a place.
float NumberOf(const std::string& text, const TexturePlace& place) {
  const Scene scene =
      ReadWorld(text + "\nMaterial \"conductor\" \"texture roughness\" \"t\" Shape \"sphere\"");
  const std::int32_t texture = scene.materials.at(1).roughness_textures[0];
  EXPECT_NE(texture, kNoTexture);
  return texture == kNoTexture ? 0 : TextureNumber(scene.textures, texture, place);
}

TEST(PbrtMaterialsTest, KindsOfTexturesAreReadAsPbrtHasThem) {
  const Vec3 p = {0.3F, 1.2F, -0.7F};
  const TexturePlace place = {{0.25F, 0.75F}, p, {0, 0, 1}};
  // The direction is in the space of the texture: y becomes z.
  EXPECT_FLOAT_EQ(NumberOf("Rotate 90 1 0 0 Texture \"t\" \"float\" \"directionmix\" "
                           "\"float tex1\" 0.2 \"float tex2\" 0.7",
                           place),
                  0.2F);
  EXPECT_FLOAT_EQ(
      NumberOf("Scale 0.5 0.5 0.5 Texture \"t\" \"float\" \"fbm\" \"integer octaves\" 3 "
               "\"float roughness\" 0.25",
               place),
      FbmAt(p * 2, 0.25F, 3));
  EXPECT_FLOAT_EQ(NumberOf("Translate 1 0 0 Texture \"t\" \"float\" \"wrinkled\"", place),
                  TurbulenceAt(p - Vec3{1, 0, 0}, 0.5F, 8));
  EXPECT_FLOAT_EQ(NumberOf("Texture \"t\" \"float\" \"windy\"", place),
                  std::abs(FbmAt(p * 0.1F, 0.5F, 3)) * FbmAt(p, 0.5F, 6));
  const std::string cubes =
      "Texture \"t\" \"float\" \"checkerboard\" \"integer dimension\" 3 \"float tex1\" 0.1 "
      "\"float tex2\" 0.9";
  EXPECT_FLOAT_EQ(NumberOf(cubes, place), 0.1F);  // cube (0, 1, -1)
  EXPECT_FLOAT_EQ(NumberOf("Translate 0 0 0.5 " + cubes, place), 0.9F);
}

TEST(PbrtMaterialsTest, DotsShowWhatPbrtShowsInThem) {
  // Around whole numbers where noise is above 0 there is a dot, whose middle is at most 0.15 off.
  float column = 0;
  while (!(NoiseAt({column + 0.5F, 0.5F, 0.5F}) > 0))
    ++column;
  EXPECT_FLOAT_EQ(
      NumberOf("Texture \"t\" \"float\" \"dots\" \"float inside\" 0.7 \"float outside\" 0.2",
               {{column, 0}, {}, {}}),
      0.2F);
}

TEST(PbrtMaterialsTest, MixesOfConstantsAreConstants) {
  const Scene scene = ReadWorld(
      "Texture \"t\" \"float\" \"mix\" \"float tex2\" 0.5 \"float amount\" 0.5\n"
      "Material \"conductor\" \"texture roughness\" \"t\" Shape \"sphere\"");
  EXPECT_FALSE(scene.materials[1].DependsOnPlace());
  EXPECT_FLOAT_EQ(scene.materials[1].alpha_u, 0.5F);
}

TEST(PbrtMaterialsTest, TexturesOfAKindThatGivesOnlyOneOfTheTwoAreRefused) {
  EXPECT_THAT(SaidOfWorld("Texture \"t\" \"spectrum\" \"fbm\"\n"
                          "Material \"diffuse\" \"texture reflectance\" \"t\""),
              HasSubstr("gives numbers only"));
  EXPECT_THAT(SaidOfWorld("Texture \"t\" \"float\" \"marble\"\n"
                          "Material \"conductor\" \"texture roughness\" \"t\""),
              HasSubstr("gives colours only"));
}

// Two textures of the one before each: 2^n lookups.
TEST(PbrtMaterialsTest, TexturesThatDoubleAreRefused) {
  std::string text = "Texture \"t0\" \"float\" \"wrinkled\"\n";
  for (int i = 1; i < 20; ++i) {
    const std::string before = "\"t" + std::to_string(i - 1) + "\"";
    text += "Texture \"t" + std::to_string(i) + "\" \"float\" \"mix\" \"texture tex1\" " + before +
            " \"texture tex2\" " + before + "\n";
  }
  EXPECT_THAT(SaidOfWorld(text), HasSubstr("is made of more than 1024 textures"));
}

constexpr const char* kCurve =
    " Shape \"curve\" \"point3 P\" [0 0 0 0 0 1 0 0 2 0 0 3] \"float width\" 0.1\n";

// The material of the first curve.
Material OnCurve(const std::string& world, std::map<std::string, std::string> others = {}) {
  const Scene scene = ReadWorld(world + kCurve, std::move(others));
  EXPECT_FALSE(scene.curve_pieces.empty());
  return scene.materials[static_cast<std::size_t>(scene.curve_pieces[0].traits.material)];
}

TEST(PbrtMaterialsTest, ReadsHair) {
  const Material plain = OnCurve("Material \"hair\"");
  EXPECT_EQ(plain.kind, Material::Kind::kHair);
  EXPECT_TRUE(plain.is_on_thin_shapes);
  EXPECT_EQ(plain.ior, 1.55F);
  EXPECT_EQ(plain.beta_m, 0.3F);
  EXPECT_EQ(plain.beta_n, 0.3F);
  EXPECT_NEAR(plain.scale_tilt, 0.0349066F, 1e-6F);
  // 1.3 of eumelanin.
  EXPECT_NEAR(plain.absorption.r, 1.3F * 0.419F, 1e-6F);
  EXPECT_NEAR(plain.absorption.g, 1.3F * 0.697F, 1e-6F);
  EXPECT_NEAR(plain.absorption.b, 1.3F * 1.37F, 1e-6F);
  const Material other = OnCurve(
      "Material \"hair\" \"float beta_m\" 0.2 \"float beta_n\" 0.001 \"float alpha\" 0 \"float "
      "eta\" "
      "1.4 \"float eumelanin\" 0.5 \"float pheomelanin\" 2");
  EXPECT_EQ(other.beta_m, 0.2F);
  EXPECT_EQ(other.beta_n, 0.01F);  // as smooth as pbrt-v4 makes it
  EXPECT_EQ(other.scale_tilt, 0);
  EXPECT_EQ(other.ior, 1.4F);
  EXPECT_NEAR(other.absorption.g, 0.5F * 0.697F + 2 * 0.4F, 1e-6F);
  // One melanin alone: nothing of the other.
  EXPECT_NEAR(OnCurve("Material \"hair\" \"float pheomelanin\" 1").absorption.r, 0.187F, 1e-6F);
}

// sigma_a before reflectance before melanin; what is left out is named.
TEST(PbrtMaterialsTest, HairHasTheColourThatIsGivenFirst) {
  const std::string all =
      "Material \"hair\" \"float eumelanin\" 9 \"rgb reflectance\" [0.5 0.25 0.125] ";
  const Material by_absorption = OnCurve(all + "\"rgb sigma_a\" [1 2 3]");
  EXPECT_FALSE(by_absorption.absorbs_for_reflectance);
  EXPECT_EQ(by_absorption.absorption, (Rgb{1, 2, 3}));
  EXPECT_THAT(SaidOfWorld(all + "\"rgb sigma_a\" [1 2 3]" + kCurve),
              HasSubstr("because sigma_a is given"));
  EXPECT_THAT(SaidOfWorld(all + kCurve), HasSubstr("because reflectance is given"));
  EXPECT_THAT(SaidOfWorld(all + kCurve), Not(HasSubstr("unknown parameter")));
  EXPECT_THAT(SaidOfWorld("Material \"hair\" \"rgb color\" [1 1 1] \"float pheomelanin\" 1" +
                          std::string(kCurve)),
              HasSubstr("because color is given"));
  // The absorption belongs to the reflectance in the space that light is multiplied in.
  const Scene scene = InWorkingSpace(ReadWorld(all + kCurve));
  const Material& material =
      scene.materials[static_cast<std::size_t>(scene.curve_pieces[0].traits.material)];
  const Rgb back = HairReflectance(material.absorption, material.beta_n);
  const Rgb expected = ToWorking({0.5F, 0.25F, 0.125F});
  for (int c = 0; c < 3; ++c)
    EXPECT_NEAR(back[c], expected[c], 1e-5F);
}

TEST(PbrtMaterialsTest, HairTakesTexturesOfColour) {
  const std::string texture =
      "Texture \"c\" \"spectrum\" \"checkerboard\" \"rgb tex1\" [0.2 0.4 0.8] "
      "\"rgb tex2\" [0.2 0.4 0.8]\n";
  for (const std::string name : {"sigma_a", "reflectance"}) {
    Scene scene = ReadWorld(texture + "Material \"hair\" \"texture " + name + "\" \"c\"" + kCurve);
    scene = InWorkingSpace(scene);
    const std::unique_ptr<Intersector> intersector = Intersector::Create(scene).value();
    const float size = scene.unit == 1 ? 1 : static_cast<float>(1 / scene.unit);
    const Ray ray = {Vec3{0, -5, 0.5F} * size, {0, 1, 0}, HUGE_VALF};
    Hit hit;
    ASSERT_TRUE(intersector->Intersect(ray, hit));
    SurfacePoint point = intersector->SurfaceAt(ray, hit);
    std::optional<Material> storage;
    const Material& here = MaterialAt(scene, point, -ray.direction, storage);
    const Rgb color = ToWorking({0.2F, 0.4F, 0.8F});
    if (name == "sigma_a") {
      EXPECT_EQ(here.absorption, color);
    } else {
      EXPECT_EQ(here.absorption, HairAbsorption(color, 0.3F));
    }
  }
}

TEST(PbrtMaterialsTest, SaysWhatHairCannotBe) {
  const auto said = [](const std::string& parameters, const std::string& shape) {
    return SaidOfWorld(std::string(kPlanar) + "Material \"hair\" " + parameters + shape);
  };
  EXPECT_THAT(said("", "Shape \"sphere\""), HasSubstr("for curves of type flat or cylinder alone"));
  EXPECT_THAT(said("",
                   "Shape \"curve\" \"string type\" \"ribbon\" \"point3 P\" [0 0 0 0 0 1 0 0 2 0 0 "
                   "3] \"normal N\" [1 0 0 1 0 0]"),
              HasSubstr("for curves of type flat or cylinder alone"));
  EXPECT_THAT(
      SaidOfWorld(
          "MakeNamedMaterial \"h\" \"string type\" \"hair\" MakeNamedMaterial \"d\" \"string "
          "type\" \"diffuse\" Material \"mix\" \"string materials\" [\"d\" \"h\"] Shape \"disk\""),
      HasSubstr("for curves of type flat or cylinder alone"));
  EXPECT_THAT(said("\"texture beta_m\" \"r\"", kCurve),
              HasSubstr("must not be a texture that varies"));
  EXPECT_THAT(said("\"float beta_n\" 1.5", kCurve), HasSubstr("\"beta_n\""));
  EXPECT_THAT(said("\"rgb sigma_a\" [-1 0 0]", kCurve), HasSubstr("\"sigma_a\""));
  EXPECT_THAT(said("\"texture displacement\" \"r\"", kCurve),
              HasSubstr("is ignored, as by pbrt-v4"));
  EXPECT_THAT(said("", kCurve), Not(HasSubstr("hair")));
}

// Named glasses and curves disperse where they are smooth dielectrics; else it is said that they do
// not.
TEST(PbrtMaterialsTest, ReadsSubsurface) {
  const auto read = [](const std::string& parameters) {
    const Scene scene =
        InWorkingSpace(ReadWorld("Material \"subsurface\" " + parameters + " Shape \"sphere\""));
    return scene.materials[static_cast<std::size_t>(scene.spheres[0].traits.material)];
  };
  const Material of_colour = read(
      "\"rgb reflectance\" [0.5 0.5 0.5] \"float mfp\" 0.25 \"float scale\" 2 \"float g\" 0.3");
  EXPECT_EQ(of_colour.kind, Material::Kind::kSubsurface);
  EXPECT_NEAR(of_colour.reflectance.g, 0.5F, 1e-6F);
  EXPECT_NEAR(of_colour.extinction.r, 2.0F, 1e-5F);
  EXPECT_EQ(of_colour.ior, 1.33F);
  EXPECT_EQ(of_colour.phase_g, 0.3F);
  EXPECT_TRUE(PropertiesOf(of_colour).gathers);
  // The reflectance follows from the coefficients, and gives them back.
  const Material of_coefficients = read(
      "\"float sigma_a\" 0.1 \"float sigma_s\" 1.9 \"float eta\" 1.5 \"float roughness\" 0.04");
  EXPECT_NEAR(of_coefficients.extinction.g, 2, 1e-5F);
  EXPECT_NEAR(of_coefficients.reflectance.g, of_coefficients.below->ReflectanceOf(0.95F), 1e-6F);
  EXPECT_NEAR(of_coefficients.alpha_u, 0.2F, 1e-6F);
  // By default, and by name: whole milk.
  const Material milk = read("");
  EXPECT_GT(milk.reflectance.r, milk.reflectance.b);
  EXPECT_EQ(read("\"string name\" \"Wholemilk\"").reflectance, milk.reflectance);
  EXPECT_NE(read("\"string name\" \"Ketchup\"").reflectance, milk.reflectance);
  EXPECT_NEAR(read("\"float scale\" 3").extinction.g, 3 * milk.extinction.g, 1e-4F);
  // More of the sun's light is absorbed by espresso than by milk.
  EXPECT_LT(read("\"string name\" \"Espresso\"").reflectance.g,
            0.1F * read("\"string name\" \"Regular Milk\"").reflectance.g);
}

// A surface that is smooth at some places and rough at others, with what each lets through.
TEST(PbrtMaterialsTest, RoughnessOfSubsurfaceMayBeATexture) {
  const Scene scene = InWorkingSpace(ReadWorld(
      "Texture \"r\" \"float\" \"checkerboard\" \"float tex1\" 0 \"float tex2\" 0.25 \"float "
      "uscale\" 2 Material \"subsurface\" \"texture roughness\" \"r\" Shape \"sphere\""));
  const Material& material =
      scene.materials[static_cast<std::size_t>(scene.spheres[0].traits.material)];
  EXPECT_TRUE(material.may_be_smooth);
  EXPECT_TRUE(PropertiesOf(material).scatters_smoothly);
  EXPECT_TRUE(PropertiesOf(material).has_rough_coat);
  ASSERT_NE(material.coats, nullptr);
  const Material rough =
      ReadWorld("Material \"subsurface\" \"float roughness\" 0.25 Shape \"sphere\"")
          .materials.back();
  EXPECT_EQ(material.alpha_u, rough.alpha_u);
}

// Lengths below surfaces are lengths as others are.
TEST(PbrtMaterialsTest, SubsurfaceIsTheSameInAnyUnit) {
  const Scene scene = ReadWorld(
      "Scale 1e9 1e9 1e9 Material \"subsurface\" \"rgb reflectance\" [0.5 0.5 0.5] "
      "\"float mfp\" 1e8 Shape \"sphere\"");
  ASSERT_NE(scene.unit, 1);
  const auto& sphere = scene.spheres[0];
  const Material& material = scene.materials[static_cast<std::size_t>(sphere.traits.material)];
  EXPECT_NEAR(material.extinction.g * sphere.radius, 10, 1e-4F);
}

// The number in the material is the largest that the texture gives, and a place has its own.
TEST(PbrtMaterialsTest, ThicknessOfCoatsMayBeATexture) {
  const std::string texture =
      "Texture \"t\" \"float\" \"checkerboard\" \"float tex1\" 0.5 \"float tex2\" -1 \"float "
      "uscale\" "
      "2 ";
  for (const std::string kind : {"coateddiffuse", "coatedconductor"}) {
    const std::string rough = kind == "coateddiffuse" ? "\"texture roughness\" \"t\""
                                                      : "\"texture conductor.roughness\" \"t\"";
    const std::string world = texture + "Material \"" + kind + "\" \"texture thickness\" \"t\" ";
    const Scene scene = InWorkingSpace(ReadWorld(world + "Shape \"sphere\""));
    const Material& material =
        scene.materials[static_cast<std::size_t>(scene.spheres[0].traits.material)];
    EXPECT_EQ(material.thickness, 0.5F);
    EXPECT_TRUE(material.DependsOnPlace());
    SurfacePoint point;
    point.material = static_cast<std::uint32_t>(scene.spheres[0].traits.material);
    point.geometry = GeometryOf(scene, ShapeKind::kSphere);
    std::set<float> found;
    for (int i = 0; i < 32; ++i) {
      point.position = Vec3{std::cos(0.2F * static_cast<float>(i)),
                            std::sin(0.2F * static_cast<float>(i)), 0.1F};
      point.geometric_normal = point.shading_normal = Normalize(point.position);
      std::optional<Material> storage;
      const Material& here = MaterialAt(scene, point, {0, 0, 1}, storage);
      found.insert(here.thickness);
      // What a hitpoint carries makes the same of the material.
      Material again = material;
      SetNumbers(again, NumbersOf(here));
      EXPECT_EQ(again.thickness, here.thickness);
      EXPECT_EQ(again.coat, here.coat);
      EXPECT_EQ(again.coat_above_share, here.coat_above_share);
    }
    EXPECT_THAT(found, ElementsAre(0, 0.5F));
    EXPECT_THAT(SaidOfWorld(world + rough + " Shape \"sphere\""),
                HasSubstr("cannot both be textures"));
  }
  // In rendering threads the largest would be 0.
  EXPECT_EQ(ReadWorld("Texture \"c\" \"float\" \"checkerboard\" \"float tex1\" 0 \"float tex2\" "
                      "1e-40 Material \"coateddiffuse\" \"texture thickness\" \"c\" Shape "
                      "\"sphere\"")
                .materials.back()
                .thickness_texture,
            kNoTexture);
  EXPECT_EQ(ReadWorld("Texture \"c\" \"float\" \"constant\" \"float value\" 0.25 Material "
                      "\"coateddiffuse\" \"texture thickness\" \"c\" Shape \"sphere\"")
                .materials.back()
                .thickness,
            0.25F);
}

TEST(PbrtMaterialsTest, SaysWhatIsWrongWithSubsurface) {
  const auto said = [](const std::string& parameters) {
    return SaidOfWorld("Material \"subsurface\" " + parameters + " Shape \"sphere\"");
  };
  EXPECT_THAT(said("\"string name\" \"Honey\""), HasSubstr("not known; there are Apple, "));
  EXPECT_THAT(said("\"float sigma_a\" 1"), HasSubstr("must be given together"));
  EXPECT_THAT(said("\"string name\" \"Marble\" \"float sigma_a\" 1"),
              HasSubstr("must not be given beside name"));
  EXPECT_THAT(said("\"float eta\" 0.8"), HasSubstr("eta"));
  EXPECT_THAT(said("\"float g\" 1"), HasSubstr("g"));
  EXPECT_THAT(said("\"rgb reflectance\" [1 1 1] \"float mfp\" 0"), HasSubstr("mfp"));
  EXPECT_THAT(said("\"rgb reflectance\" [1 1 1] \"float mfp\" 1e-39"), HasSubstr("mfp"));
  EXPECT_THAT(said("\"rgb sigma_a\" [1 1 1] \"rgb sigma_s\" [1 1 1] \"rgb reflectance\" [1 1 1]"),
              HasSubstr("is ignored, as by pbrt-v4, because coefficients are given"));
}

TEST(PbrtMaterialsTest, GlassDispersesWhereItIsSmooth) {
  const auto glass = [](const std::string& parameters) {
    return ReadWorld("Material \"dielectric\" " + parameters + " Shape \"sphere\"")
        .materials.back();
  };
  const auto said = [](const std::string& material) {
    return SaidOfWorld("Material " + material + " Shape \"sphere\"");
  };
  const Material flint = glass("\"spectrum eta\" \"glass-F11\"");
  EXPECT_TRUE(flint.Disperses());
  EXPECT_EQ(flint.ior, 1.78472F);
  EXPECT_THAT(said("\"dielectric\" \"spectrum eta\" \"glass-F11\""), Not(HasSubstr("index")));
  // Between 400 and 700 nm by a straight line, of which Cauchy's equation keeps all but a
  // thousandth.
  const Material curve = glass("\"spectrum eta\" [400 1.52 700 1.5]");
  ASSERT_TRUE(curve.Disperses());
  for (const float nm : {400.0F, 550.0F, 700.0F}) {
    EXPECT_NEAR(IndexAt(nm, curve.ior, curve.dispersion), 1.52F - 0.02F * (nm - 400) / 300, 2e-3F)
        << nm;
  }
  EXPECT_FALSE(glass("\"spectrum eta\" [400 1.5 700 1.5]").Disperses());
  EXPECT_FALSE(glass("\"float eta\" 1.5").Disperses());
  for (const std::string other :
       {"\"dielectric\" \"spectrum eta\" \"glass-F11\" \"float roughness\" 0.3",
        "\"thindielectric\" \"spectrum eta\" \"glass-F11\"",
        "\"coateddiffuse\" \"spectrum eta\" \"glass-F11\""}) {
    EXPECT_THAT(said(other), HasSubstr("one index of refraction (at 587.6 nm)")) << other;
  }
  // A resonance in the middle of what is seen.
  EXPECT_THAT(said("\"dielectric\" \"spectrum eta\" [400 1.5 540 1.5 550 1.9 560 1.5 700 1.5]"),
              HasSubstr("Cauchy's equation"));
  EXPECT_THAT(said("\"dielectric\" \"spectrum eta\" [400 1.5 700 0]"), HasSubstr("error"));
}

// Thirty mixes of two equal mixes each have 2^30 ways down. Does not end where each way is taken.
TEST(PbrtMaterialsTest, MixesThatDoubleAreReadAtOnce) {
  std::string world = "MakeNamedMaterial \"m0\" \"string type\" \"diffuse\"\n";
  for (int i = 1; i <= 30; ++i) {
    const std::string below = "\"m" + std::to_string(i - 1) + "\"";
    world += "MakeNamedMaterial \"m" + std::to_string(i) +
             "\" \"string type\" \"mix\" \"string materials\" [" + below + " " + below + "]\n";
  }
  const Scene scene = ReadWorld(world + "NamedMaterial \"m30\" Shape \"sphere\"");
  EXPECT_EQ(scene.materials[static_cast<std::size_t>(scene.spheres[0].traits.material)].kind,
            Material::Kind::kMix);
}

}  // namespace
}  // namespace lucerna
