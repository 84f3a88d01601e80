// Reads meshes from PLY files.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "render/base/status.h"
#include "render/math/vector.h"
#include "render/scene/scene.h"

namespace lucerna {

struct PlyFaces {
  std::vector<std::size_t> quads;  // of each the first of its two triangles, in order
  std::uint64_t skipped = 0;       // had neither three nor four corners
};

// Reads ASCII, binary little-endian and binary big-endian PLY, gzipped or not: vertices with
// x y z and, when all are there, nx ny nz and texture coordinates (u v or s t); faces as lists of
// three or four indices (quads are split along their 0-2 diagonal). Faces with other numbers of
// corners, other elements and properties are skipped.
//
// All come as the file has them, but for normals and texture coordinates that are not finite,
// which become zero; the caller transforms positions and normals. Traits are left at their
// defaults. Errors: INVALID_ARGUMENT with what is wrong and, where there is one, the vertex, face
// or byte: truncated data, counts that the file's size cannot hold (checked before anything is
// allocated), an index out of range, a position that is not finite, a decompressed size above 200
// times the compressed one. `faces` (may be null) becomes what the mesh does not say of them.
[[nodiscard]] StatusOr<TriangleMesh> ParsePly(std::string_view bytes, PlyFaces* faces = nullptr);

// The vertices of a PLY file that need no faces, segments, and what its comments say.
struct PlyPoints {
  std::vector<Vec3> positions;
  std::vector<Vec3> normals;    // [positions], as the file has them
  std::vector<float> spacings;  // [positions] or empty: the property `spacing`, as the file has it
  std::vector<std::array<Vec3, 2>> segments;  // the element `segment`: ax ay az bx by bz, finite
  // The element `bucket`, finite: corners ax ay az bx by bz cx cy cz, and the ball that they lie
  // on, ox oy oz r.
  std::vector<SensorBucket> buckets;
  std::vector<std::string> comments;  // without the word "comment"
};

// Errors: those of ParsePly but for faces, which are skipped, and INVALID_ARGUMENT without normals.
[[nodiscard]] StatusOr<PlyPoints> ParsePlyPoints(std::string_view bytes);

}  // namespace lucerna
