// A mesh of surfaces stays whole however it is refined: no cracks, no area lost, no thin faces, and
// sensors on the faces that they measure.
#include "render/bake/surface_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include <nlohmann/json.hpp>

#include "client/bake/baked_light.h"
#include "client/bake/irradiance_plan.h"
#include "render/bake/chart_atlas.h"
#include "render/bake/mesh_file.h"
#include "render/bake/surface_figures.h"
#include "render/formats/ply_file.h"
#include "render/math/double3.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

using testing::HasSubstr;

Scene Box() {
  Scene scene;
  AddMaterial(scene, DiffuseMaterial(0.5F));
  AddBox(scene, {0, 0, 0}, {1, 2, 3}, 0);
  return scene;
}

SurfaceMesh MeshOf(const Scene& scene, MeasuredSides sides = MeasuredSides::kFront,
                   double spacing = 0.1) {
  StatusOr<SurfaceMesh> mesh =
      SurfaceMesh::FromScene(scene, {.sides = sides, .names = {}, .spacing = spacing});
  EXPECT_TRUE(mesh.ok()) << mesh.status();
  return *std::move(mesh);
}

using Field = std::function<double(const Sensor&)>;

std::vector<Irradiance> Measure(const std::vector<Sensor>& sensors, const Field& field) {
  std::vector<Irradiance> measured;
  for (const Sensor& sensor : sensors)
    measured.push_back({Gray(static_cast<float>(field(sensor))), 0, 0});
  return measured;
}

// As `lucerna bake` refines. Returns how many sensors were used.
std::size_t Bake(SurfaceMesh& mesh, const Field& field, double tolerance) {
  std::size_t count = 0;
  do {
    const std::vector<Sensor> sensors = mesh.NextSensors(true);
    count += sensors.size();
    mesh.SetMeasured(Measure(sensors, field));
  } while (mesh.Refine(tolerance).value() > 0);
  const std::vector<Sensor> rest = mesh.NextSensors(false);
  mesh.SetMeasured(Measure(rest, field));
  return count + rest.size();
}

double AreaOf(const SurfaceMesh& mesh) {
  double area = 0;
  for (const MeshFace& face : mesh.faces())
    area += mesh.AreaOf(face);
  return area;
}

// How often each edge is used, by places: in each direction once where there is no crack.
std::map<std::pair<std::uint32_t, std::uint32_t>, int> EdgesOf(const SurfaceMesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const MeshFace& face : mesh.faces()) {
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t a = mesh.vertices()[face.vertices[i]].place;
      const std::uint32_t b = mesh.vertices()[face.vertices[(i + 1) % 3]].place;
      EXPECT_NE(a, b);
      ++edges[{a, b}];
    }
  }
  return edges;
}

void ExpectNoCracks(const SurfaceMesh& closed) {
  const auto edges = EdgesOf(closed);
  for (const auto& [edge, count] : edges) {
    EXPECT_EQ(count, 1);
    EXPECT_EQ(edges.count({edge.second, edge.first}), 1U) << "an edge with one face";
  }
}

double SmallestAngleOf(const SurfaceMesh& mesh) {
  double smallest = std::numbers::pi;
  for (const MeshFace& face : mesh.faces()) {
    for (std::size_t i = 0; i < 3; ++i) {
      const Double3 at(mesh.vertices()[face.vertices[i]].position);
      const Double3 a = Double3(mesh.vertices()[face.vertices[(i + 1) % 3]].position) - at;
      const Double3 b = Double3(mesh.vertices()[face.vertices[(i + 2) % 3]].position) - at;
      smallest = std::min(smallest, std::acos(Dot(a, b) / (Length(a) * Length(b))));
    }
  }
  return smallest;
}

// A light spot with a sharp rim around one corner of the box.
double Spot(const Sensor& sensor) {
  return Length(sensor.position - Vec3{1, 2, 3}) < 0.77F ? 1.0 : 0.2;
}

TEST(SurfaceMeshTest, ABoxHasAVertexAtEachCornerOfEachSide) {
  const SurfaceMesh mesh = MeshOf(Box());
  EXPECT_EQ(mesh.vertices().size(), 24U);
  EXPECT_EQ(mesh.faces().size(), 12U);
  EXPECT_NEAR(AreaOf(mesh), 22, 1e-5);
  ExpectNoCracks(mesh);
  for (const MeshVertex& vertex : mesh.vertices())
    EXPECT_NEAR(Length(vertex.normal), 1, 1e-6);
}

TEST(SurfaceMeshTest, StaysWholeAroundARim) {
  SurfaceMesh mesh = MeshOf(Box());
  ASSERT_TRUE(mesh.SplitLongEdges(1.6).ok());
  Bake(mesh, Spot, 0.05);
  ExpectNoCracks(mesh);
  EXPECT_NEAR(AreaOf(mesh), 22, 1e-4);
  // Of the first faces, halved at their longest edges, none is less than half as pointed (Rivara).
  EXPECT_GT(SmallestAngleOf(mesh), 0.5 * std::atan(1.0 / 3) - 1e-6);
  // Finest at the rim, coarse elsewhere.
  double shortest = HUGE_VAL;
  std::size_t coarse = 0;
  for (const MeshFace& face : mesh.faces()) {
    shortest = std::min(shortest, std::sqrt(mesh.AreaOf(face)));
    coarse += mesh.AreaOf(face) > 0.2 ? 1 : 0;
  }
  EXPECT_LT(shortest, 0.1);
  EXPECT_GT(coarse, 10U);
}

TEST(SurfaceMeshTest, WhatIsLinearIsNotRefinedAndExact) {
  SurfaceMesh mesh = MeshOf(Box());
  const auto linear = [](const Sensor& sensor) {
    return 1 + static_cast<double>(sensor.position.x + 2 * sensor.position.y);
  };
  Bake(mesh, linear, 0.01);
  EXPECT_EQ(mesh.faces().size(), 12U);
  // Sensors are a little beside corners.
  EXPECT_LT(mesh.InterpolationError(), 1e-3);
}

TEST(SurfaceMeshTest, AToleranceOfZeroRefinesEverywhere) {
  SurfaceMesh uniform = MeshOf(Box());
  Bake(uniform, Spot, 0);
  SurfaceMesh adaptive = MeshOf(Box());
  ASSERT_TRUE(adaptive.SplitLongEdges(1.6).ok());
  Bake(adaptive, Spot, 0.05);
  for (const MeshFace& face : uniform.faces())
    EXPECT_LT(std::sqrt(uniform.AreaOf(face)), 0.1);
  EXPECT_GT(uniform.faces().size(), 5 * adaptive.faces().size());
}

TEST(SurfaceMeshTest, DifferencesWithinTheNoiseAreNotRefined) {
  SurfaceMesh mesh = MeshOf(Box());
  const std::vector<Sensor> sensors = mesh.NextSensors(true);
  std::vector<Irradiance> measured = Measure(sensors, Spot);
  for (Irradiance& of : measured)
    of.noise = 0.4F;
  mesh.SetMeasured(measured);
  EXPECT_EQ(mesh.Refine(0.05).value(), 0U);
}

TEST(SurfaceMeshTest, TheBrighterSideIsKept) {
  Scene scene;
  AddMaterial(scene, DiffuseMaterial(0.5F));
  AddQuad(scene, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0);
  AddQuad(scene, {0, 0, 1}, {0, 1, 0}, {1, 0, 0}, 0);
  const auto from_above = [](const Sensor& sensor) { return sensor.normal.z > 0 ? 1.0 : 0.1; };
  SurfaceMesh mesh = MeshOf(scene, MeasuredSides::kBrighter, 10);
  mesh.SetBuckets(Measure(mesh.Buckets().sensors, from_above));
  mesh.DropDarkerSides();
  mesh.KeepAsSurvey();
  Bake(mesh, from_above, 0.05);
  ASSERT_EQ(mesh.faces().size(), 4U);
  for (const MeshFace& face : mesh.faces()) {
    EXPECT_EQ(mesh.vertices()[face.vertices[0]].normal.z, 1);
    // Seen from the measured side faces are counter-clockwise.
    const Vec3 normal = TriangleNormal(mesh.vertices()[face.vertices[0]].position,
                                       mesh.vertices()[face.vertices[1]].position,
                                       mesh.vertices()[face.vertices[2]].position);
    EXPECT_EQ(normal.z, 1);
  }
  SurfaceMesh both = MeshOf(scene, MeasuredSides::kBoth, 10);
  Bake(both, from_above, 0.05);
  EXPECT_EQ(both.faces().size(), 8U);
}

TEST(SurfaceMeshTest, NewVerticesOfASphereAreOnIt) {
  Scene scene;
  AddMaterial(scene, DiffuseMaterial(0.5F));
  AddSphere(scene, {1, 2, 3}, 2, 0);
  SurfaceMesh mesh = MeshOf(scene, MeasuredSides::kFront, 0.2);
  ASSERT_TRUE(mesh.SplitLongEdges(0.5).ok());
  Bake(
      mesh, [](const Sensor& sensor) { return sensor.position.x > 1.5F ? 1.0 : 0.3; }, 0.05);
  ExpectNoCracks(mesh);
  for (const MeshVertex& vertex : mesh.vertices()) {
    const Vec3 out = vertex.sensor.position - Vec3{1, 2, 3};
    EXPECT_NEAR(Length(out), 2, 1e-5);
    EXPECT_NEAR(Dot(Normalize(out), vertex.sensor.normal), 1, 1e-5);
  }
  // Triangles of a circumradius of at most 0.3 lie 1 % or less below the sphere.
  EXPECT_LT(AreaOf(mesh), 16 * std::numbers::pi);
  EXPECT_GT(AreaOf(mesh), 0.98 * 16 * std::numbers::pi);
}

TEST(SurfaceMeshTest, SensorsLieOnTheirFaces) {
  SurfaceMesh mesh = MeshOf(Box(), MeasuredSides::kFront, 0.5);
  Bake(mesh, Spot, 0.05);
  for (const MeshVertex& vertex : mesh.vertices()) {
    const Vec3 p = vertex.sensor.position;
    const Vec3 n = vertex.sensor.normal;
    // In the plane of the side, and inside of its rim.
    const Vec3 high = {1, 2, 3};
    int on_faces = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto at = [&](Vec3 v) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; };
      if (at(n) != 0) {
        EXPECT_NEAR(at(p), at(n) > 0 ? at(high) : 0, 1e-6);
        ++on_faces;
      } else {
        EXPECT_GT(at(p), 0);
        EXPECT_LT(at(p), at(high));
      }
    }
    EXPECT_EQ(on_faces, 1);
    EXPECT_LT(Length(p - vertex.position), 1e-3F);
  }
}

TEST(SurfaceMeshTest, BucketsAreTheFaces) {
  SurfaceMesh mesh = MeshOf(Box(), MeasuredSides::kBrighter);
  ASSERT_TRUE(mesh.SplitLongEdges(0.9).ok());
  const SensorSet set = mesh.Buckets();
  ASSERT_EQ(set.sensors.size(), mesh.faces().size());
  ASSERT_EQ(set.buckets.size(), mesh.faces().size());
  // As many borders as edges, each once: of a box with both sides, 3/2 to two faces.
  EXPECT_EQ(set.borders.size(), 3 * mesh.faces().size() / 4);
  const auto from_outside = [](const Sensor& sensor) {
    const Vec3 middle = {0.5F, 1, 1.5F};
    return Dot(sensor.position - middle, sensor.normal) > 0 ? 1.0 + sensor.position.x : 0.5;
  };
  mesh.SetBuckets(Measure(set.sensors, from_outside));
  mesh.DropDarkerSides();
  mesh.SetBuckets(Measure(mesh.Buckets().sensors, from_outside));
  EXPECT_NEAR(AreaOf(mesh), 22, 1e-5);
  const BakedMesh baked = BakedMeshOf(mesh);
  ASSERT_EQ(baked.surfaces.size(), 1U);
  EXPECT_EQ(baked.surfaces[0].positions.size(), 3 * mesh.faces().size());
  double flux = 0;
  for (const MeshFace& face : mesh.faces())
    flux += mesh.AreaOf(face) * static_cast<double>(face.bucket->value.g);
  // 1 + x over the box: 6 on x = 0, 12 on x = 1, and 1.5 times 10 on the others.
  EXPECT_NEAR(flux, 6 + 12 + 15, 1e-3);
}

TEST(SurfaceMeshTest, ASpacingThatIsTooFineIsRefused) {
  SurfaceMesh mesh = MeshOf(Box());
  const Status status = mesh.SplitLongEdges(1e-9);
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(status.message()), HasSubstr("larger spacing"));
}

TEST(SurfaceMeshTest, ChoosesByMaterial) {
  Scene scene = Box();
  scene.materials[0].name = "box";
  Material glass = DielectricMaterial(1.5F);
  glass.name = "glass";
  AddMaterial(scene, glass);
  AddSphere(scene, {0, 0, 9}, 1, 1);
  EXPECT_EQ(MeshOf(scene).faces().size(), 12U);  // nothing is kept on glass
  const auto none = SurfaceMesh::FromScene(
      scene, {.sides = MeasuredSides::kFront, .names = {"glass"}, .spacing = 1});
  EXPECT_EQ(none.status().code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(none.status().message()), HasSubstr("there are box"));
}

// One square of 16 x 16, as two faces.
SurfaceMesh SquareOf(double spacing, MeshElements elements = MeshElements::kLinear) {
  Scene scene;
  AddMaterial(scene, DiffuseMaterial(0.5F));
  AddQuad(scene, {0, 0, 0}, {16, 0, 0}, {0, 16, 0}, 0);
  StatusOr<SurfaceMesh> mesh = SurfaceMesh::FromScene(
      scene,
      {.sides = MeasuredSides::kFront, .names = {}, .spacing = spacing, .elements = elements});
  EXPECT_TRUE(mesh.ok()) << mesh.status();
  return *std::move(mesh);
}

// A spot within one face, on no edge's middle of the first meshes: of radius 1.2 around (11, 4.7).
double SmallSpot(const Sensor& sensor) {
  return Length(sensor.position - Vec3{11, 4.7F, 0}) < 1.2F ? 100.0 : 1.0;
}

double AreaOfSmallSpot() {
  return std::numbers::pi * 1.44;
}

TEST(SurfaceMeshTest, ASpotWithinAFaceIsFoundByTheSurvey) {
  const auto refined = [](bool is_surveyed) {
    SurfaceMesh mesh = SquareOf(0.5);
    if (is_surveyed) {
      // The spot is in the second face, which is below the diagonal.
      const SensorSet set = mesh.Buckets();
      std::vector<Irradiance> means;
      for (const Sensor& sensor : set.sensors) {
        const bool has_spot = sensor.position.x > sensor.position.y;
        means.push_back(
            {Gray(has_spot ? static_cast<float>(1 + 99 * AreaOfSmallSpot() / 128) : 1), 0.01F});
      }
      mesh.SetBuckets(means);
      mesh.KeepAsSurvey();
    }
    Bake(mesh, SmallSpot, 0.05);
    return mesh;
  };
  // It is missed by vertices and middles alone.
  EXPECT_EQ(refined(false).faces().size(), 2U);
  const SurfaceMesh found = refined(true);
  double flux = 0;
  for (const MeshFace& face : found.faces()) {
    for (const std::uint32_t vertex : face.vertices)
      flux += found.AreaOf(face) / 3 *
              static_cast<double>(found.vertices()[vertex].irradiance->value.g);
  }
  // Interpolation spreads the rim over an edge or so: of 0.5 at a circumference of 7.5.
  EXPECT_NEAR(flux, 256 + 99 * AreaOfSmallSpot(), 99 * 7.5 * 0.25);
  // Finest faces have an area of 1/16; the face without a spot is fine along its border alone.
  EXPECT_LT(found.faces().size(), 2048 + 512U);
}

TEST(SurfaceMeshTest, DirectLightThatIsMissedIsFoundHoweverNoisyItsMean) {
  SurfaceMesh mesh = SquareOf(0.5);
  // As many samples of the spot as make a mean as large as its noise.
  mesh.SetBuckets({{Gray(3), 2, 3}, {Gray(1), 0.1F, 1}});
  mesh.KeepAsSurvey();
  mesh.SetMeasured([&] {
    std::vector<Irradiance> measured = Measure(mesh.NextSensors(true), SmallSpot);
    for (Irradiance& of : measured)
      of.direct = of.value.g;
    return measured;
  }());
  // Of the first face all edges.
  EXPECT_EQ(mesh.Refine(0.05).value(), 3U);
  EXPECT_GT(mesh.faces().size(), 4U);
}

TEST(SurfaceMeshTest, TheSurveysNoiseIsNoSpot) {
  SurfaceMesh mesh = SquareOf(0.5);
  // 30 % off, and four standard deviations are 40 %; where no noise is known nothing is.
  mesh.SetBuckets({{Gray(1.3F), 0.1F, 0}, {Gray(0), 0, 0}});
  mesh.KeepAsSurvey();
  Bake(
      mesh, [](const Sensor&) { return 1.0; }, 0.05);
  EXPECT_EQ(mesh.faces().size(), 2U);
}

// Over x, from 0 to 16.
double Parabola(const Sensor& sensor) {
  const auto x = static_cast<double>(sensor.position.x);
  return 1 + 0.25 * x * x;
}

TEST(SurfaceMeshTest, QuadraticElementsAreExactOnParabolas) {
  SurfaceMesh mesh = SquareOf(0.5, MeshElements::kQuadratic);
  Bake(mesh, Parabola, 0.01);
  EXPECT_EQ(mesh.faces().size(), 2U);
  EXPECT_LT(mesh.InterpolationError(), 1e-3);
  const BakedMesh baked = BakedMeshOf(mesh);
  ASSERT_EQ(baked.surfaces.size(), 1U);
  EXPECT_TRUE(baked.is_quadratic);
  EXPECT_EQ(baked.surfaces[0].faces.size(), 8U);
  EXPECT_EQ(baked.surfaces[0].positions.size(), 9U);  // 4 corners and 5 middles
  const BakedLight light(baked);
  for (const float x : {0.3F, 4.0F, 7.7F, 11.0F, 15.9F}) {
    for (const float y : {0.2F, 5.0F, 13.1F}) {
      const std::optional<Rgb> at = light.At("", {x, y, 0.001F}, {0, 0, 1});
      ASSERT_TRUE(at);
      const double expected = Parabola({{x, y, 0}, {0, 0, 1}, 0});
      // Sensors lie 0.0005 beside corners, where the slope is 8 at most.
      EXPECT_NEAR(static_cast<double>(at->g), expected, 0.01) << x << " " << y;
    }
  }
  // Linear ones need many more, and are wrong by the tolerance between vertices.
  SurfaceMesh linear = SquareOf(0.5);
  Bake(linear, Parabola, 0.01);
  EXPECT_GT(linear.faces().size(), 10 * mesh.faces().size());
}

TEST(SurfaceMeshTest, QuadraticElementsStayWholeAroundARim) {
  StatusOr<SurfaceMesh> mesh =
      SurfaceMesh::FromScene(Box(), {.sides = MeasuredSides::kFront,
                                     .names = {},
                                     .spacing = 0.1,
                                     .elements = MeshElements::kQuadratic});
  ASSERT_TRUE(mesh.ok());
  ASSERT_TRUE(mesh->SplitLongEdges(1.6).ok());
  Bake(*mesh, Spot, 0.05);
  ExpectNoCracks(*mesh);
  const BakedMesh baked = BakedMeshOf(*mesh);
  double area = 0;
  for (const auto& face : baked.surfaces[0].faces) {
    area += Length(TriangleCross(baked.surfaces[0].positions[face[0]],
                                 baked.surfaces[0].positions[face[1]],
                                 baked.surfaces[0].positions[face[2]])) /
            2;
  }
  EXPECT_NEAR(area, 22, 1e-4);
  // What a corner or a middle measures, the file has.
  for (std::size_t i = 0; i < baked.surfaces[0].positions.size(); ++i) {
    const double value = static_cast<double>(baked.surfaces[0].irradiance[i].g);
    EXPECT_GE(value, 0.2 - 1e-6);
    EXPECT_LE(value, 1 + 1e-6);
  }
}

// Nearly the field of a light over the middle: smooth.
double Smooth(const Sensor& sensor) {
  const double x = static_cast<double>(sensor.position.x) - 8;
  const double y = static_cast<double>(sensor.position.y) - 8;
  return 100 / (x * x + y * y + 100);
}

TEST(SurfaceMeshTest, DecimationKeepsWhatWasMeasured) {
  SurfaceMesh mesh = SquareOf(0.5);
  ASSERT_TRUE(mesh.SplitLongEdges(1).ok());  // far finer than the field asks for
  Bake(mesh, Smooth, 0.05);
  const std::size_t before = mesh.faces().size();
  const std::vector<MeshVertex> measured = mesh.vertices();
  const std::size_t removed = mesh.Decimate(0.05, 8);
  EXPECT_GT(removed, before / 4);
  EXPECT_LT(mesh.faces().size(), before / 4);
  EXPECT_NEAR(AreaOf(mesh), 256, 1e-3);
  // On the border too edges have two faces or lie along the border.
  for (const auto& [edge, count] : EdgesOf(mesh)) {
    EXPECT_EQ(count, 1);
  }
  const BakedMesh baked = BakedMeshOf(mesh);
  const BakedLight light(baked);
  for (const MeshVertex& vertex : measured) {
    const std::optional<Rgb> at = light.At("", vertex.position, {0, 0, 1});
    ASSERT_TRUE(at);
    const auto was = static_cast<double>(vertex.irradiance->value.g);
    const auto is = static_cast<double>(at->g);
    EXPECT_NEAR(is, was, 0.05 * std::max(was, is) + 1e-6);
  }
  EXPECT_LT(mesh.InterpolationError(), 0.05);
  EXPECT_GT(mesh.InterpolationError(), 0);
}

TEST(SurfaceMeshTest, DecimationLeavesNoCracks) {
  SurfaceMesh mesh = MeshOf(Box());
  ASSERT_TRUE(mesh.SplitLongEdges(0.3).ok());
  Bake(mesh, Spot, 0.05);
  const std::size_t before = mesh.faces().size();
  (void)mesh.Decimate(0.05, 1.6);
  EXPECT_LT(mesh.faces().size(), 0.8 * static_cast<double>(before));
  ExpectNoCracks(mesh);
  EXPECT_NEAR(AreaOf(mesh), 22, 1e-4);
}

// Of something in even light.
void ExpectShapeKeptByDecimation(const Scene& scene) {
  SurfaceMesh mesh = MeshOf(scene, MeasuredSides::kFront, 0.05);
  ASSERT_TRUE(mesh.SplitLongEdges(0.15).ok());
  Bake(
      mesh, [](const Sensor&) { return 1.0; }, 0.05);
  const double area = AreaOf(mesh);
  EXPECT_GT(mesh.Decimate(0.05, 10), 10U);
  EXPECT_NEAR(AreaOf(mesh), area, 1e-5 * area);
}

TEST(SurfaceMeshTest, DecimationKeepsBordersThatBend) {
  Scene scene;
  AddMaterial(scene, DiffuseMaterial(0.5F));
  AddDisk(scene, {0, 0, 0}, {0, 0, 1}, 1, 0, kNoAreaLight);
  ExpectShapeKeptByDecimation(scene);
}

// A half tube of many strips: vertices within a strip and along its edges go, none across the bend.
TEST(SurfaceMeshTest, ABentMeshKeepsItsShape) {
  Scene scene;
  TriangleMesh arch;
  arch.traits.material = AddMaterial(scene, DiffuseMaterial(0.5F));
  constexpr std::uint32_t kStrips = 12;
  for (std::uint32_t i = 0; i <= kStrips; ++i) {
    const double angle = std::numbers::pi * i / kStrips;
    for (const float y : {0.0F, 4.0F})
      arch.positions.push_back(
          {static_cast<float>(std::cos(angle)), y, static_cast<float>(std::sin(angle))});
    if (i < kStrips)
      arch.indices.insert(arch.indices.end(),
                          {2 * i, 2 * i + 1, 2 * i + 3, 2 * i, 2 * i + 3, 2 * i + 2});
  }
  scene.meshes.push_back(std::move(arch));
  ExpectShapeKeptByDecimation(scene);
}

TEST(SurfaceMeshTest, ASphereIsNotDecimated) {
  Scene scene;
  AddMaterial(scene, DiffuseMaterial(0.5F));
  AddSphere(scene, {0, 0, 0}, 1, 0);
  SurfaceMesh mesh = MeshOf(scene, MeasuredSides::kFront, 0.2);
  Bake(
      mesh, [](const Sensor&) { return 1.0; }, 0.05);
  EXPECT_EQ(mesh.Decimate(0.05, 10), 0U);
}

BakedMesh SmallBake() {
  Scene scene = Box();
  scene.materials[0].name = "box";
  SurfaceMesh mesh = MeshOf(scene);
  Bake(mesh, Spot, 10);
  return BakedMeshOf(mesh);
}

TEST(MeshFileTest, PlyIsReadBack) {
  const BakedMesh baked = SmallBake();
  for (const bool is_ascii : {false, true}) {
    const std::string bytes = MeshPly(baked, is_ascii);
    const StatusOr<TriangleMesh> read = ParsePly(bytes);
    ASSERT_TRUE(read.ok()) << read.status();
    EXPECT_EQ(read->indices.size(), 36U);
    ASSERT_EQ(read->positions.size(), 24U);
    for (std::size_t i = 0; i < 24; ++i) {
      EXPECT_EQ(read->positions[i], baked.surfaces[0].positions[i]);
      EXPECT_EQ(read->normals[i], baked.surfaces[0].normals[i]);
    }
  }
}

TEST(MeshFileTest, GlbIsWhatItsHeaderSays) {
  const BakedMesh baked = SmallBake();
  const std::string bytes = MeshGlb(baked);
  const auto word = [&](std::size_t at) {
    std::uint32_t value = 0;
    std::memcpy(&value, bytes.data() + at, sizeof(value));
    return value;
  };
  ASSERT_EQ(bytes.substr(0, 4), "glTF");
  EXPECT_EQ(word(4), 2U);
  ASSERT_EQ(word(8), bytes.size());
  const std::uint32_t json_size = word(12);
  EXPECT_EQ(json_size % 4, 0U);
  const auto file = nlohmann::json::parse(bytes.substr(20, json_size));
  const std::size_t binary_at = 20 + json_size + 8;
  ASSERT_EQ(word(20 + json_size), bytes.size() - binary_at);
  EXPECT_EQ(file["buffers"][0]["byteLength"], bytes.size() - binary_at);
  const auto& attributes = file["meshes"][0]["primitives"][0]["attributes"];
  const auto float_at = [&](const nlohmann::json& accessor_number, std::size_t index) {
    const auto& accessor = file["accessors"][accessor_number.get<std::size_t>()];
    const auto& view = file["bufferViews"][accessor["bufferView"].get<std::size_t>()];
    float value = 0;
    std::memcpy(&value,
                bytes.data() + binary_at + view["byteOffset"].get<std::size_t>() + 4 * index, 4);
    return value;
  };
  for (std::size_t vertex = 0; vertex < 24; ++vertex) {
    EXPECT_EQ(float_at(attributes["POSITION"], 3 * vertex), baked.surfaces[0].positions[vertex].x);
    EXPECT_EQ(float_at(attributes["_IRRADIANCE"], 3 * vertex + 1),
              baked.surfaces[0].irradiance[vertex].g);
  }
  const auto& positions = file["accessors"][attributes["POSITION"].get<std::size_t>()];
  EXPECT_EQ(positions["min"], (std::vector<float>{0, 0, 0}));
  EXPECT_EQ(positions["max"], (std::vector<float>{1, 2, 3}));
  EXPECT_EQ(positions["count"], 24);
}

TEST(MeshFileTest, GlbIsReadBack) {
  BakedMesh baked = SmallBake();
  baked.scene = "box.pbrt";
  baked.is_indirect = true;
  baked.surfaces[0].noise[1] = 0.25F;
  const std::string bytes = MeshGlb(baked);
  const StatusOr<BakedMesh> read = ReadMeshGlb("box.glb", bytes);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->scene, "box.pbrt");
  EXPECT_TRUE(read->is_indirect);
  EXPECT_FALSE(read->is_quadratic);
  ASSERT_EQ(read->surfaces.size(), 1U);
  EXPECT_EQ(read->surfaces[0].name, "0 box");
  EXPECT_EQ(read->surfaces[0].material, "box");
  EXPECT_EQ(read->surfaces[0].positions, baked.surfaces[0].positions);
  EXPECT_EQ(read->surfaces[0].normals, baked.surfaces[0].normals);
  EXPECT_EQ(read->surfaces[0].irradiance, baked.surfaces[0].irradiance);
  EXPECT_EQ(read->surfaces[0].noise, baked.surfaces[0].noise);
  EXPECT_EQ(read->surfaces[0].faces, baked.surfaces[0].faces);
  // Shortened anywhere, it is refused or is the same.
  for (std::size_t size = 0; size < bytes.size(); size += 97) {
    EXPECT_FALSE(ReadMeshGlb("box.glb", bytes.substr(0, size)).ok()) << size;
  }
  const StatusOr<BakedMesh> other = ReadMeshGlb("other.gltf", R"({"asset": {"version": "2.0"}})");
  ASSERT_FALSE(other.ok());
  EXPECT_THAT(std::string(other.status().message()), HasSubstr("no meshes"));
}

TEST(BakedLightTest, IsThatOfTheNearestFaceThatLooksTheSameWay) {
  BakedMesh baked;
  const auto add = [&](const std::string& material, float z, bool faces_up, float value) {
    BakedMesh::Surface& surface = baked.surfaces.emplace_back();
    surface.material = material;
    surface.positions = {{0, 0, z}, {1, 0, z}, {0, 1, z}};
    surface.normals.assign(3, {0, 0, faces_up ? 1.0F : -1.0F});
    surface.irradiance.assign(3, Gray(value));
    surface.irradiance[1] = Gray(2 * value);
    surface.noise.assign(3, 0);
    surface.faces.push_back({0, 1, 2});
    if (!faces_up) std::swap(surface.faces[0][1], surface.faces[0][2]);
  };
  add("floor", 0, true, 1);
  add("floor", 0, false, 10);
  add("table", 0.1F, true, 100);
  const BakedLight light(baked);
  const Vec3 up = {0, 0, 1};
  EXPECT_NEAR(light.At("floor", {0.25F, 0.25F, 0.01F}, up)->g, 1.25F, 1e-5F);
  EXPECT_NEAR(light.At("floor", {0.25F, 0.25F, -0.01F}, -up)->g, 12.5F, 1e-4F);
  // Not what is nearer and of another material.
  EXPECT_NEAR(light.At("floor", {0, 0, 0.09F}, up)->g, 1, 1e-5F);
  EXPECT_NEAR(light.At("table", {0, 0, 0.09F}, up)->g, 100, 1e-3F);
  // Of a material that the mesh does not have, only on the mesh itself.
  EXPECT_NEAR(light.At("mix", {0, 0, 0.1F}, up)->g, 100, 1e-3F);
  EXPECT_FALSE(light.At("mix", {0, 0, 0.05F}, up));
  EXPECT_FALSE(light.At("floor", {0, 0, 1}, up));
  EXPECT_FALSE(light.At("table", {0, 0, 0.1F}, -up));
  EXPECT_FALSE(light.At("floor", {0, 0, 0}, {1, 0, 0}));
}

TEST(ChartAtlasTest, TexelsLieOnTheirSurfacesAndCoverThem) {
  const SurfaceMesh mesh = MeshOf(Box());
  const StatusOr<ChartAtlas> atlas = ChartAtlasOf(mesh, 0.1);
  ASSERT_TRUE(atlas.ok()) << atlas.status();
  EXPECT_EQ(atlas->charts, 6U);
  double area = 0;
  std::map<std::pair<int, int>, int> used;
  for (const ChartAtlas::Texel& texel : atlas->texels) {
    EXPECT_GE(texel.x, 0);
    EXPECT_LT(texel.x, atlas->width);
    EXPECT_GE(texel.y, 0);
    EXPECT_LT(texel.y, atlas->height);
    EXPECT_EQ(++(used[{texel.x, texel.y}]), 1) << "a texel of two charts";
    area += texel.area;
    const Vec3 p = texel.sensor.position;
    EXPECT_TRUE(p.x >= 0 && p.y >= 0 && p.z >= 0 && p.x <= 1 && p.y <= 2 && p.z <= 3);
    // In the plane of its face.
    const Vec3 corner = mesh.vertices()[mesh.faces()[texel.face].vertices[0]].position;
    EXPECT_NEAR(Dot(p - corner, texel.sensor.normal), 0, 1e-5F);
  }
  // Sides are whole numbers of texels wide, and parallel to them.
  EXPECT_NEAR(area, 22, 0.01 * 22);
  // Charts are upright: not much more than the texels of the sides and their margins.
  EXPECT_LT(atlas->width * atlas->height, 1.4 * (2200 + 6 * 4 * 64));
}

TEST(ChartAtlasTest, BilinearLookUpsFindWhatIsLinear) {
  const SurfaceMesh mesh = MeshOf(Box());
  const StatusOr<ChartAtlas> atlas = ChartAtlasOf(mesh, 0.1);
  ASSERT_TRUE(atlas.ok()) << atlas.status();
  const auto linear = [](Vec3 p) { return 1 + p.x + 2 * p.y + 3 * p.z; };
  std::vector<Irradiance> measured;
  for (const ChartAtlas::Texel& texel : atlas->texels)
    measured.push_back({Gray(linear(texel.sensor.position)), 0, 0});
  const Image image = AtlasImage(*atlas, measured);
  const BakedMesh baked = AtlasMesh(mesh, *atlas, image);
  ASSERT_EQ(baked.surfaces.size(), 1U);
  ASSERT_EQ(baked.surfaces[0].positions.size(), 24U);
  for (std::size_t i = 0; i < 24; ++i) {
    // Texels beside a chart have its border's values: off by half a texel in each direction.
    EXPECT_NEAR(baked.surfaces[0].irradiance[i].g, linear(baked.surfaces[0].positions[i]),
                0.05F * 5 + 1e-3F);
    EXPECT_TRUE(baked.surfaces[0].uvs[i].x > 0 && baked.surfaces[0].uvs[i].x < 1);
  }
  const std::vector<SurfaceFigures> figures = FiguresOf(mesh, *atlas, measured);
  ASSERT_EQ(figures.size(), 1U);
  EXPECT_NEAR(figures[0].area, 22, 1e-4);
  // At the middle of the box.
  EXPECT_NEAR(figures[0].mean, 1 + 0.5 + 2 + 4.5, 0.02 * 8);
  EXPECT_NEAR(figures[0].lowest, 1, 0.01);
  EXPECT_NEAR(figures[0].highest, 15, 0.01);
}

TEST(ChartAtlasTest, NoChartFoldsOverItself) {
  // A sphere has charts of at most 45 degrees around a direction: some, and none too many.
  Scene scene;
  AddMaterial(scene, DiffuseMaterial(0.5F));
  AddSphere(scene, {1, 2, 3}, 2, 0);
  const SurfaceMesh mesh = MeshOf(scene, MeasuredSides::kFront, 0.1);
  const StatusOr<ChartAtlas> atlas = ChartAtlasOf(mesh, 0.1);
  ASSERT_TRUE(atlas.ok()) << atlas.status();
  EXPECT_GE(atlas->charts, 6U);
  EXPECT_LT(atlas->charts, 40U);
  double area = 0;
  for (const ChartAtlas::Texel& texel : atlas->texels) {
    area += texel.area;
    EXPECT_NEAR(Length(texel.sensor.position - Vec3{1, 2, 3}), 2, 1e-5F);
  }
  EXPECT_NEAR(area, AreaOf(mesh), 0.02 * AreaOf(mesh));
  const StatusOr<ChartAtlas> fine = ChartAtlasOf(mesh, 1e-6);
  EXPECT_EQ(fine.status().code(), absl::StatusCode::kResourceExhausted);
}

TEST(SurfaceFiguresTest, AreThoseOfLinearTriangles) {
  BakedMesh mesh;
  mesh.surfaces.push_back({.name = "0 desk",
                           .positions = {{0, 0, 0}, {2, 0, 0}, {0, 1, 0}},
                           .normals = {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}},
                           .irradiance = {Gray(1), Gray(2), Gray(6)},
                           .noise = {0, 0, 0},
                           .faces = {{0, 1, 2}}});
  const std::vector<SurfaceFigures> figures = FiguresOf(mesh);
  ASSERT_EQ(figures.size(), 1U);
  EXPECT_DOUBLE_EQ(figures[0].area, 1);
  EXPECT_NEAR(figures[0].mean, 3, 1e-6);
  EXPECT_NEAR(figures[0].lowest, 1, 1e-6);
  EXPECT_NEAR(figures[0].highest, 6, 1e-6);
  EXPECT_NEAR(figures[0].uniformity(), 1.0 / 3, 1e-6);
  EXPECT_THAT(FiguresTable(figures, true), HasSubstr("2049"));  // 3 · 683 lx
}

TEST(IrradiancePlanTest, HoldsWhatIsFarBrighterThanTheRest) {
  BakedMesh mesh;
  mesh.surfaces.push_back({.name = "0 floor",
                           .positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {2, 0, 0}},
                           .normals = std::vector<Vec3>(5, Vec3{0, 0, 1}),
                           .irradiance = {Gray(1), Gray(1), Gray(1), Gray(1), Gray(1e30F)},
                           .noise = {0, 0, 0, 0, 0},
                           .faces = {{0, 1, 2}, {0, 2, 3}}});
  // One triangle of a thousandth of the area has a corner that is 1e30 times as bright.
  mesh.surfaces[0].positions[4] = {1.002F, 0, 0};
  mesh.surfaces[0].faces.push_back({1, 4, 2});
  const std::string svg = IrradiancePlan(mesh, false);
  EXPECT_THAT(svg, HasSubstr(">0.9</text>"));
  // Each triangle is there, in the last band alone.
  std::size_t paths = 0;
  for (std::size_t at = svg.find("<path"); at != std::string::npos; at = svg.find("<path", at + 1))
    ++paths;
  EXPECT_EQ(paths, 3U);
}

// A square of 1 m from which irradiance falls from 10 to 0 along x, and a smaller one that lies
// above it, even: bands of 1, and nine lines of equal irradiance across the first.
TEST(IrradiancePlanTest, HasBandsLinesAndAScale) {
  BakedMesh mesh;
  mesh.surfaces.push_back({.name = "0 floor",
                           .positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}},
                           .normals = std::vector<Vec3>(4, Vec3{0, 0, 1}),
                           .irradiance = {Gray(0), Gray(10), Gray(10), Gray(0)},
                           .noise = {0, 0, 0, 0},
                           .faces = {{0, 1, 2}, {0, 2, 3}}});
  mesh.surfaces.push_back({.name = "1 wall",
                           .positions = {{0, 0, 0}, {0, 1, 0}, {0, 0, .5F}},
                           .normals = std::vector<Vec3>(3, Vec3{1, 0, 0}),
                           .irradiance = std::vector<Rgb>(3, Gray(99)),
                           .noise = {0, 0, 0},
                           .faces = {{0, 1, 2}}});
  const std::string svg = IrradiancePlan(mesh, false);
  const auto count = [&](const std::string& text) {
    int found = 0;
    for (std::size_t at = svg.find(text); at != std::string::npos; at = svg.find(text, at + 1))
      ++found;
    return found;
  };
  EXPECT_EQ(svg.find("<svg"), 0U);
  EXPECT_THAT(svg, HasSubstr("W/m"));
  // Means of the two triangles are 10/3 and 20/3: up to the larger one bands are of 0.5.
  EXPECT_EQ(count("<rect x="), 14);
  EXPECT_THAT(svg, HasSubstr(">6.5</text>"));
  // Of each band a part in each triangle that has it, none of the wall.
  EXPECT_EQ(count("<path d=\"M"), 2 * 14 + 1);
  // The line at 5 W/m² runs across the middle of the square, which is 800 pixels wide.
  EXPECT_THAT(svg, HasSubstr("420.0 "));
}

}  // namespace
}  // namespace lucerna
