// Reads Shape directives.
//
// Each function that reads a directive reads the parameters that it knows, reports what is wrong,
// and does its best to go on; after an error its outcome is never rendered.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "render/base/status.h"
#include "render/formats/asset_reader.h"
#include "render/formats/pbrt/parameter_list.h"
#include "render/formats/pbrt/textures.h"
#include "render/formats/ply_file.h"
#include "render/math/transform.h"
#include "render/scene/scene.h"
#include "render/scene/shape_moves.h"

namespace lucerna {

// Shapes in world space, or in the space of an object that is instanced later. Their traits are
// those of the Shape directive that made them.
struct ShapeSet {
  std::vector<TriangleMesh> meshes;
#define LUCERNA_MEMBER(Name, list, name) std::vector<Name> list;
  LUCERNA_ANALYTIC_SHAPES(LUCERNA_MEMBER)
#undef LUCERNA_MEMBER

  // Shapes of pbrt-v4 that these stand for, where they are triangles, patches or faces of a file.
  std::uint64_t parts = 1;

  // What it costs to keep: triangles, every other shape as one, and vertices that no triangle
  // needs as a third of one.
  [[nodiscard]] std::uint64_t Cost() const;
  // In memory.
  [[nodiscard]] std::uint64_t SizeBytes() const;
  // [m²], of one side.
  [[nodiscard]] double Area() const;
};

struct ShapePlacement {
  Transform to_world;
  bool reverse_orientation = false;
  ShapeTraits traits;
  bool emits = false;  // also where the light is made after the shape
  // What is seen may depend on texture coordinates, besides by alpha.
  bool may_show_uv = true;
  // Of shapes that move: at the end the transform scales all axes alike.
  bool stays_similar = true;
};

// What float textures are called, and all textures so far.
struct ShapeTextures {
  const TextureNames& numbers;
  std::span<const Texture> all;
};

[[nodiscard]] ShapeSet ReadShapes(std::string_view type, ParameterList& parameters,
                                  const ShapePlacement& placement, const ShapeTextures& textures,
                                  AssetReader& assets);

// The same of a mesh that was read otherwise, with sound indices, in the shape's own space.
[[nodiscard]] ShapeSet PlaceMadeMesh(TriangleMesh mesh, ParameterList& parameters,
                                     const ShapePlacement& placement, const TextureNames& numbers);

// Warns of faces of a PLY file that were left out.
void WarnOfSkipped(const PlyFaces& faces, ParameterList& parameters);

// The shapes of an object where an instance of it stands; an ellipsoid, which has no kind of its
// own, as a mesh, and where `stays_similar` is false what may become one. Errors: INVALID_ARGUMENT
// when the transform moves a position out of the finite numbers.
[[nodiscard]] StatusOr<ShapeSet> Instantiate(const ShapeSet& object, const Transform& to_world,
                                             bool stays_similar);

}  // namespace lucerna
