// The readers of each kind of analytic shape, defined in shape_NAME.cc, and what they share.
//
// Read  Adds a shape to `shapes`, or reports what is wrong. A part of the shape, or one that its
//       transform stretches, becomes a mesh.
// Mesh  The same shape as triangles, in the same space; of shapes that are not thin.
#pragma once

#include <array>
#include <string_view>
#include <vector>

#include "render/base/status.h"
#include "render/formats/asset_reader.h"
#include "render/formats/pbrt/parameter_list.h"
#include "render/formats/pbrt/shapes.h"
#include "render/math/transform.h"
#include "render/scene/scene.h"
#include "render/scene/shape_moves.h"

namespace lucerna {

// Types that a parameter of points, or of normals, may have.
inline constexpr std::array<std::string_view, 2> kPointTypes = {"point3", "point"};
inline constexpr std::array<std::string_view, 2> kNormalTypes = {"normal", "normal3"};

// What the readers of all kinds of shape are given.
struct ShapeInput {
  ParameterList& parameters;
  const ShapePlacement& placement;
  AssetReader& assets;
  const ShapeTextures& textures;
};

// So many triangles may a shape be split into: while it is, neighbours are looked up in tables.
[[nodiscard]] std::size_t MostTriangles(const AssetReader& assets);

#define LUCERNA_DECLARE(Name, list, name)                     \
  void Read##Name(const ShapeInput& input, ShapeSet& shapes); \
  [[nodiscard]] TriangleMesh Mesh##Name(const Name& shape);
LUCERNA_ANALYTIC_SHAPES(LUCERNA_DECLARE)
#undef LUCERNA_DECLARE

// Shapes that are always meshes.
void ReadCylinder(const ShapeInput& input, ShapeSet& shapes);
void ReadBilinearMesh(const ShapeInput& input, ShapeSet& shapes);
void ReadLoopSubdivision(const ShapeInput& input, ShapeSet& shapes);

// Puts a mesh with sound indices, in the shape's own space, where `placement` says.
void PlaceMesh(TriangleMesh mesh, ParameterList& parameters, const ShapePlacement& placement,
               ShapeSet& shapes);

// Positions "P" and their "indices", `corners` a face, which may be absent for one face. As in
// pbrt-v4 those that make no whole face are left out, with a warning. False, and reported, when
// they are wrong.
[[nodiscard]] bool ReadPositions(ParameterList& parameters, std::uint32_t corners,
                                 TriangleMesh& mesh);
// The optional "N", one for each position. As in pbrt-v4 all are left out, with a warning, when
// their number is wrong.
void ReadNormals(ParameterList& parameters, TriangleMesh& mesh);
// The same of the optional "uv" or "st".
void ReadUvs(ParameterList& parameters, TriangleMesh& mesh);

// True, with a note, when the transform leaves nothing of a shape with a volume, or of its extent.
[[nodiscard]] bool IsFlattened(ParameterList& parameters, const Transform& to_world);

// "phimax" in radians, in (0, 2 pi].
[[nodiscard]] double ReadPhiMax(ParameterList& parameters);
// As pbrt-v4 has a sphere, disk or cylinder face: turned over by a mirroring transform.
[[nodiscard]] ShapePlacement PlacementOfQuadric(const ShapePlacement& placement);

// Moves a mesh around the origin to `center`, its axes to `axes`, and winds it by its normals,
// which are turned over for `is_reversed`.
void PutOnAxes(Vec3 center, const ShapeAxes& axes, bool is_reversed, TriangleMesh& mesh);

}  // namespace lucerna
