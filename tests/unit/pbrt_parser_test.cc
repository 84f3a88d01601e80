// What a pbrt-v4 text means: defaults, units, scopes and orientation are pbrt-v4's, and everything
// wrong is said at once, each at its place.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <numbers>
#include <optional>
#include <string>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

#include "render/formats/pbrt/optical_constants.h"
#include "render/formats/read_scene.h"
#include "render/formats/wavelength_color.h"
#include "render/math/color_matching.h"
#include "render/math/color_space.h"
#include "render/math/warp.h"
#include "tests/support/memory_files.h"
#include "tests/support/pbrt_text.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

using ::testing::AnyOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

void ExpectNear(Vec3 a, Vec3 b) {
  EXPECT_LT(MaxAbs(a - b), 1e-5F) << a.x << " " << a.y << " " << a.z;
}
void ExpectNear(Rgb a, Rgb b, float tolerance = 1e-5F) {
  EXPECT_NEAR(a.r, b.r, tolerance);
  EXPECT_NEAR(a.g, b.g, tolerance);
  EXPECT_NEAR(a.b, b.b, tolerance);
}

// ---- camera, film, filter, integrator

TEST(PbrtParserTest, DefaultsArePbrts) {
  const Scene scene = ReadWorld("");
  EXPECT_EQ(scene.camera.fov_deg, 90);
  EXPECT_EQ(scene.camera.lens_radius, 0);
  EXPECT_EQ(scene.camera.focal_distance, 1e6);
  EXPECT_EQ(scene.film.width, 1280);
  EXPECT_EQ(scene.film.height, 720);
  EXPECT_EQ(scene.film.crop_x1, 1280);
  EXPECT_EQ(scene.film.exposure, 1);
  EXPECT_TRUE(std::isinf(scene.film.max_component));
  EXPECT_EQ(scene.filter.kind, PixelFilter::Kind::kGaussian);
  EXPECT_EQ(scene.filter.radius_x, 1.5F);
  EXPECT_FALSE(scene.integrator.initial_radius.has_value());
  EXPECT_EQ(scene.materials[0], Material());
}

TEST(PbrtParserTest, TheFieldOfViewSpansTheShorterSide) {
  Camera camera;
  const Window wide = ScreenWindow(camera, 200, 100);
  EXPECT_NEAR(wide.high_y, 1, 1e-12);
  EXPECT_NEAR(wide.high_x, 2, 1e-12);
  const Window tall = ScreenWindow(camera, 100, 200);
  EXPECT_NEAR(tall.low_x, -1, 1e-12);
  EXPECT_NEAR(tall.low_y, -2, 1e-12);
  camera.fov_deg = 60;
  camera.screen_window = Window{0, 1, -1, 3};
  const Window set = ScreenWindow(camera, 100, 200);
  EXPECT_NEAR(set.low_x, 0, 1e-12);
  EXPECT_NEAR(set.high_y, 3 * std::tan(std::numbers::pi / 6), 1e-12);
}

TEST(PbrtParserTest, LookAtAndAMirrorPlaceTheCamera) {
  const ParsedScene parsed = ParsePbrt(
      "Scale -1 1 1 LookAt 1 2 3  1 2 10  0 1 0 Camera \"perspective\" \"float fov\" 40 "
      "WorldBegin");
  const Transform& camera_to_world = parsed.scene.camera.camera_to_world;
  ExpectNear(camera_to_world.Point({0, 0, 0}), {1, 2, 3});
  ExpectNear(camera_to_world.Vector({0, 0, 1}), {0, 0, 1});
  ExpectNear(camera_to_world.Vector({0, 1, 0}), {0, 1, 0});
  ExpectNear(camera_to_world.Vector({1, 0, 0}), {-1, 0, 0});
  EXPECT_EQ(parsed.scene.camera.fov_deg, 40);
}

TEST(PbrtParserTest, MatricesAreWrittenColumnByColumn) {
  const Scene scene = ReadWorld(
      "Transform [1 0 0 0  0 1 0 0  0 0 1 0  5 6 7 1] ConcatTransform [2 0 0 0 0 2 0 0 0 0 2 0 0 0 "
      "0 1] Shape \"sphere\"");
  ExpectNear(scene.spheres[0].center, {5, 6, 7});
  EXPECT_EQ(scene.spheres[0].radius, 2);
}

// What the fourth row does to points has no place here.
TEST(PbrtParserTest, ThingsWithAPlaceNeedTransformsThatAreAffine) {
  const std::string matrix = "ConcatTransform [0 0 1 0  1 0 0 0  0 1 0 8.9  0 0 0 1] ";
  const std::string wrong = "needs transforms that are affine";
  for (const char* const thing :
       {"Shape \"sphere\"", "LightSource \"point\"", "Texture \"t\" \"spectrum\" \"checkerboard\"",
        "CoordinateSystem \"c\" Identity CoordSysTransform \"c\" Scale 2 2 2 Shape \"disk\""})
    EXPECT_THAT(SaidOfWorld(matrix + thing), HasSubstr(wrong)) << thing;
  EXPECT_THAT(SaidOfWorld(matrix + "Identity Shape \"sphere\""), Not(HasSubstr(wrong)));
  // A row that moves what a column has moved turns directions, too.
  const std::string sky = "LightSource \"infinite\"";
  EXPECT_THAT(SaidOfWorld(matrix + sky), Not(HasSubstr(wrong)));
  EXPECT_THAT(SaidOfWorld(matrix + "Translate 1 0 0 " + sky), HasSubstr(wrong));
  EXPECT_THAT(SaidOfWorld("Translate 1 0 0 " + matrix + sky), HasSubstr(wrong));
  EXPECT_THAT(SaidOfPbrt(matrix + "Camera \"perspective\" WorldBegin"), HasSubstr(wrong));
}

TEST(PbrtParserTest, OfTwoCamerasTheLastCounts) {
  const ParsedScene parsed = ParsePbrt(
      "Camera \"perspective\" \"float fov\" 30 \"float lensradius\" 2\n"
      "Translate 0 0 -4 Camera \"perspective\" \"float fov\" 50 WorldBegin Shape \"sphere\"");
  ASSERT_TRUE(parsed.ok()) << parsed.ToStatus();
  EXPECT_EQ(parsed.scene.camera.fov_deg, 50);
  EXPECT_EQ(parsed.scene.camera.lens_radius, 0);
  EXPECT_EQ(parsed.scene.camera.camera_to_world, Transform::Translate(0, 0, 4));
  EXPECT_THAT(SaidOf(parsed), HasSubstr("s.pbrt:2:18: warning: Camera \"perspective\" takes the "
                                        "place of the camera before it"));
}

TEST(PbrtParserTest, FilmCropAndExposure) {
  const Scene scene =
      ParsePbrt(
          "Film \"rgb\" \"integer xresolution\" [100] \"integer yresolution\" 50 \"float iso\" 200 "
          "\"float cropwindow\" [0.25 0.5 0 0.1] \"string filename\" \"a b.exr\"\n"
          "Camera \"perspective\" \"float shutterclose\" 0.5 WorldBegin")
          .scene;
  EXPECT_EQ(scene.film.crop_x0, 25);
  EXPECT_EQ(scene.film.crop_x1, 50);
  EXPECT_EQ(scene.film.crop_y0, 0);
  EXPECT_EQ(scene.film.crop_y1, 5);
  EXPECT_DOUBLE_EQ(scene.film.exposure, 1);  // half the time at twice the speed
  EXPECT_EQ(scene.film.filename, "a b.exr");
  const Scene bounds = ParsePbrt(
                           "Film \"rgb\" \"integer pixelbounds\" [3 9 4 2000] Camera "
                           "\"perspective\" WorldBegin")
                           .scene;
  EXPECT_EQ(bounds.film.crop_x0, 3);
  EXPECT_EQ(bounds.film.crop_x1, 9);
  EXPECT_EQ(bounds.film.crop_y0, 4);
  EXPECT_EQ(bounds.film.crop_y1, 720);
}

TEST(PbrtParserTest, IntegratorAndSampler) {
  const Scene scene =
      ParsePbrt(
          "Integrator \"sppm\" \"integer maxdepth\" 9 \"float radius\" 0.01 "
          "\"integer photonsperiteration\" 1000 \"integer seed\" 3\n"
          "Sampler \"halton\" \"integer pixelsamples\" 32 Camera \"perspective\" WorldBegin")
          .scene;
  EXPECT_EQ(scene.integrator.max_depth, 9);
  EXPECT_EQ(scene.integrator.initial_radius, 0.01);
  EXPECT_EQ(scene.integrator.photons_per_pass, 1000);
  EXPECT_EQ(scene.integrator.seed, 3);
  EXPECT_EQ(scene.integrator.pixel_samples, 32);
  const Scene path = ParsePbrt(
                         "Integrator \"path\" \"integer maxdepth\" 4 \"float radius\" 1 Camera "
                         "\"perspective\" WorldBegin")
                         .scene;
  EXPECT_EQ(path.integrator.max_depth, 4);
  EXPECT_FALSE(path.integrator.initial_radius.has_value());
}

TEST(PbrtParserTest, Filters) {
  const auto filter = [](const std::string& text) {
    return ParsePbrt("PixelFilter " + text + " Camera \"perspective\" WorldBegin").scene.filter;
  };
  EXPECT_EQ(filter("\"box\"").radius_x, 0.5F);
  EXPECT_EQ(filter("\"triangle\"").radius_y, 2);
  EXPECT_EQ(filter("\"mitchell\"").b, 1.0F / 3);
  EXPECT_EQ(filter("\"gaussian\" \"float sigma\" 0.3").sigma, 0.3F);
  EXPECT_EQ(filter("\"sinc\"").radius_x, 4);
  EXPECT_EQ(filter("\"sinc\" \"float tau\" 2").window, 2);
  EXPECT_THAT(
      SaidOfPbrt("PixelFilter \"sinc\" \"float tau\" 0.01 Camera \"perspective\" WorldBegin"),
      HasSubstr("tau"));
}

// Light of the chromaticity that CIE 15 gives for an illuminant becomes grey of the same luminance.
TEST(PbrtParserTest, WhiteBalanceMakesAnIlluminantGrey) {
  const auto balance = [](const std::string& kelvin) {
    return ParsePbrt("Film \"rgb\" \"float whitebalance\" " + kelvin +
                     " Camera \"perspective\" WorldBegin")
        .scene.film.white_balance;
  };
  struct Illuminant {
    const char* kelvin;
    double x, y;
  };
  for (const Illuminant& light : {Illuminant{"5000", 0.34567, 0.35850},
                                  {"5500", 0.33242, 0.34743},
                                  {"7500", 0.29902, 0.31485},
                                  {"2856", 0.44758, 0.40745}}) {
    const std::optional<ColorMatrix> matrix = balance(light.kelvin);
    ASSERT_TRUE(matrix.has_value());
    const auto color =
        Transformed(*matrix, Rec709({light.x / light.y, 1, (1 - light.x - light.y) / light.y}));
    for (const double channel : color)
      EXPECT_NEAR(channel, 1, 2e-3) << light.kelvin;
  }
  EXPECT_FALSE(balance("0").has_value());
  const auto said = [](const std::string& film) {
    return SaidOfPbrt("Film \"rgb\" " + film + " Camera \"perspective\" WorldBegin");
  };
  EXPECT_THAT(said("\"float whitebalance\" 500"), HasSubstr("must be 0, or from 1000 to 25000"));
  EXPECT_THAT(said("\"float whitebalance\" 30000"), HasSubstr("whitebalance"));
  EXPECT_THAT(said("\"string sensor\" \"nikon_d850\""), HasSubstr("is read as cie1931"));
}

// ---- shapes and which way they face

constexpr char kOneTriangle[] = "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] ";

Vec3 Outward(const Scene& scene) {
  const TriangleMesh& mesh = scene.meshes.at(0);
  const auto p = [&](std::size_t i) { return mesh.positions[mesh.indices[i]]; };
  return Normalize(Cross(p(1) - p(0), p(2) - p(0)));
}

TEST(PbrtParserTest, AMeshWithoutNormalsFacesByItsWinding) {
  ExpectNear(Outward(ReadWorld(kOneTriangle)), {0, 0, 1});
  ExpectNear(Outward(ReadWorld(std::string("ReverseOrientation ") + kOneTriangle)), {0, 0, -1});
  // In world space the mirror image is wound the other way; pbrt-v4 turns it over.
  ExpectNear(Outward(ReadWorld(std::string("Scale -1 1 1 ") + kOneTriangle)), {0, 0, 1});
  ExpectNear(Outward(ReadWorld(std::string("Scale 1 1 -1 ") + kOneTriangle)), {0, 0, -1});
  ExpectNear(Outward(ReadWorld(std::string("Scale -1 1 1 ReverseOrientation ") + kOneTriangle)),
             {0, 0, -1});
}

TEST(PbrtParserTest, AMeshWithNormalsFacesWithThem) {
  const std::string down = std::string(kOneTriangle) + "\"normal N\" [0 0 -2 0 0 -2 0 0 -2] ";
  const Scene scene = ReadWorld(down);
  ExpectNear(Outward(scene), {0, 0, -1});
  ExpectNear(scene.meshes[0].normals[0], {0, 0, -1});
  const Scene reversed = ReadWorld("ReverseOrientation " + down);
  ExpectNear(Outward(reversed), {0, 0, 1});
  ExpectNear(reversed.meshes[0].normals[0], {0, 0, 1});
  ExpectNear(Outward(ReadWorld("Scale -1 1 1 " + down)), {0, 0, -1});
  // Normals of zero leave the choice to the winding.
  ExpectNear(Outward(ReadWorld(std::string(kOneTriangle) + "\"normal N\" [0 0 0 0 0 0 0 0 0] ")),
             {0, 0, 1});
}

TEST(PbrtParserTest, NormalsAreMappedAsNormals) {
  const Scene scene = ReadWorld(
      "Scale 1 2 1 Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 -1 0 0 0 1] "
      "\"normal N\" [1 1 0 1 1 0 1 1 0]");
  ExpectNear(scene.meshes[0].normals[0], Normalize({2, 1, 0}));
}

TEST(PbrtParserTest, SpheresAndDisks) {
  const Scene scene = ReadWorld(
      "Translate 1 2 3 Scale 2 2 2 Shape \"sphere\" \"float radius\" 3 "
      "Rotate 90 1 0 0 Shape \"disk\" \"float height\" 1 \"float innerradius\" 0.5 "
      "ReverseOrientation Shape \"sphere\" Shape \"disk\"");
  ExpectNear(scene.spheres[0].center, {1, 2, 3});
  EXPECT_EQ(scene.spheres[0].radius, 6);
  EXPECT_FALSE(scene.spheres[0].inward);
  EXPECT_TRUE(scene.spheres[1].inward);
  ExpectNear(scene.disks[0].normal, {0, -1, 0});
  ExpectNear(scene.disks[0].center, {1, 0, 3});
  EXPECT_EQ(scene.disks[0].inner_radius, 1);
  ExpectNear(scene.disks[1].normal, {0, 1, 0});
}

TEST(PbrtParserTest, DegenerateTrianglesAreDroppedAndCounted) {
  const std::string world =
      "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0 2 0 0] "
      "\"integer indices\" [0 1 1  0 1 2  0 1 3]";
  EXPECT_THAT(ReadWorld(world).meshes[0].indices, ElementsAre(0, 1, 2));
  EXPECT_THAT(SaidOfWorld(world), HasSubstr("2 of 3 triangles have no area"));
}

// What was meant to shine and does not is said, with its place.
TEST(PbrtParserTest, LightsThatEmitNothingAreWarnedOf) {
  const std::string light = "AreaLightSource \"diffuse\"\n";
  const std::string flat =
      "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 2 0 0] \"integer indices\" [0 1 2]";
  EXPECT_THAT(SaidOfWorld(light + flat), HasSubstr("warning: Shape \"trianglemesh\" has no area"));
  EXPECT_THAT(SaidOfWorld(flat), Not(HasSubstr("warning: Shape")));
  // In single precision: 1e-25 m² are more than kLeastArea, and next to the other triangle nothing.
  const std::string tiny =
      "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1e-25 0 0 0 1e-25 0] \"integer indices\" [0 1 2]";
  EXPECT_THAT(SaidOfWorld(std::string(kOneTriangle) + light + tiny),
              HasSubstr("warning: Shape \"trianglemesh\" has no area"));
  EXPECT_THAT(SaidOfWorld(light + "Shape \"disk\" \"float radius\" 1 \"float innerradius\" 1"),
              AnyOf(HasSubstr("Shape \"disk\" has no area"), HasSubstr("error")));
  EXPECT_THAT(SaidOfWorld(light + "Shape \"sphere\" \"float radius\" 0"), HasSubstr("error"));
  EXPECT_THAT(SaidOfWorld(light + kOneTriangle), Not(HasSubstr("has no area")));
  EXPECT_THAT(SaidOfWorld("AreaLightSource \"diffuse\" \"rgb L\" [0 0 0]"),
              HasSubstr("warning: AreaLightSource \"diffuse\" emits nothing"));
  for (const char* type : {"point", "spot", "distant", "infinite"}) {
    const std::string source = std::string("LightSource \"") + type + "\"";
    EXPECT_THAT(SaidOfWorld(source + " \"float scale\" 0"), HasSubstr("emits nothing")) << type;
    EXPECT_THAT(SaidOfWorld(source), Not(HasSubstr("emits nothing"))) << type;
  }
}

TEST(PbrtParserTest, InstancesAreLaidOut) {
  const Scene scene =
      ReadWorld(std::string("ObjectBegin \"o\" Translate 1 0 0 Shape \"sphere\" ") + kOneTriangle +
                "ObjectEnd ObjectInstance \"o\" Translate 0 5 0 Scale -2 2 2 ObjectInstance \"o\"");
  ASSERT_EQ(scene.spheres.size(), 2U);
  ExpectNear(scene.spheres[0].center, {1, 0, 0});
  ExpectNear(scene.spheres[1].center, {-2, 5, 0});
  EXPECT_EQ(scene.spheres[1].radius, 2);
  ASSERT_EQ(scene.meshes.size(), 2U);
  // A mirrored instance keeps its outward side outward.
  const TriangleMesh& mirrored = scene.meshes[1];
  const auto p = [&](std::size_t i) { return mirrored.positions[mirrored.indices[i]]; };
  EXPECT_GT(Cross(p(1) - p(0), p(2) - p(0)).z, 0);
  EXPECT_THAT(
      SaidOfWorld("ObjectBegin \"o\" AreaLightSource \"diffuse\" Shape \"sphere\" ObjectEnd"),
      HasSubstr("is part of an object and emits no light"));
}

TEST(PbrtParserTest, InstancesCountAgainstTheLimit) {
  SceneLimits limits;
  limits.max_triangles = 10;
  std::string text =
      "Camera \"perspective\" WorldBegin ObjectBegin \"o\" Shape \"sphere\" Shape "
      "\"disk\" ObjectEnd ";
  for (int i = 0; i < 4; ++i)
    text += "ObjectInstance \"o\" ";
  EXPECT_TRUE(ParsePbrt(text, {}, limits).ok());  // with the object itself
  EXPECT_THAT(SaidOfPbrt(text + "ObjectInstance \"o\"", {}, limits),
              HasSubstr("more than 10 triangles"));
}

// ---- materials

Material MaterialOf(const std::string& text) {
  const Scene scene = ReadWorld("Material " + text + " Shape \"sphere\"");
  return scene.materials.at(static_cast<std::size_t>(scene.spheres.at(0).traits.material));
}

TEST(PbrtParserTest, Materials) {
  EXPECT_EQ(MaterialOf("\"diffuse\" \"rgb reflectance\" [0.1 0.2 0.3]").reflectance,
            (Rgb{0.1F, 0.2F, 0.3F}));
  const Material copper = MaterialOf("\"conductor\"");
  const auto curve_of = [](const std::string& name) { return *MetalSpectrumNamed(name).curve; };
  EXPECT_EQ(*copper.given.spectra->eta.curve, curve_of("metal-Cu-eta"));
  EXPECT_EQ(copper.alpha_u, 0);
  const Material gold =
      MaterialOf("\"conductor\" \"spectrum eta\" \"metal-Au-eta\" \"spectrum k\" [\"metal-Au-k\"]");
  EXPECT_EQ(*gold.given.spectra->eta.curve, curve_of("metal-Au-eta"));
  EXPECT_EQ(*gold.given.spectra->k.curve, curve_of("metal-Au-k"));
  const Material reflecting = MaterialOf("\"conductor\" \"rgb reflectance\" [0.5 0 1]");
  EXPECT_EQ(reflecting.eta, Gray(1));
  EXPECT_NEAR(reflecting.k.r, 2, 1e-5);
  EXPECT_EQ(reflecting.k.g, 0);
  EXPECT_NEAR(reflecting.k.b, 2 * std::sqrt(0.9999 / 0.0001), 0.1);
  const Material listed = MaterialOf("\"conductor\" \"spectrum eta\" [400 1 700 4] \"float k\" 3");
  EXPECT_NEAR(listed.eta.r, 3.3F, 1e-5);
  EXPECT_EQ(listed.k, Gray(3));
  EXPECT_EQ(MaterialOf("\"dielectric\"").ior, 1.5F);
  EXPECT_EQ(MaterialOf("\"dielectric\" \"spectrum eta\" \"glass-BK7\"").ior, 1.5168F);
}

TEST(PbrtParserTest, RoughnessIsRemappedUnlessToldNotTo) {
  EXPECT_FLOAT_EQ(MaterialOf("\"conductor\" \"float roughness\" 0.04").alpha_u, 0.2F);
  const Material direct = MaterialOf(
      "\"dielectric\" \"float uroughness\" 0.1 \"float vroughness\" 0.3 \"bool remaproughness\" "
      "false");
  EXPECT_FLOAT_EQ(direct.alpha_u, 0.1F);
  EXPECT_FLOAT_EQ(direct.alpha_v, 0.3F);
  // Below a width of 0.001 pbrt-v4 renders a smooth surface.
  EXPECT_EQ(MaterialOf("\"dielectric\" \"float roughness\" 9e-7").alpha_u, 0);
  EXPECT_GT(MaterialOf("\"dielectric\" \"float roughness\" 2e-6").alpha_u, 0);
}

TEST(PbrtParserTest, ReflectanceByWavelength) {
  ExpectNear(MaterialOf("\"diffuse\" \"spectrum reflectance\" [300 0.5 900 0.5]").reflectance,
             Gray(0.5F), 1e-4F);
  const Rgb red =
      MaterialOf("\"diffuse\" \"spectrum reflectance\" [300 0 599 0 600 1 900 1]").reflectance;
  EXPECT_GT(red.r, 0.6F);
  EXPECT_LT(red.g, 0.1F);
}

TEST(PbrtParserTest, NamedMaterialsMayComeLaterAndScopesEnd) {
  const Scene scene = ReadWorld(
      "NamedMaterial \"late\" Shape \"sphere\" AttributeBegin Material \"dielectric\" Shape "
      "\"sphere\" AttributeEnd Shape \"sphere\" "
      "MakeNamedMaterial \"late\" \"string type\" \"conductor\"");
  const auto kind = [&](std::size_t i) {
    return scene.materials[static_cast<std::size_t>(scene.spheres[i].traits.material)].kind;
  };
  EXPECT_EQ(kind(0), Material::Kind::kConductor);
  EXPECT_EQ(kind(1), Material::Kind::kDielectric);
  EXPECT_EQ(kind(2), Material::Kind::kConductor);
  EXPECT_THAT(SaidOfWorld("NamedMaterial \"none\" Shape \"sphere\""),
              HasSubstr("s.pbrt:2:1: error: there is no material \"none\"; define it"));
}

// As in pbrt-v4, which looks for it when a shape is made.
TEST(PbrtParserTest, AMaterialThatNoShapeHasMayBeMissing) {
  const std::string said =
      SaidOfWorld("AttributeBegin NamedMaterial \"none\" AttributeEnd Shape \"sphere\"");
  EXPECT_THAT(said, HasSubstr("s.pbrt:2:16: warning: there is no material \"none\"; no shape has"));
  EXPECT_THAT(said, Not(HasSubstr("error")));
}

// ---- lights

TEST(PbrtParserTest, AreaLightsBelongToTheShapesOfTheirScope) {
  const Scene scene = ReadWorld(
      "Shape \"sphere\" AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [1 2 3] \"float "
      "scale\" "
      "2 \"bool twosided\" true Shape \"sphere\" Shape \"disk\" AttributeEnd Shape \"sphere\"");
  EXPECT_EQ(scene.spheres[0].traits.area_light, kNoAreaLight);
  EXPECT_EQ(scene.spheres[1].traits.area_light, 0);
  EXPECT_EQ(scene.disks[0].traits.area_light, 0);
  EXPECT_EQ(scene.spheres[2].traits.area_light, kNoAreaLight);
  EXPECT_EQ(scene.area_lights[0], (AreaLight{{2, 4, 6}, true}));
}

TEST(PbrtParserTest, PowerIsWhatTheLightEmits) {
  const Scene scene = ReadWorld(
      "AreaLightSource \"diffuse\" \"float power\" 100 Shape \"sphere\" \"float radius\" 2 "
      "Shape \"disk\" \"float innerradius\" 0.5 Shape \"trianglemesh\" \"point3 P\" [0 0 0 2 0 0 0 "
      "2 "
      "0] LightSource \"point\" \"float power\" 60 LightSource \"spot\" \"float power\" 30");
  const auto power = [&](const ShapeTraits& traits, float area) {
    return scene.area_lights[static_cast<std::size_t>(traits.area_light)].radiance.g * area * kPi;
  };
  EXPECT_NEAR(power(scene.spheres[0].traits, 4 * kPi * 4), 100, 1e-3);
  EXPECT_NEAR(power(scene.disks[0].traits, kPi * 0.75F), 100, 1e-3);
  EXPECT_NEAR(power(scene.meshes[0].traits, 2), 100, 1e-3);
  EXPECT_NEAR(scene.point_lights[0].intensity.g * 4 * kPi, 60, 1e-3);
  // The spot by numbers: 2 pi times the integral over the cosine.
  const SpotLight& spot = scene.spot_lights[0];
  double sum = 0;
  constexpr int kSteps = 100'000;
  for (int i = 0; i < kSteps; ++i) {
    const double c = (i + 0.5) / kSteps;
    const double t =
        std::clamp((c - static_cast<double>(spot.cos_total_width)) /
                       static_cast<double>(spot.cos_falloff_start - spot.cos_total_width),
                   0.0, 1.0);
    sum += t * t * (3 - 2 * t) / kSteps;
  }
  EXPECT_NEAR(2 * std::numbers::pi * sum * static_cast<double>(spot.intensity.g), 30, 0.01);
}

TEST(PbrtParserTest, AnEmptyTypeSwitchesEmissionOff) {
  const Scene scene = ReadWorld(
      "AreaLightSource \"diffuse\" Shape \"sphere\" AreaLightSource \"\" Shape \"sphere\"");
  EXPECT_EQ(scene.spheres[0].traits.area_light, 0);
  EXPECT_EQ(scene.spheres[1].traits.area_light, kNoAreaLight);
}

TEST(PbrtParserTest, APictureWithoutANameIsNone) {
  const Scene scene = ReadWorld(
      "AreaLightSource \"diffuse\" \"string filename\" \"\" \"rgb L\" [1 2 3] Shape \"sphere\" "
      "LightSource \"infinite\" \"string filename\" \"\" \"rgb L\" [3 2 1]");
  EXPECT_EQ(scene.area_lights.at(0).radiance, (Rgb{1, 2, 3}));
  EXPECT_EQ(scene.infinite_lights.at(0).radiance, (Rgb{3, 2, 1}));
  EXPECT_THAT(SaidOfWorld("LightSource \"projection\" \"string filename\" \"\""),
              HasSubstr("needs \"string filename\""));
}

// Chromaticities: CIE 15:2018, table T.3; of D60 that of the white of ACES.
TEST(PbrtParserTest, StandardIlluminants) {
  const struct {
    const char* name;
    double x, y;
  } kExpected[] = {{"stdillum-A", 0.44758, 0.40745},
                   {"stdillum-D50", 0.34567, 0.35851},
                   {"illum-acesD60", 0.32168, 0.33767},
                   {"stdillum-D65", 0.31272, 0.32903}};
  for (const auto& expected : kExpected) {
    SCOPED_TRACE(expected.name);
    const Scene scene =
        ReadWorld(std::string("LightSource \"point\" \"spectrum I\" \"") + expected.name + "\"");
    const PointLight& light = scene.point_lights.at(0);
    EXPECT_NEAR(Luminance(light.intensity), 1, 1e-5);
    const std::array<double, 3> white =
        Rec709({expected.x / expected.y, 1, (1 - expected.x - expected.y) / expected.y});
    ExpectNear(
        light.intensity,
        {static_cast<float>(white[0]), static_cast<float>(white[1]), static_cast<float>(white[2])},
        2e-3F);
    // A grey one has the spectrum of D65 without.
    EXPECT_EQ(light.spectrum.is_given(), std::string(expected.name) != "stdillum-D65");
  }
  // The daylight series itself, against the table of D65.
  const WavelengthCurve daylight = DaylightCurve(6500);
  for (std::size_t i = 0; i < daylight.value.size(); ++i)
    EXPECT_NEAR(daylight.value[i], D65At(daylight.wavelength_nm[i]), 0.1);
  EXPECT_THAT(SaidOfWorld("LightSource \"point\" \"spectrum I\" \"stdillum-F11\""),
              HasSubstr("\"stdillum-F11\" is not supported for lights; there are stdillum-A"));
}

TEST(PbrtParserTest, OtherLights) {
  const Scene scene = ReadWorld(
      "Translate 0 0 5 LightSource \"point\" \"rgb I\" [1 2 3] \"point3 from\" [1 0 0] "
      "LightSource \"spot\" \"point3 from\" [0 0 0] \"point3 to\" [0 2 0] \"float coneangle\" 60 "
      "LightSource \"distant\" \"point3 from\" [0 1 0] \"point3 to\" [0 0 0] \"float illuminance\" "
      "4 "
      "LightSource \"infinite\" \"rgb L\" [0.5 0.5 0.5] \"float scale\" 2");
  ExpectNear(scene.point_lights[0].position, {1, 0, 5});
  EXPECT_EQ(scene.point_lights[0].intensity, (Rgb{1, 2, 3}));
  ExpectNear(scene.spot_lights[0].direction, {0, 1, 0});
  EXPECT_NEAR(scene.spot_lights[0].cos_total_width, 0.5F, 1e-6);
  EXPECT_NEAR(scene.spot_lights[0].cos_falloff_start, std::cos(55 * kPi / 180), 1e-6);
  ExpectNear(scene.distant_lights[0].direction, {0, -1, 0});
  EXPECT_EQ(scene.distant_lights[0].irradiance, Gray(4));
  EXPECT_EQ(scene.infinite_lights[0].radiance, Gray(1));
}

TEST(PbrtParserTest, ColoursByTemperatureAndWavelengthHaveLuminanceOne) {
  const auto intensity = [](const std::string& text) {
    return ReadWorld("LightSource \"point\" " + text).point_lights.at(0).intensity;
  };
  const Rgb warm = intensity("\"blackbody I\" 2700");
  EXPECT_NEAR(Luminance(warm), 1, 1e-5);
  EXPECT_GT(warm.r, 1.5F);
  EXPECT_LT(warm.b, 0.4F);
  // The Planckian at 6504 K is close to D65, which is white.
  ExpectNear(intensity("\"blackbody I\" [6504]"), Gray(1), 0.06F);
  EXPECT_NEAR(Luminance(intensity("\"spectrum I\" [400 7 700 9]")), 1, 1e-5);
  EXPECT_NEAR(Luminance(intensity("\"spectrum I\" [600 1 610 1]")), 1, 1e-5);
}

// ---- scopes, files

// CIE illuminant A is the black body of 2,856 K, and has these coordinates (CIE 15:2004).
TEST(PbrtParserTest, ABlackBodyHasTheColourOfIlluminantA) {
  const Scene scene = ReadWorld("LightSource \"point\" \"blackbody I\" 2856");
  const Rgb color = scene.point_lights.at(0).intensity;
  const std::array<std::array<double, 3>, 3> to_xyz = {{{0.4124564, 0.3575761, 0.1804375},
                                                        {0.2126729, 0.7151522, 0.0721750},
                                                        {0.0193339, 0.1191920, 0.9503041}}};
  std::array<double, 3> xyz{};
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t c = 0; c < 3; ++c)
      xyz[row] += to_xyz[row][c] * static_cast<double>(color[static_cast<int>(c)]);
  }
  const double sum = xyz[0] + xyz[1] + xyz[2];
  EXPECT_NEAR(xyz[0] / sum, 0.44758, 2e-4);
  EXPECT_NEAR(xyz[1] / sum, 0.40745, 2e-4);
}

// pbrt-v4 makes a picture of such a light, and a picture has the unit of its file: a black body is
// 1 where it is brightest, at any wavelength.
TEST(PbrtParserTest, BehindAPortalColoursByTemperatureAndWavelengthKeepTheirUnit) {
  const auto luminance = [](const std::string& parameters) {
    const Scene scene = ReadWorld("LightSource \"infinite\" " + parameters);
    return static_cast<double>(Luminance(scene.infinite_lights.at(0).radiance));
  };
  const std::string portal = " \"point3 portal\" [0 0 0  0 1 0  1 1 0  1 0 0] \"float scale\" 3";
  EXPECT_NEAR(luminance("\"spectrum L\" [300 2 900 2]" + portal), 6, 1e-4);
  EXPECT_NEAR(luminance("\"spectrum L\" [300 2 900 2]"), 1, 1e-4);
  EXPECT_NEAR(luminance("\"rgb L\" [2 2 2]" + portal), 6, 1e-4);
  // A picture's illuminance is that of its pixels, whatever their unit: of one, 2 pi of it.
  const std::string lux = portal + " \"float illuminance\" 2";
  for (const std::string light :
       {"\"spectrum L\" [300 2 900 2]", "\"rgb L\" [2 2 2]", "\"blackbody L\" 6500"})
    EXPECT_NEAR(luminance(light + lux), 3 * 2 / (2 * std::numbers::pi), 1e-4) << light;
  for (const double temperature_k : {2500.0, 6500.0}) {
    // h c / (k T) in nm.
    const double unit_nm = 6.62607015e-34 * 299792458 / (1.380649e-23 * temperature_k) * 1e9;
    const auto planck = [&](double nm) { return std::pow(nm, -5) / std::expm1(unit_nm / nm); };
    double peak = 0;
    for (double nm = 100; nm < 3000; nm += 0.5)
      peak = std::max(peak, planck(nm));
    double seen = 0;
    double white = 0;
    for (double nm = 360; nm <= 830; nm += 1) {
      seen += planck(nm) / peak * CieObserver(nm)[1];
      white += CieObserver(nm)[1];
    }
    EXPECT_NEAR(
        luminance("\"blackbody L\" " + std::to_string(temperature_k) + portal) / (3 * seen / white),
        1, 1e-3);
  }
}

TEST(PbrtParserTest, AttributesAreDefaultsThatAShapeMayOverride) {
  const Scene scene = ReadWorld(
      "AttributeBegin Attribute \"shape\" \"float radius\" 3 Attribute \"light\" \"float scale\" 2 "
      "Shape \"sphere\" Shape \"sphere\" \"float radius\" 4 LightSource \"point\" AttributeEnd "
      "Shape \"sphere\"");
  EXPECT_EQ(scene.spheres[0].radius, 3);
  EXPECT_EQ(scene.spheres[1].radius, 4);
  EXPECT_EQ(scene.spheres[2].radius, 1);
  EXPECT_EQ(scene.point_lights[0].intensity, Gray(2));
}

TEST(PbrtParserTest, CoordinateSystems) {
  const Scene scene =
      ParsePbrt(
          "Translate 0 0 -4 Camera \"perspective\" WorldBegin Translate 1 0 0 CoordinateSystem "
          "\"there\" Identity Shape \"sphere\" CoordSysTransform \"there\" Shape \"sphere\" "
          "CoordSysTransform \"camera\" Shape \"sphere\"")
          .scene;
  ExpectNear(scene.spheres[0].center, {0, 0, 0});
  ExpectNear(scene.spheres[1].center, {1, 0, 0});
  ExpectNear(scene.spheres[2].center, {0, 0, 4});
}

TEST(PbrtParserTest, IncludeAndImport) {
  const Scene scene = ReadWorld(
      "Include \"parts/a.pbrt\" Shape \"sphere\" Import \"b.pbrt\" Shape \"sphere\"",
      {{"parts/a.pbrt", "Translate 1 0 0 Include \"parts/c.pbrt\""},  // from the main folder
       {"parts/c.pbrt", "Translate 0 1 0"},
       {"b.pbrt", "Translate 0 0 1 Shape \"sphere\""}});
  ExpectNear(scene.spheres[0].center, {1, 1, 0});
  ExpectNear(scene.spheres[1].center, {1, 1, 1});
  ExpectNear(scene.spheres[2].center, {1, 1, 0});  // an import leaves no trace
}

// pbrt-v4 reads the files as one text.
TEST(PbrtParserTest, ParametersGoOnAfterTheFileInWhichTheyBegin) {
  const std::map<std::string, std::string> files = {
      {"a.pbrt", "Shape \"sphere\" Shape \"sphere\" \"float radius\" 2"},
      {"outer.pbrt", "Include \"a.pbrt\" \"float phimax\" 360"}};
  const Scene scene = ReadWorld(
      "Include \"outer.pbrt\" \"float alpha\" [0.5] Translate 1 0 0 Shape \"sphere\"", files);
  ASSERT_EQ(scene.spheres.size(), 3U);
  EXPECT_EQ(scene.spheres[0].radius, 1);
  EXPECT_EQ(scene.spheres[1].radius, 2);
  EXPECT_EQ(scene.spheres[1].traits.alpha, 0.5F);
  ExpectNear(scene.spheres[2].center, {1, 0, 0});
  // A list that breaks off is one error, wherever it does.
  const std::string broken =
      SaidOf(ParseWorld("Include \"outer.pbrt\" \"float zmax\" [1 [ 2] Shape \"sphere\"", files));
  EXPECT_THAT(broken, HasSubstr("have no closing ]"));
  EXPECT_EQ(broken.find("error", broken.find("error") + 1), std::string::npos) << broken;
  // Not out of an import, which is a text of its own.
  EXPECT_THAT(SaidOf(ParseWorld("Import \"a.pbrt\" \"float zmin\" -1", files)),
              HasSubstr("s.pbrt:2:17: error: expected a directive, not \"float zmin\""));
}

TEST(PbrtParserTest, IncludesEnd) {
  // One error, whatever else the file holds.
  const std::string cycle =
      SaidOfPbrt("Scale 1 1 Include \"a.pbrt\"", {{"a.pbrt", "Include \"s.pbrt\""}});
  EXPECT_THAT(cycle, HasSubstr("a.pbrt:1:1: error: the file \"s.pbrt\" includes itself"));
  EXPECT_EQ(std::count(cycle.begin(), cycle.end(), '\n'), 2) << cycle;
  std::map<std::string, std::string> chain;
  for (int i = 0; i < 40; ++i)
    chain[std::to_string(i)] = "Include \"" + std::to_string(i + 1) + "\"";
  EXPECT_THAT(SaidOfPbrt("Include \"0\"", chain),
              HasSubstr("include one another more than 32 deep"));
  SceneLimits limits;
  limits.max_files = 100;
  // Every reading counts, also of a file that was read before.
  std::string many;
  for (int i = 0; i < 101; ++i)
    many += "Include \"a.pbrt\" ";
  EXPECT_THAT(SaidOfPbrt(many, {{"a.pbrt", ""}}, limits), HasSubstr("more than 100 files"));
}

TEST(PbrtParserTest, PlyMeshesAreReadAndTheirErrorsPlaced) {
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float "
      "z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0 1 0 0 0 1 0 3 "
      "0 ";
  const std::string world = "Translate 0 0 2 Shape \"plymesh\" \"string filename\" \"m.ply\"";
  ExpectNear(ReadWorld(world, {{"m.ply", ply + "1 2\n"}}).meshes.at(0).positions[1], {1, 0, 2});
  EXPECT_THAT(SaidOfPbrt("WorldBegin " + world, {{"m.ply", ply + "1 3\n"}}),
              HasSubstr("s.pbrt:1:44: error: \"filename\" of Shape \"plymesh\" cannot be read: "
                        "m.ply: bad PLY file: face 0 refers to vertex 3 of 3"));
  EXPECT_THAT(SaidOfPbrt("WorldBegin " + world), HasSubstr("m.ply: no such file"));
}

// ---- what is refused

TEST(PbrtParserTest, AllErrorsAreSaidAtOnceEachAtItsPlace) {
  const std::string said = SaidOfPbrt(
      "Camera \"perspective\" \"float fov\" [ 200 ]\n"
      "WorldBegin\n"
      "Sahpe \"sphere\"\n"
      "Shape \"cone\"\n"
      "  Material \"diffuse\" \"rgb reflectance\" [0.5 1.5 0]\n"
      "Shape \"sphere\" \"float radius\" [1 2] \"float raduis\" 1\n"
      "Translate 1 2 Shape \"sphere\" \"integer radius\" 1\n"
      "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 nan 0 1 0]\n"
      "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 3]\n"
      "AttributeEnd\n"
      "AttributeBegin\n");
  EXPECT_THAT(said, HasSubstr("s.pbrt:1:22: error: \"fov\" of Camera \"perspective\" must be at "
                              "least 0.001 and at most 179.999, not 200\n"));
  EXPECT_THAT(said,
              HasSubstr("s.pbrt:3:1: error: unknown directive \"Sahpe\"; did you mean Shape?"));
  EXPECT_THAT(said, HasSubstr("s.pbrt:4:1: error: Shape \"cone\" is not supported; there are"));
  EXPECT_THAT(said,
              HasSubstr("s.pbrt:5:22: error: \"reflectance\" of Material \"diffuse\" must be"));
  EXPECT_THAT(said,
              HasSubstr("s.pbrt:6:16: error: \"radius\" of Shape \"sphere\" must have 1 value"));
  EXPECT_THAT(said, HasSubstr("s.pbrt:6:37: warning: unknown parameter \"raduis\" of Shape "
                              "\"sphere\" is ignored; did you mean \"radius\"?"));
  EXPECT_THAT(said,
              HasSubstr("s.pbrt:7:15: error: Translate takes 3 finite numbers, not \"Shape\""));
  EXPECT_THAT(said, HasSubstr("s.pbrt:7:30: error: \"radius\" of Shape \"sphere\" must be of type "
                              "float, not integer"));
  EXPECT_THAT(said, HasSubstr("s.pbrt:8:44: error: \"P\" of Shape takes finite numbers"));
  EXPECT_THAT(said, HasSubstr("refers to vertex 3 of 3"));
  EXPECT_THAT(said,
              HasSubstr("s.pbrt:10:1: warning: AttributeEnd without AttributeBegin is ignored"));
  EXPECT_THAT(said, HasSubstr("s.pbrt:11:1: error: AttributeBegin is never closed"));
  // Each mistake once: nothing is said of what only follows from another error.
  EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 12);
}

// As in pbrt-v4, which says so and goes on.
TEST(PbrtParserTest, SomeMistakesAreWarnings) {
  const ParsedScene parsed = ParsePbrt(
      "WorldBegin LightSource \"infinite\" AttributeEnd CoordSysTransform \"nowhere\"\n"
      "Translate 1 0 0 Shape \"sphere\" Import \"i.pbrt\" Shape \"sphere\"",
      {{"i.pbrt", "AttributeEnd TransformEnd Translate 0 5 0"}});
  ASSERT_TRUE(parsed.ok()) << parsed.ToStatus();
  const std::string said = SaidOf(parsed);
  EXPECT_THAT(said, HasSubstr("s.pbrt:1:35: warning: AttributeEnd without AttributeBegin is"));
  EXPECT_THAT(said, HasSubstr("warning: there is no coordinate system \"nowhere\""));
  EXPECT_THAT(said, HasSubstr("is ignored, as by pbrt-v4 (and at 1 more place)"));
  EXPECT_THAT(said, HasSubstr("i.pbrt:1:14: warning: TransformEnd without TransformBegin"));
  ExpectNear(parsed.scene.spheres.at(1).center, {1, 0, 0});
  EXPECT_THAT(SaidOfWorld("ObjectEnd"), HasSubstr("error: ObjectEnd without ObjectBegin"));
}

// pbrt-v4 reads TransformBegin as AttributeBegin.
TEST(PbrtParserTest, AScopeMayEndByTheOtherName) {
  const Scene scene = ReadWorld(
      "TransformBegin Translate 1 0 0 AttributeBegin Translate 1 0 0 TransformEnd "
      "Shape \"sphere\" AttributeEnd Shape \"sphere\" LightSource \"infinite\"");
  ExpectNear(scene.spheres.at(0).center, {1, 0, 0});
  ExpectNear(scene.spheres.at(1).center, {0, 0, 0});
}

TEST(PbrtParserTest, EndsOfACropMayBeSwapped) {
  const std::string film =
      "Film \"rgb\" \"integer xresolution\" 100 \"integer yresolution\" 100 \"float cropwindow\" ";
  const std::string world = " WorldBegin LightSource \"infinite\" Shape \"sphere\"";
  const Scene scene = ReadPbrt(film + "[0.75 0.25 1 0]" + world);
  EXPECT_EQ(scene.film.crop_x0, 25);
  EXPECT_EQ(scene.film.crop_x1, 75);
  EXPECT_EQ(scene.film.crop_y0, 0);
  EXPECT_EQ(scene.film.crop_y1, 100);
  EXPECT_THAT(SaidOf(ParsePbrt(film + "[0 1 0 1] \"integer pixelbounds\" [0 1 0 1]" + world)),
              HasSubstr("warning: \"pixelbounds\" of Film \"rgb\" is ignored, as by pbrt-v4"));
}

TEST(PbrtParserTest, WithoutACameraThereIsThatOfPbrt) {
  const ParsedScene parsed = ParsePbrt("WorldBegin LightSource \"infinite\" Shape \"sphere\"");
  ASSERT_TRUE(parsed.ok()) << parsed.ToStatus();
  EXPECT_EQ(parsed.scene.camera.kind, Camera::Kind::kPerspective);
  EXPECT_EQ(parsed.scene.camera.fov_deg, 90);
  EXPECT_EQ(parsed.scene.camera.camera_to_world, Transform());
  EXPECT_THAT(SaidOf(parsed), HasSubstr("warning: the scene has no Camera"));
}

TEST(PbrtParserTest, ANumberThatCannotBeReadIsOneError) {
  const std::string said = SaidOfWorld(
      "Shape \"sphere\" \"float radius\" [nan] Shape \"trianglemesh\" \"point3 P\" [0 0 x]\n"
      "Material \"dielectric\" \"float eta\" 1,5 LightSource \"point\" \"blackbody I\" hot");
  EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 4) << said;
}

TEST(PbrtParserTest, ParametersOfOtherFilmsAreKnown) {
  EXPECT_THAT(SaidOfPbrt("Film \"gbuffer\" \"string coordinatesystem\" \"world\" Film "
                         "\"spectral\" \"integer nbuckets\" 16 \"float lambdamin\" 360 \"float "
                         "lambdamax\" 830 Camera \"perspective\" WorldBegin"),
              Not(HasSubstr("unknown parameter")));
}

TEST(PbrtParserTest, DepthsOfPbrtThatHaveNoPlaceHere) {
  const auto parse = [](const std::string& depth) {
    return ParsePbrt("Integrator \"volpath\" \"integer maxdepth\" " + depth +
                     " Camera \"perspective\" WorldBegin");
  };
  const ParsedScene lights_alone = parse("0");
  EXPECT_EQ(lights_alone.scene.integrator.max_depth, 1);
  EXPECT_THAT(SaidOf(lights_alone), HasSubstr("warning: \"maxdepth\""));
  const ParsedScene endless = parse("-1");
  EXPECT_EQ(endless.scene.integrator.max_depth, 1000);
  EXPECT_THAT(SaidOf(endless), HasSubstr("warning: \"maxdepth\""));
  const ParsedScene long_paths = parse("10001");
  EXPECT_EQ(long_paths.scene.integrator.max_depth, 10000);
  EXPECT_THAT(SaidOf(long_paths), HasSubstr("is 10001 and is held at 10000"));
}

// Names that are put together while a material is read, with a prefix or without.
TEST(PbrtParserTest, MisspeltRoughnessesAreNamed) {
  const std::string said = SaidOfPbrt(
      "WorldBegin\n"
      "Material \"conductor\" \"float rougness\" 0.1 \"float vroughnes\" 0.1\n"
      "Material \"coatedconductor\" \"float interface.uroughnes\" 0.1\n"
      "Material \"coatedconductor\" \"float conductor.rougness\" 0.1\n");
  for (const char* name :
       {"roughness", "vroughness", "interface.uroughness", "conductor.roughness"})
    EXPECT_THAT(said, HasSubstr(std::string("did you mean \"") + name + "\"?"));
}

TEST(PbrtParserTest, OlderDialectsAreRefusedByNameAndByThatAlone) {
  for (const char* sign :
       {"Film \"image\" \"integer xresolution\" 9", "WorldBegin Material \"matte\"",
        "WorldBegin MakeNamedMaterial \"m\" \"string type\" \"uber\"", "WorldBegin WorldEnd",
        "SurfaceIntegrator \"path\""}) {
    const ParsedScene parsed = ParsePbrt(std::string("Nonsense\n") + sign);
    ASSERT_EQ(parsed.diagnostics.size(), 1U) << sign;
    EXPECT_EQ(parsed.diagnostics[0].message,
              "this is a pbrt-v3 file; convert it with \"pbrt --upgrade\"");
    EXPECT_EQ(parsed.diagnostics[0].line, 2);
  }
}

// ---- textures and environment maps

// A PFM of grey `value`s, row by row from the bottom.
std::string GreyPfm(int width, int height, float value) {
  std::string bytes = "Pf\n" + std::to_string(width) + " " + std::to_string(height) + "\n-1\n";
  char raw[4];
  std::memcpy(raw, &value, 4);
  for (int i = 0; i < width * height; ++i)
    bytes.append(raw, 4);
  return bytes;
}

TEST(PbrtTextureTest, ReadsWhatItIsMadeOf) {
  const Scene scene = ReadWorld(
      "Texture \"a\" \"spectrum\" \"imagemap\" \"string filename\" \"./m/a.pfm\" "
      "\"string wrap\" \"clamp\" \"float scale\" 2 \"bool invert\" true \"float uscale\" 3 "
      "\"float vscale\" 4 \"float udelta\" 5 \"float vdelta\" 6 \"string filter\" \"ewa\"\n"
      "Texture \"again\" \"spectrum\" \"imagemap\" \"string filename\" \"./m/a.pfm\"\n"
      "Texture \"half\" \"spectrum\" \"scale\" \"texture tex\" \"a\" \"float scale\" 0.5\n"
      "Texture \"board\" \"spectrum\" \"checkerboard\" \"texture tex1\" \"half\" "
      "\"rgb tex2\" [0.1 0.2 0.3]\n"
      "Texture \"flat\" \"spectrum\" \"constant\" \"rgb value\" [0.4 0.5 0.6]\n"
      "Material \"diffuse\" \"texture reflectance\" \"board\" Shape \"sphere\"\n"
      "Material \"conductor\" \"texture reflectance\" \"flat\" Shape \"sphere\"",
      {{"m/a.pfm", GreyPfm(2, 1, 0.25F)}});
  ASSERT_EQ(scene.textures.size(), 6U);
  const Texture& a = scene.textures[0];
  EXPECT_EQ(a.wrap_u, Texture::Wrap::kClamp);
  EXPECT_EQ(a.wrap_v, Texture::Wrap::kClamp);
  EXPECT_EQ(a.scale, 2);
  EXPECT_TRUE(a.is_inverted);
  EXPECT_EQ(a.mapping, (ByUv(3, 4, 5, 6)));
  EXPECT_EQ(a.picture, scene.textures[1].picture);  // in memory once
  const std::int32_t board =
      scene.materials[static_cast<std::size_t>(scene.spheres[0].traits.material)].texture;
  EXPECT_EQ(TextureColor(scene.textures, board, {{0.5F, 0.5F}, {}, {}}), Gray(0.25F));
  EXPECT_EQ(TextureColor(scene.textures, board, {{1.5F, 0.5F}, {}, {}}), (Rgb{0.1F, 0.2F, 0.3F}));
  const Material& metal =
      scene.materials[static_cast<std::size_t>(scene.spheres[1].traits.material)];
  EXPECT_EQ(TextureColor(scene.textures, metal.texture, {}), (Rgb{0.4F, 0.5F, 0.6F}));
}

TEST(PbrtTextureTest, SaysWhereATextureIsWrong) {
  const auto said = [](const std::string& world) {
    return SaidOfPbrt("Camera \"perspective\" WorldBegin\n" + world, {{"a.pfm", GreyPfm(2, 1, 2)}});
  };
  const std::string image = "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" ";
  EXPECT_THAT(said(image + "\"b.pfm\""),
              HasSubstr("s.pbrt:2:35: error: \"filename\" of Texture \"t\" cannot be read: b.pfm: "
                        "no such file"));
  EXPECT_THAT(said(image + "\"s.pbrt\""), HasSubstr("images are read as .png"));
  EXPECT_THAT(said(image + "\"a.pfm\""), HasSubstr("s.pbrt:2:1: warning: Texture \"t\" is up to 2 "
                                                   "and is held at 1"));
  EXPECT_THAT(said(image + "\"a.pfm\" \"string wrap\" \"mirror\""),
              HasSubstr("must be repeat, clamp or black"));
  EXPECT_THAT(said(image + "\"a.pfm\" \"string mapping\" \"box\""),
              HasSubstr("must be uv, planar, spherical or cylindrical"));
  EXPECT_THAT(said(image + "\"a.pfm\" \"string encoding\" \"gamma x\""),
              HasSubstr("sRGB, linear or gamma"));
  EXPECT_THAT(said("Material \"diffuse\" \"texture reflectance\" \"t\""),
              HasSubstr("s.pbrt:2:20: error: \"reflectance\" of Material \"diffuse\" refers to the "
                        "spectrum texture \"t\", which is not defined before it"));
  EXPECT_THAT(said("Texture \"t\" \"spectrum\" \"scale\" \"texture tex\" \"t\""),
              HasSubstr("not defined before it"));
  EXPECT_THAT(said(image + "\"a.pfm\" " + image + "\"a.pfm\""), HasSubstr("defined twice"));
}

// Scenes declare more than they use.
TEST(PbrtTextureTest, WhatIsNotSupportedIsRefusedOnlyWhereItIsUsed) {
  const std::string declared =
      "Texture \"f\" \"float\" \"ptex\" \"string filename\" \"none.ptx\"\n"
      "Texture \"m\" \"spectrum\" \"ptex\"\n";
  EXPECT_THAT(SaidOfWorld(declared), Not(HasSubstr("error")));
  EXPECT_THAT(SaidOfWorld(declared + "Material \"diffuse\" \"texture reflectance\" \"m\""),
              HasSubstr("s.pbrt:4:20: error: \"reflectance\" of Material \"diffuse\" refers to a "
                        "texture of type \"ptex\""));
  const std::string float_used =
      SaidOfWorld(declared + "Material \"conductor\" \"texture roughness\" \"f\"");
  EXPECT_THAT(float_used,
              HasSubstr("s.pbrt:4:22: error: \"roughness\" of Material \"conductor\" refers to a "
                        "texture of type \"ptex\""));
  EXPECT_EQ(std::count(float_used.begin(), float_used.end(), '\n'), 1);
}

TEST(PbrtParserTest, ShapesTakeNoMoreMemoryThanTheLimit) {
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float "
      "z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0 1 0 0 0 1 0 3 "
      "0 1 2\n";
  const std::string mesh = "Shape \"plymesh\" \"string filename\" \"m.ply\"\n";
  const std::string instance = "ObjectInstance \"o\"\n";
  SceneLimits limits;
  // Of a triangle: three vertices, three indices, and what a mesh takes itself.
  constexpr int kTriangles = 6;
  limits.max_shape_bytes = kTriangles * (3 * 12 + 3 * 4 + sizeof(TriangleMesh));
  const auto times = [](const std::string& text, int count) {
    std::string repeated;
    for (int i = 0; i < count; ++i)
      repeated += text;
    return repeated;
  };
  const auto said = [&](const std::string& text) {
    return SaidOfPbrt("Camera \"perspective\" WorldBegin LightSource \"infinite\"\n" + text,
                      {{"m.ply", ply}}, limits);
  };
  EXPECT_EQ(said(times(mesh, kTriangles)), "");
  EXPECT_THAT(
      said(times(mesh, kTriangles + 1)),
      HasSubstr("s.pbrt:8:1: error: with this, the shapes of the scene take more than the " +
                std::to_string(limits.max_shape_bytes) +
                " bytes of memory that there are for them; repeat meshes less often, or "
                "give meshes with fewer vertices"));
  // An object and its instances alike.
  EXPECT_THAT(said("ObjectBegin \"o\"\n" + mesh + "ObjectEnd\n" + times(instance, kTriangles)),
              HasSubstr("s.pbrt:10:1: error: with this, the shapes"));
}

TEST(PbrtTextureTest, PicturesTakeNoMoreMemoryThanTheLimit) {
  SceneLimits limits;
  limits.max_picture_bytes = 40;
  EXPECT_THAT(
      SaidOfPbrt("Camera \"perspective\" WorldBegin\n"
                 "Texture \"a\" \"spectrum\" \"imagemap\" \"string filename\" \"a.pfm\"\n"
                 "Texture \"b\" \"spectrum\" \"imagemap\" \"string filename\" \"b.pfm\"\n",
                 {{"a.pfm", GreyPfm(4, 2, 1)}, {"b.pfm", GreyPfm(3, 1, 1)}}, limits),
      HasSubstr("s.pbrt:3:35: error: \"filename\" of Texture \"b\" cannot be read: b.pfm: the "
                "image would take 12 bytes of memory, and 8 are left"));
}

TEST(PbrtParserTest, EnvironmentMapsAreSquareAndPlaced) {
  const std::map<std::string, std::string> files = {{"sky.pfm", GreyPfm(4, 4, 3)},
                                                    {"wide.pfm", GreyPfm(4, 2, 3)}};
  const Scene scene = ReadWorld(
      "Rotate 90 0 0 1 Scale 2 2 2 LightSource \"infinite\" \"string filename\" \"sky.pfm\" "
      "\"float scale\" 0.5",
      files);
  ASSERT_EQ(scene.infinite_lights.size(), 1U);
  EXPECT_EQ(scene.infinite_lights[0].map->width, 4);
  EXPECT_EQ(scene.infinite_lights[0].radiance, Gray(0.5F));
  ExpectNear(scene.infinite_lights[0].axes.x, {0, 1, 0});
  ExpectNear(scene.infinite_lights[0].axes.y, {-1, 0, 0});
  // A direction does not see a fourth row.
  const ParsedScene projective = ParsePbrt(
      "Camera \"perspective\" WorldBegin ConcatTransform [0 1 0 0  -1 0 0 0  0 0 1 8.9  0 0 0 1] "
      "LightSource \"infinite\" \"string filename\" \"sky.pfm\"",
      files);
  EXPECT_THAT(SaidOf(projective), HasSubstr("warning: LightSource \"infinite\" has a transform"));
  ASSERT_TRUE(projective.ok());
  ExpectNear(projective.scene.infinite_lights[0].axes.x, {0, 1, 0});
  ExpectNear(projective.scene.infinite_lights[0].axes.y, {-1, 0, 0});
  // Twice as bright as a constant light of that illuminance: 3 times the scale is 2 / pi.
  const Scene lux = ReadWorld(
      "LightSource \"infinite\" \"string filename\" \"sky.pfm\" \"float illuminance\" 1", files);
  EXPECT_NEAR(lux.infinite_lights[0].radiance.g * 3 * kPi, 2, 2e-2);

  const auto said = [&](const std::string& world) {
    return SaidOfPbrt("Camera \"perspective\" WorldBegin\n" + world, files);
  };
  EXPECT_THAT(
      said("LightSource \"infinite\" \"string filename\" \"wide.pfm\""),
      HasSubstr("s.pbrt:2:24: error: \"filename\" of LightSource \"infinite\" has 4 x 2 pixels"));
  EXPECT_THAT(said("Scale 1 2 1 LightSource \"infinite\" \"string filename\" \"sky.pfm\""),
              HasSubstr("is stretched by its transform"));
  EXPECT_THAT(said("LightSource \"infinite\" \"string filename\" \"sky.pfm\" \"rgb L\" [1 1 1]"),
              HasSubstr("exclude each other"));
}

TEST(PbrtParserTest, WhatIsNotSupportedIsAnErrorThatSaysSo) {
  const auto expect = [](const std::string& world, const std::string& part) {
    const std::string said = SaidOfWorld(world);
    EXPECT_THAT(said, HasSubstr("error: "));
    EXPECT_THAT(said, HasSubstr(part));
  };
  expect("Material \"dielectric\" \"texture eta\" \"t\"", "is a texture");
  expect("Material \"jelly\"", "there are diffuse, conductor, dielectric, interface");
  expect("Material \"coateddiffuse\" \"texture albedo\" \"t\"", "must not be a texture");
  expect("Material \"coateddiffuse\" \"float g\" 1", "g");
  expect("Material \"measured\"", "must name a .bsdf file");
  expect("Material \"measured\" \"string filename\" \"none.bsdf\"", "cannot be read");
  expect("Material \"fourier\"", "Fourier BSDFs");
  expect("Material \"conductor\" \"spectrum eta\" \"none.spd\"", "\"none.spd\" cannot be read");
  expect("MakeNamedMaterial \"m\" \"string type\" \"jelly\"", "\"jelly\"");
  expect("LightSource \"laser\"",
         "there are point, spot, goniometric, projection, distant and infinite");
  expect("LightSource \"infinite\" \"string filename\" \"sky.exr\"", "no such file");
  expect("Camera \"perspective\"", "before WorldBegin");
  EXPECT_THAT(
      SaidOfPbrt("Camera \"realistic\" \"string lensfile\" \"l.dat\" WorldBegin"),
      HasSubstr("Camera \"realistic\" is not supported: no rays are traced through lenses of "
                "a camera; use a perspective camera"));
}

TEST(PbrtParserTest, ReadsCoatedDiffuse) {
  const Scene scene = ReadWorld(
      "Material \"coateddiffuse\" Shape \"sphere\"\n"
      "Material \"coateddiffuse\" \"rgb reflectance\" [0.1 0.2 0.3] \"float roughness\" 0.25 "
      "\"float eta\" 1.3 \"float thickness\" 0.5 \"integer maxdepth\" 7 \"integer nsamples\" 2 "
      "\"float g\" 0.5 \"rgb albedo\" [0.2 0.4 0.6] Shape \"sphere\"");
  ASSERT_EQ(scene.materials.size(), 3U);
  const Material& plain = scene.materials[1];
  EXPECT_EQ(plain.kind, Material::Kind::kCoatedDiffuse);
  EXPECT_FALSE(plain.HasHaze());
  EXPECT_EQ(plain.reflectance, Gray(0.5F));
  EXPECT_EQ(plain.alpha_u, 0);
  EXPECT_EQ(plain.ior, 1.5F);
  EXPECT_EQ(plain.thickness, 0.01F);
  EXPECT_EQ(plain.base_hits, 5);
  const Material& other = scene.materials[2];
  EXPECT_EQ(other.reflectance, (Rgb{0.1F, 0.2F, 0.3F}));
  EXPECT_EQ(other.alpha_u, 0.5F);
  EXPECT_EQ(other.ior, 1.3F);
  EXPECT_EQ(other.thickness, 0.5F);
  EXPECT_EQ(other.base_hits, 4);
  EXPECT_EQ(other.coat_albedo, (Rgb{0.2F, 0.4F, 0.6F}));
  EXPECT_EQ(other.phase_g, 0.5F);
}

TEST(PbrtParserTest, ReadsCoatedConductor) {
  const Scene scene = ReadWorld(
      "Material \"coatedconductor\" Shape \"sphere\"\n"
      "Material \"coatedconductor\" \"rgb conductor.eta\" [1 2 3] \"rgb conductor.k\" [4 5 6] "
      "\"float conductor.roughness\" 0.25 \"float interface.uroughness\" 0.04 "
      "\"float interface.vroughness\" 0.09 \"float interface.eta\" 1.3 \"float thickness\" 0.5 "
      "\"integer maxdepth\" 7 Shape \"sphere\"\n"
      "Material \"coatedconductor\" \"rgb reflectance\" [0.5 0.5 0.5] Shape \"sphere\"");
  ASSERT_EQ(scene.materials.size(), 4U);
  const Material& plain = scene.materials[1];
  EXPECT_EQ(plain.kind, Material::Kind::kCoatedConductor);
  EXPECT_LT(plain.eta.r, plain.eta.b);  // copper
  EXPECT_EQ(plain.alpha_u, 0);
  EXPECT_EQ(plain.base_alpha_u, 0);
  EXPECT_EQ(plain.ior, 1.5F);
  EXPECT_EQ(plain.thickness, 0.01F);
  EXPECT_EQ(plain.base_hits, 5);
  const Material& other = scene.materials[2];
  EXPECT_EQ(other.eta, (Rgb{1, 2, 3}));
  EXPECT_EQ(other.k, (Rgb{4, 5, 6}));
  EXPECT_EQ(other.base_alpha_u, 0.5F);
  EXPECT_EQ(other.base_alpha_v, 0.5F);
  EXPECT_EQ(other.alpha_u, 0.2F);
  EXPECT_EQ(other.alpha_v, 0.3F);
  EXPECT_EQ(other.ior, 1.3F);
  EXPECT_EQ(other.thickness, 0.5F);
  EXPECT_EQ(other.base_hits, 4);
  EXPECT_EQ(scene.materials[3].eta, Gray(1));
  EXPECT_EQ(scene.materials[3].k.g, AbsorptionFor(0.5F));
}

TEST(PbrtParserTest, ReadsSheets) {
  const Scene scene = ReadWorld(
      "Texture \"t\" \"spectrum\" \"constant\" \"rgb value\" [0.5 0.5 0.5]\n"
      "Material \"diffusetransmission\" Shape \"sphere\"\n"
      "Material \"diffusetransmission\" \"rgb reflectance\" [0.4 0.4 0.4] "
      "\"texture transmittance\" \"t\" \"float scale\" 0.5 Shape \"sphere\"\n"
      "Material \"thindielectric\" \"float eta\" 1.7 Shape \"sphere\"");
  ASSERT_EQ(scene.materials.size(), 4U);
  EXPECT_EQ(scene.materials[1].reflectance, Gray(0.25F));
  EXPECT_EQ(scene.materials[1].transmittance, Gray(0.25F));
  EXPECT_EQ(scene.materials[2].reflectance, Gray(0.2F));
  EXPECT_NE(scene.materials[2].second_texture, kNoTexture);
  EXPECT_EQ(scene.materials[2].texture_scale, 0.5F);
  const Scene bright = ReadWorld(
      "Material \"diffusetransmission\" \"rgb reflectance\" [0.1 0.2 0.6] \"float scale\" 3 "
      "\"spectrum transmittance\" [300 0.5 800 0.5] Shape \"sphere\"");
  ExpectNear(bright.materials[1].reflectance, Rgb{0.3F, 0.6F, 1});
  ExpectNear(bright.materials[1].transmittance, Gray(1));
  EXPECT_EQ(bright.materials[1].given.spectra->transmittance.curve->At(500), 1);
  EXPECT_EQ(scene.materials[3].kind, Material::Kind::kThinDielectric);
  EXPECT_EQ(scene.materials[3].ior, 1.7F);
}

TEST(PbrtParserTest, ReadsSpectraFromFiles) {
  const Scene scene = ReadWorld(
      "Material \"conductor\" \"spectrum eta\" \"n.spd\" \"spectrum k\" [400 1 700 3] "
      "Shape \"sphere\"",
      {{"n.spd", "# index\n400 0\n700\t3 # of refraction\r\n"}});
  const MaterialSpectra& given = *scene.materials[1].given.spectra;
  EXPECT_DOUBLE_EQ(given.eta.curve->At(630), 2.3);
  EXPECT_DOUBLE_EQ(given.k.curve->At(532), 1.88);
}

TEST(PbrtParserTest, NeedsAWorld) {
  EXPECT_THAT(SaidOfPbrt(""), StartsWith("s.pbrt: error: the scene has no WorldBegin\n"));
  EXPECT_THAT(SaidOfPbrt("Shape \"sphere\""), HasSubstr("Shape must come after WorldBegin"));
}

TEST(PbrtParserTest, EveryUnknownDirectiveIsReported) {
  const std::string said = SaidOfWorld("Foo \"a\" [1 true]\nBar 1 2\nShape \"sphere\"\nBaz");
  EXPECT_THAT(said, HasSubstr("s.pbrt:2:1: error: unknown directive \"Foo\""));
  EXPECT_THAT(said, HasSubstr("s.pbrt:3:1: error: unknown directive \"Bar\""));
  EXPECT_THAT(said, HasSubstr("s.pbrt:5:1: error: unknown directive \"Baz\""));
  EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 3) << said;
}

// As pbrt-v4 has it.
TEST(PbrtParserTest, OfAParameterThatComesTwiceTheLastCounts) {
  const ParsedScene twice = ParseWorld(
      "LightSource \"infinite\"\nShape \"sphere\" \"float radius\" 1 \"float radius\" 2");
  EXPECT_EQ(
      SaidOf(twice),
      "s.pbrt:3:33: warning: parameter \"radius\" of Shape \"sphere\" is given twice; the last "
      "one counts\n");
  ASSERT_EQ(twice.scene.spheres.size(), 1U);
  EXPECT_EQ(twice.scene.spheres[0].radius, 2);
  EXPECT_EQ(SaidOfWorld("Shape \"sphere\" \"float radius\" 1 \"integer radius\" 2"),
            "s.pbrt:2:33: error: parameter \"radius\" of Shape \"sphere\" is given twice\n");
}

TEST(PbrtParserTest, AByteOrderMarkIsSkipped) {
  EXPECT_EQ(ParsePbrt("\xEF\xBB\xBF"
                      "Camera \"perspective\" WorldBegin Include \"a.pbrt\"",
                      {{"a.pbrt", "\xEF\xBB\xBFShape \"sphere\""}})
                .scene.spheres.size(),
            1U);
}

TEST(PbrtParserTest, BinaryFilesAndMissingFiles) {
  EXPECT_EQ(SaidOfPbrt(std::string("PNG\0\0", 5)),
            "s.pbrt: error: this is not a pbrt text file: it holds binary data\n");
  MemoryFiles none({});
  EXPECT_EQ(ReadScene(none, "s.pbrt").ToStatus().code(), absl::StatusCode::kInvalidArgument);
}

// A triangle is kept as long as its area is a normal float, whatever the product of its edges
// squared is.
TEST(PbrtParserTest, TinyAndHugeTrianglesAndNeedlesAreKept) {
  for (const std::string_view points :
       {"0 0 0 1e-12 0 0 0 1e-12 0", "0 0 0 1e15 0 0 0 1e15 0", "0 0 0 1 0 0 0.5 1e-20 0"}) {
    const Scene scene =
        ReadWorld("Shape \"trianglemesh\" \"point3 P\" [" + std::string(points) + "]");
    ASSERT_EQ(scene.meshes.size(), 1U) << points;
    EXPECT_THAT(scene.meshes[0].indices, ElementsAre(0, 1, 2)) << points;
  }
}

}  // namespace
}  // namespace lucerna
