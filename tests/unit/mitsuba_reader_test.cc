// What a Mitsuba scene says arrives in the scene as the same thing said in pbrt text, or in closed
// forms where pbrt has no word for it; and what is wrong in a file is refused in one sentence.
#include <array>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include <zlib.h>

#include "render/formats/mesh_placement.h"
#include "render/formats/mitsuba/meshes.h"
#include "render/formats/read_scene.h"
#include "render/math/equal_area_square.h"
#include "render/math/rng.h"
#include "render/math/warp.h"
#include "render/scene/texture.h"
#include "render/transport/bsdf.h"
#include "render/transport/microfacet.h"
#include "tests/support/measured_file.h"
#include "tests/support/memory_files.h"

namespace lucerna {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using Files = std::map<std::string, std::string>;

std::string Said(const ParsedScene& parsed) {
  std::string all;
  for (const Diagnostic& diagnostic : parsed.diagnostics)
    all += diagnostic.ToString() + "\n";
  return all;
}

constexpr std::string_view kView =
    "<sensor type='perspective'><float name='fov' value='40'/><film type='hdrfilm'>"
    "<integer name='width' value='64'/><integer name='height' value='64'/></film></sensor>"
    "<emitter type='constant'/>";

// A whole scene with this in it.
std::string Around(std::string_view body, std::string_view version = "3.0.0") {
  return "<scene version='" + std::string(version) + "'>" + std::string(kView) + std::string(body) +
         "</scene>";
}

ParsedScene ReadXml(const std::string& text, Files files = {}) {
  files["main.xml"] = text;
  MemoryFiles all(std::move(files));
  return ReadScene(all, "main.xml");
}

Scene SceneOf(std::string_view body, Files files = {}, std::string_view version = "3.0.0") {
  ParsedScene parsed = ReadXml(Around(body, version), std::move(files));
  EXPECT_TRUE(parsed.ok()) << Said(parsed);
  return std::move(parsed.scene);
}

Scene PbrtSceneOf(const std::string& world, const std::string& before = "Camera \"perspective\"") {
  MemoryFiles files(Files{{"main.pbrt", before + " WorldBegin LightSource \"infinite\" " + world}});
  ParsedScene parsed = ReadScene(files, "main.pbrt");
  EXPECT_TRUE(parsed.ok()) << Said(parsed);
  return std::move(parsed.scene);
}

void ExpectNear(Vec3 a, Vec3 b, float tolerance = 1e-5F) {
  EXPECT_LT(Length(a - b), tolerance) << "(" << a.x << ", " << a.y << ", " << a.z << ") and ("
                                      << b.x << ", " << b.y << ", " << b.z << ")";
}

void ExpectNear(Rgb a, Rgb b, float tolerance = 1e-5F) {
  ExpectNear(Vec3{a.r, a.g, a.b}, Vec3{b.r, b.g, b.b}, tolerance);
}

// What a bsdf and a pbrt material make, without their names.
MaterialNumbers MaterialOf(std::string_view bsdf, std::string_view version = "3.0.0") {
  const Scene scene =
      SceneOf("<shape type='sphere'>" + std::string(bsdf) + "</shape>", {}, version);
  return scene.materials.at(static_cast<std::size_t>(scene.spheres.at(0).traits.material));
}
MaterialNumbers PbrtMaterialOf(const std::string& material) {
  const Scene scene = PbrtSceneOf("Material " + material + " Shape \"sphere\"");
  return scene.materials.at(static_cast<std::size_t>(scene.spheres.at(0).traits.material));
}

std::string Float(std::string_view name, double value) {
  return "<float name='" + std::string(name) + "' value='" + std::to_string(value) + "'/>";
}

// ---- Views

TEST(MitsubaReaderTest, ACameraSeesWhatTheSameOneOfPbrtSees) {
  // Right and left are not exchanged: pbrt's camera has +x to the right and Mitsuba's to the left,
  // and their LookAt differ likewise.
  const ParsedScene read = ReadXml(
      "<scene version='3.0.0'><sensor type='perspective'><float name='fov' value='50'/>"
      "<transform name='to_world'><lookat origin='1, 2, 8' target='0.5 1 0' "
      "up='0,1,0'/></transform>"
      "<film type='hdrfilm'><integer name='width' value='200'/><integer name='height' value='100'/>"
      "</film></sensor><emitter type='constant'/><shape type='sphere'/></scene>");
  ASSERT_TRUE(read.ok()) << Said(read);
  const Camera& camera = read.scene.camera;
  const Vec3 right = camera.camera_to_world.Vector({1, 0, 0});
  const Vec3 up = camera.camera_to_world.Vector({0, 1, 0});
  const Vec3 forward = camera.camera_to_world.Vector({0, 0, 1});
  ExpectNear(camera.camera_to_world.Point({0, 0, 0}), {1, 2, 8});
  ExpectNear(forward, Normalize(Vec3{-0.5F, -1, -8}));
  // Looking along -z with y up, +x is to the right.
  EXPECT_GT(right.x, 0.9F);
  EXPECT_GT(up.y, 0.9F);
  // The given angle is along x, the wider side; the camera's is that of the other.
  EXPECT_NEAR(std::tan(camera.fov_deg / 2 * M_PI / 180), std::tan(25 * M_PI / 180) / 2, 1e-9);
  EXPECT_EQ(read.scene.film.width, 200);
  EXPECT_EQ(read.scene.film.height, 100);
}

TEST(MitsubaReaderTest, AnglesOfViewAreAlongTheAxisThatIsNamed) {
  const auto tangent = [](std::string_view axis, int width, int height) {
    const ParsedScene read = ReadXml(
        "<scene version='0.6.0'><sensor type='thinlens'><float name='fov' value='60'/>"
        "<string name='fovAxis' value='" +
        std::string(axis) +
        "'/>"
        "<float name='apertureRadius' value='0.25'/><float name='focusDistance' value='7'/>"
        "<film type='hdrfilm'><integer name='width' value='" +
        std::to_string(width) + "'/><integer name='height' value='" + std::to_string(height) +
        "'/></film></sensor><emitter type='constant'/><shape type='sphere'/></scene>");
    EXPECT_TRUE(read.ok()) << Said(read);
    EXPECT_EQ(read.scene.camera.lens_radius, 0.25);
    EXPECT_EQ(read.scene.camera.focal_distance, 7);
    return std::tan(read.scene.camera.fov_deg / 2 * M_PI / 180) / std::tan(M_PI / 6);
  };
  EXPECT_NEAR(tangent("x", 300, 400), 1, 1e-9);
  EXPECT_NEAR(tangent("y", 300, 400), 0.75, 1e-9);
  EXPECT_NEAR(tangent("smaller", 400, 300), 1, 1e-9);
  EXPECT_NEAR(tangent("larger", 400, 300), 0.75, 1e-9);
  EXPECT_NEAR(tangent("diagonal", 400, 300), 0.6, 1e-9);
}

TEST(MitsubaReaderTest, FilmIntegratorAndSamplerSetWhatTheySetInPbrt) {
  const ParsedScene read = ReadXml(
      "<scene version='3.0.0'><default name='spp' value='12'/><default name='spp' value='99'/>"
      "<integrator type='path'><integer name='max_depth' value='7'/></integrator>"
      "<sensor type='orthographic'><sampler type='independent'>"
      "<integer name='sample_count' value='$spp'/></sampler><film type='hdrfilm'>"
      "<integer name='width' value='40'/><integer name='height' value='20'/>"
      "<integer name='crop_offset_x' value='4'/><integer name='crop_offset_y' value='5'/>"
      "<integer name='crop_width' value='10'/><integer name='crop_height' value='8'/>"
      "<rfilter type='box'/></film></sensor><emitter type='constant'/><shape "
      "type='sphere'/></scene>");
  ASSERT_TRUE(read.ok()) << Said(read);
  EXPECT_EQ(read.scene.integrator.max_depth, 6);
  EXPECT_EQ(read.scene.integrator.pixel_samples, 12);
  EXPECT_EQ(read.scene.film.crop_x0, 4);
  EXPECT_EQ(read.scene.film.crop_x1, 14);
  EXPECT_EQ(read.scene.film.crop_y0, 5);
  EXPECT_EQ(read.scene.film.crop_y1, 13);
  EXPECT_EQ(read.scene.filter.kind, PixelFilter::Kind::kBox);
  // 2 wide, whatever the image's sides.
  const Window window = ScreenWindow(read.scene.camera, 40, 20);
  EXPECT_DOUBLE_EQ(window.high_x * read.scene.camera.window_scale, 1);
  EXPECT_DOUBLE_EQ(window.high_y * read.scene.camera.window_scale, 0.5);
}

// ---- Dialects

TEST(MitsubaReaderTest, BothDialectsSayTheSame) {
  const std::string newer =
      "<bsdf type='roughconductor' id='metal'><string name='material' value='Au'/>"
      "<string name='distribution' value='ggx'/><float name='alpha_u' value='0.1'/>"
      "<float name='alpha_v' value='0.3'/></bsdf>"
      "<shape type='sphere'><float name='radius' value='2'/><boolean name='flip_normals' "
      "value='true'/><transform name='to_world'><translate x='1' y='2'/></transform>"
      "<ref id='metal'/></shape>"
      "<emitter type='spot'><rgb name='intensity' value='1, 2, 3'/><float name='cutoff_angle' "
      "value='30'/><float name='beam_width' value='20'/></emitter>";
  std::string older = newer;
  for (const auto& [from, to] :
       std::vector<std::pair<std::string, std::string>>{{"alpha_u", "alphaU"},
                                                        {"alpha_v", "alphaV"},
                                                        {"flip_normals", "flipNormals"},
                                                        {"to_world", "toWorld"},
                                                        {"cutoff_angle", "cutoffAngle"},
                                                        {"beam_width", "beamWidth"}}) {
    older.replace(older.find(from), from.size(), to);
  }
  const Scene a = SceneOf(newer);
  const Scene b = SceneOf(older, {}, "0.6.0");
  EXPECT_EQ(a.materials, b.materials);
  ASSERT_EQ(a.spheres.size(), 1U);
  ASSERT_EQ(b.spheres.size(), 1U);
  ExpectNear(a.spheres[0].center, {1, 2, 0});
  ExpectNear(b.spheres[0].center, {1, 2, 0});
  EXPECT_EQ(a.spot_lights.at(0).cos_total_width, b.spot_lights.at(0).cos_total_width);
  EXPECT_FLOAT_EQ(a.spot_lights.at(0).cos_falloff_start, std::cos(static_cast<float>(M_PI / 9)));
  EXPECT_EQ(a.materials.at(1).alpha_u, 0.1F);
  EXPECT_EQ(a.materials.at(1).alpha_v, 0.3F);
}

TEST(MitsubaReaderTest, StepsOfATransformAreAppliedInTheirOrder) {
  const Scene scene = SceneOf(
      "<shape type='rectangle'><transform name='to_world'><scale x='2' y='3'/>"
      "<rotate z='1' angle='90'/><translate x='10'/>"
      "<matrix value='1 0 0 0  0 1 0 0  0 0 1 5  0 0 0 1'/></transform></shape>");
  ASSERT_EQ(scene.meshes.size(), 1U);
  // (1, 1, 0) -> (2, 3, 0) -> (-3, 2, 0) -> (7, 2, 0) -> (7, 2, 5).
  ExpectNear(scene.meshes[0].positions.at(2), {7, 2, 5});
}

// ---- Materials

TEST(MitsubaReaderTest, MaterialsAreThoseOfPbrt) {
  EXPECT_EQ(MaterialOf("<bsdf type='diffuse'><rgb name='reflectance' value='.1 .2 .3'/></bsdf>"),
            PbrtMaterialOf("\"diffuse\" \"rgb reflectance\" [.1 .2 .3]"));
  EXPECT_EQ(MaterialOf("<bsdf type='twosided'><bsdf type='diffuse'/></bsdf>"),
            PbrtMaterialOf("\"diffuse\""));
  EXPECT_EQ(MaterialOf("<bsdf type='dielectric'>" + Float("int_ior", 1.5) + Float("ext_ior", 1.2) +
                       "</bsdf>"),
            PbrtMaterialOf("\"dielectric\" \"float eta\" 1.25"));
  EXPECT_FLOAT_EQ(MaterialOf("<bsdf type='dielectric'/>").ior, 1.5046F / 1.000277F);
  EXPECT_FLOAT_EQ(
      MaterialOf("<bsdf type='dielectric'><string name='int_ior' value='water'/></bsdf>").ior,
      1.333F / 1.000277F);
  EXPECT_EQ(MaterialOf("<bsdf type='roughdielectric'>" + Float("alpha", 0.3) +
                       Float("int_ior", 1.5) + Float("ext_ior", 1) + "</bsdf>"),
            PbrtMaterialOf("\"dielectric\" \"float eta\" 1.5 \"float roughness\" 0.3 "
                           "\"bool remaproughness\" false"));
  EXPECT_EQ(MaterialOf("<bsdf type='thindielectric'>" + Float("int_ior", 1.5) +
                       Float("ext_ior", 1) + "</bsdf>"),
            PbrtMaterialOf("\"thindielectric\" \"float eta\" 1.5"));
  EXPECT_EQ(MaterialOf("<bsdf type='conductor'><string name='material' value='Ag'/></bsdf>"),
            PbrtMaterialOf("\"conductor\" \"spectrum eta\" \"metal-Ag-eta\" \"spectrum k\" "
                           "\"metal-Ag-k\""));
  EXPECT_EQ(MaterialOf("<bsdf type='roughconductor'><rgb name='eta' value='.2 .9 1.1'/>"
                       "<rgb name='k' value='3 2 1.8'/></bsdf>"),
            PbrtMaterialOf("\"conductor\" \"rgb eta\" [.2 .9 1.1] \"rgb k\" [3 2 1.8] "
                           "\"float roughness\" 0.1 \"bool remaproughness\" false"));
  EXPECT_EQ(MaterialOf("<bsdf type='difftrans'><rgb name='transmittance' value='.4'/></bsdf>"),
            PbrtMaterialOf("\"diffusetransmission\" \"rgb transmittance\" [.4 .4 .4] "
                           "\"rgb reflectance\" [0 0 0]"));
}

TEST(MitsubaReaderTest, ReadsMeasuredSurfaces) {
  MetalToMeasure metal;
  metal.knots = 3;
  metal.thetas = 2;
  const std::string body =
      "<shape type='sphere'><bsdf type='measured'><string name='filename' value='a.bsdf'/></bsdf>"
      "</shape>";
  const Scene scene = SceneOf(body, {{"a.bsdf", MeasuredFile(MeasureMetal(metal))}});
  const Material& material = scene.materials.at(scene.spheres.at(0).traits.material);
  ASSERT_EQ(material.kind, Material::Kind::kMeasured);
  EXPECT_EQ(*material.measured, MeasuredTable(MeasureMetal(metal)));
  const ParsedScene without = ReadXml(Around(body));
  EXPECT_THAT(Said(without), HasSubstr("cannot be read: a.bsdf: no such file"));
}

TEST(MitsubaReaderTest, AConductorWithoutConstantsIsAMirrorOrInOlderFilesCopper) {
  const MaterialNumbers mirror = MaterialOf("<bsdf type='conductor'/>");
  EXPECT_EQ(mirror, PbrtMaterialOf("\"conductor\" \"rgb reflectance\" [1 1 1]"));
  EXPECT_EQ(MaterialOf("<bsdf type='conductor'/>", "0.6.0"), PbrtMaterialOf("\"conductor\""));
}

TEST(MitsubaReaderTest, APlasticReflectsAsMuchOfTheLightBelowItsCoatAsMitsubaSays) {
  // F is the share of diffuse light that the coat reflects back to the base: 0.596 at 1.49, by
  // integrating Fresnel's formula.
  const double index = 1.49 / 1.000277;
  double inside = 0;
  const int kSteps = 100'000;
  for (int i = 0; i < kSteps; ++i) {
    const double cosine2 = (i + 0.5) / kSteps;  // of a cosine-weighted direction
    const double sine2_out = index * index * (1 - cosine2);
    double reflected = 1;
    if (sine2_out < 1) {
      const double in = std::sqrt(cosine2);
      const double out = std::sqrt(1 - sine2_out);
      const double parallel = (in - index * out) / (in + index * out);
      const double perpendicular = (index * in - out) / (index * in + out);
      reflected = (parallel * parallel + perpendicular * perpendicular) / 2;
    }
    inside += reflected / kSteps;
  }
  for (const double rho : {0.1, 0.5, 0.9}) {
    const MaterialNumbers material =
        MaterialOf("<bsdf type='plastic'><rgb name='diffuse_reflectance' value='" +
                   std::to_string(rho) + "'/></bsdf>");
    EXPECT_EQ(material.kind, Material::Kind::kCoatedDiffuse);
    EXPECT_EQ(material.thickness, 0);
    const auto base = static_cast<double>(material.reflectance.g);
    // The fit of F that Mitsuba and this use is within 0.01 of it.
    EXPECT_NEAR(base / (1 - base * inside) / (rho / (1 - inside)), 1, 0.03) << rho;
    const MaterialNumbers nonlinear = MaterialOf(
        "<bsdf type='plastic'><boolean name='nonlinear' value='true'/>"
        "<rgb name='diffuse_reflectance' value='" +
        std::to_string(rho) + "'/></bsdf>");
    EXPECT_FLOAT_EQ(nonlinear.reflectance.g, static_cast<float>(rho));
  }
}

// The rougher a coat is, the less it reflects back: what is left of the light is that of random
// facets that are drawn as they are seen.
TEST(MitsubaReaderTest, ARoughPlasticReflectsAsMuchBelowItsCoatAsItsFacetsDo) {
  const double index = 1.49 / 1.000277;
  constexpr float kAlpha = 0.3F;
  constexpr double kRho = 0.5;
  KeyedRng rng(5);
  constexpr int kSamples = 200'000;
  const Ggx facets(kAlpha, kAlpha);
  double inside = 0;
  for (int i = 0; i < kSamples; ++i) {
    const float u1 = rng.Uniform();
    const Vec3 w = SquareToCosineHemisphere(u1, rng.Uniform());
    const float u2 = rng.Uniform();
    const Vec3 m = facets.SampleVisible(w, u2, rng.Uniform());
    const Vec3 out = ReflectAt(w, m);
    float cos_t = 0;
    if (Dot(w, m) > 0 && out.z > 0) {
      inside += static_cast<double>(
          FresnelDielectric(Dot(w, m), static_cast<float>(1 / index), cos_t) * facets.G1(out));
    }
  }
  inside /= kSamples;
  const MaterialNumbers material = MaterialOf(
      "<bsdf type='roughplastic'><string name='distribution' value='ggx'/>"
      "<float name='alpha' value='0.3'/><rgb name='diffuse_reflectance' value='0.5'/></bsdf>");
  // 0.5 % of four standard errors of the mean, and as much of the sum.
  EXPECT_NEAR(static_cast<double>(material.reflectance.g), kRho / (1 - inside + kRho * inside),
              0.01);
}

// In Mitsuba an encoding is that of all files, and opacity is no number.
TEST(MitsubaReaderTest, PicturesOfNumbersAreWhatTheirColoursSay) {
  // One pixel of a TGA: blue, green, red, opacity.
  const std::string tga = std::string({0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 1, 0, 32, 8}) +
                          std::string(3, '\x80') + std::string(1, '\x20');
  const Scene scene = SceneOf(
      "<shape type='rectangle'><bsdf type='mask'><texture type='bitmap' name='opacity'><boolean "
      "name='raw' value='true'/><string name='filename' value='a.tga'/><string name='filter_type' "
      "value='nearest'/></texture><bsdf type='diffuse'/></bsdf></shape>",
      {{"a.tga", tga}});
  const Texture& opacity = scene.textures.at(0);
  EXPECT_NEAR(opacity.picture->At(0, 0).g, 128.0F / 255, 1e-6F);
  EXPECT_TRUE(opacity.is_nearest);
}

TEST(MitsubaReaderTest, AMirrorDoesNotTurnRoundShapesOver) {
  const std::string mirror = "<transform name='to_world'><scale x='-1' y='1' z='1'/></transform>";
  for (const std::string emitter : {"", "<emitter type='area'/>"}) {
    const Scene scene = SceneOf("<shape type='sphere'>" + mirror + emitter +
                                "</shape><shape type='disk'>" + mirror + emitter + "</shape>");
    EXPECT_FALSE(scene.spheres.at(0).inward);
    EXPECT_GT(scene.disks.at(0).normal.z, 0);
  }
  // Those that show a texture are meshes.
  const Scene textured = SceneOf("<shape type='disk'>" + mirror +
                                 "<bsdf type='diffuse'><texture type='checkerboard' "
                                 "name='reflectance'/></bsdf></shape>");
  for (const Vec3 normal : textured.meshes.at(0).normals)
    EXPECT_GT(normal.z, 0);
}

TEST(MitsubaReaderTest, BlendsMasksAndBumpsAreMixesAlphaAndDisplacement) {
  const Scene scene = SceneOf(
      "<bsdf type='diffuse' id='a'><rgb name='reflectance' value='.1'/></bsdf>"
      "<shape type='sphere'><bsdf type='mask'><float name='opacity' value='0.25'/>"
      "<bsdf type='blendbsdf'><float name='weight' value='0.75'/><ref id='a'/>"
      "<bsdf type='diffuse'><rgb name='reflectance' value='.9'/></bsdf></bsdf></bsdf></shape>"
      "<shape type='sphere'><bsdf type='bumpmap'><float name='scale' value='2'/>"
      "<texture type='checkerboard'><float name='color0' value='0'/><float name='color1' "
      "value='1'/></texture><ref id='a'/></bsdf></shape>");
  ASSERT_EQ(scene.spheres.size(), 2U);
  EXPECT_EQ(scene.spheres[0].traits.alpha, 0.25F);
  const Material& mix =
      scene.materials.at(static_cast<std::size_t>(scene.spheres[0].traits.material));
  ASSERT_EQ(mix.kind, Material::Kind::kMix);
  EXPECT_EQ(mix.amount, 0.75F);
  EXPECT_FLOAT_EQ(scene.materials.at(static_cast<std::size_t>(mix.mixed[0])).reflectance.r, 0.1F);
  EXPECT_FLOAT_EQ(scene.materials.at(static_cast<std::size_t>(mix.mixed[1])).reflectance.r, 0.9F);
  const Material& bumpy =
      scene.materials.at(static_cast<std::size_t>(scene.spheres[1].traits.material));
  ASSERT_NE(bumpy.displacement, kNoTexture);
  EXPECT_EQ(scene.textures.at(static_cast<std::size_t>(bumpy.displacement)).kind,
            Texture::Kind::kScaled);
}

TEST(MitsubaReaderTest, AMaterialThatIsUsedTwiceIsOne) {
  const Scene scene = SceneOf(
      "<bsdf type='diffuse' id='a'/><shape type='sphere'><ref id='a'/></shape>"
      "<shape type='disk'><ref id='a'/></shape>");
  EXPECT_EQ(scene.materials.size(), 2U);
  EXPECT_EQ(scene.spheres.at(0).traits.material, scene.disks.at(0).traits.material);
}

// ---- Textures

// The colour of the only mesh's material where Mitsuba's place on its rectangle is (u, v).
Rgb ColorAt(const Scene& scene, float u, float v) {
  const TriangleMesh& mesh = scene.meshes.at(0);
  const Material& material = scene.materials.at(static_cast<std::size_t>(mesh.traits.material));
  // The corners of the rectangle are (-1, -1), (1, -1), (1, 1), (-1, 1); Mitsuba's place of the
  // first is (0, 0).
  const Vec2 a = mesh.uvs.at(0);
  const Vec2 b = mesh.uvs.at(1);
  const Vec2 d = mesh.uvs.at(3);
  const TexturePlace place = {
      {a.x + u * (b.x - a.x) + v * (d.x - a.x), a.y + u * (b.y - a.y) + v * (d.y - a.y)},
      {},
      {0, 0, 1}};
  return TextureColor(scene.textures, material.texture, place);
}

// Two by two pixels: red green over blue white.
const std::string kFourPixels = [] {
  std::string pfm = "PF\n2 2\n-1\n";
  // From the bottom up.
  const std::array<float, 12> rows = {0, 0, 1, 1, 1, 1, 1, 0, 0, 0, 1, 0};
  pfm.append(reinterpret_cast<const char*>(rows.data()), sizeof(rows));
  return pfm;
}();

// One pixel of 0.5.
const std::string kGreyPixels = [] {
  std::string pfm = "PF\n1 1\n-1\n";
  const std::array<float, 3> pixel = {0.5F, 0.5F, 0.5F};
  pfm.append(reinterpret_cast<const char*>(pixel.data()), sizeof(pixel));
  return pfm;
}();

std::string Textured(std::string_view texture) {
  return "<shape type='rectangle'><bsdf type='diffuse'>" + std::string(texture) + "</bsdf></shape>";
}

// Of a bitmap each pixel is what the colour would be.
TEST(MitsubaReaderTest, APictureBelowACoatIsAsItsColoursWouldBe) {
  const auto scene_of = [](const std::string& more) {
    return SceneOf("<shape type='rectangle'><bsdf type='plastic'>" + more +
                       "<texture type='bitmap' name='diffuse_reflectance'><string name='filename' "
                       "value='grey.pfm'/></texture></bsdf></shape>",
                   {{"grey.pfm", kGreyPixels}});
  };
  const MaterialNumbers alone =
      MaterialOf("<bsdf type='plastic'><rgb name='diffuse_reflectance' value='0.5'/></bsdf>");
  const Scene linear = scene_of("");
  ExpectNear(ColorAt(linear, 0.5F, 0.5F), alone.reflectance);
  EXPECT_GT(alone.reflectance.g, 0.6F);
  const Scene nonlinear = scene_of("<boolean name='nonlinear' value='true'/>");
  ExpectNear(ColorAt(nonlinear, 0.5F, 0.5F), {0.5F, 0.5F, 0.5F});
}

TEST(MitsubaReaderTest, PicturesHaveTheirTopWhereVIsZero) {
  const Scene scene = SceneOf(Textured("<texture type='bitmap' name='reflectance'>"
                                       "<string name='filename' value='four.pfm'/></texture>"),
                              {{"four.pfm", kFourPixels}});
  ExpectNear(ColorAt(scene, 0.25F, 0.25F), {1, 0, 0});
  ExpectNear(ColorAt(scene, 0.75F, 0.25F), {0, 1, 0});
  ExpectNear(ColorAt(scene, 0.25F, 0.75F), {0, 0, 1});
  ExpectNear(ColorAt(scene, 0.75F, 0.75F), {1, 1, 1});
}

TEST(MitsubaReaderTest, PlacementsOfTexturesAreMitsubas) {
  const Scene scene =
      SceneOf(Textured("<texture type='bitmap' name='reflectance'><string name='filename' "
                       "value='four.pfm'/><transform name='to_uv'><scale x='0.5' y='0.25'/>"
                       "<translate x='0.5' y='0.125'/></transform></texture>"),
              {{"four.pfm", kFourPixels}});
  // Mitsuba's (0.5, 0.5) -> (0.75, 0.25): green.
  ExpectNear(ColorAt(scene, 0.5F, 0.5F), {0, 1, 0});
}

TEST(MitsubaReaderTest, ACheckerboardHasTwoCellsToAUnitAndBeginsWithColor0) {
  const Scene scene = SceneOf(Textured(
      "<texture type='checkerboard' name='reflectance'><rgb name='color0' value='.8'/>"
      "<rgb name='color1' value='.1'/><transform name='to_uv'><scale x='2' y='3'/></transform>"
      "</texture>"));
  for (int i = 0; i < 400; ++i) {
    const float u = (static_cast<float>(i % 20) + 0.5F) / 20;
    const float v = (static_cast<float>(i / 20) + 0.5F) / 20;
    const int cells = static_cast<int>(2 * 2 * u) + static_cast<int>(2 * 3 * v);
    EXPECT_FLOAT_EQ(ColorAt(scene, u, v).g, cells % 2 == 0 ? 0.8F : 0.1F) << u << " " << v;
  }
}

// ---- Lights

TEST(MitsubaReaderTest, LightsHaveTheStrengthThatIsGiven) {
  const Scene scene = SceneOf(
      "<emitter type='point'><point name='position' x='1' y='2' z='3'/><spectrum "
      "name='intensity' value='5'/></emitter>"
      "<emitter type='directional'><vector name='direction' x='0' y='-2' z='0'/>"
      "<rgb name='irradiance' value='3 2 1'/></emitter>"
      "<shape type='rectangle'><emitter type='area'><rgb name='radiance' value='7'/></emitter>"
      "</shape>");
  ExpectNear(scene.point_lights.at(0).position, {1, 2, 3});
  ExpectNear(scene.point_lights.at(0).intensity, Gray(5));
  ExpectNear(scene.distant_lights.at(0).direction, {0, -1, 0});
  ExpectNear(scene.distant_lights.at(0).irradiance, {3, 2, 1});
  ExpectNear(scene.infinite_lights.at(0).radiance, Gray(1));
  ASSERT_EQ(scene.meshes.size(), 1U);
  ExpectNear(
      scene.area_lights.at(static_cast<std::size_t>(scene.meshes[0].traits.area_light)).radiance,
      Gray(7));
  // A rectangle shines towards +z.
  EXPECT_GT(EdgeCross(scene.meshes[0], 0).z, 0);
}

TEST(MitsubaReaderTest, AnAreaLightMayShowAPicture) {
  const Scene scene = SceneOf(
      "<shape type='rectangle'><emitter type='area'><texture type='bitmap' name='radiance'>"
      "<string name='filename' value='two.pfm'/><string name='wrap_mode' value='mirror'/>"
      "<transform name='to_uv'><scale x='2' y='1'/></transform></texture></emitter></shape>",
      {{"two.pfm", [] {
          std::string pfm = "PF\n2 1\n-1\n";
          const std::array<float, 6> pixels = {0, 0, 0, 3, 2, 1};
          pfm.append(reinterpret_cast<const char*>(pixels.data()), sizeof(pixels));
          return pfm;
        }()}});
  ASSERT_EQ(scene.area_lights.size(), 1U);
  const AreaLight& light = scene.area_lights[0];
  ASSERT_NE(light.picture, nullptr);
  EXPECT_EQ(light.largest_pixel, 3);
  EXPECT_EQ(light.wrap_u, Texture::Wrap::kMirror);
  // The second pixel is around u = 3/8 and, mirrored, 5/8.
  EXPECT_EQ(light.PixelAt({0.375F, 0.5F}), (Rgb{3, 2, 1}));
  EXPECT_EQ(light.PixelAt({0.625F, 0.5F}), (Rgb{3, 2, 1}));
  EXPECT_EQ(light.PixelAt({0.125F, 0.5F}), Rgb());
}

TEST(MitsubaReaderTest, ALightThatIsTheSameAtAllWavelengthsHasItsValueAsLuminance) {
  const Scene scene =
      SceneOf("<emitter type='point'><spectrum name='intensity' value='360:4, 830:4'/></emitter>");
  EXPECT_NEAR(Luminance(scene.point_lights.at(0).intensity), 4, 0.02);
}

TEST(MitsubaReaderTest, EnvironmentMapsShowEachDirectionWhatTheirPictureHasThere) {
  // 8 x 4 patches of 16 x 16 pixels, each with a colour of its own.
  std::string pfm = "PF\n128 64\n-1\n";
  for (int y = 63; y >= 0; --y) {
    for (int x = 0; x < 128; ++x) {
      const std::array<float, 3> pixel = {static_cast<float>(x / 16), static_cast<float>(y / 16),
                                          1};
      pfm.append(reinterpret_cast<const char*>(pixel.data()), sizeof(pixel));
    }
  }
  const Scene scene = SceneOf(
      "<emitter type='envmap'><string name='filename' value='sky.pfm'/><float name='scale' "
      "value='2'/></emitter><shape type='sphere'/>",
      {{"sky.pfm", pfm}});
  ASSERT_EQ(scene.infinite_lights.size(), 2U);
  const InfiniteLight& light = scene.infinite_lights[1];
  EXPECT_EQ(light.radiance.g, 2);
  double mean = 0;
  for (int i = 0; i < light.map->width * light.map->height; ++i)
    mean += static_cast<double>(light.map->At(i % light.map->width, i / light.map->width).g);
  mean /= light.map->width * light.map->height;
  // Rows of a latitude map cover 1 - cos of their angle: sum over rows of y (cos - cos) / 2.
  double expected = 0;
  for (int y = 0; y < 4; ++y)
    expected += y * (std::cos(y * M_PI / 4) - std::cos((y + 1) * M_PI / 4)) / 2;
  EXPECT_NEAR(mean, expected, 2e-3);
  // Middles of the patches of the second row: 67.5 degrees from +y, the first 22.5 degrees around
  // from -z towards +x.
  const auto at = [&](double around, double from_top) {
    const Vec3 direction = {static_cast<float>(std::sin(from_top) * std::sin(around)),
                            static_cast<float>(std::cos(from_top)),
                            static_cast<float>(-std::sin(from_top) * std::cos(around))};
    const Vec2 place = EqualAreaPlace(direction);
    return light.map->At(static_cast<int>(place.x * static_cast<float>(light.map->width)),
                         static_cast<int>(place.y * static_cast<float>(light.map->height)));
  };
  for (int x = 0; x < 8; ++x) {
    const Rgb seen = at((x + 0.5) * M_PI / 4, 1.5 * M_PI / 4);
    EXPECT_FLOAT_EQ(seen.r, static_cast<float>(x));
    EXPECT_FLOAT_EQ(seen.g, 1);
  }
}

// ---- Media, groups

TEST(MitsubaReaderTest, MediaAreThoseOfPbrt) {
  const Scene scene = SceneOf(
      "<medium type='homogeneous' id='fog'><rgb name='sigma_t' value='2 1 0.5'/>"
      "<float name='albedo' value='0.25'/><float name='scale' value='4'/>"
      "<phase type='hg'><float name='g' value='0.5'/></phase></medium>"
      "<shape type='sphere'><bsdf type='null'/><ref name='interior' id='fog'/></shape>");
  ASSERT_EQ(scene.media.size(), 1U);
  ExpectNear(scene.media[0].scattering, {2, 1, 0.5F});
  ExpectNear(scene.media[0].absorption, {6, 3, 1.5F});
  EXPECT_EQ(scene.media[0].g, 0.5F);
  EXPECT_EQ(scene.spheres.at(0).traits.medium_inside, 0);
  EXPECT_EQ(scene.spheres.at(0).traits.medium_outside, kNoMedium);
  EXPECT_EQ(scene.camera.medium, kNoMedium);
}

TEST(MitsubaReaderTest, InstancesRepeatTheirGroup) {
  const Scene scene = SceneOf(
      "<shape type='shapegroup' id='g'><shape type='cube'><transform name='to_world'>"
      "<translate x='1'/></transform></shape></shape>"
      "<shape type='instance'><ref id='g'/><transform name='to_world'><scale value='2'/>"
      "</transform></shape><shape type='instance'><ref id='g'/></shape>");
  ASSERT_EQ(scene.meshes.size(), 2U);
  Bounds first;
  for (const Vec3& position : scene.meshes[0].positions)
    first.Add(position);
  ExpectNear(first.low, {0, -2, -2});
  ExpectNear(first.high, {4, 2, 2});
}

TEST(MitsubaReaderTest, ACubeHasSixSidesThatFaceOutward) {
  const TriangleMesh cube = UnitCube();
  ASSERT_EQ(cube.indices.size(), 36U);
  double area = 0;
  for (std::size_t i = 0; i < 12; ++i) {
    const Double3 cross = EdgeCross(cube, i);
    const Double3 corner(cube.positions[cube.indices[3 * i]]);
    EXPECT_GT(Dot(cross, corner), 0);
    ExpectNear(ToFloat(cross * (1 / Length(cross))), cube.normals[cube.indices[3 * i]]);
    area += Length(cross) / 2;
  }
  EXPECT_DOUBLE_EQ(area, 24);
}

TEST(MitsubaReaderTest, ACylinderStandsBetweenItsEnds) {
  const Scene scene = SceneOf(
      "<shape type='cylinder'><point name='p0' x='1' y='1' z='1'/><point name='p1' x='1' y='4' "
      "z='1'/><float name='radius' value='0.5'/></shape>");
  Bounds box;
  for (const Vec3& position : scene.meshes.at(0).positions)
    box.Add(position);
  ExpectNear(box.low, {0.5F, 1, 0.5F}, 2e-3F);
  ExpectNear(box.high, {1.5F, 4, 1.5F}, 2e-3F);
}

// ---- Mesh files

TEST(MitsubaReaderTest, ObjFilesOfPolygonsAndNegativeIndicesAreRead) {
  const std::string obj =
      "# a house front\nv 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 2 0\nv 0 1 0\nvt 0 0\nvt 1 0\n"
      "vt 1 1\nvt .5 1\nvt 0 1\ng front\nf -5/1 -4/2 -3/3 -2/4 -1/5\n";
  const auto mesh = ParseObj(obj);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(mesh->indices.size(), 9U);
  EXPECT_EQ(mesh->positions.size(), 5U);
  double area = 0;
  for (std::size_t i = 0; i < 3; ++i)
    area += EdgeCross(*mesh, i).z / 2;
  EXPECT_DOUBLE_EQ(area, 3);
  // By default the texture coordinates of OBJ files have v = 0 at the bottom, as here.
  const Scene scene = SceneOf(
      "<shape type='obj'><string name='filename' value='house.obj'/></shape>"
      "<shape type='obj'><string name='filename' value='house.obj'/><boolean "
      "name='flip_tex_coords' value='false'/><boolean name='face_normals' value='true'/></shape>",
      {{"house.obj", obj}});
  ASSERT_EQ(scene.meshes.size(), 2U);
  EXPECT_EQ(scene.meshes[0].uvs.at(3).y, 1);
  EXPECT_EQ(scene.meshes[1].uvs.at(3).y, 0);
  EXPECT_EQ(scene.meshes[0].normals.size(), 5U);
  EXPECT_TRUE(scene.meshes[1].normals.empty());
}

TEST(MitsubaReaderTest, ObjFilesThatAreWrongAreRefused) {
  for (const std::string obj : {"", "v 0 0 0\n", "v 0 0 0\nf 1 2 3\n", "f 1 2 3\n"}) {
    EXPECT_FALSE(ParseObj(obj).ok()) << obj;
  }
}

TEST(MitsubaReaderTest, NormalsWithoutAFileFollowTheSurface) {
  TriangleMesh cube = UnitCube();
  // Each corner of the cube once: angles of its three sides are equal, so that their mean points
  // along the diagonal however they are cut into triangles.
  TriangleMesh joined;
  for (const std::uint32_t index : cube.indices) {
    const Vec3 position = cube.positions[index];
    std::uint32_t found = 0;
    while (found < joined.positions.size() && Length(joined.positions[found] - position) > 0)
      ++found;
    if (found == joined.positions.size()) joined.positions.push_back(position);
    joined.indices.push_back(found);
  }
  ComputeNormals(joined);
  ASSERT_EQ(joined.normals.size(), 8U);
  for (std::size_t i = 0; i < 8; ++i)
    ExpectNear(joined.normals[i], Normalize(joined.positions[i]), 1e-6F);
}

std::string Deflated(const std::string& bytes) {
  uLongf size = compressBound(bytes.size());
  std::string packed(size, '\0');
  compress(reinterpret_cast<Bytef*>(packed.data()), &size,
           reinterpret_cast<const Bytef*>(bytes.data()), bytes.size());
  packed.resize(size);
  return packed;
}

template <typename Number>
void Append(std::string& bytes, Number number) {
  bytes.append(reinterpret_cast<const char*>(&number), sizeof(number));
}

// Two meshes, the second of doubles with normals, texture coordinates and colours.
std::string SerializedFile(std::uint16_t version) {
  std::string file;
  std::vector<std::uint64_t> begins;
  for (const bool is_second : {false, true}) {
    begins.push_back(file.size());
    std::string mesh;
    Append<std::uint32_t>(mesh, is_second ? 0x200BU : 0x1000U);
    if (version == 4) mesh += std::string("name") + '\0';
    Append<std::uint64_t>(mesh, 3);
    Append<std::uint64_t>(mesh, 1);
    const auto number = [&](double value) {
      if (is_second) {
        Append(mesh, value);
      } else {
        Append(mesh, static_cast<float>(value));
      }
    };
    for (const double p : {0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, is_second ? 5.0 : 0.0})
      number(p);
    if (is_second) {
      for (int i = 0; i < 3; ++i) {
        for (const double n : {0.0, 0.0, 2.0})
          number(n);
      }
      for (const double uv : {0.0, 0.0, 1.0, 0.0, 0.0, 1.0})
        number(uv);
      for (int i = 0; i < 9; ++i)
        number(0.5);
    }
    for (const std::uint32_t index : {0U, 1U, 2U})
      Append(mesh, index);
    Append<std::uint16_t>(file, 0x041C);
    Append<std::uint16_t>(file, version);
    file += Deflated(mesh);
  }
  for (const std::uint64_t begin : begins) {
    if (version == 4) {
      Append(file, begin);
    } else {
      Append(file, static_cast<std::uint32_t>(begin));
    }
  }
  Append<std::uint32_t>(file, 2);
  return file;
}

TEST(MitsubaReaderTest, SerializedMeshesAreRead) {
  for (const std::uint16_t version : {std::uint16_t{3}, std::uint16_t{4}}) {
    const std::string file = SerializedFile(version);
    const auto first = ParseSerialized(file, 0, 1 << 20);
    ASSERT_TRUE(first.ok()) << first.status();
    EXPECT_EQ(first->positions.size(), 3U);
    EXPECT_TRUE(first->normals.empty());
    const auto second = ParseSerialized(file, 1, 1 << 20);
    ASSERT_TRUE(second.ok()) << second.status();
    EXPECT_EQ(second->positions.at(2).z, 5);
    ExpectNear(second->normals.at(0), {0, 0, 1});
    EXPECT_EQ(second->uvs.at(1).x, 1);
    EXPECT_FALSE(ParseSerialized(file, 2, 1 << 20).ok());
    EXPECT_FALSE(ParseSerialized(file, 1, 50).ok());
    // Cut off before the end of the second mesh.
    for (std::size_t size = 0; size < file.size() / 2; ++size)
      EXPECT_FALSE(ParseSerialized(file.substr(0, size), 1, 1 << 20).ok()) << size;
  }
}

// ---- How long paths become, and what else a view says

// The whole of a scene around an integrator.
ParsedScene WithIntegrator(const std::string& integrator) {
  return ReadXml(Around(integrator + "<shape type='sphere'/>"));
}

TEST(MitsubaReaderTest, PathsWithoutAMaximumAreLong) {
  for (const std::string integrator :
       {"", "<integrator type='path'/>",
        "<integrator type='path'><integer name='max_depth' value='-1'/></integrator>"}) {
    const ParsedScene parsed = WithIntegrator(integrator);
    ASSERT_TRUE(parsed.ok()) << Said(parsed);
    EXPECT_EQ(parsed.scene.integrator.max_depth, 1000) << integrator;
    EXPECT_THAT(Said(parsed), Not(HasSubstr("warning"))) << integrator;
  }
}

TEST(MitsubaReaderTest, MaximaOfPathsAreHeldWithinTheirRange) {
  for (const auto& [given, held] :
       {std::pair{"1", 1}, {"0", 1}, {"2", 1}, {"10001", 10'000}, {"20000", 10'000}}) {
    const ParsedScene parsed =
        WithIntegrator("<integrator type='path'><integer name='maxDepth' value='" +
                       std::string(given) + "'/></integrator>");
    ASSERT_TRUE(parsed.ok()) << Said(parsed);
    EXPECT_EQ(parsed.scene.integrator.max_depth, held) << given;
    const bool is_within = given == std::string("2") || given == std::string("10001");
    EXPECT_EQ(Said(parsed).find("\"maxDepth\" of <integrator") == std::string::npos, is_within)
        << given << Said(parsed);
  }
}

TEST(MitsubaReaderTest, IntegratorsThatRenderSomethingElseAreWarnedOf) {
  for (const std::string type : {"direct", "ao", "depth"}) {
    EXPECT_THAT(Said(WithIntegrator("<integrator type='" + type + "'/>")),
                HasSubstr("warning: <integrator type=\"" + type + "\"> is not what is rendered"));
  }
  EXPECT_THAT(Said(WithIntegrator("<integrator type='aov'><integrator type='path'/></integrator>")),
              HasSubstr("its layers are not written"));
  EXPECT_THAT(Said(WithIntegrator("<integrator type='path'><boolean name='hide_emitters' "
                                  "value='true'/></integrator>")),
              HasSubstr("\"hide_emitters\" of <integrator type=\"path\"> is ignored"));
}

ParsedScene WithSensor(const std::string& values) {
  return ReadXml("<scene version='0.6.0'><sensor type='perspective'>" + values +
                 "</sensor><emitter type='constant'/><shape type='sphere'/></scene>");
}

TEST(MitsubaReaderTest, ClippingAndShiftsThatChangeAViewAreWarnedOf) {
  EXPECT_THAT(Said(WithSensor(Float("nearClip", 0.01) + Float("farClip", 1e4) +
                              Float("principal_point_offset_x", 0))),
              Not(HasSubstr("warning")));
  for (const std::string name : {"nearClip", "farClip", "principal_point_offset_x"}) {
    EXPECT_THAT(Said(WithSensor(Float(name, 3))),
                HasSubstr("\"" + name + "\" of <sensor type=\"perspective\"> is ignored"));
  }
}

// A sensor with these parameters before a sphere.
ParsedScene ReadSensor(const std::string& type, const std::string& parameters) {
  return ReadXml("<scene version='3.0.0'><sensor type='" + type +
                 "'><float name='fov' value='40'/>" + parameters +
                 "</sensor><emitter type='constant'/><shape type='sphere'/></scene>");
}

TEST(MitsubaReaderTest, AThinLensWithoutADistanceFocusesFarAway) {
  const auto focal_distance = [](const std::string& more) {
    return ReadSensor("thinlens", Float("aperture_radius", 0.1) + more).scene.camera.focal_distance;
  };
  EXPECT_EQ(focal_distance(""), 1e4);
  EXPECT_EQ(focal_distance(Float("focus_distance", 3)), 3);
}

TEST(MitsubaReaderTest, AxesOfAnglesAreKnownInAnyCaseOrRefused) {
  const auto read = [](const std::string& axis) {
    return ReadSensor("perspective", "<string name='fov_axis' value='" + axis + "'/>");
  };
  EXPECT_EQ(read("Y").scene.camera.fov_deg, read("y").scene.camera.fov_deg);
  EXPECT_NE(read("y").scene.camera.fov_deg, read("x").scene.camera.fov_deg);
  EXPECT_THAT(Said(read("z")), HasSubstr("must be x, y, diagonal, smaller or larger"));
}

TEST(MitsubaReaderTest, AFocalLengthMayHaveAFraction) {
  const ParsedScene parsed = WithSensor("<string name='focalLength' value='35.5mm'/>");
  ASSERT_TRUE(parsed.ok()) << Said(parsed);
  // Of half the diagonal of the film, 36 by 24 mm, in that of 768 by 576 pixels.
  const double expected = std::hypot(36, 24) / 2 / 35.5 * 576 / std::hypot(768, 576);
  EXPECT_NEAR(std::tan(parsed.scene.camera.fov_deg / 2 * M_PI / 180), expected, 1e-9);
}

// ---- Shapes without a bsdf, and those of nothing

TEST(MitsubaReaderTest, AShapeWithoutABsdfIsGreyOrBlackOrNothing) {
  const auto material_of = [](const std::string& in_shape, std::string_view version) {
    const Scene scene =
        SceneOf("<medium type='homogeneous' id='m'/><shape type='sphere'>" + in_shape + "</shape>",
                {}, version);
    return scene.materials.at(static_cast<std::size_t>(scene.spheres.at(0).traits.material));
  };
  const std::string light = "<emitter type='area'/>";
  const std::string medium = "<ref name='interior' id='m'/>";
  EXPECT_EQ(material_of("", "3.0.0").reflectance, Gray(0.5F));
  EXPECT_EQ(material_of(light, "3.0.0").reflectance, Rgb());
  EXPECT_EQ(material_of(light, "0.6.0").reflectance, Rgb());
  EXPECT_EQ(material_of(medium, "3.0.0").kind, Material::Kind::kDiffuse);
  EXPECT_EQ(material_of(medium, "0.6.1").kind, Material::Kind::kDiffuse);
  EXPECT_EQ(material_of(medium, "0.6.0").kind, Material::Kind::kInterface);
  EXPECT_EQ(material_of(medium, "0.4").kind, Material::Kind::kInterface);
  EXPECT_EQ(material_of(medium + light, "0.6.0").kind, Material::Kind::kDiffuse);
}

TEST(MitsubaReaderTest, LightsOfNothingShineAndAreBlack) {
  const ParsedScene parsed = ReadXml(
      Around("<shape type='sphere'><bsdf type='null'/><emitter type='area'><rgb name='radiance' "
             "value='7'/></emitter></shape>"));
  ASSERT_TRUE(parsed.ok()) << Said(parsed);
  EXPECT_THAT(Said(parsed), HasSubstr("light does not pass through it"));
  const ShapeTraits& traits = parsed.scene.spheres.at(0).traits;
  const Material& material = parsed.scene.materials.at(static_cast<std::size_t>(traits.material));
  EXPECT_EQ(material.kind, Material::Kind::kDiffuse);
  EXPECT_EQ(material.reflectance, Rgb());
  ASSERT_NE(traits.area_light, kNoAreaLight);
  ExpectNear(parsed.scene.area_lights.at(static_cast<std::size_t>(traits.area_light)).radiance,
             Gray(7));
}

// ---- More of textures

TEST(MitsubaReaderTest, NormalMapsLieAsTheirTextureSays) {
  const Scene scene = SceneOf(
      "<shape type='rectangle'><bsdf type='normalmap'><texture type='scale'><float name='scale' "
      "value='0.5'/><texture type='bitmap' name='x'><string name='filename' value='four.pfm'/>"
      "<string name='wrapModeU' value='clamp'/><string name='wrapModeV' value='mirror'/>"
      "<float name='uscale' value='4'/><float name='voffset' value='0.25'/></texture></texture>"
      "<bsdf type='diffuse'/></bsdf></shape>",
      {{"four.pfm", kFourPixels}}, "0.6.0");
  const Material& material =
      scene.materials.at(static_cast<std::size_t>(scene.meshes.at(0).traits.material));
  ASSERT_NE(material.normal_map, kNoTexture);
  const Texture& map = scene.textures.at(static_cast<std::size_t>(material.normal_map));
  EXPECT_EQ(map.wrap_u, Texture::Wrap::kClamp);
  EXPECT_EQ(map.wrap_v, Texture::Wrap::kMirror);
  EXPECT_EQ(map.scale, 0.5F);
  EXPECT_EQ(map.mapping.scale_u, 4);
  EXPECT_EQ(map.mapping.scale_v, 1);
  // v + 0.25 from the top is -0.25 from the bottom.
  EXPECT_EQ(map.mapping.delta_v, -0.25F);
}

TEST(MitsubaReaderTest, TexturesMayBeTurned) {
  // (u, v) -> (-v, u).
  for (const std::string to_uv :
       {"<rotate z='1' angle='90'/>", "<matrix value='0 -1 0 1 0 0 0 0 1'/>"}) {
    const Scene scene =
        SceneOf(Textured("<texture type='bitmap' name='reflectance'><string name='filename' "
                         "value='four.pfm'/><transform name='to_uv'>" +
                         to_uv + "</transform></texture>"),
                {{"four.pfm", kFourPixels}});
    ExpectNear(ColorAt(scene, 0.25F, 0.25F), {0, 1, 0});  // at (0.75, 0.25)
    ExpectNear(ColorAt(scene, 0.25F, 0.75F), {1, 0, 0});  // at (0.25, 0.25)
    ExpectNear(ColorAt(scene, 0.75F, 0.75F), {0, 0, 1});  // at (0.25, 0.75)
    ExpectNear(ColorAt(scene, 0.75F, 0.25F), {1, 1, 1});  // at (0.75, 0.75)
  }
  const Scene board = SceneOf(
      Textured("<texture type='checkerboard' name='reflectance'><rgb name='color0' value='.8'/>"
               "<rgb name='color1' value='.1'/><transform name='to_uv'><rotate z='1' angle='-90'/>"
               "<scale x='1' y='3'/><translate x='1'/></transform></texture>"));
  for (int i = 0; i < 400; ++i) {
    const float u = (static_cast<float>(i % 20) + 0.5F) / 20;
    const float v = (static_cast<float>(i / 20) + 0.5F) / 20;
    const int cells =
        static_cast<int>(std::floor(2 * (v + 1))) + static_cast<int>(std::floor(2 * 3 * -u));
    EXPECT_FLOAT_EQ(ColorAt(board, u, v).g, cells % 2 == 0 ? 0.8F : 0.1F) << u << " " << v;
  }
}

TEST(MitsubaReaderTest, PicturesMayBeMirroredBeyondTheirEdges) {
  const Scene scene =
      SceneOf(Textured("<texture type='bitmap' name='reflectance'><string name='filename' "
                       "value='four.pfm'/><string name='wrap_mode' value='mirror'/><transform "
                       "name='to_uv'><translate x='1'/></transform></texture>"),
              {{"four.pfm", kFourPixels}});
  // Mitsuba's (0.25, 0.25) -> (1.25, 0.25), which is that of 0.75.
  ExpectNear(ColorAt(scene, 0.25F, 0.25F), {0, 1, 0});
}

TEST(MitsubaReaderTest, AScaleMayHaveAColour) {
  const Scene scene = SceneOf(
      Textured("<texture type='scale' name='reflectance'><rgb name='scale' value='2 0.5 0.25'/>"
               "<texture type='bitmap'><string name='filename' value='grey.pfm'/></texture>"
               "</texture>"),
      {{"grey.pfm",
        [] {
          std::string pfm = "PF\n1 1\n-1\n";
          const std::array<float, 3> pixel = {0.25F, 0.5F, 0.5F};
          pfm.append(reinterpret_cast<const char*>(pixel.data()), sizeof(pixel));
          return pfm;
        }()}},
      "0.6.0");
  ExpectNear(ColorAt(scene, 0.5F, 0.5F), {0.5F, 0.25F, 0.125F});
}

TEST(MitsubaReaderTest, TexturesThatNothingReadsAreWarnedOf) {
  const std::string board = "<texture type='checkerboard'";
  EXPECT_THAT(Said(ReadXml(Around(Textured(board + " name='diffuseReflectance'/>")))),
              HasSubstr("unknown parameter \"diffuseReflectance\" of <bsdf type=\"diffuse\">"));
  EXPECT_THAT(Said(ReadXml(Around(Textured(board + "/>")))),
              HasSubstr("<texture type=\"checkerboard\"> in <bsdf type=\"diffuse\"> is ignored"));
  EXPECT_THAT(Said(ReadXml(Around(Textured(board + " name='reflectance'/>" +
                                           "<rgb name="
                                           "'reflectance' value='1'/>")))),
              HasSubstr("is given twice"));
}

// ---- Colours by wavelength

TEST(MitsubaReaderTest, SpectraOfATypeAreWhatTheyAreAsValues) {
  const auto reflectance = [](const std::string& spectrum, std::string_view version = "3.0.0") {
    return MaterialOf("<bsdf type='diffuse'>" + spectrum + "</bsdf>", version);
  };
  const MaterialNumbers by_pairs =
      reflectance("<spectrum name='reflectance' value='400:.1, 550:.2, 700:.6'/>");
  EXPECT_EQ(reflectance("<spectrum name='reflectance' type='irregular'><string name='wavelengths' "
                        "value='400, 550, 700'/><string name='values' value='.1, .2, .6'/>"
                        "</spectrum>"),
            by_pairs);
  EXPECT_EQ(reflectance("<texture name='reflectance' type='regular'><float name='wavelength_min' "
                        "value='400'/><integer name='wavelength_max' value='700'/><string "
                        "name='values' value='.1 .2 .6'/></texture>"),
            by_pairs);
  const MaterialNumbers red = reflectance("<rgb name='reflectance' value='.6 .1 .2'/>");
  EXPECT_EQ(reflectance("<spectrum name='reflectance' type='srgb'><rgb name='color' "
                        "value='.6 .1 .2'/></spectrum>"),
            red);
  EXPECT_EQ(reflectance("<spectrum name='reflectance' value='.6 .1 .2'/>", "0.6.0"), red);
  EXPECT_EQ(reflectance("<spectrum name='reflectance' type='uniform'><float name='value' "
                        "value='.25'/></spectrum>"),
            reflectance("<rgb name='reflectance' value='.25'/>"));
  // A step.
  EXPECT_NEAR(reflectance("<spectrum name='reflectance' value='360:.3, 550:.3, 550:.3, 830:.3'/>")
                  .reflectance.g,
              0.3F, 1e-4F);
}

TEST(MitsubaReaderTest, ASpectrumOfAPictureIsATexture) {
  const Scene scene = SceneOf(Textured("<spectrum type='bitmap' name='reflectance'>"
                                       "<string name='filename' value='four.pfm'/></spectrum>"),
                              {{"four.pfm", kFourPixels}});
  ExpectNear(ColorAt(scene, 0.75F, 0.25F), {0, 1, 0});
}

TEST(MitsubaReaderTest, LightsMayHaveTheSpectrumOfAFileOrABlackBody) {
  const auto intensity = [](const std::string& spectrum, Files files = {}) {
    return SceneOf("<emitter type='point'>" + spectrum + "</emitter>", std::move(files))
        .point_lights.at(0)
        .intensity;
  };
  ExpectNear(intensity("<spectrum name='intensity' filename='s.spd'/>",
                       {{"s.spd", "# a light\n360 4\n550 4\n550 4\n830 4\n"}}),
             intensity("<spectrum name='intensity' value='360:4, 830:4'/>"), 1e-3F);
  ExpectNear(intensity("<spectrum name='intensity' type='d65'><float name='scale' value='3'/>"
                       "</spectrum>"),
             Gray(3));
  // In watts as Mitsuba has it: by Planck's law at each wavelength.
  std::string pairs;
  for (int nm = 360; nm <= 830; nm += 2) {
    const double metres = nm * 1e-9;
    const double radiance =
        2 * 6.62607015e-34 * 2.99792458e8 * 2.99792458e8 / std::pow(metres, 5) /
        std::expm1(6.62607015e-34 * 2.99792458e8 / (metres * 1.380649e-23 * 5000)) * 1e-9 * 1e-3;
    pairs += std::to_string(nm) + ":" + std::to_string(radiance) + " ";
  }
  const Rgb expected = intensity("<spectrum name='intensity' value='" + pairs + "'/>");
  EXPECT_GT(Luminance(expected), 1);
  ExpectNear(intensity("<blackbody name='intensity' temperature='5000K' scale='0.001'/>"), expected,
             0.01F);
  ExpectNear(intensity("<spectrum name='intensity' type='blackbody'><float name='temperature' "
                       "value='5000'/><float name='scale' value='.001'/></spectrum>"),
             expected, 0.01F);
}

// ---- More of materials and media

TEST(MitsubaReaderTest, ADiffuseBsdfOfOldFilesHasTwoNamesForItsColour) {
  EXPECT_EQ(MaterialOf("<bsdf type='diffuse'><rgb name='diffuseReflectance' value='.2'/></bsdf>",
                       "0.6.0"),
            MaterialOf("<bsdf type='diffuse'><rgb name='reflectance' value='.2'/></bsdf>"));
}

TEST(MitsubaReaderTest, WholeNumbersAreNumbers) {
  EXPECT_EQ(MaterialOf("<bsdf type='roughdielectric'><integer name='alpha' value='1'/>"
                       "<integer name='int_ior' value='2'/></bsdf>"),
            MaterialOf("<bsdf type='roughdielectric'>" + Float("alpha", 1) + Float("int_ior", 2) +
                       "</bsdf>"));
  EXPECT_EQ(SceneOf("<shape type='sphere'><integer name='radius' value='2'/></shape>")
                .spheres.at(0)
                .radius,
            2);
  EXPECT_EQ(MaterialOf("<bsdf type='diffuse'><integer name='reflectance' value='1'/></bsdf>"),
            MaterialOf("<bsdf type='diffuse'><rgb name='reflectance' value='1'/></bsdf>"));
}

TEST(MitsubaReaderTest, IndicesHaveNamesInAnyCase) {
  const auto index_of = [](const std::string& name) {
    return MaterialOf("<bsdf type='dielectric'><string name='int_ior' value='" + name +
                      "'/><float name='ext_ior' value='1'/></bsdf>")
        .ior;
  };
  EXPECT_EQ(index_of("BK7"), 1.5046F);
  EXPECT_EQ(index_of("Silicone Oil"), 1.52045F);
  EXPECT_EQ(index_of("glycerol"), 1.4729F);
  EXPECT_EQ(index_of("bromine"), 1.661F);
  EXPECT_EQ(index_of("carbon dioxide"), 1.00045F);
  EXPECT_EQ(index_of("carbon tetrachloride"), 1.461F);
}

TEST(MitsubaReaderTest, TransformsMayBeRoundedOrTurnByNothing) {
  const Scene scene = SceneOf(
      "<shape type='rectangle'><transform name='to_world'><rotate angle='0'/>"
      "<matrix value='1 0 0 3  0 1 0 0  0 0 1 0  1e-6 0 0 1.00001'/></transform></shape>");
  ExpectNear(scene.meshes.at(0).positions.at(2), {4, 1, 0});
}

TEST(MitsubaReaderTest, ASecondSideIsWarnedOf) {
  const ParsedScene parsed =
      ReadXml(Around("<shape type='sphere'><bsdf type='twosided'><bsdf type='diffuse'/><bsdf "
                     "type='conductor'/></bsdf></shape>"));
  EXPECT_TRUE(parsed.ok()) << Said(parsed);
  EXPECT_THAT(Said(parsed), HasSubstr("has a second bsdf, which is not used"));
}

TEST(MitsubaReaderTest, PhongIsAMixWithALobeOfItsWidth) {
  const Scene scene = SceneOf(
      "<shape type='sphere'><bsdf type='phong'><rgb name='diffuseReflectance' value='.3'/>"
      "<rgb name='specularReflectance' value='.2 .1 .0'/><float name='exponent' value='48'/>"
      "</bsdf></shape>",
      {}, "0.6.0");
  const Material& mix =
      scene.materials.at(static_cast<std::size_t>(scene.spheres.at(0).traits.material));
  ASSERT_EQ(mix.kind, Material::Kind::kMix);
  EXPECT_FLOAT_EQ(mix.amount, 0.25F);
  const Material& diffuse = scene.materials.at(static_cast<std::size_t>(mix.mixed[0]));
  const Material& metal = scene.materials.at(static_cast<std::size_t>(mix.mixed[1]));
  EXPECT_FLOAT_EQ(diffuse.reflectance.g * (1 - mix.amount), 0.3F);
  EXPECT_EQ(metal.kind, Material::Kind::kConductor);
  EXPECT_FLOAT_EQ(metal.alpha_u, 0.2F);
  const MaterialNumbers same = PbrtMaterialOf("\"conductor\" \"rgb reflectance\" [.8 .4 0]");
  ExpectNear(metal.k, same.k, 1e-3F);
}

TEST(MitsubaReaderTest, CoatingsAreThoseOfPbrt) {
  const std::string ends = " \"float thickness\" 0 \"integer maxdepth\" 40";
  EXPECT_EQ(
      MaterialOf("<bsdf type='coating'><float name='int_ior' value='1.5'/><float "
                 "name='ext_ior' value='1'/><bsdf type='twosided'><bsdf type='diffuse'>"
                 "<rgb name='reflectance' value='.3'/></bsdf></bsdf></bsdf>"),
      PbrtMaterialOf("\"coateddiffuse\" \"rgb reflectance\" [.3 .3 .3] \"float eta\" 1.5" + ends));
  EXPECT_EQ(MaterialOf("<bsdf type='coating'><float name='int_ior' value='1.5'/><float "
                       "name='ext_ior' value='1'/><bsdf type='roughconductor'><string "
                       "name='material' value='Al'/><float name='alpha' value='.2'/></bsdf>"
                       "</bsdf>"),
            PbrtMaterialOf("\"coatedconductor\" \"spectrum conductor.eta\" \"metal-Al-eta\" "
                           "\"spectrum conductor.k\" \"metal-Al-k\" \"float conductor.roughness\" "
                           ".2 \"bool remaproughness\" false \"float interface.roughness\" 0 "
                           "\"float interface.eta\" 1.5" +
                           ends));
}

TEST(MitsubaReaderTest, FactorsOfLobesTintThem) {
  const MaterialNumbers glass = MaterialOf(
      "<bsdf type='dielectric'><rgb name='specular_reflectance' value='1, 0.5, 0'/>"
      "<float name='specular_transmittance' value='0.25'/></bsdf>");
  EXPECT_TRUE(glass.is_tinted);
  EXPECT_EQ(glass.reflection_tint, (Rgb{1, 0.5F, 0}));
  EXPECT_EQ(glass.transmission_tint, Gray(0.25F));
  const MaterialNumbers metal = MaterialOf(
      "<bsdf type='conductor'><string name='material' value='Al'/>"
      "<rgb name='specular_reflectance' value='0.5, 0.6, 0.7'/></bsdf>");
  EXPECT_EQ(metal.reflection_tint, (Rgb{0.5F, 0.6F, 0.7F}));
  EXPECT_FALSE(MaterialOf("<bsdf type='thindielectric'/>").is_tinted);
  // Without constants it is the reflectance.
  const MaterialNumbers mirror = MaterialOf(
      "<bsdf type='conductor'><rgb name='specular_reflectance' value='0.5, 0.6, 0.7'/></bsdf>");
  EXPECT_FALSE(mirror.is_tinted);
  EXPECT_GT(mirror.k.b, mirror.k.r);
}

TEST(MitsubaReaderTest, ThePrincipledBsdfIsWhatItsSharesAre) {
  const MaterialNumbers plastic = MaterialOf(
      "<bsdf type='principled'><rgb name='base_color' value='0.2, 0.4, 0.6'/>"
      "<float name='roughness' value='0.5'/><float name='specular' value='0.5'/></bsdf>");
  EXPECT_EQ(plastic.kind, Material::Kind::kCoatedDiffuse);
  EXPECT_TRUE(plastic.coat_passes_rest);
  EXPECT_FLOAT_EQ(plastic.alpha_u, 0.25F);
  EXPECT_FLOAT_EQ(plastic.ior, 1.5F);
  ExpectNear(plastic.reflectance, {0.2F, 0.4F, 0.6F});
  const MaterialNumbers metal =
      MaterialOf("<bsdf type='principled'><float name='metallic' value='1'/></bsdf>");
  EXPECT_EQ(metal.kind, Material::Kind::kConductor);
  EXPECT_FLOAT_EQ(metal.alpha_u, 0.25F);
  const MaterialNumbers glass = MaterialOf(
      "<bsdf type='principled'><rgb name='base_color' value='0.25, 1, 1'/>"
      "<float name='spec_trans' value='1'/><float name='eta' value='1.6'/></bsdf>");
  EXPECT_EQ(glass.kind, Material::Kind::kDielectric);
  EXPECT_FLOAT_EQ(glass.ior, 1.6F);
  EXPECT_EQ(glass.transmission_tint, (Rgb{0.5F, 1, 1}));
  const Scene mixed = SceneOf(
      "<shape type='sphere'><bsdf type='principled'><float name='metallic' value='0.3'/>"
      "<float name='spec_trans' value='0.6'/></bsdf></shape>");
  const Material& of_metal =
      mixed.materials.at(static_cast<std::size_t>(mixed.spheres.at(0).traits.material));
  ASSERT_EQ(of_metal.kind, Material::Kind::kMix);
  EXPECT_FLOAT_EQ(of_metal.amount, 0.3F);
  const Material& inner = mixed.materials.at(static_cast<std::size_t>(of_metal.mixed[0]));
  ASSERT_EQ(inner.kind, Material::Kind::kMix);
  EXPECT_FLOAT_EQ(inner.amount, 0.6F);
  EXPECT_THAT(Said(ReadXml(Around("<shape type='sphere'><bsdf type='principled'>"
                                  "<float name='clearcoat' value='0.5'/></bsdf></shape>"))),
              HasSubstr("clearcoat"));
}

TEST(MitsubaReaderTest, VerticesOfPlyFilesMayHaveColours) {
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
      "property float z\nproperty float r\nproperty float g\nproperty float b\n"
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
      "0 0 0 1 0 0\n1 0 0 0 1 0\n0 1 0 0 0 1\n3 0 1 2\n";
  const std::string shape =
      "<shape type='ply'><string name='filename' value='mesh.ply'/><bsdf type='diffuse'>";
  const Scene scene =
      SceneOf(shape +
                  "<texture type='mesh_attribute' name='reflectance'>"
                  "<string name='name' value='vertex_color'/></texture></bsdf></shape>",
              {{"mesh.ply", ply}});
  const TriangleMesh& mesh = scene.meshes.at(0);
  EXPECT_EQ(mesh.colors, (std::vector<Rgb>{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}));
  const Material& material = scene.materials.at(static_cast<std::size_t>(mesh.traits.material));
  EXPECT_EQ(TextureColor(scene.textures, material.texture, {{}, {}, {}, {0.5F, 0.25F, 0}}),
            (Rgb{0.5F, 0.25F, 0}));
  // Where no texture shows them they take no memory.
  EXPECT_TRUE(SceneOf(shape + "</bsdf></shape>", {{"mesh.ply", ply}}).meshes.at(0).colors.empty());
}

TEST(MitsubaReaderTest, AMixtureOfTwoIsAMix) {
  const Scene scene = SceneOf(
      "<shape type='sphere'><bsdf type='mixturebsdf'><string name='weights' value='0.7, 0.3'/>"
      "<bsdf type='diffuse'/><bsdf type='conductor'/></bsdf></shape>",
      {}, "0.6.0");
  const Material& mix =
      scene.materials.at(static_cast<std::size_t>(scene.spheres.at(0).traits.material));
  ASSERT_EQ(mix.kind, Material::Kind::kMix);
  EXPECT_FLOAT_EQ(mix.amount, 0.3F);
  EXPECT_EQ(scene.materials.at(static_cast<std::size_t>(mix.mixed[1])).kind,
            Material::Kind::kConductor);
}

TEST(MitsubaReaderTest, VolumesThatAreTheSameEverywhereMakeHomogeneousMedia) {
  for (const std::string type : {"homogeneous", "heterogeneous"}) {
    for (const std::string name : {"sigma_t", "density"}) {
      if (type == "homogeneous" && name == "density") continue;
      const Scene scene = SceneOf(
          "<medium type='" + type + "' id='m'><volume name='" + name +
          "' type='constvolume'><rgb name='value' value='4 2 1'/></volume><volume name='albedo' "
          "type='constvolume'><float name='value' value='.5'/></volume></medium>"
          "<shape type='cube'><bsdf type='null'/><ref name='interior' id='m'/></shape>");
      ASSERT_EQ(scene.media.size(), 1U);
      ExpectNear(scene.media[0].scattering, {2, 1, 0.5F});
      ExpectNear(scene.media[0].absorption, {2, 1, 0.5F});
    }
  }
}

// ---- Texture coordinates of shapes

// Mitsuba's texture coordinates of the vertex of a mesh that is nearest to a point.
Vec2 UvNear(const TriangleMesh& mesh, Vec3 point, Vec3 normal) {
  std::size_t nearest = 0;
  const auto distance = [&](std::size_t i) {
    return Length(mesh.positions[i] - point) + Length(mesh.normals[i] - normal);
  };
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    if (distance(i) < distance(nearest)) nearest = i;
  }
  return {mesh.uvs.at(nearest).x, 1 - mesh.uvs.at(nearest).y};
}

TEST(MitsubaReaderTest, SidesOfACubeHaveMitsubasTextureCoordinates) {
  struct Side {
    Vec3 normal, u, v;
  };
  const Scene scene = SceneOf("<shape type='cube'/>");
  for (const Side& side : {Side{{1, 0, 0}, {0, 1, 0}, {0, 0, -1}},
                           {{-1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                           {{0, 1, 0}, {-1, 0, 0}, {0, 0, -1}},
                           {{0, -1, 0}, {0, 0, 1}, {1, 0, 0}},
                           {{0, 0, 1}, {0, 1, 0}, {1, 0, 0}},
                           {{0, 0, -1}, {0, -1, 0}, {1, 0, 0}}}) {
    for (const float u : {0.0F, 1.0F}) {
      for (const float v : {0.0F, 1.0F}) {
        const Vec3 corner = side.normal + side.u * (2 * u - 1) + side.v * (2 * v - 1);
        const Vec2 uv = UvNear(scene.meshes.at(0), corner, side.normal);
        EXPECT_EQ(uv.x, u);
        EXPECT_EQ(uv.y, v);
      }
    }
  }
}

TEST(MitsubaReaderTest, TexturedDisksAndCylindersHaveMitsubasTextureCoordinates) {
  const std::string bsdf =
      "<bsdf type='twosided'><bsdf type='diffuse'><texture "
      "type='checkerboard' name='reflectance'/></bsdf></bsdf></shape>";
  const Scene disk = SceneOf("<shape type='disk'>" + bsdf);
  ASSERT_EQ(disk.meshes.size(), 1U);
  const Vec2 at_rim = UvNear(disk.meshes[0], {0, 1, 0}, {0, 0, 1});
  EXPECT_NEAR(at_rim.x, 1, 1e-6);
  EXPECT_NEAR(at_rim.y, 0.25, 1e-6);
  EXPECT_NEAR(UvNear(disk.meshes[0], {0, 0, 0}, {0, 0, 1}).x, 0, 1e-6);
  EXPECT_GT(EdgeCross(disk.meshes[0], 0).z, 0);
  const Scene cylinder = SceneOf("<shape type='cylinder'><point name='p1' z='4'/>" + bsdf);
  const Vec2 on_top = UvNear(cylinder.meshes.at(0), {0, 1, 4}, {0, 1, 0});
  EXPECT_NEAR(on_top.x, 0.25, 1e-6);
  EXPECT_NEAR(on_top.y, 1, 1e-6);
  EXPECT_NEAR(UvNear(cylinder.meshes.at(0), {0, 1, 0}, {0, 1, 0}).y, 0, 1e-6);
}

TEST(MitsubaReaderTest, FacesOfAnObjFileWithoutTextureCoordinatesLeaveTheOthersTheirs) {
  const auto mesh =
      ParseObj("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt .5 1\nf 1/1 2/1 3/1\nf 1 3 4\n");
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  ASSERT_EQ(mesh->uvs.size(), mesh->positions.size());
  EXPECT_EQ(mesh->uvs[mesh->indices[0]].y, 1);
  EXPECT_EQ(mesh->uvs[mesh->indices[3]].y, 0);
}

TEST(MitsubaReaderTest, MaterialsOfAnObjFileAreTheBsdfsThatAreNamedLikeThem) {
  const Files files = {{"two.obj",
                        "mtllib two.mtl\nv -1 -1 0\nv 0 -1 0\nv 0 1 0\nv -1 1 0\nv 1 -1 0\n"
                        "v 1 1 0\nusemtl matA\nf 1 2 3 4\nusemtl matB\nf 2 5 6 3\n"}};
  const std::string body =
      "<bsdf type='diffuse' id='r'><rgb name='reflectance' value='1 0 0'/></bsdf>"
      "<bsdf type='diffuse' id='g'><rgb name='reflectance' value='0 1 0'/></bsdf>"
      "<shape type='obj'><string name='filename' value='two.obj'/>";
  const Scene scene =
      SceneOf(body + "<ref name='matA' id='r'/><ref name='matB' id='g'/></shape>", files, "0.6.0");
  ASSERT_EQ(scene.meshes.size(), 2U);
  for (const TriangleMesh& mesh : scene.meshes) {
    const Rgb color =
        scene.materials.at(static_cast<std::size_t>(mesh.traits.material)).reflectance;
    const bool is_left = mesh.positions.at(0).x < 0;
    EXPECT_EQ(color.r, is_left ? 1 : 0);
    EXPECT_EQ(color.g, is_left ? 0 : 1);
    EXPECT_EQ(mesh.indices.size(), 6U);
  }
  const std::string said = "has materials of a file (mtllib), which is not read";
  EXPECT_THAT(Said(ReadXml(Around(body + "<ref name='matA' id='r'/></shape>", "0.6.0"), files)),
              HasSubstr(said));
  EXPECT_THAT(Said(ReadXml(Around(body + "</shape>", "0.6.0"), files)), HasSubstr(said));
  EXPECT_THAT(Said(ReadXml(Around(body + "</shape>"), files)), Not(HasSubstr(said)));
}

// ---- What is wrong

TEST(MitsubaReaderTest, WhatIsWrongIsSaidInOneSentenceWithItsPlace) {
  struct Case {
    std::string body, said;
  };
  const std::vector<Case> cases = {
      {"<shape type='sphere'><bsdf type='ward'/></shape>", "<bsdf type=\"ward\"> is not supported"},
      {"<shape type='sphere'><bsdf type='diffuse'><texture type='wood' name='reflectance'/></bsdf>"
       "</shape>",
       "<texture type=\"wood\"> is not supported; there are bitmap"},
      {"<shape type='sphere'><bsdf type='diffuse'><spectrum type='wood' name='reflectance'/></bsdf>"
       "</shape>",
       "type=\"wood\"> is not supported; there are bitmap"},
      {"<shape type='sphere'><bsdf type='diffuse'><spectrum name='reflectance' value='.1 .2 .3'/>"
       "</bsdf></shape>",
       "one number, or pairs"},
      {"<shape type='sphere'><bsdf type='diffuse'><spectrum type='irregular' name='reflectance'>"
       "<string name='wavelengths' value='400'/><string name='values' value='1, 1'/></spectrum>"
       "</bsdf></shape>",
       "as many wavelengths as values"},
      {"<shape type='sphere'><bsdf type='coating'><bsdf type='plastic'/></bsdf></shape>",
       "is supported over diffuse"},
      {"<shape type='sphere'><bsdf type='mixturebsdf'><bsdf type='diffuse'/><bsdf type='diffuse'/>"
       "</bsdf></shape>",
       "needs <string name=\"weights\">"},
      {"<alias id='none' as='b'/>", "no object with the id \"none\""},
      {"<bsdf type='diffuse' id='a'/><alias id='a' as='a'/>", "the id \"a\" is given twice"},
      {"<medium type='heterogeneous' id='m'><volume type='gridvolume' name='sigma_t'/></medium>"
       "<shape type='cube'><bsdf type='null'/><ref name='interior' id='m'/></shape>",
       "is not supported; there is homogeneous"},
      {"<emitter type='point'><blackbody name='intensity' temperature='3K'/></emitter>",
       "must have a temperature from 500"},
      {"<shape type='sphere'><transform name='to_world'><matrix value='1 0 0 0 0 1 0 0 0 0 1 0 0 0 "
       ".1 1'/></transform></shape>",
       "must be affine"},
      {"<shape type='sphere'><ref id='none'/></shape>", "no object with the id \"none\""},
      {"<shape type='teapot'/>", "<shape type=\"teapot\"> is not supported; there are obj"},
      {"<shape type='sphere'><float name='radius' value='-1'/></shape>", "\"radius\" of"},
      {"<shape type='sphere'><float name='radius' value='wide'/></shape>",
       "\"radius\" must be a number, not \"wide\""},
      {"<shape type='sphere'><flaot name='radius' value='1'/></shape>", "did you mean <float>?"},
      {"<shape type='obj'><string name='filename' value='no.obj'/></shape>", "no such file"},
      {"<shape type='obj'/>", "needs <string name=\"filename\">"},
      {"<shape type='sphere'><bsdf type='conductor'><string name='material' value='Xy'/></bsdf>"
       "</shape>",
       "no constants for \"Xy\""},
      {"<shape type='sphere'><bsdf type='dielectric'><string name='int_ior' value='jelly'/></bsdf>"
       "</shape>",
       "\"int_ior\" of <bsdf type=\"dielectric\"> is unknown"},
      {"<emitter type='sky'/>", "<emitter type=\"sky\"> is not supported"},
      {"<shape type='sphere'><float name='radius' value='1'/><float name='radius' value='2'/>"
       "</shape>",
       "\"radius\" of <shape type=\"sphere\"> is given twice"},
      {"<bsdf type='diffuse' id='a'/><bsdf type='diffuse' id='a'/>", "the id \"a\" is given twice"},
      {"<bsdf type='twosided' id='a'><ref id='a'/></bsdf><shape type='sphere'><ref "
       "id='a'/></shape>",
       "refers to itself"},
      {"<include filename='main.xml'/>", "includes itself"},
      {"<shape type='sphere'><float name='radius' value='$r'/></shape>", "no value of \"$r\""},
      {"<shape type='sphere'><transform name='to_world'><matrix value='1 2 "
       "3'/></transform></shape>",
       "must be 16 numbers"},
      {"<shape type='sphere'><transform name='to_world'><rotate angle='3'/></transform></shape>",
       "<rotate>"},
      {"<shape type='instance'/>", "needs a reference to a shapegroup"},
      {"<shape type='sphere'><bsdf type='blendbsdf'/></shape>", "needs two bsdfs"},
      {"<shape type='sphere'><emitter type='area'><texture type='checkerboard' "
       "name='radiance'/></emitter>"
       "</shape>",
       "is a texture, which is not supported here"},
  };
  for (const Case& wrong : cases) {
    const ParsedScene parsed = ReadXml(Around(wrong.body));
    EXPECT_FALSE(parsed.ok()) << wrong.body;
    EXPECT_THAT(Said(parsed), HasSubstr(wrong.said)) << wrong.body;
    EXPECT_THAT(Said(parsed), HasSubstr("main.xml:1:")) << wrong.body;
  }
}

TEST(MitsubaReaderTest, TextsThatAreNoScenesAreRefused) {
  for (const std::string text : {"<scene version='3.0.0'>", "<room/>", "<scene><a></scene>", "<"}) {
    const ParsedScene parsed = ReadXml(text);
    EXPECT_FALSE(parsed.ok()) << text;
    EXPECT_EQ(parsed.diagnostics.size(), 1U) << Said(parsed);
  }
}

TEST(MitsubaReaderTest, LinesAreThoseOfTheFile) {
  const ParsedScene parsed =
      ReadXml("<scene version='3.0.0'>\n\n  <shape type='teapot'/>\n</scene>");
  EXPECT_THAT(Said(parsed), HasSubstr("main.xml:3:4: error: <shape"));
}

TEST(MitsubaReaderTest, WhatIsApproximatedOrUnknownIsWarnedOf) {
  const ParsedScene parsed =
      ReadXml(Around("<shape type='sphere'><float name='raduis' value='2'/>"
                     "<bsdf type='roughconductor'/></shape><medium type='homogeneous' id='fog'/>"
                     "<emitter type='point'><ref id='fog'/></emitter>"));
  EXPECT_THAT(Said(parsed), HasSubstr("<medium type=\"homogeneous\"> in <emitter type=\"point\">"));
  EXPECT_TRUE(parsed.ok()) << Said(parsed);
  EXPECT_THAT(Said(parsed), HasSubstr("did you mean \"radius\"?"));
  EXPECT_THAT(Said(parsed), HasSubstr("rendered as \"ggx\""));
}

TEST(MitsubaReaderTest, IncludedFilesAreReadInPlace) {
  const Scene scene =
      SceneOf("<include filename='parts.xml'/><shape type='sphere'><ref id='red'/></shape>",
              {{"parts.xml",
                "<scene version='3.0.0'><bsdf type='diffuse' id='red'><rgb name='reflectance' "
                "value='#ff0000'/></bsdf></scene>"}});
  ExpectNear(scene.materials.at(1).reflectance, {1, 0, 0});
}

TEST(MitsubaReaderTest, AnIncludedFileMayBeOneObject) {
  const Scene scene =
      SceneOf("<shape type='sphere'><include filename='red.xml'/></shape>",
              {{"red.xml",
                "<bsdf type='diffuse' version='3.0.0'><include name='reflectance' "
                "filename='color.xml'/></bsdf>"},
               {"color.xml", "<texture type='srgb'><rgb name='color' value='1 0 0'/></texture>"}});
  ExpectNear(scene.materials.at(1).reflectance, {1, 0, 0});
}

TEST(MitsubaReaderTest, ObjectsMayHaveASecondName) {
  const Scene scene = SceneOf(
      "<bsdf type='diffuse' id='a'/><alias id='a' as='b'/><shape type='sphere'><ref id='a'/>"
      "</shape><shape type='sphere'><ref id='b'/></shape>");
  EXPECT_EQ(scene.spheres.at(0).traits.material, scene.spheres.at(1).traits.material);
}

TEST(MitsubaReaderTest, DefaultsMayBeInObjectsAndHaveDashes) {
  const Scene scene = SceneOf(
      "<shape type='sphere'><default name='r-x' value='3'/><default name='r' value='2'/>"
      "<float name='radius' value='$r-x'/></shape>"
      "<shape type='sphere'><float name='radius' value='$r'/></shape>");
  EXPECT_EQ(scene.spheres.at(0).radius, 3);
  EXPECT_EQ(scene.spheres.at(1).radius, 2);
}

TEST(MitsubaReaderTest, DefaultsOfDefaultsDoNotGrowWithoutEnd) {
  std::string body = "<default name='d0' value='0123456789'/>";
  for (int i = 1; i < 12; ++i) {
    const std::string before = "$d" + std::to_string(i - 1);
    std::string value;
    for (int repeat = 0; repeat < 10; ++repeat)
      value += before + ".";
    body += "<default name='d" + std::to_string(i) + "' value='" + value + "'/>";
  }
  const ParsedScene parsed = ReadXml(Around(body));
  EXPECT_FALSE(parsed.ok());
  EXPECT_THAT(Said(parsed), HasSubstr("too long with its defaults put in"));
}

TEST(MitsubaReaderTest, FilesAreLookedForInTheFoldersOfAScene) {
  const std::string body = "<path value='./sub/'/><path value='other'/>" +
                           Textured(
                               "<texture type='bitmap' name='reflectance'><string "
                               "name='filename' value='four.pfm'/></texture>");
  for (const std::string path : {"sub/four.pfm", "other/four.pfm", "four.pfm"}) {
    const Scene scene = SceneOf(body, {{path, kFourPixels}});
    ExpectNear(ColorAt(scene, 0.75F, 0.25F), {0, 1, 0});
  }
  const ParsedScene none = ReadXml(Around(body));
  EXPECT_THAT(Said(none), HasSubstr("four.pfm: no such file"));
}

}  // namespace
}  // namespace lucerna
