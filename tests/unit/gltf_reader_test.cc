// What a glTF 2.0 file says arrives in the scene: places, faces, cameras, units of light, materials
// and textures, in closed forms; and what is wrong in a file is refused in one sentence.
#include <cmath>
#include <string>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

#include "render/formats/mesh_placement.h"
#include "render/image/image.h"
#include "render/math/warp.h"
#include "render/scene/render_settings.h"
#include "render/scene/texture.h"
#include "tests/support/gltf_builder.h"
#include "tests/support/local_render.h"

namespace lucerna {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using Json = nlohmann::json;

std::string Said(const ParsedScene& parsed) {
  std::string all;
  for (const Diagnostic& diagnostic : parsed.diagnostics)
    all += diagnostic.ToString() + "\n";
  return all;
}

Scene SceneOf(const GltfBuilder& builder, const SceneLimits& limits = {}) {
  ParsedScene parsed = builder.Read(limits);
  EXPECT_TRUE(parsed.ok()) << parsed.ToStatus();
  return std::move(parsed.scene);
}

void ExpectNear(Vec3 a, Vec3 b, float tolerance = 1e-6F) {
  EXPECT_LT(Length(a - b), tolerance) << "(" << a.x << ", " << a.y << ", " << a.z << ") and ("
                                      << b.x << ", " << b.y << ", " << b.z << ")";
}

Vec3 OutwardOf(const TriangleMesh& mesh, std::size_t triangle = 0) {
  const Double3 cross = EdgeCross(mesh, triangle);
  return Normalize(
      {static_cast<float>(cross.x), static_cast<float>(cross.y), static_cast<float>(cross.z)});
}

// ---- Nodes and meshes

TEST(GltfReaderTest, NodesPlaceMeshesByTheirMatricesAndByTranslationRotationAndScale) {
  GltfBuilder builder;
  builder.AddCamera();
  const int mesh = builder.AddTriangleMesh();
  // A quarter turn about z after scaling by 2, 3, 4; then moved; all of it within a matrix that
  // moves by 10 along x.
  const double half = std::sqrt(0.5);
  const int child = builder.Add("nodes", {{"mesh", mesh},
                                          {"translation", {1, 2, 3}},
                                          {"rotation", {0, 0, half, half}},
                                          {"scale", {2, 3, 4}}});
  builder.AddNode(
      {{"matrix", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 10, 0, 0, 1}}, {"children", {child}}});
  const Scene scene = SceneOf(builder);
  ASSERT_EQ(scene.meshes.size(), 1U);
  ASSERT_EQ(scene.meshes[0].positions.size(), 3U);
  ExpectNear(scene.meshes[0].positions[0], {11, 2, 3});
  ExpectNear(scene.meshes[0].positions[1], {11, 4, 3});
  ExpectNear(scene.meshes[0].positions[2], {8, 2, 3});
  EXPECT_EQ(scene.unit, 1);
}

TEST(GltfReaderTest, MirroredNodesKeepTheFrontOfTheirMeshes) {
  GltfBuilder builder;
  builder.AddCamera();
  const int mesh = builder.AddTriangleMesh();
  builder.AddNode({{"mesh", mesh}});
  builder.AddNode({{"mesh", mesh}, {"scale", {-1, 1, 1}}});
  builder.AddNode({{"mesh", mesh}, {"scale", {1, 1, -1}}});
  const Scene scene = SceneOf(builder);
  ASSERT_EQ(scene.meshes.size(), 3U);
  ExpectNear(OutwardOf(scene.meshes[0]), {0, 0, 1});
  // Mirrored in x the front still faces +z; mirrored in z it faces -z.
  ExpectNear(OutwardOf(scene.meshes[1]), {0, 0, 1});
  ExpectNear(OutwardOf(scene.meshes[2]), {0, 0, -1});
}

TEST(GltfReaderTest, MeshesAreWoundByTheirNormals) {
  GltfBuilder builder;
  builder.AddCamera();
  const int normals = builder.AddAccessor<float>({0, 0, -2, 0, 0, -2, 0, 0, -2}, "VEC3");
  builder.AddNode({{"mesh", builder.AddTriangleMesh({{"attributes", {{"NORMAL", normals}}}})}});
  const Scene scene = SceneOf(builder);
  ExpectNear(scene.meshes.at(0).normals.at(0), {0, 0, -1});
  ExpectNear(OutwardOf(scene.meshes[0]), {0, 0, -1});
}

TEST(GltfReaderTest, StripsAndFansAreTriangles) {
  // A pentagon's corners, in the order of a fan.
  const std::vector<float> fan = {0, 0, 0, 2, 0, 0, 2, 1, 0, 1, 2, 0, 0, 1, 0};
  // Two squares side by side, in the order of a strip.
  const std::vector<float> strip = {0, 0, 0, 0, 1, 0, 1, 0, 0, 1, 1, 0, 2, 0, 0, 2, 1, 0};
  for (const int mode : {5, 6}) {
    GltfBuilder builder;
    builder.AddCamera();
    const int positions = builder.AddAccessor(mode == 5 ? strip : fan, "VEC3");
    const int mesh = builder.Add(
        "meshes", {{"primitives", {{{"mode", mode}, {"attributes", {{"POSITION", positions}}}}}}});
    builder.AddNode({{"mesh", mesh}});
    const Scene scene = SceneOf(builder);
    const TriangleMesh& read = scene.meshes.at(0);
    ASSERT_EQ(read.indices.size(), mode == 5 ? 12U : 9U);
    double area = 0;
    for (std::size_t i = 0; i < read.indices.size() / 3; ++i) {
      area += Length(EdgeCross(read, i)) / 2;
      // All face the same way.
      ExpectNear(OutwardOf(read, i), mode == 5 ? Vec3{0, 0, -1} : Vec3{0, 0, 1});
    }
    EXPECT_NEAR(area, mode == 5 ? 2 : 3, 1e-6);
  }
}

TEST(GltfReaderTest, AMatrixMayBeAffineUpToRounding) {
  GltfBuilder builder;
  builder.AddCamera();
  const int mesh = builder.AddTriangleMesh();
  const auto with_fourth_row = [&](double x, double w) {
    GltfBuilder copy = builder;
    copy.AddNode({{"mesh", mesh}, {"matrix", {1, 0, 0, x, 0, 1, 0, 0, 0, 0, 1, 0, 5, 0, 0, w}}});
    return copy;
  };
  // The fourth row is taken for 0 0 0 1: nothing is divided by it.
  const Scene scene = SceneOf(with_fourth_row(-5e-5, 0.9999999403953552));
  EXPECT_THAT(scene.meshes.at(0).positions,
              ElementsAre(Vec3{5, 0, 0}, Vec3{6, 0, 0}, Vec3{5, 1, 0}));
  EXPECT_THAT(Said(with_fourth_row(0, 0.999).Read()), HasSubstr("matrix must be affine"));
}

TEST(GltfReaderTest, WhatIsBelowANodeThatIsNotVisibleIsLeftOutButForCameras) {
  GltfBuilder builder;
  const Json hidden = {{"KHR_node_visibility", {{"visible", false}}}};
  const Json shown = {{"KHR_node_visibility", {{"visible", true}}}};
  const int mesh = builder.AddTriangleMesh();
  builder.json["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "point"}}};
  const Json light = {{"KHR_lights_punctual", {{"light", 0}}}};
  const int child =
      builder.Add("nodes", {{"mesh", mesh}, {"translation", {1, 0, 0}}, {"extensions", shown}});
  const int child_light = builder.Add("nodes", {{"extensions", light}});
  builder.AddCamera({{"extensions", hidden}, {"children", {child, child_light}}});
  builder.AddNode({{"mesh", mesh}, {"translation", {2, 0, 0}}, {"extensions", shown}});
  builder.json["extensionsRequired"] = {"KHR_node_visibility"};
  const ParsedScene parsed = builder.Read();
  ASSERT_TRUE(parsed.ok()) << parsed.ToStatus();
  ASSERT_EQ(parsed.scene.meshes.size(), 1U);
  ExpectNear(parsed.scene.meshes[0].positions[0], {2, 0, 0});
  EXPECT_TRUE(parsed.scene.point_lights.empty());
  EXPECT_THAT(Said(parsed), Not(HasSubstr("the file has no camera")));
}

TEST(GltfReaderTest, AFileWithoutTrianglesAndCameraHasOneErrorThatSaysSo) {
  GltfBuilder builder;
  builder.AddNode({{"mesh", builder.AddTriangleMesh({{"mode", 0}})}});
  const ParsedScene parsed = builder.Read();
  EXPECT_FALSE(parsed.ok());
  EXPECT_THAT(Said(parsed), HasSubstr("s.gltf: error: the file has no triangles: points, lines and "
                                      "empty nodes are not rendered"));
  EXPECT_THAT(Said(parsed), Not(HasSubstr("camera")));
  EXPECT_THAT(Said(parsed), Not(HasSubstr("warning")));
}

// ---- Skins and morph targets

std::vector<float> MatrixThatMoves(float x, float y, float z) {
  return {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, x, y, z, 1};
}

// A triangle whose node, at (100, 0, 0), has a skin of two joints: one moves by 1 along x and turns
// by a right angle about z, the other doubles in size. The second is hidden below the last node.
struct Skinned {
  GltfBuilder builder;
  int mesh = 0;
  int skin = 0;

  explicit Skinned(const Json& attributes) {
    builder.AddCamera();
    Json primitive;
    primitive["attributes"] = attributes;
    mesh = builder.AddTriangleMesh(primitive);
  }
  void AddNodes() {
    const double half = std::sqrt(0.5);
    std::vector<float> binds = MatrixThatMoves(0, 0, 0);
    const std::vector<float> second = MatrixThatMoves(0, 0, 3);
    binds.insert(binds.end(), second.begin(), second.end());
    const int inverse_binds = builder.Add("accessors", {{"bufferView", builder.AddNumbers(binds)},
                                                        {"componentType", 5126},
                                                        {"count", 2},
                                                        {"type", "MAT4"}});
    builder.AddNode({{"mesh", mesh}, {"skin", 0}, {"translation", {100, 0, 0}}});
    const int turned =
        builder.AddNode({{"translation", {1, 0, 0}}, {"rotation", {0, 0, half, half}}});
    const int larger = builder.Add("nodes", {{"scale", {2, 2, 2}}});
    builder.AddNode(
        {{"extensions", {{"KHR_node_visibility", {{"visible", false}}}}}, {"children", {larger}}});
    skin = builder.Add("skins",
                       {{"joints", {turned, larger}}, {"inverseBindMatrices", inverse_binds}});
  }
};

TEST(GltfReaderTest, ASkinPlacesVerticesByTheirJointsAndNotByTheNode) {
  Skinned skinned(Json::object());
  Json& attributes = skinned.builder.json["meshes"][0]["primitives"][0]["attributes"];
  GltfBuilder& builder = skinned.builder;
  attributes["NORMAL"] = builder.AddAccessor<float>({1, 0, 0, 1, 0, 0, 0, 0, 1}, "VEC3");
  // The first vertex follows joint 0, the second both, by weights whose sum is a half, the third
  // joint 1, which is in the second set. Joint 77 has no weight.
  attributes["JOINTS_0"] =
      builder.AddAccessor<std::uint8_t>({0, 77, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0}, "VEC4");
  attributes["WEIGHTS_0"] =
      builder.AddAccessor<float>({1, 0, 0, 0, 0.25F, 0.25F, 0, 0, 0, 0, 0, 0}, "VEC4");
  attributes["JOINTS_1"] =
      builder.AddAccessor<std::uint16_t>({0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0}, "VEC4");
  attributes["WEIGHTS_1"] =
      builder.AddAccessor<std::uint8_t>({0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 255, 0}, "VEC4", true);
  skinned.AddNodes();
  const ParsedScene parsed = builder.Read();
  ASSERT_TRUE(parsed.ok()) << parsed.ToStatus();
  ASSERT_EQ(parsed.scene.meshes.size(), 1U);
  const TriangleMesh& mesh = parsed.scene.meshes[0];
  ExpectNear(mesh.positions.at(0), {1, 0, 0});
  // (1, 0, 0) goes to (1, 1, 0) and, moved by 3 along z and doubled, to (2, 0, 6).
  ExpectNear(mesh.positions.at(1), {1.5F, 0.5F, 3});
  ExpectNear(mesh.positions.at(2), {0, 2, 6});
  ExpectNear(mesh.normals.at(0), {0, 1, 0});
  // The mean of a quarter turn and of twice the identity, (1, -0.5; 0.5, 1): its inverse transpose
  // turns as it does.
  ExpectNear(mesh.normals.at(1), Normalize({1, 0.5F, 0}));
  ExpectNear(mesh.normals.at(2), {0, 0, 1});
  EXPECT_THAT(Said(parsed), Not(HasSubstr("skin")));
}

TEST(GltfReaderTest, ASkinWithoutMatricesMovesByItsJointsAndOtherPrimitivesByTheNode) {
  Skinned skinned(Json::object());
  GltfBuilder& builder = skinned.builder;
  Json& primitives = builder.json["meshes"][0]["primitives"];
  primitives.push_back(primitives[0]);
  Json& attributes = primitives[0]["attributes"];
  attributes["JOINTS_0"] = builder.AddAccessor<std::uint8_t>(std::vector<std::uint8_t>(12), "VEC4");
  // Without weights each vertex follows its first joint.
  attributes["WEIGHTS_0"] = builder.AddAccessor<float>(std::vector<float>(12), "VEC4");
  skinned.AddNodes();
  builder.json["skins"][0].erase("inverseBindMatrices");
  const ParsedScene parsed = builder.Read();
  ASSERT_TRUE(parsed.ok()) << parsed.ToStatus();
  ASSERT_EQ(parsed.scene.meshes.size(), 2U);
  ExpectNear(parsed.scene.meshes[0].positions.at(1), {1, 1, 0});
  ExpectNear(parsed.scene.meshes[1].positions.at(1), {101, 0, 0});
  EXPECT_THAT(Said(parsed), HasSubstr("warning: meshes[0].primitives[1]: has no JOINTS_0"));
}

TEST(GltfReaderTest, ASkinThatMirrorsKeepsTheFrontOfItsMesh) {
  Skinned skinned(Json::object());
  GltfBuilder& builder = skinned.builder;
  Json& attributes = builder.json["meshes"][0]["primitives"][0]["attributes"];
  attributes["JOINTS_0"] = builder.AddAccessor<std::uint8_t>(std::vector<std::uint8_t>(12), "VEC4");
  attributes["WEIGHTS_0"] = builder.AddAccessor<float>(std::vector<float>(12, 1), "VEC4");
  builder.AddNode({{"mesh", 0}, {"skin", 0}});
  builder.Add("skins", {{"joints", {builder.AddNode({{"scale", {-1, 1, 1}}})}}});
  ExpectNear(OutwardOf(SceneOf(builder).meshes.at(0)), {0, 0, 1});
}

TEST(GltfReaderTest, JointsAndWeightsOfAVertexAreChecked) {
  const auto said = [](const std::vector<std::uint8_t>& joints, const std::vector<float>& weights) {
    Skinned skinned(Json::object());
    GltfBuilder& builder = skinned.builder;
    Json& attributes = builder.json["meshes"][0]["primitives"][0]["attributes"];
    attributes["JOINTS_0"] = builder.AddAccessor(joints, "VEC4");
    if (!weights.empty()) attributes["WEIGHTS_0"] = builder.AddAccessor(weights, "VEC4");
    skinned.AddNodes();
    const ParsedScene parsed = builder.Read();
    EXPECT_FALSE(parsed.ok());
    return Said(parsed);
  };
  const std::vector<std::uint8_t> zeros(12);
  std::vector<std::uint8_t> beyond = zeros;
  beyond[4] = 2;
  EXPECT_THAT(said(beyond, std::vector<float>(12, 1)),
              HasSubstr("JOINTS_0 of vertex 1 is 2, none of the 2 joints of the skin"));
  EXPECT_THAT(said(zeros, std::vector<float>(12, HUGE_VALF)),
              HasSubstr("a weight of vertex 0 is not finite"));
  EXPECT_THAT(said(zeros, {}), HasSubstr("has JOINTS_0 and no WEIGHTS_0"));
  EXPECT_THAT(said(zeros, {1, 1, 1, 1}),
              HasSubstr("WEIGHTS_0 must have as many elements as POSITION (3), not 1"));
}

TEST(GltfReaderTest, MorphTargetsAreAddedByTheWeightsOfTheNodeElseOfTheMesh) {
  GltfBuilder builder;
  builder.AddCamera();
  const int normals = builder.AddAccessor<float>({0, 0, 1, 0, 0, 1, 0, 0, 1}, "VEC3");
  const int up = builder.AddAccessor<float>({0, 0, 4, 0, 0, 4, 0, 0, 4}, "VEC3");
  const int aside = builder.AddAccessor<float>({2, 0, 0, 2, 0, 0, 4, 0, 0}, "VEC3");
  const int tilt = builder.AddAccessor<float>({2, 0, 0, 0, 0, 0, 0, 0, 0}, "VEC3");
  const int mesh = builder.AddTriangleMesh(
      {{"attributes", {{"NORMAL", normals}}},
       {"targets", {{{"POSITION", up}}, {{"POSITION", aside}, {"NORMAL", tilt}}}}});
  builder.json["meshes"][mesh]["weights"] = {0.25, 0};
  builder.AddNode({{"mesh", mesh}});
  builder.AddNode({{"mesh", mesh}, {"weights", {-0.5, 0.5}}, {"translation", {0, 10, 0}}});
  const ParsedScene parsed = builder.Read();
  ASSERT_TRUE(parsed.ok()) << parsed.ToStatus();
  ASSERT_EQ(parsed.scene.meshes.size(), 2U);
  const TriangleMesh& of_mesh = parsed.scene.meshes[0];
  EXPECT_THAT(of_mesh.positions, ElementsAre(Vec3{0, 0, 1}, Vec3{1, 0, 1}, Vec3{0, 1, 1}));
  EXPECT_THAT(of_mesh.normals, ElementsAre(Vec3{0, 0, 1}, Vec3{0, 0, 1}, Vec3{0, 0, 1}));
  const TriangleMesh& of_node = parsed.scene.meshes[1];
  EXPECT_THAT(of_node.positions, ElementsAre(Vec3{1, 10, -2}, Vec3{2, 10, -2}, Vec3{2, 11, -2}));
  ExpectNear(of_node.normals.at(0), {std::sqrt(0.5F), 0, std::sqrt(0.5F)});
  ExpectNear(of_node.normals.at(1), {0, 0, 1});
  EXPECT_THAT(Said(parsed), Not(HasSubstr("morph")));
}

TEST(GltfReaderTest, MorphTargetsComeBeforeSkins) {
  Skinned skinned(Json::object());
  GltfBuilder& builder = skinned.builder;
  Json& primitive = builder.json["meshes"][0]["primitives"][0];
  primitive["attributes"]["JOINTS_0"] =
      builder.AddAccessor<std::uint8_t>(std::vector<std::uint8_t>(12, 1), "VEC4");
  primitive["attributes"]["WEIGHTS_0"] =
      builder.AddAccessor<float>({1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}, "VEC4");
  const int aside = builder.AddAccessor<float>({5, 0, 0, 5, 0, 0, 5, 0, 0}, "VEC3");
  primitive["targets"] = {{{"POSITION", aside}}};
  builder.json["meshes"][0]["weights"] = {1};
  skinned.AddNodes();
  ExpectNear(SceneOf(builder).meshes.at(0).positions.at(0), {10, 0, 6});
}

TEST(GltfReaderTest, PointsAndLinesAreNoted) {
  GltfBuilder builder;
  builder.AddCamera();
  builder.AddNode({{"mesh", builder.AddTriangleMesh({{"mode", 1}})}});
  builder.AddNode({{"mesh", builder.AddTriangleMesh()}});
  const ParsedScene parsed = builder.Read();
  ASSERT_TRUE(parsed.ok()) << parsed.ToStatus();
  EXPECT_EQ(parsed.scene.meshes.size(), 1U);
  EXPECT_THAT(Said(parsed), HasSubstr("note: points and lines are left out"));
}

// ---- Accessors

template <typename Number>
std::vector<Vec3> PositionsOf(const std::vector<Number>& numbers, bool is_normalized) {
  GltfBuilder builder;
  builder.AddCamera();
  const int positions = builder.AddAccessor(numbers, "VEC3", is_normalized);
  const int mesh =
      builder.Add("meshes", {{"primitives", {{{"attributes", {{"POSITION", positions}}}}}}});
  builder.AddNode({{"mesh", mesh}});
  return SceneOf(builder).meshes.at(0).positions;
}

TEST(GltfReaderTest, PositionsMayHaveEveryComponentType) {
  const auto expect = [](const std::vector<Vec3>& read, Vec3 last) {
    ASSERT_EQ(read.size(), 3U);
    ExpectNear(read[0], {0, 0, 0});
    ExpectNear(read[2], last);
  };
  expect(PositionsOf<std::int8_t>({0, 0, 0, 1, 0, 0, -127, -128, 127}, false), {-127, -128, 127});
  expect(PositionsOf<std::uint8_t>({0, 0, 0, 1, 0, 0, 255, 51, 0}, false), {255, 51, 0});
  expect(PositionsOf<std::int16_t>({0, 0, 0, 1, 0, 0, -32768, 2, 3}, false), {-32768, 2, 3});
  expect(PositionsOf<std::uint16_t>({0, 0, 0, 1, 0, 0, 65535, 2, 3}, false), {65535, 2, 3});
  expect(PositionsOf<std::uint32_t>({0, 0, 0, 1, 0, 0, 70000, 2, 3}, false), {70000, 2, 3});
  expect(PositionsOf<float>({0, 0, 0, 1, 0, 0, -1.5F, 2, 3}, false), {-1.5F, 2, 3});
  // Integers that stand for [0, 1] and [-1, 1]; the lowest two are both -1.
  expect(PositionsOf<std::int8_t>({0, 0, 0, 127, 0, 0, -127, -128, 127}, true), {-1, -1, 1});
  expect(PositionsOf<std::uint8_t>({0, 0, 0, 255, 0, 0, 255, 51, 0}, true), {1, 0.2F, 0});
  expect(PositionsOf<std::int16_t>({0, 0, 0, 9, 0, 0, -32768, 32767, 0}, true), {-1, 1, 0});
  expect(PositionsOf<std::uint16_t>({0, 0, 0, 9, 0, 0, 65535, 13107, 0}, true), {1, 0.2F, 0});
}

template <typename Number>
void ExpectIndices(const std::vector<Number>& indices) {
  GltfBuilder builder;
  builder.AddCamera();
  const int accessor = builder.AddAccessor(indices, "SCALAR");
  builder.AddNode({{"mesh", builder.AddTriangleMesh({{"indices", accessor}})}});
  EXPECT_THAT(SceneOf(builder).meshes.at(0).indices, ElementsAre(2, 1, 0, 0, 1, 2));
}

TEST(GltfReaderTest, IndicesMayBeUnsignedIntegersOfEverySize) {
  ExpectIndices<std::uint8_t>({2, 1, 0, 0, 1, 2});
  ExpectIndices<std::uint16_t>({2, 1, 0, 0, 1, 2});
  ExpectIndices<std::uint32_t>({2, 1, 0, 0, 1, 2});
}

TEST(GltfReaderTest, ElementsMayLieApartAndBehindOneAnother) {
  GltfBuilder builder;
  builder.AddCamera();
  // Position and normal by turns, after one number that belongs to neither.
  const int view =
      builder.AddNumbers<float>({99, 0, 0, 0, 0, 0, 1, 1, 0, 0, 0, 0, 1, 0, 1, 0, 0, 0, 1});
  builder.json["bufferViews"][view]["byteStride"] = 24;
  const auto accessor = [&](int offset) {
    return builder.Add("accessors", {{"bufferView", view},
                                     {"byteOffset", offset},
                                     {"componentType", 5126},
                                     {"count", 3},
                                     {"type", "VEC3"}});
  };
  const int positions = accessor(4);
  const int normals = accessor(16);
  const int mesh = builder.Add(
      "meshes",
      {{"primitives", {{{"attributes", {{"POSITION", positions}, {"NORMAL", normals}}}}}}});
  builder.AddNode({{"mesh", mesh}});
  const Scene scene = SceneOf(builder);
  EXPECT_THAT(scene.meshes.at(0).positions,
              ElementsAre(Vec3{0, 0, 0}, Vec3{1, 0, 0}, Vec3{0, 1, 0}));
  EXPECT_THAT(scene.meshes.at(0).normals, ElementsAre(Vec3{0, 0, 1}, Vec3{0, 0, 1}, Vec3{0, 0, 1}));
}

TEST(GltfReaderTest, SparseValuesReplaceOthersOrZeros) {
  for (const bool has_view : {true, false}) {
    GltfBuilder builder;
    builder.AddCamera();
    const int positions = builder.AddAccessor<float>({0, 0, 7, 1, 0, 7, 0, 1, 7, 1, 1, 7}, "VEC3");
    Json& accessor = builder.json["accessors"][positions];
    if (!has_view) accessor.erase("bufferView");
    const int indices = builder.AddNumbers<std::uint16_t>({1, 2});
    const int values = builder.AddNumbers<float>({5, 0, 7, 0, 5, 7});
    builder.json["accessors"][positions]["sparse"] = {
        {"count", 2},
        {"indices", {{"bufferView", indices}, {"componentType", 5123}}},
        {"values", {{"bufferView", values}}}};
    const int mesh = builder.Add(
        "meshes", {{"primitives", {{{"mode", 5}, {"attributes", {{"POSITION", positions}}}}}}});
    builder.AddNode({{"mesh", mesh}});
    const Scene scene = SceneOf(builder);
    if (has_view) {
      EXPECT_THAT(scene.meshes.at(0).positions,
                  ElementsAre(Vec3{0, 0, 7}, Vec3{5, 0, 7}, Vec3{0, 5, 7}, Vec3{1, 1, 7}));
    } else {
      EXPECT_THAT(scene.meshes.at(0).positions,
                  ElementsAre(Vec3{0, 0, 0}, Vec3{5, 0, 7}, Vec3{0, 5, 7}, Vec3{0, 0, 0}));
    }
  }
}

TEST(GltfReaderTest, AnAccessorWithoutBytesIsZerosUpTo64Mebibytes) {
  // A triangle and 997 vertices that nothing uses; in the second case all of them are zeros.
  for (const int sparse_count : {2, 0}) {
    GltfBuilder builder;
    builder.AddCamera();
    const int at = builder.AddNumbers<std::uint16_t>({1, 2});
    const int values = builder.AddNumbers<float>({5, 0, 7, 0, 5, 7});
    Json accessor = {{"componentType", 5126}, {"count", 1000}, {"type", "VEC3"}};
    const int indices = builder.AddAccessor<std::uint16_t>({0, 1, 2}, "SCALAR");
    if (sparse_count > 0) {
      accessor["sparse"] = {{"count", sparse_count},
                            {"indices", {{"bufferView", at}, {"componentType", 5123}}},
                            {"values", {{"bufferView", values}}}};
    }
    const int positions = builder.Add("accessors", accessor);
    const int mesh = builder.Add(
        "meshes",
        {{"primitives", {{{"indices", indices}, {"attributes", {{"POSITION", positions}}}}}}});
    builder.AddNode({{"mesh", mesh}});
    const ParsedScene parsed = builder.Read();
    ASSERT_TRUE(parsed.ok()) << parsed.ToStatus();
    if (sparse_count > 0) {
      EXPECT_THAT(parsed.scene.meshes.at(0).positions,
                  ElementsAre(Vec3{0, 0, 0}, Vec3{5, 0, 7}, Vec3{0, 5, 7}));
    } else {
      EXPECT_THAT(Said(parsed), HasSubstr("1 of 1 triangles have no area"));
    }
    builder.json["accessors"][positions]["count"] = (1 << 26) / 12 + 1;
    EXPECT_THAT(Said(builder.Read()), HasSubstr("of which it may have 67108864 bytes"));
  }
}

TEST(GltfReaderTest, OfSharedVerticesAMeshKeepsThoseThatItUses) {
  GltfBuilder builder;
  builder.AddCamera();
  std::vector<float> many(3 * 100);
  for (std::size_t i = 0; i < 100; ++i)
    many[3 * i + i % 3] = static_cast<float>(i);
  const int positions = builder.AddAccessor(many, "VEC3");
  const int indices = builder.AddAccessor<std::uint16_t>({99, 10, 50}, "SCALAR");
  const int mesh = builder.Add(
      "meshes",
      {{"primitives", {{{"indices", indices}, {"attributes", {{"POSITION", positions}}}}}}});
  builder.AddNode({{"mesh", mesh}});
  const Scene scene = SceneOf(builder);
  EXPECT_THAT(scene.meshes.at(0).positions,
              ElementsAre(Vec3{0, 10, 0}, Vec3{0, 0, 50}, Vec3{99, 0, 0}));
  EXPECT_THAT(scene.meshes.at(0).indices, ElementsAre(2, 0, 1));
}

TEST(GltfReaderTest, BytesComeFromFilesFromTheTextAndFromTheSecondChunk) {
  GltfBuilder builder;
  builder.AddCamera();
  builder.AddNode({{"mesh", builder.AddTriangleMesh()}});
  const std::vector<Vec3> expected = SceneOf(builder).meshes.at(0).positions;

  MemoryFiles glb({{"s.glb", builder.Glb()}});
  ParsedScene parsed = ReadScene(glb, "s.glb");
  ASSERT_TRUE(parsed.ok()) << parsed.ToStatus();
  EXPECT_EQ(parsed.scene.meshes.at(0).positions, expected);
  // By its first bytes too.
  MemoryFiles unnamed({{"scene", builder.Glb()}});
  EXPECT_TRUE(ReadScene(unnamed, "scene").ok());

  GltfBuilder embedded = builder;
  std::string base64;
  constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  for (std::size_t i = 0; i < builder.buffer().size(); i += 3) {
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < 3; ++k)
      bits = bits << 8 | static_cast<std::uint8_t>(builder.buffer()[i + k]);
    for (int k = 3; k >= 0; --k)
      base64 += kDigits[bits >> static_cast<unsigned>(6 * k) & 63U];
  }
  embedded.json["buffers"] = {{{"byteLength", builder.buffer().size()},
                               {"uri", "data:application/octet-stream;base64," + base64}}};
  EXPECT_EQ(SceneOf(embedded).meshes.at(0).positions, expected);

  GltfBuilder escaped = builder;
  escaped.files["two words.bin"] = builder.buffer();
  escaped.json["buffers"] = {{{"byteLength", builder.buffer().size()}, {"uri", "two%20words.bin"}}};
  EXPECT_EQ(SceneOf(escaped).meshes.at(0).positions, expected);
}

TEST(GltfReaderTest, PathsAreReadAsOtherProgramsReadThem) {
  GltfBuilder builder;
  builder.AddCamera();
  builder.AddNode({{"mesh", builder.AddTriangleMesh()}});
  const auto reads = [&](const std::string& uri, const std::string& file) {
    GltfBuilder copy = builder;
    copy.json["buffers"] = {{{"byteLength", builder.buffer().size()}, {"uri", uri}}};
    copy.files[file] = builder.buffer();
    std::map<std::string, std::string> all = copy.AllFiles();
    if (file != "b.bin") all.erase("b.bin");
    MemoryFiles files(std::move(all));
    return Said(ReadScene(files, "s.gltf"));
  };
  const auto is_read = Not(HasSubstr("error"));
  EXPECT_THAT(reads("sub/../sub/c.bin", "sub/c.bin"), is_read);
  EXPECT_THAT(reads("./sub/./c.bin", "sub/c.bin"), is_read);
  EXPECT_THAT(reads("sub%2F..%2Fc.bin", "c.bin"), is_read);
  EXPECT_THAT(reads("sub\\c.bin", "sub/c.bin"), is_read);
  EXPECT_THAT(reads("100%.bin", "100%.bin"), is_read);
  EXPECT_THAT(reads("100%zz%20.bin", "100%zz .bin"), is_read);
  EXPECT_THAT(reads("c.bin?v=1", "c.bin"), is_read);
  EXPECT_THAT(reads("c.bin#first", "c.bin"), is_read);
  EXPECT_THAT(reads("c.bin?v=1", "c.bin?v=1"), is_read);
  EXPECT_THAT(reads("a#1.bin", "a#1.bin"), is_read);
  // Not beyond the folder.
  EXPECT_THAT(reads("sub/../../c.bin", "c.bin"), HasSubstr("not a path inside"));
  EXPECT_THAT(reads("sub\\..\\..\\c.bin", "c.bin"), HasSubstr("not a path inside"));
  EXPECT_THAT(reads("/../c.bin", "c.bin"), HasSubstr("not a path inside"));
  EXPECT_THAT(reads("..", "c.bin"), HasSubstr("not a path inside"));
  EXPECT_THAT(reads("sub/..", "c.bin"), HasSubstr("not a path inside"));
  EXPECT_THAT(reads("C:\\c.bin", "c.bin"), HasSubstr("nothing is fetched"));
}

TEST(GltfReaderTest, Base64MayHaveLinesAndBeNamedInCapitals) {
  GltfBuilder builder;
  builder.AddCamera();
  builder.AddNode({{"mesh", builder.AddTriangleMesh()}});
  for (const char* start : {"data:;base64,", "DATA:application/octet-stream;BASE64,"}) {
    // 36 bytes: the corners of the triangle.
    GltfBuilder embedded = builder;
    embedded.json["buffers"] = {
        {{"byteLength", 36},
         {"uri",
          std::string(start) + "AAAAAAAAAAAA\nAAAAAACAPwAA\r\n AAAAAAAAAAAAAAAAgD8AAAAA \n"}}};
    EXPECT_THAT(SceneOf(embedded).meshes.at(0).positions,
                ElementsAre(Vec3{0, 0, 0}, Vec3{1, 0, 0}, Vec3{0, 1, 0}));
  }
}

// ---- Instances

TEST(GltfReaderTest, InstancesAreWrittenOutWhileTheyAreSmall) {
  GltfBuilder builder;
  builder.AddCamera();
  const int mesh = builder.AddTriangleMesh();
  const int places = builder.AddAccessor<float>({1, 0, 0, 2, 0, 0}, "VEC3");
  const int turns = builder.AddAccessor<std::int8_t>({0, 0, 0, 127, 0, 0, 127, 0}, "VEC4", true);
  const int sizes = builder.AddAccessor<float>({1, 1, 1, 3, 3, 3}, "VEC3");
  builder.AddNode(
      {{"mesh", mesh},
       {"translation", {0, 0, 5}},
       {"extensions",
        {{"EXT_mesh_gpu_instancing",
          {{"attributes", {{"TRANSLATION", places}, {"ROTATION", turns}, {"SCALE", sizes}}}}}}}});
  const Scene scene = SceneOf(builder);
  ASSERT_EQ(scene.meshes.size(), 2U);
  ExpectNear(scene.meshes[0].positions[1], {2, 0, 5});
  ExpectNear(scene.meshes[1].positions[1],
             {-1, 0, 5});  // half a turn about z, three times as large
}

TEST(GltfReaderTest, WhatRepeatsALotIsShared) {
  GltfBuilder builder;
  builder.AddCamera();
  // A strip of 2,000 triangles, 600 times; the second primitive emits and is written out.
  std::vector<float> strip;
  for (int i = 0; i < 2002; ++i)
    strip.insert(strip.end(), {static_cast<float>(i / 2), static_cast<float>(i % 2), 0});
  const int positions = builder.AddAccessor(strip, "VEC3");
  const int emitter = builder.Add("materials", {{"emissiveFactor", {1, 1, 1}}});
  const int mesh = builder.AddTriangleMesh({{"material", emitter}});
  builder.json["meshes"][mesh]["primitives"].push_back(
      {{"mode", 5}, {"attributes", {{"POSITION", positions}}}});
  std::vector<float> places;
  for (int i = 0; i < 600; ++i)
    places.insert(places.end(), {0, 0, static_cast<float>(i)});
  const int at = builder.AddAccessor(places, "VEC3");
  builder.AddNode(
      {{"mesh", mesh},
       {"extensions", {{"EXT_mesh_gpu_instancing", {{"attributes", {{"TRANSLATION", at}}}}}}}});
  const Scene scene = SceneOf(builder);
  EXPECT_EQ(scene.instances.size(), 600U);
  ASSERT_EQ(scene.object_meshes.size(), 1U);
  EXPECT_EQ(scene.object_meshes[0].indices.size(), 6000U);
  EXPECT_EQ(scene.meshes.size(), 600U);
  EXPECT_EQ(scene.area_lights.size(), 1U);
  // The same, if the copies may only have a thousand triangles.
  SceneLimits limits;
  limits.max_triangles = 1000;
  EXPECT_THAT(Said(builder.Read(limits)), HasSubstr("more than 1000 triangles"));
  limits = {};
  limits.max_shape_bytes = 100'000;
  EXPECT_THAT(Said(builder.Read(limits)), HasSubstr("take more than the 100000 bytes"));
}

// ---- Cameras

TEST(GltfReaderTest, CamerasLookAlongMinusZWithXToTheRight) {
  GltfBuilder builder;
  const double half = std::sqrt(0.5);
  // Turned a quarter to the left: it looks along -x, with -z to its right. Scale has no effect.
  builder.AddCamera(
      {{"translation", {1, 2, 3}}, {"rotation", {0, half, 0, half}}, {"scale", {2, 2, 2}}});
  builder.AddNode({{"mesh", builder.AddTriangleMesh()}});
  const Camera camera = SceneOf(builder).camera;
  ExpectNear(camera.camera_to_world.Point({0, 0, 0}), {1, 2, 3});
  ExpectNear(camera.camera_to_world.Vector({0, 0, 1}), {-1, 0, 0});
  ExpectNear(camera.camera_to_world.Vector({0, 1, 0}), {0, 1, 0});
  ExpectNear(camera.camera_to_world.Vector({1, 0, 0}), {0, 0, -1});
  EXPECT_NEAR(camera.fov_deg, 180 / kPi64, 1e-9);
}

TEST(GltfReaderTest, AnglesOfViewAreThoseOfTheImagesHeight) {
  const auto with_aspect = [](double aspect) {
    GltfBuilder builder;
    builder.AddCamera();
    builder.json["cameras"][0]["perspective"]["aspectRatio"] = aspect;
    builder.AddNode({{"mesh", builder.AddTriangleMesh()}});
    return SceneOf(builder);
  };
  const Scene wide = with_aspect(2);
  EXPECT_EQ(wide.film.width, 1440);
  EXPECT_EQ(wide.film.crop_x1, 1440);
  EXPECT_EQ(wide.film.height, 720);
  const Scene tall = with_aspect(0.5);
  EXPECT_EQ(tall.film.width, 720);
  EXPECT_EQ(tall.film.height, 1440);
  for (const Scene& scene : {wide, tall}) {
    const Window window = ScreenWindow(scene.camera, scene.film.width, scene.film.height);
    EXPECT_NEAR(window.high_y, std::tan(0.5), 1e-9);
    EXPECT_NEAR(window.low_x, -window.high_x, 1e-12);
  }
}

TEST(GltfReaderTest, OrthographicCamerasShowTheirRectangle) {
  GltfBuilder builder;
  builder.Add("cameras", {{"type", "orthographic"},
                          {"orthographic", {{"xmag", 6}, {"ymag", 4}, {"znear", 0}, {"zfar", 9}}}});
  builder.AddNode({{"camera", 0}});
  builder.AddNode({{"mesh", builder.AddTriangleMesh()}});
  const Scene scene = SceneOf(builder);
  EXPECT_EQ(scene.camera.kind, Camera::Kind::kOrthographic);
  const Window window = ScreenWindow(scene.camera, scene.film.width, scene.film.height);
  EXPECT_NEAR(window.high_x, 6, 1e-9);
  EXPECT_NEAR(window.high_y, 4, 1e-9);
}

TEST(GltfReaderTest, ANegativeRectangleOfACameraIsReadWithoutItsSign) {
  GltfBuilder builder;
  builder.Add("cameras",
              {{"type", "orthographic"},
               {"orthographic", {{"xmag", -6}, {"ymag", 4}, {"znear", 0}, {"zfar", 9}}}});
  builder.AddNode({{"camera", 0}});
  builder.AddNode({{"mesh", builder.AddTriangleMesh()}});
  const Scene scene = SceneOf(builder);
  const Window window = ScreenWindow(scene.camera, scene.film.width, scene.film.height);
  EXPECT_NEAR(window.high_x, 6, 1e-9);
  EXPECT_THAT(Said(builder.Read()), HasSubstr("warning: cameras[0].orthographic: xmag is -6"));
  builder.json["cameras"][0]["orthographic"]["xmag"] = 0;
  EXPECT_THAT(Said(builder.Read()), HasSubstr("error: cameras[0].orthographic: xmag is 0"));
}

TEST(GltfReaderTest, WithoutACameraTheWholeSceneIsSeen) {
  GltfBuilder builder;
  builder.AddNode({{"mesh", builder.AddTriangleMesh()}, {"translation", {7, 0, -3}}});
  const ParsedScene parsed = builder.Read();
  ASSERT_TRUE(parsed.ok()) << parsed.ToStatus();
  EXPECT_THAT(Said(parsed), HasSubstr("warning: the file has no camera"));
  EXPECT_THAT(Said(parsed), HasSubstr("warning: the file has no light"));
  ASSERT_EQ(parsed.scene.infinite_lights.size(), 1U);
  EXPECT_EQ(parsed.scene.infinite_lights[0].radiance, Gray(1));
  const Camera& camera = parsed.scene.camera;
  const Transform to_camera = camera.camera_to_world.Inverse().value();
  const Window window = ScreenWindow(camera, 1280, 720);
  for (const Vec3 position : parsed.scene.meshes.at(0).positions) {
    const Vec3 seen = to_camera.Point(position);
    ASSERT_GT(seen.z, 0);
    EXPECT_LT(std::abs(static_cast<double>(seen.y / seen.z)), window.high_y);
  }
  // What is to the right in the file is to the right in the image.
  EXPECT_GT(to_camera.Point({8, 0, -3}).x, to_camera.Point({7, 0, -3}).x);
}

TEST(GltfReaderTest, OfSeveralCamerasTheFirstIsUsed) {
  GltfBuilder builder;
  builder.AddCamera({{"translation", {1, 0, 0}}});
  builder.AddCamera({{"translation", {2, 0, 0}}});
  builder.AddNode({{"mesh", builder.AddTriangleMesh()}});
  const ParsedScene parsed = builder.Read();
  EXPECT_THAT(Said(parsed), HasSubstr("note: the scene has 2 cameras; the first, cameras[0]"));
  ExpectNear(parsed.scene.camera.camera_to_world.Point({0, 0, 0}), {1, 0, 0});
}

// ---- Lights

TEST(GltfReaderTest, CandelaAndLuxBecomeWatts) {
  GltfBuilder builder;
  builder.AddCamera();
  builder.json["extensions"]["KHR_lights_punctual"]["lights"] = {
      {{"type", "point"}, {"intensity", 683}, {"color", {1, 0.5, 0}}},
      {{"type", "spot"},
       {"intensity", 1366},
       {"spot", {{"innerConeAngle", 0.1}, {"outerConeAngle", 0.4}}}},
      {{"type", "directional"}, {"intensity", 2049}}};
  const double half = std::sqrt(0.5);
  for (int light = 0; light < 3; ++light) {
    // Turned to look down, along -y.
    builder.AddNode({{"translation", {light, 5, 0}},
                     {"rotation", {-half, 0, 0, half}},
                     {"scale", {3, 3, 3}},
                     {"extensions", {{"KHR_lights_punctual", {{"light", light}}}}}});
  }
  builder.AddNode({{"mesh", builder.AddTriangleMesh()}});
  const Scene scene = SceneOf(builder);
  ASSERT_EQ(scene.point_lights.size(), 1U);
  EXPECT_EQ(scene.point_lights[0].intensity, (Rgb{1, 0.5F, 0}));
  ExpectNear(scene.point_lights[0].position, {0, 5, 0});
  ASSERT_EQ(scene.spot_lights.size(), 1U);
  EXPECT_EQ(scene.spot_lights[0].intensity, Gray(2));
  ExpectNear(scene.spot_lights[0].position, {1, 5, 0});
  ExpectNear(scene.spot_lights[0].direction, {0, -1, 0});
  EXPECT_FLOAT_EQ(scene.spot_lights[0].cos_falloff_start, std::cos(0.1F));
  EXPECT_FLOAT_EQ(scene.spot_lights[0].cos_total_width, std::cos(0.4F));
  ASSERT_EQ(scene.distant_lights.size(), 1U);
  EXPECT_EQ(scene.distant_lights[0].irradiance, Gray(3));
  ExpectNear(scene.distant_lights[0].direction, {0, -1, 0});
  EXPECT_TRUE(scene.infinite_lights.empty());
}

TEST(GltfReaderTest, AnInnerConeEndsWithinTheOuterOne) {
  const auto spot_of = [](const Json& cone) {
    GltfBuilder builder;
    builder.AddCamera();
    builder.json["extensions"]["KHR_lights_punctual"]["lights"] = {
        {{"type", "spot"}, {"spot", cone}}};
    builder.AddNode({{"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
    builder.AddNode({{"mesh", builder.AddTriangleMesh()}});
    EXPECT_THAT(Said(builder.Read()), HasSubstr("not below outerConeAngle"));
    return SceneOf(builder).spot_lights.at(0);
  };
  for (const Json& cone : std::vector<Json>{{{"innerConeAngle", 0.5}, {"outerConeAngle", 0.5}},
                                            {{"innerConeAngle", 0.6}, {"outerConeAngle", 0.5}}}) {
    const SpotLight spot = spot_of(cone);
    EXPECT_FLOAT_EQ(spot.cos_total_width, std::cos(0.5F));
    EXPECT_GT(spot.cos_falloff_start, spot.cos_total_width);
    EXPECT_LT(spot.cos_falloff_start, std::cos(0.499F));
  }
  EXPECT_FLOAT_EQ(spot_of({{"innerConeAngle", 1}}).cos_total_width, std::sqrt(0.5F));
}

TEST(GltfReaderTest, ALightThatIsFlattenedIsLeftOutUnlessItShinesAllAround) {
  GltfBuilder builder;
  builder.AddCamera();
  builder.json["extensions"]["KHR_lights_punctual"]["lights"] = {
      {{"type", "point"}}, {{"type", "spot"}}, {{"type", "directional"}}};
  for (int light = 0; light < 3; ++light) {
    builder.AddNode(
        {{"scale", {0, 0, 0}}, {"extensions", {{"KHR_lights_punctual", {{"light", light}}}}}});
  }
  builder.AddNode({{"mesh", builder.AddTriangleMesh()}});
  const ParsedScene parsed = builder.Read();
  ASSERT_TRUE(parsed.ok()) << parsed.ToStatus();
  EXPECT_EQ(parsed.scene.point_lights.size(), 1U);
  EXPECT_TRUE(parsed.scene.spot_lights.empty());
  EXPECT_TRUE(parsed.scene.distant_lights.empty());
  EXPECT_THAT(Said(parsed),
              HasSubstr("note: extensions.KHR_lights_punctual.lights[1]: is left out"));
}

// ---- Materials

// The scene of one triangle with a material.
Scene WithMaterial(GltfBuilder& builder, const Json& material) {
  builder.AddCamera();
  const int uvs = builder.AddAccessor<float>({0, 0, 1, 0, 0, 1}, "VEC2");
  const int number = builder.Add("materials", material);
  builder.AddNode({{"mesh", builder.AddTriangleMesh(
                                {{"material", number}, {"attributes", {{"TEXCOORD_0", uvs}}}})}});
  return SceneOf(builder);
}
Scene WithMaterial(const Json& material) {
  GltfBuilder builder;
  return WithMaterial(builder, material);
}
const Material& MaterialOf(const Scene& scene) {
  return scene.materials[static_cast<std::size_t>(scene.meshes.at(0).traits.material)];
}
const Material& PartOf(const Scene& scene, const Material& mix, std::size_t part) {
  return scene.materials.at(static_cast<std::size_t>(mix.mixed.at(part)));
}

TEST(GltfReaderTest, AMetalReflectsItsBaseColour) {
  const Scene scene = WithMaterial({{"name", "brass"},
                                    {"pbrMetallicRoughness",
                                     {{"baseColorFactor", {0.9, 0.7, 0.3, 1}},
                                      {"metallicFactor", 1},
                                      {"roughnessFactor", 0.5}}}});
  const Material& metal = MaterialOf(scene);
  EXPECT_EQ(metal.kind, Material::Kind::kConductor);
  EXPECT_EQ(metal.name, "brass");
  EXPECT_FLOAT_EQ(metal.k.g, AbsorptionFor(0.7F));
  EXPECT_FLOAT_EQ(metal.alpha_u, 0.25F);
  // The format's own defaults: a rough white metal.
  const Scene by_default = WithMaterial(Json::object());
  EXPECT_EQ(MaterialOf(by_default).kind, Material::Kind::kConductor);
  EXPECT_FLOAT_EQ(MaterialOf(by_default).alpha_u, 1);
}

TEST(GltfReaderTest, WhatIsNoMetalHasACoat) {
  const Scene scene = WithMaterial(
      {{"pbrMetallicRoughness",
        {{"baseColorFactor", {0.2, 0.4, 0.6, 1}}, {"metallicFactor", 0}, {"roughnessFactor", 0.4}}},
       {"extensions", {{"KHR_materials_ior", {{"ior", 1.3}}}}}});
  const Material& coated = MaterialOf(scene);
  EXPECT_EQ(coated.kind, Material::Kind::kCoatedDiffuse);
  EXPECT_EQ(coated.reflectance, (Rgb{0.2F, 0.4F, 0.6F}));
  EXPECT_FLOAT_EQ(coated.ior, 1.3F);
  EXPECT_FLOAT_EQ(coated.alpha_v, 0.16F);
  // With an index of 1 nothing is reflected at the coat.
  const Scene matte = WithMaterial({{"pbrMetallicRoughness", {{"metallicFactor", 0}}},
                                    {"extensions", {{"KHR_materials_ior", {{"ior", 1}}}}}});
  EXPECT_EQ(MaterialOf(matte).kind, Material::Kind::kDiffuse);
}

TEST(GltfReaderTest, BetweenMetalAndNoMetalIsAMix) {
  const Scene scene = WithMaterial({{"pbrMetallicRoughness", {{"metallicFactor", 0.25}}}});
  const Material& mix = MaterialOf(scene);
  ASSERT_EQ(mix.kind, Material::Kind::kMix);
  EXPECT_FLOAT_EQ(mix.amount, 0.25F);
  EXPECT_EQ(PartOf(scene, mix, 0).kind, Material::Kind::kCoatedDiffuse);
  EXPECT_EQ(PartOf(scene, mix, 1).kind, Material::Kind::kConductor);
}

TEST(GltfReaderTest, ThinGlassIsASheetAndAVolumeIsFilled) {
  const Json clear = {{"metallicFactor", 0}, {"roughnessFactor", 0}};
  const Json transmission = {{"transmissionFactor", 1}};
  const Scene thin = WithMaterial({{"pbrMetallicRoughness", clear},
                                   {"extensions", {{"KHR_materials_transmission", transmission}}}});
  EXPECT_EQ(MaterialOf(thin).kind, Material::Kind::kThinDielectric);
  EXPECT_FALSE(MaterialOf(thin).is_tinted);
  const Scene stained = WithMaterial(
      {{"pbrMetallicRoughness",
        {{"metallicFactor", 0}, {"roughnessFactor", 0}, {"baseColorFactor", {1, 0.5, 0.25, 1}}}},
       {"extensions", {{"KHR_materials_transmission", transmission}}}});
  EXPECT_TRUE(MaterialOf(stained).is_tinted);
  EXPECT_EQ(MaterialOf(stained).transmission_tint, (Rgb{1, 0.5F, 0.25F}));
  EXPECT_EQ(MaterialOf(stained).reflection_tint, Gray(1));
  const Scene solid = WithMaterial({{"pbrMetallicRoughness", clear},
                                    {"extensions",
                                     {{"KHR_materials_transmission", transmission},
                                      {"KHR_materials_ior", {{"ior", 1.7}}},
                                      {"KHR_materials_volume",
                                       {{"thicknessFactor", 1},
                                        {"attenuationDistance", 2},
                                        {"attenuationColor", {1, 0.5, 0.25}}}}}}});
  EXPECT_EQ(MaterialOf(solid).kind, Material::Kind::kDielectric);
  EXPECT_EQ(MaterialOf(solid).alpha_u, 0);
  EXPECT_FLOAT_EQ(MaterialOf(solid).ior, 1.7F);
  ASSERT_EQ(solid.media.size(), 1U);
  EXPECT_EQ(solid.meshes[0].traits.medium_inside, 0);
  EXPECT_EQ(solid.meshes[0].traits.medium_outside, kNoMedium);
  // After 2 m half of the green light is left, and a quarter of the blue.
  const Rgb left = solid.media[0].Transmittance(2);
  EXPECT_NEAR(left.r, 1, 1e-6);
  EXPECT_NEAR(left.g, 0.5, 1e-6);
  EXPECT_NEAR(left.b, 0.25, 1e-6);
  const Scene partly = WithMaterial(
      {{"pbrMetallicRoughness", clear},
       {"extensions", {{"KHR_materials_transmission", {{"transmissionFactor", 0.3}}}}}});
  ASSERT_EQ(MaterialOf(partly).kind, Material::Kind::kMix);
  EXPECT_FLOAT_EQ(MaterialOf(partly).amount, 0.3F);
  EXPECT_EQ(PartOf(partly, MaterialOf(partly), 1).kind, Material::Kind::kThinDielectric);
}

TEST(GltfReaderTest, AMaterialWithoutShadingIsDiffuse) {
  const Json unlit = {{"KHR_materials_unlit", Json::object()}};
  const Scene scene = WithMaterial(
      {{"pbrMetallicRoughness", {{"baseColorFactor", {0.2, 0.4, 0.6, 1}}}}, {"extensions", unlit}});
  EXPECT_EQ(MaterialOf(scene).kind, Material::Kind::kDiffuse);
  EXPECT_EQ(MaterialOf(scene).reflectance, (Rgb{0.2F, 0.4F, 0.6F}));
}

TEST(GltfReaderTest, AnIndexOfRefractionAbove100IsHeldThere) {
  GltfBuilder builder;
  const Scene scene =
      WithMaterial(builder, {{"pbrMetallicRoughness", {{"metallicFactor", 0}}},
                             {"extensions", {{"KHR_materials_ior", {{"ior", 1000}}}}}});
  EXPECT_EQ(MaterialOf(scene).ior, 100);
  EXPECT_THAT(Said(builder.Read()), HasSubstr("ior is 1000, outside 0 to 100, and is held there"));
}

TEST(GltfReaderTest, AnAttenuationDistanceOfZeroOrBeyondAllBoundsAbsorbsNothing) {
  for (const Json& distance : std::vector<Json>{0, nullptr, 3.4e38}) {
    const Scene scene =
        WithMaterial({{"pbrMetallicRoughness", {{"metallicFactor", 0}, {"roughnessFactor", 0}}},
                      {"extensions",
                       {{"KHR_materials_transmission", {{"transmissionFactor", 1}}},
                        {"KHR_materials_volume",
                         {{"thicknessFactor", 1},
                          {"attenuationDistance", distance},
                          {"attenuationColor", {0.5, 0.5, 0.5}}}}}}});
    EXPECT_EQ(MaterialOf(scene).kind, Material::Kind::kDielectric);
    EXPECT_TRUE(scene.media.empty());
  }
}

TEST(GltfReaderTest, AMemberThatIsNullIsNotThere) {
  GltfBuilder builder;
  builder.AddCamera();
  builder.json["skins"] = nullptr;
  builder.AddNode({{"mesh", builder.AddTriangleMesh({{"material", nullptr}, {"indices", nullptr}})},
                   {"matrix", nullptr},
                   {"translation", {0, 0, 1}},
                   {"extensions", nullptr}});
  ExpectNear(SceneOf(builder).meshes.at(0).positions[0], {0, 0, 1});
}

TEST(GltfReaderTest, EmissionIsRadiance) {
  const Scene scene = WithMaterial(
      {{"emissiveFactor", {1, 0.5, 0.25}},
       {"doubleSided", true},
       {"extensions", {{"KHR_materials_emissive_strength", {{"emissiveStrength", 8}}}}}});
  ASSERT_EQ(scene.area_lights.size(), 1U);
  EXPECT_EQ(scene.area_lights[0].radiance, (Rgb{8, 4, 2}));
  EXPECT_TRUE(scene.area_lights[0].two_sided);
  EXPECT_EQ(scene.meshes[0].traits.area_light, 0);
}

TEST(GltfReaderTest, EmissionMayBeAnImage) {
  GltfBuilder builder;
  const int texture =
      builder.AddTexture(Png(2, 1, 3, {0, 0, 0, 255, 0, 0}), {{"wrapS", 33071}, {"wrapT", 33648}});
  const Json shifted = {{"index", texture},
                        {"extensions", {{"KHR_texture_transform", {{"offset", {0.5, 0}}}}}}};
  const Scene scene =
      WithMaterial(builder, {{"emissiveFactor", {1, 1, 0.5}}, {"emissiveTexture", shifted}});
  ASSERT_EQ(scene.area_lights.size(), 1U);
  const AreaLight& light = scene.area_lights[0];
  EXPECT_EQ(light.radiance, (Rgb{1, 1, 0.5F}));
  ASSERT_NE(light.picture, nullptr);
  EXPECT_EQ(light.largest_pixel, 1);
  EXPECT_EQ(light.wrap_u, Texture::Wrap::kClamp);
  EXPECT_EQ(light.wrap_v, Texture::Wrap::kMirror);
  EXPECT_EQ(light.PixelAt({-0.25F, 0.5F}), Rgb());
  EXPECT_EQ(light.PixelAt({0.25F, 0.5F}), (Rgb{1, 0, 0}));
  // A black image is no light.
  GltfBuilder black;
  const int none = black.AddTexture(Png(1, 1, 3, {0, 0, 0}));
  EXPECT_TRUE(
      WithMaterial(black, {{"emissiveFactor", {1, 1, 1}}, {"emissiveTexture", {{"index", none}}}})
          .area_lights.empty());
}

// Alpha is the share of the surface that is there, and that shines.
TEST(GltfReaderTest, WhatEmitsMayBeTransparent) {
  GltfBuilder builder;
  const int texture = builder.AddTexture(Png(2, 1, 4, {255, 255, 255, 0, 255, 255, 255, 255}));
  const Scene masked = WithMaterial(
      builder, {{"emissiveFactor", {1, 1, 1}},
                {"alphaMode", "MASK"},
                {"pbrMetallicRoughness", {{"baseColorTexture", {{"index", texture}}}}}});
  EXPECT_EQ(masked.area_lights.size(), 1U);
  EXPECT_NE(masked.meshes.at(0).traits.alpha_texture, kNoTexture);
  EXPECT_EQ(masked.meshes.at(0).traits.area_light, 0);
  const Scene blended =
      WithMaterial({{"emissiveFactor", {1, 1, 1}},
                    {"alphaMode", "BLEND"},
                    {"pbrMetallicRoughness", {{"baseColorFactor", {1, 1, 1, 0.25}}}}});
  EXPECT_EQ(blended.meshes.at(0).traits.alpha, 0.25F);
  EXPECT_EQ(blended.meshes.at(0).traits.area_light, 0);
}

// ---- Textures

Rgb LookUp(const Scene& scene, std::int32_t texture, Vec2 uv) {
  return TextureColor(scene.textures, texture, {uv, {}, {}});
}
// Of one triangle, at (0, 0), (1, 0) and (0, 1) of the file.
Vec2 SceneUv(float u, float v) {
  return {u, 1 - v};
}

TEST(GltfReaderTest, ImagesAreColouredByTheirFactor) {
  GltfBuilder builder;
  // Red, green above; blue, white below.
  const int texture = builder.AddTexture(
      Png(2, 2, 3, {255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 255, 255}), {{"wrapS", 33071}});
  const Scene scene = WithMaterial(builder, {{"pbrMetallicRoughness",
                                              {{"metallicFactor", 0},
                                               {"baseColorFactor", {0.5, 0.25, 1, 1}},
                                               {"baseColorTexture", {{"index", texture}}}}}});
  const std::int32_t number = MaterialOf(scene).texture;
  ASSERT_NE(number, kNoTexture);
  // The file's v points down.
  EXPECT_EQ(LookUp(scene, number, SceneUv(0.25F, 0.25F)), (Rgb{0.5F, 0, 0}));
  EXPECT_EQ(LookUp(scene, number, SceneUv(0.75F, 0.25F)), (Rgb{0, 0.25F, 0}));
  EXPECT_EQ(LookUp(scene, number, SceneUv(0.25F, 0.75F)), (Rgb{0, 0, 1}));
  EXPECT_THAT(scene.meshes[0].uvs, ElementsAre(Vec2{0, 1}, Vec2{1, 1}, Vec2{0, 0}));
  EXPECT_EQ(scene.textures[static_cast<std::size_t>(number)].wrap_u, Texture::Wrap::kClamp);
  EXPECT_EQ(scene.textures[static_cast<std::size_t>(number)].wrap_v, Texture::Wrap::kRepeat);
}

TEST(GltfReaderTest, RoughnessIsGreenAndMetallicIsBlue) {
  GltfBuilder builder;
  const int texture =
      builder.AddTexture(Png(2, 1, 3, {255, 51, 0, 255, 102, 255}), {{"wrapS", 33071}});
  const Scene scene =
      WithMaterial(builder, {{"pbrMetallicRoughness",
                              {{"metallicFactor", 0.5},
                               {"roughnessFactor", 0.5},
                               {"metallicRoughnessTexture", {{"index", texture}}}}}});
  const Material& mix = MaterialOf(scene);
  ASSERT_EQ(mix.kind, Material::Kind::kMix);
  const auto number = [&](std::int32_t of, float u) {
    return TextureNumber(scene.textures, of, {SceneUv(u, 0.5F), {}, {}});
  };
  ASSERT_NE(mix.amount_texture, kNoTexture);
  EXPECT_FLOAT_EQ(number(mix.amount_texture, 0.25F), 0);
  EXPECT_FLOAT_EQ(number(mix.amount_texture, 0.75F), 0.5F);
  const Material& metal = PartOf(scene, mix, 1);
  EXPECT_FALSE(metal.remaps_roughness);
  // The width is the square of half of 0.2 and of half of 0.4.
  EXPECT_FLOAT_EQ(number(metal.roughness_textures[0], 0.25F), 0.01F);
  EXPECT_FLOAT_EQ(number(metal.roughness_textures[1], 0.75F), 0.04F);
  EXPECT_FLOAT_EQ(metal.alpha_u, 0.04F);
}

TEST(GltfReaderTest, TexturesAreTransformed) {
  GltfBuilder builder;
  const int texture =
      builder.AddTexture(Png(2, 2, 3, {255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 255, 255}));
  const auto with = [&](const Json& transform) {
    return Json({{"index", texture}, {"extensions", {{"KHR_texture_transform", transform}}}});
  };
  const auto texture_of = [&](const Json& transform) {
    GltfBuilder copy = builder;
    const Scene scene = WithMaterial(
        copy,
        {{"pbrMetallicRoughness", {{"metallicFactor", 0}, {"baseColorTexture", with(transform)}}}});
    return scene.textures.at(static_cast<std::size_t>(MaterialOf(scene).texture));
  };
  const auto mapped = [](const Texture& of, float u, float v) {
    const Vec2 uv = of.mapping.Map({SceneUv(u, v), {}, {}});
    return Vec2{uv.x, 1 - uv.y};  // as the file counts
  };
  const auto expect = [](Vec2 a, Vec2 b) {
    EXPECT_NEAR(a.x, b.x, 1e-6);
    EXPECT_NEAR(a.y, b.y, 1e-6);
  };
  // The first example of the extension: the lower left quadrant, turned clockwise.
  const Texture turned =
      texture_of({{"offset", {0, 1}}, {"rotation", kPi64 / 2}, {"scale", {0.5, 0.5}}});
  expect(mapped(turned, 0, 0), {0, 1});
  expect(mapped(turned, 1, 0), {0, 0.5F});
  expect(mapped(turned, 0, 1), {0.5F, 1});
  expect(mapped(turned, 1, 1), {0.5F, 0.5F});
  // The second: v upside down.
  const Texture over = texture_of({{"offset", {0, 1}}, {"scale", {1, -1}}});
  expect(mapped(over, 0.25F, 0.1F), {0.25F, 0.9F});
}

TEST(GltfReaderTest, TransparentPixelsAreNotThere) {
  GltfBuilder builder;
  const int texture = builder.AddTexture(Png(2, 1, 4, {255, 255, 255, 102, 255, 255, 255, 204}),
                                         {{"wrapS", 33071}});
  const Json pbr = {{"metallicFactor", 0},
                    {"baseColorFactor", {1, 1, 1, 0.5}},
                    {"baseColorTexture", {{"index", texture}}}};
  const auto alpha_of = [&](const Json& material, float u) {
    GltfBuilder copy = builder;
    const Scene scene = WithMaterial(copy, material);
    const ShapeTraits& traits = scene.meshes.at(0).traits;
    EXPECT_NE(traits.alpha_texture, kNoTexture);
    return TextureNumber(scene.textures, traits.alpha_texture, {SceneUv(u, 0.5F), {}, {}});
  };
  const Json blended = {{"pbrMetallicRoughness", pbr}, {"alphaMode", "BLEND"}};
  EXPECT_FLOAT_EQ(alpha_of(blended, 0.25F), 0.2F);
  EXPECT_FLOAT_EQ(alpha_of(blended, 0.75F), 0.4F);
  const Json masked = {{"pbrMetallicRoughness", pbr}, {"alphaMode", "MASK"}, {"alphaCutoff", 0.3}};
  EXPECT_FLOAT_EQ(alpha_of(masked, 0.25F), 0);
  EXPECT_FLOAT_EQ(alpha_of(masked, 0.75F), 1);
  // Without an image the factor decides; without an alphaMode it does not.
  EXPECT_FLOAT_EQ(WithMaterial({{"pbrMetallicRoughness", {{"baseColorFactor", {1, 1, 1, 0.5}}}},
                                {"alphaMode", "BLEND"}})
                      .meshes.at(0)
                      .traits.alpha,
                  0.5F);
  EXPECT_FLOAT_EQ(WithMaterial({{"pbrMetallicRoughness", {{"baseColorFactor", {1, 1, 1, 0.5}}}}})
                      .meshes.at(0)
                      .traits.alpha,
                  1);
}

TEST(GltfReaderTest, NormalMapsAreNoColours) {
  GltfBuilder builder;
  const int texture = builder.AddTexture(Png(1, 1, 3, {51, 128, 255}));
  const Scene scene =
      WithMaterial(builder, {{"normalTexture", {{"index", texture}, {"scale", 0.5}}}});
  const Rgb color = LookUp(scene, MaterialOf(scene).normal_map, {0.5F, 0.5F});
  EXPECT_FLOAT_EQ(color.r, 0.2F);
  EXPECT_FLOAT_EQ(color.b, 1);
  EXPECT_FLOAT_EQ(MaterialOf(scene).normal_scale, 0.5F);
  EXPECT_TRUE(MaterialOf(scene).normal_map_follows_v);
}

TEST(GltfReaderTest, ImagesMayShowTheirNearestPixel) {
  GltfBuilder builder;
  const int texture =
      builder.AddTexture(Png(2, 1, 3, {255, 0, 0, 0, 255, 0}), {{"magFilter", 9728}});
  const Scene scene = WithMaterial(
      builder, {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", texture}}}}}});
  EXPECT_EQ(LookUp(scene, MaterialOf(scene).texture, {0.45F, 0.5F}), (Rgb{1, 0, 0}));
}

TEST(GltfReaderTest, ColoursOfVerticesMultiplyTheBaseColour) {
  GltfBuilder builder;
  builder.AddCamera();
  const int colors = builder.AddAccessor<float>({1, 0, 0, 0, 1, 0, 0, 0, 2}, "VEC3");
  const int material = builder.Add(
      "materials",
      {{"pbrMetallicRoughness", {{"metallicFactor", 0}, {"baseColorFactor", {0.5, 1, 1, 1}}}}});
  builder.AddNode({{"mesh", builder.AddTriangleMesh(
                                {{"attributes", {{"COLOR_0", colors}}}, {"material", material}})}});
  const Scene scene = SceneOf(builder);
  ASSERT_EQ(scene.meshes.size(), 1U);
  EXPECT_THAT(scene.meshes[0].colors, ElementsAre(Rgb{1, 0, 0}, Rgb{0, 1, 0}, Rgb{0, 0, 1}));
  const Material& of_mesh =
      scene.materials[static_cast<std::size_t>(scene.meshes[0].traits.material)];
  EXPECT_EQ(TextureColor(scene.textures, of_mesh.texture, {{}, {}, {}, {1, 0.5F, 0}}),
            (Rgb{0.5F, 0.5F, 0}));
}

TEST(GltfReaderTest, TheSpecularExtensionScalesWhatTheCoatReflects) {
  const auto coated = [](const Json& specular) {
    return MaterialOf(WithMaterial({{"pbrMetallicRoughness", {{"metallicFactor", 0}}},
                                    {"extensions", {{"KHR_materials_specular", specular}}}}));
  };
  // Of an index of 1.5 a coat reflects 0.04, a quarter of which is 0.01: (1 + 0.1) / (1 - 0.1).
  EXPECT_NEAR(coated({{"specularFactor", 0.25}}).ior, 1.1 / 0.9, 1e-6);
  EXPECT_NEAR(coated({{"specularColorFactor", {0.1, 2.25, 1}}}).ior, 1.3 / 0.7, 1e-6);
  EXPECT_EQ(coated({{"specularFactor", 0}}).kind, Material::Kind::kDiffuse);
}

TEST(GltfReaderTest, AClearcoatLiesOverMetalAndOverWhatIsNone) {
  const auto read = [](double metallic, const Json& clearcoat) {
    return WithMaterial({{"pbrMetallicRoughness",
                          {{"baseColorFactor", {0.5, 0.5, 0.5, 1}},
                           {"metallicFactor", metallic},
                           {"roughnessFactor", 0.6}}},
                         {"extensions", {{"KHR_materials_clearcoat", clearcoat}}}});
  };
  const Json whole = {{"clearcoatFactor", 1}, {"clearcoatRoughnessFactor", 0.2}};
  const Material paint = MaterialOf(read(1, whole));
  EXPECT_EQ(paint.kind, Material::Kind::kCoatedConductor);
  EXPECT_TRUE(paint.is_metal_in_coat);
  EXPECT_FLOAT_EQ(paint.ior, 1.5F);
  EXPECT_FLOAT_EQ(paint.base_alpha_u, 0.36F);
  EXPECT_FLOAT_EQ(paint.alpha_u, 0.04F);
  EXPECT_FLOAT_EQ(paint.k.g, 2);  // of a reflectance of one half
  EXPECT_GE(paint.base_hits, 100) << "no light is lost between coat and metal";
  const Material lacquer = MaterialOf(read(0, whole));
  EXPECT_EQ(lacquer.kind, Material::Kind::kCoatedDiffuse);
  EXPECT_TRUE(lacquer.coat_passes_rest);
  EXPECT_FLOAT_EQ(lacquer.alpha_u, 0.04F);
  // Without a roughness it is smooth, and without a factor it is not there.
  EXPECT_EQ(MaterialOf(read(1, {{"clearcoatFactor", 1}})).alpha_u, 0);
  EXPECT_EQ(MaterialOf(read(1, {{"clearcoatRoughnessFactor", 1}})).kind,
            Material::Kind::kConductor);

  const Scene thin = read(1, {{"clearcoatFactor", 0.25}});
  const Material& mix = MaterialOf(thin);
  ASSERT_EQ(mix.kind, Material::Kind::kMix);
  EXPECT_FLOAT_EQ(mix.amount, 0.25F);
  EXPECT_EQ(PartOf(thin, mix, 0).kind, Material::Kind::kConductor);
  EXPECT_EQ(PartOf(thin, mix, 1).kind, Material::Kind::kCoatedConductor);
}

TEST(GltfReaderTest, WhatAClearcoatCannotBeIsSaid) {
  const auto said = [](Json material) {
    GltfBuilder builder;
    builder.AddCamera();
    const int texture = builder.AddTexture(Png(2, 1, 3, {0, 255, 255, 0, 9, 255}), {});
    material["extensions"]["KHR_materials_clearcoat"]["clearcoatFactor"] = 1;
    const Json rough = {{"index", texture}};
    material["extensions"]["KHR_materials_clearcoat"]["clearcoatRoughnessTexture"] = rough;
    material["extensions"]["KHR_materials_clearcoat"]["clearcoatRoughnessFactor"] = 1;
    material["pbrMetallicRoughness"]["metallicRoughnessTexture"] = rough;
    builder.AddNode(
        {{"mesh", builder.AddTriangleMesh({{"material", builder.Add("materials", material)}})}});
    return Said(builder.Read());
  };
  EXPECT_THAT(said({{"pbrMetallicRoughness", {{"metallicFactor", 0}}}}),
              Not(HasSubstr("clearcoat")));
  EXPECT_THAT(said({{"pbrMetallicRoughness",
                     {{"baseColorFactor", {0.5, 0.5, 0.5, 1}}, {"metallicFactor", 1}}}}),
              HasSubstr("has its largest roughness everywhere"));
  EXPECT_THAT(said({{"pbrMetallicRoughness", {{"metallicFactor", 0}}},
                    {"extensions", {{"KHR_materials_transmission", {{"transmissionFactor", 1}}}}}}),
              HasSubstr("glass has no coat"));
}

// ---- Extensions

TEST(GltfReaderTest, AnUnknownExtensionIsAnErrorWhereItIsRequiredElseANote) {
  GltfBuilder builder;
  builder.AddCamera();
  builder.AddNode({{"mesh", builder.AddTriangleMesh()}});
  builder.json["extensionsUsed"] = {"KHR_materials_sheen", "KHR_materials_ior"};
  const ParsedScene used = builder.Read();
  EXPECT_TRUE(used.ok());
  EXPECT_THAT(Said(used), HasSubstr("note: the extension \"KHR_materials_sheen\" is ignored"));
  EXPECT_THAT(Said(used), ::testing::Not(HasSubstr("KHR_materials_ior")));
  builder.json["extensionsRequired"] = {"KHR_draco_mesh_compression"};
  EXPECT_THAT(Said(builder.Read()),
              HasSubstr("s.gltf: error: the file requires the extension "
                        "\"KHR_draco_mesh_compression\", which is not supported"));
}

TEST(GltfReaderTest, ARequiredExtensionThatOnlyChangesLooksIsAWarning) {
  GltfBuilder builder;
  builder.AddCamera();
  builder.AddNode({{"mesh", builder.AddTriangleMesh()}});
  for (const char* name :
       {"EXT_lights_image_based", "KHR_animation_pointer", "KHR_materials_anisotropy",
        "KHR_materials_diffuse_transmission", "KHR_materials_dispersion",
        "KHR_materials_iridescence", "KHR_materials_sheen", "KHR_materials_unlit",
        "KHR_materials_variants", "KHR_xmp", "KHR_xmp_json_ld", "MSFT_lod", "VRM", "VRMC_vrm"}) {
    builder.json["extensionsUsed"] = {name};
    builder.json["extensionsRequired"] = {name};
    const ParsedScene parsed = builder.Read();
    EXPECT_TRUE(parsed.ok()) << parsed.ToStatus();
    EXPECT_THAT(Said(parsed), HasSubstr("warning: the required extension \"" + std::string(name) +
                                        "\" is ignored: "));
    EXPECT_THAT(Said(parsed), Not(HasSubstr("note: the extension")));
  }
}

TEST(GltfReaderTest, ARequiredCompressionIsAnErrorThatSaysHowToExport) {
  const std::map<std::string, std::string> advice = {
      {"EXT_meshopt_compression", "export the file without compression of meshes"},
      {"KHR_draco_mesh_compression", "export the file without Draco compression"},
      {"KHR_texture_basisu", "export the file with images that are PNG or JPEG"},
      {"EXT_texture_webp", "export the file with images that are PNG or JPEG"},
      {"EXT_texture_avif", "export the file with images that are PNG or JPEG"},
      {"EXAMPLE_unknown", "there are EXT_mesh_gpu_instancing"}};
  for (const auto& [name, says] : advice) {
    GltfBuilder builder;
    builder.AddNode({{"mesh", builder.AddTriangleMesh()}});
    builder.json["extensionsRequired"] = {name};
    EXPECT_THAT(Said(builder.Read()), HasSubstr("which is not supported; " + says));
  }
}

// ---- The same scene in two formats

// A room with a light, a metal block and a block of glass, as boxes of quads.
TEST(GltfReaderTest, TheSameSceneInPbrtHasTheSameImage) {
  struct Quad {
    std::vector<float> p;  // [4 × 3], counter-clockwise from the front
    std::string pbrt_material;
    Json material;
    bool emits = false;
  };
  const auto pbr = [](std::vector<double> color, double metallic, double roughness) {
    return Json({{"baseColorFactor", {color[0], color[1], color[2], 1.0}},
                 {"metallicFactor", metallic},
                 {"roughnessFactor", roughness}});
  };
  const Json no_coat = {{"KHR_materials_ior", {{"ior", 1.0}}}};
  const std::vector<Quad> quads = {
      {{-2, 0, 2, 2, 0, 2, 2, 0, -2, -2, 0, -2},
       "Material \"diffuse\" \"rgb reflectance\" [0.5 0.25 0.125]",
       {{"pbrMetallicRoughness", pbr({0.5, 0.25, 0.125}, 0, 1)}, {"extensions", no_coat}}},
      {{-2, 0, -2, 2, 0, -2, 2, 3, -2, -2, 3, -2},
       "Material \"conductor\" \"rgb reflectance\" [0.75 0.5 0.25] \"float roughness\" 0.25 "
       "\"bool remaproughness\" false",
       {{"pbrMetallicRoughness", pbr({0.75, 0.5, 0.25}, 1, 0.5)}}},
      {{-2, 0, 0, -1, 0, 0, -1, 2, 0, -2, 2, 0},
       "Material \"thindielectric\" \"float eta\" 1.5",
       {{"pbrMetallicRoughness", pbr({1, 1, 1}, 0, 0)},
        {"extensions", {{"KHR_materials_transmission", {{"transmissionFactor", 1}}}}}}},
      {{0, 2.5F, -1, 1, 2.5F, -1, 1, 2.5F, 0, 0, 2.5F, 0},
       "Material \"diffuse\" \"rgb reflectance\" [0.5 0.5 0.5] AreaLightSource \"diffuse\" \"rgb "
       "L\" [8 8 4]",
       {{"pbrMetallicRoughness", pbr({0.5, 0.5, 0.5}, 0, 1)},
        {"emissiveFactor", {1, 1, 0.5}},
        {"extensions",
         {{"KHR_materials_ior", {{"ior", 1.0}}},
          {"KHR_materials_emissive_strength", {{"emissiveStrength", 8}}}}}},
       true},
  };
  GltfBuilder builder;
  builder.AddCamera({{"translation", {0.5, 1, 4}}});
  builder.json["cameras"][0]["perspective"]["yfov"] = 60 * kPi64 / 180;
  // What a left-handed camera has to the right is to the left in glTF: the image is mirrored.
  std::string pbrt =
      "Film \"rgb\" \"integer xresolution\" 1280 \"integer yresolution\" 720\n"
      "Scale -1 1 1 LookAt 0.5 1 4  0.5 1 0  0 1 0 Camera \"perspective\" \"float fov\" 60\n"
      "WorldBegin\n";
  for (const Quad& quad : quads) {
    pbrt += "AttributeBegin " + quad.pbrt_material +
            " Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point3 P\" [";
    for (const float number : quad.p)
      pbrt += " " + std::to_string(number);
    pbrt += "] AttributeEnd\n";
    const int positions = builder.AddAccessor(quad.p, "VEC3");
    const int indices = builder.AddAccessor<std::uint8_t>({0, 1, 2, 0, 2, 3}, "SCALAR");
    const int material = builder.Add("materials", quad.material);
    builder.AddNode({{"mesh", builder.Add("meshes", {{"primitives",
                                                      {{{"attributes", {{"POSITION", positions}}},
                                                        {"indices", indices},
                                                        {"material", material}}}}})}});
  }
  MemoryFiles files({{"s.pbrt", pbrt}});
  const ParsedScene of_pbrt = ReadScene(files, "s.pbrt");
  ASSERT_TRUE(of_pbrt.ok()) << of_pbrt.ToStatus();
  const Scene of_gltf = SceneOf(builder);
  RenderOverrides overrides;
  overrides.width = 48;
  overrides.height = 27;
  const Image a = RenderLocally(of_pbrt.scene, SettingsFor(of_pbrt.scene, overrides), 3, 1);
  const Image b = RenderLocally(of_gltf, SettingsFor(of_gltf, overrides), 3, 1);
  const ImageChannel* green = a.Find("G");
  ASSERT_NE(green, nullptr);
  double sum = 0;
  for (const float value : green->pixels)
    sum += static_cast<double>(value);
  EXPECT_GT(sum, 1);
  for (const char* channel : {"R", "G", "B"})
    EXPECT_EQ(a.Find(channel)->pixels, b.Find(channel)->pixels) << channel;
}

// ---- Hostile files

struct Broken {
  std::string says;
  // Changes a good document with a camera, a material with a texture, and a mesh with indices and
  // normals.
  void (*breaks)(Json& json);
};

GltfBuilder GoodDocument() {
  GltfBuilder builder;
  builder.AddCamera();
  const int texture = builder.AddTexture(Png(1, 1, 3, {9, 9, 9}));
  const int indices = builder.AddAccessor<std::uint16_t>({0, 1, 2}, "SCALAR");
  const int normals = builder.AddAccessor<float>({0, 0, 1, 0, 0, 1, 0, 0, 1}, "VEC3");
  const int uvs = builder.AddAccessor<float>({0, 0, 1, 0, 0, 1}, "VEC2");
  const int material = builder.Add(
      "materials", {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", texture}}}}}});
  const int mesh =
      builder.AddTriangleMesh({{"indices", indices},
                               {"material", material},
                               {"attributes", {{"NORMAL", normals}, {"TEXCOORD_0", uvs}}}});
  builder.AddNode({{"mesh", mesh}});
  builder.json["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "spot"}}};
  builder.AddNode({{"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
  builder.json["buffers"] = {{{"byteLength", builder.buffer().size()}, {"uri", "b.bin"}}};
  return builder;
}

TEST(GltfReaderTest, WhatIsWrongIsSaidInOneSentence) {
  ASSERT_TRUE(GoodDocument().Read().ok()) << GoodDocument().Read().ToStatus();
  const std::vector<Broken> all = {
      {"it has no \"asset\"", [](Json& j) { j.erase("asset"); }},
      {"the version is \"1.0\"", [](Json& j) { j["asset"]["version"] = "1.0"; }},
      {"asset: version must be a string", [](Json& j) { j["asset"]["version"] = 2.0; }},
      {"asset must be an object", [](Json& j) { j["asset"] = "2.0"; }},
      {"the version is \"2.1\"", [](Json& j) { j["asset"]["minVersion"] = "2.1"; }},
      {"nodes must be an array of objects", [](Json& j) { j["nodes"] = 3; }},
      {"meshes must be an array of objects", [](Json& j) { j["meshes"][0] = "x"; }},
      {"scene refers to scenes[7], and there are 1", [](Json& j) { j["scene"] = 7; }},
      {"scene must be a whole number", [](Json& j) { j["scene"] = -1; }},
      {"nodes refers to none of the 3 nodes", [](Json& j) { j["scenes"][0]["nodes"][0] = 9; }},
      {"nodes[1]: is reached twice", [](Json& j) { j["nodes"][1]["children"] = {1}; }},
      {"nodes[1]: is reached twice", [](Json& j) { j["nodes"][0]["children"] = {1}; }},
      {"nodes[1]: mesh refers to meshes[1], and there are 1",
       [](Json& j) { j["nodes"][1]["mesh"] = 1; }},
      {"nodes[1]: matrix must be an array of 16 numbers",
       [](Json& j) {
         j["nodes"][1]["matrix"] = {1, 2};
       }},
      {"nodes[1]: matrix must be affine",
       [](Json& j) { j["nodes"][1]["matrix"] = std::vector<int>(16, 1); }},
      {"nodes[1]: rotation is a quaternion of length 0",
       [](Json& j) {
         j["nodes"][1]["rotation"] = {0, 0, 0, 0};
       }},
      {"nodes[1]: scale[0] is 1e+300",
       [](Json& j) {
         j["nodes"][1]["scale"] = {1e300, 1, 1};
       }},
      {"a node moves or scales it out of single precision",
       [](Json& j) {
         j["nodes"][1]["scale"] = {1e30, 1, 1};
         j["nodes"].push_back({{"children", {1}}, {"scale", {1e30, 1, 1}}});
         j["scenes"][0]["nodes"] = {0, 3};
       }},
      {"meshes[0].primitives[0]: mode must be from 0 to 6",
       [](Json& j) { j["meshes"][0]["primitives"][0]["mode"] = 7; }},
      {"attributes: POSITION refers to accessors[40]",
       [](Json& j) { j["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = 40; }},
      {"NORMAL must have as many elements as POSITION (3), not 2",
       [](Json& j) { j["accessors"][1]["count"] = 2; }},
      {"its indices refer to vertex 1 of 1",
       [](Json& j) {
         for (int i = 1; i < 4; ++i)
           j["accessors"][i]["count"] = 1;
       }},
      {"accessors[0]: must be of type SCALAR here",
       [](Json& j) { j["accessors"][0]["type"] = "VEC2"; }},
      {"indices must be unsigned integers",
       [](Json& j) { j["accessors"][0]["componentType"] = 5126; }},
      {"accessors[3]: componentType must be one of",
       [](Json& j) { j["accessors"][3]["componentType"] = 5124; }},
      {"accessors[3]: count must be at least 1", [](Json& j) { j["accessors"][3]["count"] = 0; }},
      {"accessors[3]: its 4 elements lie beyond the 36 bytes of bufferViews[4]",
       [](Json& j) { j["accessors"][3]["count"] = 4; }},
      {"accessors[3]: its 9007199254740992 elements lie beyond",
       [](Json& j) { j["accessors"][3]["count"] = 0x1p53; }},
      {"accessors[3]: its 3 elements lie beyond the 36 bytes",
       [](Json& j) { j["accessors"][3]["byteOffset"] = 1; }},
      {"accessors[3]: bufferView refers to bufferViews[99]",
       [](Json& j) { j["accessors"][3]["bufferView"] = 99; }},
      {"accessors[3]: has no bufferView, so it is zeros, of which it may have 67108864 bytes",
       [](Json& j) {
         j["accessors"][3].erase("bufferView");
         j["accessors"][3]["count"] = 4'000'000'000U;
       }},
      {"bufferViews[4]: byteStride is 8; it must be from the 12 bytes of an element to 252",
       [](Json& j) { j["bufferViews"][4]["byteStride"] = 8; }},
      {"bufferViews[4]: bytes 9007199254740992 to",
       [](Json& j) { j["bufferViews"][4]["byteOffset"] = 0x1p53; }},
      {"bufferViews[4]: buffer refers to buffers[1], and there are 1",
       [](Json& j) { j["bufferViews"][4]["buffer"] = 1; }},
      {"buffers[0]: has ", [](Json& j) { j["buffers"][0]["byteLength"] = 1'000'000; }},
      {"buffers[0]: cannot be read: ", [](Json& j) { j["buffers"][0]["uri"] = "../secret"; }},
      {"buffers[0]: cannot be read: ", [](Json& j) { j["buffers"][0]["uri"] = "%2e%2e/secret"; }},
      {"buffers[0]: cannot be read: ", [](Json& j) { j["buffers"][0]["uri"] = "/etc/passwd"; }},
      {"nothing is fetched", [](Json& j) { j["buffers"][0]["uri"] = "http://example.com/b.bin"; }},
      {"nothing is fetched", [](Json& j) { j["buffers"][0]["uri"] = "file:///etc/passwd"; }},
      {"it is no base64", [](Json& j) { j["buffers"][0]["uri"] = "data:;base64,a!b"; }},
      {"it is no base64", [](Json& j) { j["buffers"][0]["uri"] = "data:;base64,AAA==="; }},
      {"is not in base64", [](Json& j) { j["buffers"][0]["uri"] = "data:,abc"; }},
      {"has neither a uri nor the binary chunk", [](Json& j) { j["buffers"][0].erase("uri"); }},
      {"sparse: count must be from 1 to the accessor's 3",
       [](Json& j) {
         j["accessors"][3]["sparse"] = {{"count", 4}};
       }},
      {"sparse.indices: must rise from each to the next",
       [](Json& j) {
         // The vertex indices 0, 1, 2, read as those of sparse values from the second on.
         j["accessors"][3]["sparse"] = {{"count", 2},
                                        {"indices", {{"bufferView", 2}, {"componentType", 5121}}},
                                        {"values", {{"bufferView", 4}}}};
       }},
      {"materials[0].pbrMetallicRoughness.baseColorTexture: index refers to textures[5]",
       [](Json& j) { j["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["index"] = 5; }},
      {"textures[0]: source refers to images[4]", [](Json& j) { j["textures"][0]["source"] = 4; }},
      {"images[0]: cannot be read: it begins neither like a PNG nor like a JPEG",
       [](Json& j) { j["images"][0]["bufferView"] = 1; }},
      {"images[0]: has neither a uri nor a bufferView",
       [](Json& j) { j["images"][0].erase("bufferView"); }},
      {"wrapS must be 10497, 33071 or 33648",
       [](Json& j) {
         j["samplers"] = {{{"wrapS", 1}}};
         j["textures"][0]["sampler"] = 0;
       }},
      {"alphaMode is \"CLIP\"", [](Json& j) { j["materials"][0]["alphaMode"] = "CLIP"; }},
      {"emissiveStrength is -1",
       [](Json& j) {
         j["materials"][0]["emissiveFactor"] = {1, 1, 1};
         j["materials"][0]["extensions"]["KHR_materials_emissive_strength"] = {
             {"emissiveStrength", -1}};
       }},
      {"cameras[0]: type is \"fisheye\"", [](Json& j) { j["cameras"][0]["type"] = "fisheye"; }},
      {"cameras[0]: is flattened",
       [](Json& j) {
         j["nodes"][0]["scale"] = {1, 1, 0};
       }},
      {"a node refers to light 3, and there are 1",
       [](Json& j) { j["nodes"][2]["extensions"]["KHR_lights_punctual"]["light"] = 3; }},
      {"type is \"area\", not point, spot or directional",
       [](Json& j) { j["extensions"]["KHR_lights_punctual"]["lights"][0]["type"] = "area"; }},
      {"nodes[1]: skin refers to skins[0], and there are 0",
       [](Json& j) { j["nodes"][1]["skin"] = 0; }},
      {"skins must be an array of objects", [](Json& j) { j["skins"] = {1}; }},
      {"skins[0]: needs joints",
       [](Json& j) {
         j["nodes"][1]["skin"] = 0;
         j["skins"] = {Json::object()};
       }},
      {"skins[0]: needs joints",
       [](Json& j) {
         j["nodes"][1]["skin"] = 0;
         j["skins"] = {{{"joints", Json::array()}}};
       }},
      {"skins[0]: joints refers to none of the 3 nodes",
       [](Json& j) {
         j["nodes"][1]["skin"] = 0;
         j["skins"] = {{{"joints", {0, 3}}}};
       }},
      {"skins[0]: joints[1] is nodes[3], which is not in the scene",
       [](Json& j) {
         j["nodes"][1]["skin"] = 0;
         j["nodes"].push_back(Json::object());
         j["skins"] = {{{"joints", {0, 3}}}};
       }},
      {"skins[0]: has 2 joints and 1 inverseBindMatrices",
       [](Json& j) {
         j["nodes"][1]["skin"] = 0;
         j["skins"] = {{{"joints", {0, 1}}, {"inverseBindMatrices", 4}}};
         j["accessors"].push_back({{"componentType", 5126}, {"count", 1}, {"type", "MAT4"}});
       }},
      {"skins[0]: inverseBindMatrices[0] must be affine",
       [](Json& j) {
         j["nodes"][1]["skin"] = 0;
         j["skins"] = {{{"joints", {0}}, {"inverseBindMatrices", 4}}};
         j["accessors"].push_back({{"componentType", 5126}, {"count", 1}, {"type", "MAT4"}});
       }},
      {"nodes[1]: weights must be an array of numbers",
       [](Json& j) { j["nodes"][1]["weights"] = 1; }},
      {"meshes[0].primitives[0].targets[0]: POSITION must have as many elements as POSITION (3), "
       "not 1",
       [](Json& j) {
         j["nodes"][1]["weights"] = {0.5};
         j["meshes"][0]["primitives"][0]["targets"] = {{{"POSITION", 4}}};
         j["accessors"].push_back({{"componentType", 5126}, {"count", 1}, {"type", "VEC3"}});
       }},
  };
  for (const Broken& broken : all) {
    SCOPED_TRACE(broken.says);
    GltfBuilder builder = GoodDocument();
    broken.breaks(builder.json);
    const ParsedScene parsed = builder.Read();
    EXPECT_FALSE(parsed.ok());
    int errors = 0;
    for (const Diagnostic& diagnostic : parsed.diagnostics)
      errors += diagnostic.severity == Diagnostic::Severity::kError ? 1 : 0;
    EXPECT_EQ(errors, 1) << Said(parsed);
    EXPECT_THAT(Said(parsed), HasSubstr(broken.says));
  }
}

TEST(GltfReaderTest, AnErrorIsSaidOnceHoweverOftenItsMemberIsRead) {
  GltfBuilder builder = GoodDocument();
  // Read for roughness and for metallic; the name by each part of the mix.
  builder.json["materials"][0]["name"] = 3;
  builder.json["materials"][0]["pbrMetallicRoughness"]["metallicFactor"] = 0.5;
  builder.json["materials"][0]["pbrMetallicRoughness"]["metallicRoughnessTexture"]["index"] = 9;
  const ParsedScene parsed = builder.Read();
  std::vector<std::string> errors;
  for (const Diagnostic& diagnostic : parsed.diagnostics) {
    if (diagnostic.severity == Diagnostic::Severity::kError) errors.push_back(diagnostic.message);
  }
  EXPECT_THAT(
      errors,
      ElementsAre("materials[0].pbrMetallicRoughness.metallicRoughnessTexture: index refers "
                  "to textures[9], and there are 1",
                  "materials[0]: name must be a string"));
}

std::string SaidOfBytes(const std::string& name, const std::string& bytes) {
  std::map<std::string, std::string> named;
  named[name] = bytes;
  MemoryFiles files(std::move(named));
  const ParsedScene parsed = ReadScene(files, name);
  EXPECT_FALSE(parsed.ok());
  return Said(parsed);
}

TEST(GltfReaderTest, DamagedContainersAndJsonAreRefused) {
  EXPECT_THAT(SaidOfBytes("s.gltf", "{\n  \"asset\": }"),
              HasSubstr("s.gltf:2:12: error: the JSON is damaged here"));
  EXPECT_THAT(SaidOfBytes("s.gltf", "[]"), HasSubstr("the JSON is no object"));
  EXPECT_THAT(SaidOfBytes("s.gltf", "{\"asset\":{\"version\":1e999}}"),
              HasSubstr("a number that is too large"));
  EXPECT_THAT(SaidOfBytes("s.gltf", ""), HasSubstr("s.gltf: error: the file is empty"));
  EXPECT_THAT(SaidOfBytes("s.glb", ""), HasSubstr("s.glb: error: the file is empty"));
  // Neither a deep nor a long document takes more than its bytes are worth.
  const std::string deep(1'000'000, '[');
  EXPECT_THAT(SaidOfBytes("s.gltf", "{\"extras\":" + deep), HasSubstr("the JSON is damaged here"));
  EXPECT_THAT(SaidOfBytes("s.gltf", "{\"extras\":" + deep + std::string(deep.size(), ']') + "}"),
              HasSubstr("the JSON is nested more than 64 deep"));
  std::string many = "{\"extras\":[0";
  for (int i = 0; i < 16'800'000; ++i)
    many += ",0";
  EXPECT_THAT(SaidOfBytes("s.gltf", many + "]}"), HasSubstr("more than 8388608 values"));

  const std::string glb = GoodDocument().Glb();
  for (std::size_t size = 4; size < glb.size(); size += size < 64 ? 1 : 97)
    SaidOfBytes("s.glb", glb.substr(0, size));
  std::string later = glb;
  later[4] = 3;
  EXPECT_THAT(SaidOfBytes("s.glb", later), HasSubstr("its version is 3, not 2"));
  std::string cut = glb;
  cut[12] = '\x7F';
  cut[14] = '\x7F';
  EXPECT_THAT(SaidOfBytes("s.glb", cut), HasSubstr("one of its chunks is cut off"));
}

TEST(GltfReaderTest, ALongChainOfNodesIsWalked) {
  GltfBuilder builder;
  builder.AddCamera();
  const int mesh = builder.AddTriangleMesh();
  constexpr int kNodes = 50'000;
  const int first = static_cast<int>(builder.json["nodes"].size());
  for (int i = 0; i < kNodes; ++i) {
    Json node = {{"translation", {1, 0, 0}}};
    if (i + 1 < kNodes) node["children"] = {first + i + 1};
    if (i + 1 == kNodes) node["mesh"] = mesh;
    builder.json["nodes"].push_back(node);
  }
  builder.json["scenes"][0]["nodes"].push_back(first);
  ExpectNear(SceneOf(builder).meshes.at(0).positions[0], {kNodes, 0, 0});
}

}  // namespace
}  // namespace lucerna
