// The shapes of pbrt-v4 that are read as triangles or pieces have the areas, normals and texture
// coordinates of the surfaces that they stand for.
#include <cmath>
#include <map>
#include <string>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

#include "render/formats/read_scene.h"
#include "render/math/double3.h"
#include "render/math/warp.h"
#include "tests/support/memory_files.h"
#include "tests/support/pbrt_text.h"

namespace lucerna {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// Under a light, without which all scenes get a warning.
ParsedScene ParseShapes(const std::string& world, std::map<std::string, std::string> files = {}) {
  return ParseWorld("LightSource \"infinite\"\n" + world, std::move(files));
}
Scene ReadShapes(const std::string& world) {
  ParsedScene parsed = ParseShapes(world);
  EXPECT_TRUE(parsed.ok()) << parsed.ToStatus();
  return std::move(parsed.scene);
}
std::string SaidOfShapes(const std::string& world) {
  return SaidOf(ParseShapes(world));
}

double AreaOf(const TriangleMesh& mesh) {
  double area = 0;
  for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
    area +=
        Length(TriangleCross(mesh.positions[mesh.indices[i]], mesh.positions[mesh.indices[i + 1]],
                             mesh.positions[mesh.indices[i + 2]])) /
        2;
  }
  return area;
}

// Each triangle is wound as its normals point, and normals point away from `inside`.
void ExpectOutward(const TriangleMesh& mesh, Vec3 inside, float sign = 1) {
  for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
    const Vec3 p = mesh.positions[mesh.indices[i]];
    const Vec3 n =
        TriangleNormal(p, mesh.positions[mesh.indices[i + 1]], mesh.positions[mesh.indices[i + 2]]);
    ASSERT_GT(sign * Dot(n, p - inside), 0) << i;
    ASSERT_GT(Dot(n, mesh.normals[mesh.indices[i]]), 0) << i;
  }
}

TEST(PbrtShapesTest, APartOfASphere) {
  const TriangleMesh mesh =
      ReadShapes(
          "Shape \"sphere\" \"float radius\" 2 \"float zmin\" -1 \"float zmax\" 1.5 \"float "
          "phimax\" 90")
          .meshes.at(0);
  // A zone's area is that of its height on a cylinder; chords take at most 0.1 % (64 sides a turn).
  EXPECT_NEAR(AreaOf(mesh) / (kPi64 / 2 * 2 * 2.5), 0.9995, 6e-4);
  ExpectOutward(mesh, {0, 0, 0});
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const Vec3 p = mesh.positions[i];
    ASSERT_NEAR(Length(p), 2, 1e-5);
    ASSERT_LE(std::abs(Length(mesh.normals[i] - p * 0.5F)), 1e-5F);
    ASSERT_TRUE(p.x >= -1e-6F && p.y >= -1e-6F && p.z >= -1.00001F && p.z <= 1.50001F);
    // pbrt-v4: u is the share of phimax, v that of the angle from the pole between its ends.
    const double u = std::atan2(static_cast<double>(p.y), static_cast<double>(p.x)) / (kPi64 / 2);
    const double low = std::acos(-0.5);
    const double v = (std::acos(static_cast<double>(p.z) / 2) - low) / (std::acos(0.75) - low);
    ASSERT_NEAR(mesh.uvs[i].x, u, 1e-5);
    ASSERT_NEAR(mesh.uvs[i].y, v, 1e-5);
  }
  const TriangleMesh reversed =
      ReadShapes("ReverseOrientation Shape \"sphere\" \"float zmax\" 0.5").meshes.at(0);
  ExpectOutward(reversed, {0, 0, 0}, -1);
}

TEST(PbrtShapesTest, AnEllipsoidIsClosedAndHasItsVolume) {
  const Scene scene = ReadShapes("Translate 1 2 3 Scale 1 2 3 Shape \"sphere\"");
  const TriangleMesh& mesh = scene.meshes.at(0);
  ExpectOutward(mesh, {1, 2, 3});
  double volume = 0;
  for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
    const auto at = [&](std::size_t k) {
      return Double3(mesh.positions[mesh.indices[i + k]]) - Double3{1, 2, 3};
    };
    volume += Dot(at(0), Cross(at(1), at(2))) / 6;
  }
  EXPECT_NEAR(volume / (4.0 / 3 * kPi64 * 6), 0.9985, 1e-3);
  std::map<std::pair<std::array<float, 3>, std::array<float, 3>>, int> sides;
  for (std::size_t i = 0; i < mesh.indices.size(); ++i) {
    const Vec3 a = mesh.positions[mesh.indices[i]];
    const Vec3 b = mesh.positions[mesh.indices[i - i % 3 + (i + 1) % 3]];
    ++sides[{{a.x, a.y, a.z}, {b.x, b.y, b.z}}];
  }
  for (const auto& [side, count] : sides) {
    ASSERT_EQ(count, 1);
    ASSERT_TRUE(sides.contains({side.second, side.first}));
  }
}

// Round shapes face the other way under a mirroring transform, as in pbrt-v4, unless they emit.
TEST(PbrtShapesTest, AMirrorTurnsRoundShapesOver) {
  const std::string mirror = "Scale -1 1 1 ";
  const std::string light = "AreaLightSource \"diffuse\" ";
  EXPECT_FALSE(ReadShapes("Shape \"sphere\"").spheres.at(0).inward);
  EXPECT_TRUE(ReadShapes(mirror + "Shape \"sphere\"").spheres.at(0).inward);
  EXPECT_FALSE(ReadShapes(mirror + "ReverseOrientation Shape \"sphere\"").spheres.at(0).inward);
  EXPECT_FALSE(ReadShapes(mirror + light + "Shape \"sphere\"").spheres.at(0).inward);
  EXPECT_LT(ReadShapes(mirror + "Shape \"disk\"").disks.at(0).normal.z, 0);
  EXPECT_GT(ReadShapes(mirror + light + "Shape \"disk\"").disks.at(0).normal.z, 0);
  ExpectOutward(ReadShapes("Scale 1 2 1 Shape \"sphere\"").meshes.at(0), {});
  ExpectOutward(ReadShapes("Scale -1 2 1 Shape \"sphere\"").meshes.at(0), {}, -1);
  ExpectOutward(ReadShapes(mirror + "Shape \"cylinder\"").meshes.at(0), {}, -1);
}

TEST(PbrtShapesTest, APhimaxOfMoreThanATurnIsOne) {
  EXPECT_EQ(ReadShapes("Shape \"sphere\" \"float phimax\" 361").spheres.size(), 1U);
}

TEST(PbrtShapesTest, TangentsOfVerticesAreWarnedOf) {
  EXPECT_THAT(SaidOfShapes("Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"vector3 S\" "
                           "[1 0 0 1 0 0 1 0 0]"),
              HasSubstr("warning: \"S\" of Shape \"trianglemesh\" is ignored"));
}

TEST(PbrtShapesTest, PartsOfDisksAndCylinders) {
  const TriangleMesh ring =
      ReadShapes(
          "Shape \"disk\" \"float radius\" 2 \"float innerradius\" 1 \"float height\" 3 \"float "
          "phimax\" 180")
          .meshes.at(0);
  EXPECT_NEAR(AreaOf(ring) / (kPi64 / 2 * 3), 0.9993, 4e-4);
  for (const Vec3 normal : ring.normals)
    ASSERT_EQ(normal, Vec3(0, 0, 1));
  ExpectOutward(ring, {0, 0, 2});
  const TriangleMesh tube =
      ReadShapes("Shape \"cylinder\" \"float radius\" 2 \"float zmin\" 3 \"float zmax\" -1")
          .meshes.at(0);
  EXPECT_NEAR(AreaOf(tube) / (2 * kPi64 * 2 * 4), 0.9998, 1e-4);
  ExpectOutward(tube, {0, 0, 0});
  for (std::size_t i = 0; i < tube.positions.size(); ++i) {
    ASSERT_EQ(tube.normals[i].z, 0);
    ASSERT_NEAR(tube.uvs[i].y, (tube.positions[i].z + 1) / 4, 1e-6);
  }
  EXPECT_TRUE(ReadShapes("Shape \"disk\"").meshes.empty());
  EXPECT_THAT(SaidOfShapes("Shape \"sphere\" \"float zmin\" 1"),
              HasSubstr("leave nothing of the sphere"));
}

TEST(PbrtShapesTest, BilinearPatches) {
  const Scene flat = ReadShapes("Shape \"bilinearmesh\" \"point3 P\" [0 0 0 2 0 0 0 3 0 2 3 0]");
  EXPECT_EQ(flat.TriangleCount(), 2U);
  EXPECT_NEAR(AreaOf(flat.meshes.at(0)), 6, 1e-5);
  EXPECT_EQ(flat.meshes[0].normals[0], Vec3(0, 0, 1));
  // z = x y: the area over the unit square is the integral of sqrt(1 + x² + y²).
  const TriangleMesh saddle =
      ReadShapes("Shape \"bilinearmesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0 1 1 1]").meshes.at(0);
  double area = 0;
  constexpr int kSteps = 500;
  for (int i = 0; i < kSteps * kSteps; ++i) {
    const double x = (i % kSteps + 0.5) / kSteps;
    const double y = (i / kSteps + 0.5) / kSteps;
    area += std::sqrt(1 + x * x + y * y) / (kSteps * kSteps);
  }
  EXPECT_NEAR(AreaOf(saddle), area, 1e-3);
  for (std::size_t i = 0; i < saddle.positions.size(); ++i) {
    const Vec3 p = saddle.positions[i];
    ASSERT_NEAR(p.z, p.x * p.y, 1e-6);
    ASSERT_LT(Length(saddle.normals[i] - Normalize({-p.y, -p.x, 1})), 1e-5F);
    ASSERT_NEAR(saddle.uvs[i].x, p.x, 1e-6);
  }
  EXPECT_EQ(ReadShapes("Shape \"bilinearmesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0 1 1 0 2 0 0 2 1 0] "
                       "\"integer indices\" [0 1 2 3 1 4 3 5]")
                .TriangleCount(),
            4U);
  EXPECT_THAT(SaidOfShapes("Shape \"bilinearmesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0]"),
              HasSubstr("four for each patch"));
}

// A PLY file of a quadrangle over the unit square, whose third corner is at z = `height`.
std::string QuadPly(double height, const std::string& columns = "", const std::string& values = "",
                    const std::string& more_faces = "") {
  const std::string count = more_faces.empty() ? "1" : "2";
  return "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
         "property float z\n" +
         columns + "element face " + count +
         "\nproperty list uchar int vertex_indices\nend_header\n" + "0 0 0 " + values + " 1 0 0 " +
         values + " 1 1 " + std::to_string(height) + " " + values + " 0 1 0 " + values +
         "\n4 0 1 2 3\n" + more_faces;
}
constexpr const char* kPly = "Shape \"plymesh\" \"string filename\" \"q.ply\"";

constexpr const char* kTextured =
    "Texture \"t\" \"spectrum\" \"bilerp\" "
    "Material \"diffuse\" \"texture reflectance\" \"t\" ";

TEST(PbrtShapesTest, QuadranglesOfFilesArePatches) {
  const auto read = [](const std::string& ply) {
    const ParsedScene parsed = ParseShapes(std::string(kTextured) + kPly, {{"q.ply", ply}});
    EXPECT_TRUE(parsed.ok()) << parsed.ToStatus();
    return parsed.scene;
  };
  const Scene flat = read(QuadPly(0));
  ASSERT_EQ(flat.meshes.size(), 1U);
  EXPECT_EQ(flat.TriangleCount(), 2U);
  for (std::size_t i = 0; i < 4; ++i) {
    const Vec3 p = flat.meshes[0].positions[i];
    EXPECT_EQ(flat.meshes[0].uvs.at(i), (Vec2{p.x, p.y}));
  }
  EXPECT_TRUE(flat.meshes[0].normals.empty());
  // z = x y; triangles have the area of their corners, on the surface.
  const TriangleMesh saddle = read(QuadPly(1)).meshes.at(0);
  EXPECT_EQ(saddle.indices.size(), std::size_t{3 * 2 * 6 * 6});
  EXPECT_NEAR(AreaOf(saddle), 1.2808, 5e-3);
  for (std::size_t i = 0; i < saddle.positions.size(); ++i) {
    const Vec3 p = saddle.positions[i];
    ASSERT_NEAR(p.z, p.x * p.y, 1e-6);
    ASSERT_NEAR(saddle.uvs[i].x, p.x, 1e-6);
    ASSERT_NEAR(saddle.uvs[i].y, p.y, 1e-6);
  }
  // Those of the file stay where it has some, and a flat quadrangle shares its corners.
  const std::string uv = "property float u\nproperty float v\n";
  const Scene given = read(QuadPly(0, uv, "0.25 0.5"));
  EXPECT_EQ(given.meshes.at(0).uvs.at(2), (Vec2{0.25F, 0.5F}));
  EXPECT_EQ(given.meshes[0].positions.size(), 4U);
  EXPECT_EQ(read(QuadPly(1, uv, "0.25 0.5")).meshes.at(0).uvs.at(9), (Vec2{0.25F, 0.5F}));
  const Scene smooth =
      read(QuadPly(0, "property float nx\nproperty float ny\nproperty float nz\n", "0 0.6 0.8"));
  EXPECT_NEAR(smooth.meshes.at(0).normals.at(3).y, 0.6F, 1e-6);
  // Triangles beside them are a mesh of their own.
  const Scene mixed = read(QuadPly(0, "", "", "3 0 1 2\n"));
  ASSERT_EQ(mixed.meshes.size(), 2U);
  EXPECT_EQ(mixed.TriangleCount(), 3U);
}

TEST(PbrtShapesTest, QuadranglesShowTheirWholeTexture) {
  const auto said = [](const std::string& ply) {
    return SaidOf(ParseShapes(std::string(kTextured) + kPly, {{"q.ply", ply}}));
  };
  EXPECT_THAT(said(QuadPly(0)), Not(HasSubstr("has no uv")));
  EXPECT_THAT(said(QuadPly(0, "", "", "3 0 1 2\n")), HasSubstr("has no uv"));
}

// Two quadrangles with a common side: six vertices where nothing shows their places, else eight.
TEST(PbrtShapesTest, FlatQuadranglesShareVerticesWhereNothingShowsTheirPlaces) {
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\n"
      "property float z\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n"
      "0 0 0\n1 0 0\n2 0 0\n0 1 0\n1 1 0\n2 1 0\n4 0 1 4 3\n4 1 2 5 4\n";
  const auto vertices = [&](const std::string& world, const std::string& after = "") {
    const ParsedScene parsed = ParseShapes(world + kPly + after, {{"q.ply", ply}});
    EXPECT_TRUE(parsed.ok()) << parsed.ToStatus();
    EXPECT_EQ(parsed.scene.meshes.size(), 1U);
    return parsed.scene.meshes.at(0).positions.size();
  };
  EXPECT_EQ(vertices(""), 6U);
  EXPECT_EQ(vertices("Material \"conductor\" \"float roughness\" 0.2 "), 6U);
  EXPECT_EQ(vertices("AreaLightSource \"diffuse\" "), 6U);
  EXPECT_EQ(vertices(kTextured), 8U);
  EXPECT_EQ(vertices("Material \"conductor\" \"float uroughness\" 0.2 \"float vroughness\" 0.4 "),
            8U);
  EXPECT_EQ(vertices("Texture \"a\" \"float\" \"bilerp\" ", " \"texture alpha\" \"a\""), 8U);
  // What is defined later may have a texture.
  EXPECT_EQ(
      vertices("NamedMaterial \"m\" ", " MakeNamedMaterial \"m\" \"string type\" \"diffuse\""), 8U);
}

TEST(PbrtShapesTest, OtherFacesOfFilesAreLeftOutWithAWarning) {
  EXPECT_THAT(
      SaidOf(ParseShapes(kPly, {{"q.ply", QuadPly(0, "", "", "5 0 1 2 3 1\n")}})),
      HasSubstr("warning: \"filename\" of Shape \"plymesh\" has 1 face with neither three nor"));
}

TEST(PbrtShapesTest, ManyCurvedQuadranglesAreFlatTriangles) {
  SceneLimits limits;
  limits.max_shape_bytes = 2048;
  const ParsedScene parsed =
      ParsePbrt(std::string("Camera \"perspective\" WorldBegin LightSource \"infinite\" ") + kPly,
                {{"q.ply", QuadPly(1)}}, limits);
  EXPECT_THAT(SaidOf(parsed), HasSubstr("each is two flat triangles"));
  EXPECT_EQ(parsed.scene.TriangleCount(), 2U);
}

TEST(PbrtShapesTest, EdgeLengthsHaveTwoNames) {
  const std::string uv = "property float u\nproperty float v\n";
  const auto triangles = [&](const std::string& edge) {
    return ParseShapes(kPly + std::string(" \"float displacement\" 0.1 \"float ") + edge + "\" 0.3",
                       {{"q.ply", QuadPly(0, uv, "0 0")}})
        .scene.TriangleCount();
  };
  EXPECT_GT(triangles("edgelength"), 2U);
  EXPECT_EQ(triangles("displacement.edgelength"), triangles("edgelength"));
}

TEST(PbrtShapesTest, ArraysOfAWrongLengthAreLeftOutWithAWarning) {
  const std::string mesh = "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] ";
  const std::string patch = "Shape \"bilinearmesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0 1 1 0] ";
  for (const std::string& shape : {mesh, patch}) {
    const ParsedScene parsed =
        ParseShapes(shape + "\"normal N\" [1 0 0 1 0 0] \"point2 uv\" [5 5] \"integer indices\" " +
                    (shape == mesh ? "[0 1 2 0 1]" : "[0 1 2 3 0]"));
    EXPECT_TRUE(parsed.ok()) << parsed.ToStatus();
    const std::string said = SaidOf(parsed);
    EXPECT_THAT(said, HasSubstr("warning: \"N\" of Shape"));
    EXPECT_THAT(said, HasSubstr("warning: \"uv\" of Shape"));
    EXPECT_THAT(said, HasSubstr("warning: \"indices\" of Shape"));
    EXPECT_EQ(parsed.scene.meshes.at(0).positions.size(), shape == mesh ? 3U : 4U);
  }
  EXPECT_THAT(SaidOfShapes(mesh + "\"integer indices\" [0 1]"), HasSubstr("needs vertex indices"));
}

TEST(PbrtShapesTest, PowerOfAWholeIsSaidOfWhatPbrtHasPartsOf) {
  const std::string light = "AreaLightSource \"diffuse\" \"float power\" 1 ";
  const std::string patches = "Shape \"bilinearmesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0 1 1 0] ";
  const std::string whole = "gets its power as a whole";
  EXPECT_THAT(SaidOfShapes(light + patches), Not(HasSubstr(whole)));
  EXPECT_THAT(SaidOfShapes(light + "Shape \"cylinder\""), Not(HasSubstr(whole)));
  EXPECT_THAT(SaidOfShapes(light + patches + "\"integer indices\" [0 1 2 3 3 2 1 0]"),
              HasSubstr(whole + "; pbrt-v4 gives it to each patch"));
  EXPECT_THAT(SaidOfShapes(light + "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] "
                                   "\"integer indices\" [0 1 2 2 1 0]"),
              HasSubstr(whole + "; pbrt-v4 gives it to each triangle"));
}

TEST(PbrtShapesTest, CurvesOfUnknownTypesAreCylinders) {
  const ParsedScene parsed = ParseShapes(
      "Shape \"curve\" \"point3 P\" [0 0 0 1 0 0 2 0 0 3 0 0] \"string type\" \"tube\"");
  EXPECT_TRUE(parsed.ok()) << parsed.ToStatus();
  EXPECT_FALSE(parsed.scene.curve_pieces.empty());
  EXPECT_THAT(SaidOf(parsed), HasSubstr("warning: \"type\" of Shape \"curve\" must be flat"));
}

TEST(PbrtShapesTest, SubdivisionSurfaces) {
  const std::string octahedron =
      "Shape \"loopsubdiv\" \"point3 P\" [1 0 0 -1 0 0 0 1 0 0 -1 0 0 0 1 0 0 -1] \"integer "
      "indices\" [0 2 4 2 1 4 1 3 4 3 0 4 2 0 5 1 2 5 3 1 5 0 3 5]";
  const Scene scene = ReadShapes(octahedron);
  EXPECT_EQ(scene.TriangleCount(), 8U * 64);
  // pbrt-v4's normals are on the other side of the cross products.
  ExpectOutward(scene.meshes.at(0), {0, 0, 0}, -1);
  EXPECT_EQ(ReadShapes(octahedron + " \"integer levels\" 1").TriangleCount(), 32U);
  EXPECT_THAT(SaidOfShapes(octahedron + " \"integer levels\" 14"),
              HasSubstr("more than the memory for shapes holds"));
}

// A short text may ask for a lot: what does not fit is refused before it is made.
TEST(PbrtShapesTest, WhatTakesTooMuchMemoryIsRefusedFirst) {
  SceneLimits limits;
  limits.max_shape_bytes = 2048;
  const auto said = [&](const std::string& shape) {
    MemoryFiles files({{"s.pbrt", "Camera \"perspective\" WorldBegin " + shape}});
    return std::string(ReadScene(files, "s.pbrt", limits).ToStatus().message());
  };
  EXPECT_THAT(said("Shape \"loopsubdiv\" \"point3 P\" [0 0 0 1 0 0 0 1 0]"),
              HasSubstr("splits it into 64 triangles"));
  EXPECT_THAT(said("Shape \"bilinearmesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0 1 1 1]"),
              HasSubstr("more than the memory for shapes holds"));
  EXPECT_THAT(said("Shape \"curve\" \"point3 P\" [0 0 0 1 0 0 2 0 0 3 0 0]"),
              HasSubstr("more than the memory for shapes holds"));
}

// A straight curve of even width is a cylinder with round ends.
TEST(PbrtShapesTest, StraightCurvesAreOnePiece) {
  const Scene scene = ReadShapes(
      "Scale 2 2 2 Shape \"curve\" \"point3 P\" [0 0 0 1 0 0 2 0 0 3 0 0] \"float width\" 0.5 "
      "\"string type\" \"cylinder\"");
  ASSERT_EQ(scene.curve_pieces.size(), 1U);
  const CurvePiece& piece = scene.curve_pieces[0];
  EXPECT_EQ(piece.to, Vec3(6, 0, 0));
  EXPECT_FLOAT_EQ(piece.from_radius, 0.5F);
  EXPECT_NEAR(piece.Area<double>(), 2 * kPi64 * 0.5 * 6, 1e-6);
  // Nothing is gathered on it; on shapes of the same material that are not thin it is.
  const Scene both =
      ReadShapes("Shape \"sphere\" Shape \"curve\" \"point3 P\" [0 0 0 1 0 0 2 0 0 3 0 0]");
  EXPECT_TRUE(
      Gathers(both.materials.at(static_cast<std::size_t>(both.spheres[0].traits.material))));
  const Material& on_curve =
      both.materials.at(static_cast<std::size_t>(both.curve_pieces[0].traits.material));
  EXPECT_FALSE(Gathers(on_curve));
  EXPECT_FALSE(GathersCaustics(on_curve));
}

// A circle's quarter, by the usual cubic (its radius is off by 3e-4), in both degrees and bases.
TEST(PbrtShapesTest, CurvesStayNearTheirAxis) {
  const Scene cubic = ReadShapes(
      "Shape \"curve\" \"point3 P\" [1 0 0 1 0.5522847 0 0.5522847 1 0 0 1 0] \"float width0\" "
      "0.02 "
      "\"float width1\" 0.04");
  ASSERT_GT(cubic.curve_pieces.size(), 8U);
  for (std::size_t i = 0; i < cubic.curve_pieces.size(); ++i) {
    const CurvePiece& piece = cubic.curve_pieces[i];
    EXPECT_NEAR(Length(piece.from), 1, 4e-4);
    // The middle of a chord leaves the curve by no more than a twentieth of the radius.
    EXPECT_GT(Length(piece.center), 1 - 4e-4F - 0.05F * 0.02F);
    if (i > 0) {
      EXPECT_EQ(piece.from, cubic.curve_pieces[i - 1].to);
      EXPECT_EQ(piece.from_radius, cubic.curve_pieces[i - 1].to_radius);
    }
  }
  EXPECT_FLOAT_EQ(cubic.curve_pieces.front().from_radius, 0.01F);
  EXPECT_FLOAT_EQ(cubic.curve_pieces.back().to_radius, 0.02F);
  EXPECT_EQ(cubic.curve_pieces.back().to_u, 1);
  // A quadratic through its elevated form: its middle is a quarter of the ends and half the
  // control.
  const Scene quadratic = ReadShapes(
      "Shape \"curve\" \"integer degree\" 2 \"point3 P\" [0 0 0 1 2 0 2 0 0] \"float width\" 0.01");
  double nearest = 1;
  for (const CurvePiece& piece : quadratic.curve_pieces)
    nearest = std::min(nearest, std::abs(piece.SignedDistance({1, 1, 0})));
  EXPECT_LT(nearest, 0.006);
  // A B-spline of points on a line runs between its inner points, evenly.
  const Scene spline = ReadShapes(
      "Shape \"curve\" \"string basis\" \"bspline\" \"point3 P\" [0 0 0 1 0 0 2 0 0 3 0 0 4 0 0] "
      "\"float width\" 0.1");
  EXPECT_NEAR(spline.curve_pieces.front().from.x, 1, 1e-6);
  EXPECT_NEAR(spline.curve_pieces.back().to.x, 3, 1e-6);
  const Scene quadratic_spline = ReadShapes(
      "Shape \"curve\" \"string basis\" \"bspline\" \"integer degree\" 2 \"point3 P\" [0 0 0 1 0 0 "
      "2 0 0] \"float width\" 0.1");
  EXPECT_NEAR(quadratic_spline.curve_pieces.front().from.x, 0.5, 1e-6);
  EXPECT_NEAR(quadratic_spline.curve_pieces.back().to.x, 1.5, 1e-6);
}

TEST(PbrtShapesTest, RibbonsAreMeshes) {
  const Scene scene = ReadShapes(
      "Shape \"curve\" \"string type\" \"ribbon\" \"point3 P\" [0 0 0 1 0 0 2 0 0 3 0 0] \"float "
      "width0\" 0.5 \"float width1\" 0.1 \"normal N\" [0 0 1 0 0 1]");
  ASSERT_EQ(scene.meshes.size(), 1U);
  EXPECT_NEAR(AreaOf(scene.meshes[0]), 3 * 0.3, 1e-5);
  for (const Vec3 normal : scene.meshes[0].normals)
    EXPECT_LT(Length(normal - Vec3{0, 0, 1}), 1e-6F);
  EXPECT_THAT(
      SaidOfShapes("Shape \"curve\" \"string type\" \"ribbon\" \"point3 P\" [0 0 0 1 0 0 2 0 0 3 0 "
                   "0]"),
      HasSubstr("a normal for each end of a segment"));
  EXPECT_THAT(SaidOfShapes("Shape \"curve\" \"point3 P\" [0 0 0 1 0 0 2 0 0]"),
              HasSubstr("must have 3 n + 1 points"));
  EXPECT_THAT(
      SaidOfShapes("AreaLightSource \"diffuse\" Shape \"curve\" \"point3 P\" [0 0 0 1 0 0 2 0 0 3 "
                   "0 0]"),
      HasSubstr("cannot emit light"));
}

TEST(PbrtShapesTest, WhatATransformFlattensIsLeftOut) {
  const std::string quad =
      "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 1 1 0 0 1 0] \"integer indices\" [0 1 2 0 "
      "2 "
      "3]\n";
  const std::string world = quad + "ObjectBegin \"o\" " + quad +
                            "ObjectEnd Scale 1 0 1 Shape \"sphere\"\n" + quad +
                            "ObjectInstance \"o\"";
  EXPECT_EQ(ReadShapes(world).TriangleCount(), 2U);
  const std::string said = SaidOfShapes(world);
  EXPECT_THAT(said, HasSubstr("Shape \"sphere\" is flattened by its transform and left out"));
  EXPECT_THAT(said, HasSubstr("triangles have no area and are dropped"));
  EXPECT_THAT(said, HasSubstr("an instance is flattened"));
  // What lies in the plane stays.
  EXPECT_EQ(ReadShapes("Scale 1 1 0 " + quad).TriangleCount(), 2U);
}

TEST(PbrtShapesTest, AlphaIsAShareOfRaysAndZeroIsNothing) {
  const Scene scene =
      ReadShapes("Shape \"sphere\" \"float alpha\" 0.25 Shape \"disk\" \"float alpha\" 0");
  EXPECT_EQ(scene.spheres.at(0).traits.alpha, 0.25F);
  EXPECT_TRUE(scene.disks.empty());
  const Scene light = ReadShapes("AreaLightSource \"diffuse\" Shape \"disk\" \"float alpha\" 0");
  EXPECT_EQ(light.disks.size(), 1U);
}

TEST(PbrtShapesTest, ObjectsThatWouldTakeMuchMemoryAreShared) {
  // 8192 triangles: 128 copies are as many as are written out.
  const std::string object =
      "ObjectBegin \"o\" Shape \"sphere\" Shape \"loopsubdiv\" \"integer levels\" 5 \"point3 P\" "
      "[1 "
      "0 0 -1 0 0 0 1 0 0 -1 0 0 0 1 0 0 -1] \"integer indices\" [0 2 4 2 1 4 1 3 4 3 0 4 2 0 5 1 "
      "2 "
      "5 3 1 5 0 3 5] ObjectEnd\n";
  std::string copies;
  for (int i = 0; i < 128; ++i)
    copies += "Translate 5 0 0 ObjectInstance \"o\"\n";
  const Scene written_out = ReadShapes(object + copies);
  EXPECT_TRUE(written_out.instances.empty());
  EXPECT_EQ(written_out.meshes.size(), 128U);
  const std::string lights =
      "AttributeBegin AreaLightSource \"diffuse\" Shape \"disk\" AttributeEnd ";
  const std::string mesh_light =
      "AttributeBegin AreaLightSource \"diffuse\" Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 "
      "0 1 0] AttributeEnd\n";
  const Scene shared =
      ReadShapes(object + lights + copies + mesh_light + "Scale 1 2 1 ObjectInstance \"o\"");
  ASSERT_EQ(shared.objects.size(), 1U);
  EXPECT_EQ(shared.instances.size(), 129U);
  EXPECT_EQ(shared.object_meshes.size(), 1U);
  // The light, and the stretched sphere; other spheres are written out.
  ASSERT_EQ(shared.meshes.size(), 2U);
  EXPECT_EQ(shared.meshes[0].traits.area_light, 1);
  EXPECT_EQ(shared.spheres.size(), 128U);
  EXPECT_EQ(shared.TriangleCount(), 8192 + 1 + shared.meshes[1].indices.size() / 3);
}

}  // namespace
}  // namespace lucerna
