// One mesh reads the same from ASCII, little-endian and big-endian PLY, gzipped or not; and bytes
// that are not a sound mesh are refused with a reason, before memory is taken for them.
#include "render/formats/ply_file.h"

#include <bit>
#include <cstdint>
#include <string>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

#include "tests/support/gzip_text.h"

namespace lucerna {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr char kColumns[] =
    "element vertex 4\n"
    "property float x\nproperty float y\nproperty float z\n"
    "property float nx\nproperty float ny\nproperty float nz\nproperty uchar red\n"
    "element face 2\nproperty list uchar int vertex_indices\nproperty short group\n"
    "end_header\n";

// A square with a quadrangle and a triangle on it.
std::string AsciiSquare() {
  return std::string("ply\nformat ascii 1.0\ncomment made by hand\n") + kColumns +
         "0 0 0 0 0 1 255\n1 0 0 0 0 1 255\n1 1 0 0 0 1 255\n0 1 0.5 0 0 1 255\n"
         "4 0 1 2 3 7\n3 0 1 3 -2\n";
}

template <typename T>
void Put(std::string& out, T value, bool big_endian) {
  const auto raw = std::bit_cast<std::array<char, sizeof(T)>>(value);
  if (big_endian) {
    out.append(raw.rbegin(), raw.rend());
  } else {
    out.append(raw.begin(), raw.end());
  }
}

std::string BinarySquare(bool big_endian) {
  std::string out = std::string("ply\nformat binary_") + (big_endian ? "big" : "little") +
                    "_endian 1.0\n" + kColumns;
  const float positions[4][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0.5F}};
  for (const auto& position : positions) {
    for (const float value : position)
      Put(out, value, big_endian);
    for (const float value : {0.0F, 0.0F, 1.0F})
      Put(out, value, big_endian);
    out += '\xFF';
  }
  out += '\x04';
  for (const std::int32_t index : {0, 1, 2, 3})
    Put(out, index, big_endian);
  Put(out, std::int16_t{7}, big_endian);
  out += '\x03';
  for (const std::int32_t index : {0, 1, 3})
    Put(out, index, big_endian);
  Put(out, std::int16_t{-2}, big_endian);
  return out;
}

std::string Why(const std::string& bytes) {
  const StatusOr<TriangleMesh> mesh = ParsePly(bytes);
  return mesh.ok() ? "" : std::string(mesh.status().message());
}

void ExpectSquare(const std::string& bytes) {
  const StatusOr<TriangleMesh> mesh = ParsePly(bytes);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_THAT(mesh->positions,
              ElementsAre(Vec3{0, 0, 0}, Vec3{1, 0, 0}, Vec3{1, 1, 0}, Vec3{0, 1, 0.5F}));
  EXPECT_THAT(mesh->normals,
              ElementsAre(Vec3{0, 0, 1}, Vec3{0, 0, 1}, Vec3{0, 0, 1}, Vec3{0, 0, 1}));
  // The quadrangle is split along 0-2.
  EXPECT_THAT(mesh->indices, ElementsAre(0, 1, 2, 0, 2, 3, 0, 1, 3));
}

TEST(PlyFileTest, ReadsOneMeshFromEveryFormat) {
  ExpectSquare(AsciiSquare());
  ExpectSquare(BinarySquare(false));
  ExpectSquare(BinarySquare(true));
  ExpectSquare(Gzip(AsciiSquare()));
  ExpectSquare(Gzip(BinarySquare(true)));
}

TEST(PlyFileTest, SkipsFacesThatAreNoTrianglesOrQuadrangles) {
  PlyFaces faces;
  const StatusOr<TriangleMesh> mesh = ParsePly(
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
      "property float z\nelement face 6\nproperty list uchar int vertex_index\nproperty int id\n"
      "end_header\n0 0 0 1 0 0 1 1 0 0 1 0\n"
      "0 7\n2 0 1 7\n3 0 1 2 7\n5 0 1 2 3 99 7\n4 0 1 2 3 7\n3 1 1 2 7\n",
      &faces);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_THAT(mesh->indices, ElementsAre(0, 1, 2, 0, 1, 2, 0, 2, 3, 1, 1, 2));
  EXPECT_THAT(faces.quads, ElementsAre(1));
  EXPECT_EQ(faces.skipped, 3U);
}

TEST(PlyFileTest, ReadsTextureCoordinatesByAllTheirNames) {
  const auto uvs = [](const std::string& names) {
    return ParsePly("ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\n" + names +
                    "property float y\nproperty float z\nelement face 1\n"
                    "property list uchar int vertex_indices\nend_header\n"
                    "0 0.5 0.25 0 0\n1 1e99 2 0 0\n0 3 4 1 0\n3 0 1 2\n")
        .value()
        .uvs;
  };
  const auto expected = ElementsAre(Vec2{0.5F, 0.25F}, Vec2{0, 0}, Vec2{3, 4});
  EXPECT_THAT(uvs("property float u\nproperty float v\n"), expected);
  EXPECT_THAT(uvs("property float s\nproperty float t\n"), expected);
  EXPECT_THAT(uvs("property float texture_u\nproperty float texture_v\n"), expected);
  EXPECT_THAT(uvs("property float texture_s\nproperty float texture_t\n"), expected);
  // One alone is none.
  EXPECT_TRUE(uvs("property float s\nproperty float v\n").empty());
}

TEST(PlyFileTest, RefusesACountThatTheFileCannotHold) {
  // Taken at its word, this file would need 48 GB.
  EXPECT_THAT(Why("ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\n"
                  "property float x\nproperty float y\nproperty float z\n"
                  "element face 0\nproperty list uchar int vertex_indices\nend_header\n"),
              HasSubstr("4000000000 times vertex, more than its"));
  EXPECT_THAT(Why("ply\nformat ascii 1.0\nelement vertex 18446744073709551615\n"
                  "property float x\nproperty float y\nproperty float z\nend_header\n0 0 0\n"),
              HasSubstr("more than its"));
}

TEST(PlyFileTest, SaysWhereATruncatedFileEnds) {
  const std::string whole = BinarySquare(false);
  EXPECT_THAT(Why(whole.substr(0, whole.size() - 1)), HasSubstr("it ends within face 1 of 2"));
  EXPECT_THAT(Why(Gzip(whole).substr(0, 60)), HasSubstr("gzip stream is truncated"));
}

TEST(PlyFileTest, RefusesIndicesPositionsAndFacesThatAreNotSound) {
  const auto with_body = [](const std::string& body) {
    return "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
           "property float z\nelement face 1\nproperty list uchar int vertex_index\nend_header\n" +
           body;
  };
  EXPECT_EQ(Why(with_body("0 0 0 1 0 0 0 1 0 3 0 1 2\n")), "");
  EXPECT_THAT(Why(with_body("0 0 0 1 0 0 0 1 0 3 0 1 3\n")), HasSubstr("refers to vertex 3 of 3"));
  EXPECT_THAT(Why(with_body("0 0 0 1 0 0 0 1 0 3 0 1 -1\n")), HasSubstr("refers to vertex -1"));
  EXPECT_THAT(Why(with_body("0 0 0 1 nan 0 0 1 0 3 0 1 2\n")),
              HasSubstr("position of vertex 1 is not finite"));
  EXPECT_THAT(Why(with_body("0 0 0 1 1e39 0 0 1 0 3 0 1 2\n")),
              HasSubstr("position of vertex 1 is not finite"));
  EXPECT_THAT(Why(with_body("0 0 0 1 0 0 0 1 0 -3 0 1 2\n")), HasSubstr("has -3 corners"));
  EXPECT_THAT(Why(with_body("0 0 0 1 0 0 0 1 0 3.5 0 1 2\n")), HasSubstr("has 3.5 corners"));
  EXPECT_THAT(Why(with_body("0 0 0 1 0 0 0 1 0 5 0 1 2 0\n")), HasSubstr("it ends within face 0"));
  EXPECT_THAT(Why(with_body("0 0 0 1 0 0 0 1 0 1e300 0 1 2 0\n")), HasSubstr("it ends within"));
  EXPECT_THAT(Why(with_body("0 0 0 1 zero 0 0 1 0 3 0 1 2\n")),
              HasSubstr("there is no number in vertex 1"));
}

TEST(PlyFileTest, RefusesAFileThatUnpacksBeyondBound) {
  // A megabyte of spaces packs about a thousand times.
  EXPECT_THAT(Why(Gzip(AsciiSquare() + std::string(1 << 20, ' '))),
              HasSubstr("more than 200 times"));
}

TEST(PlyFileTest, RefusesHeadersThatMakeNoSense) {
  EXPECT_THAT(Why(""), HasSubstr("no end_header"));
  EXPECT_THAT(Why("solid cube\n"), HasSubstr("does not begin with"));
  EXPECT_THAT(Why("ply\nend_header\n"), HasSubstr("no format line"));
  EXPECT_THAT(Why("ply\nformat ascii 1.0\nproperty float x\nend_header\n"),
              HasSubstr("header line 3: a property before any element"));
  EXPECT_THAT(Why("ply\nformat ascii 1.0\nelement vertex 1\nproperty quad x\nend_header\n"),
              HasSubstr("header line 4: unknown property type"));
  EXPECT_THAT(Why("ply\nformat ascii 1.0\nend_header\n"), HasSubstr("no vertices or no faces"));
}

}  // namespace
}  // namespace lucerna
