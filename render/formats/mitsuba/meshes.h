// Meshes of Mitsuba scenes.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "render/base/status.h"
#include "render/scene/scene.h"

namespace lucerna {

// All groups of a Wavefront OBJ file as one mesh; faces of more corners are split. Materials are
// ignored. Texture coordinates are as in the file, and 0 where only other faces have some. What
// should be a number and is none counts as 0.
// Errors: INVALID_ARGUMENT with what is wrong.
[[nodiscard]] StatusOr<TriangleMesh> ParseObj(std::string_view bytes);
// The same in parts: faces of the materials of these names, in their order, after all other faces.
// Parts may be empty; there is one more than names.
[[nodiscard]] StatusOr<std::vector<TriangleMesh>> ParseObjParts(
    std::string_view bytes, std::span<const std::string> materials);
// The names of the materials that the faces of an OBJ file have, each once.
[[nodiscard]] std::vector<std::string> MaterialsOfObj(std::string_view bytes);

// The `index`th mesh of a file in Mitsuba's own "serialized" format.
// Errors: INVALID_ARGUMENT with what is wrong, RESOURCE_EXHAUSTED for more than `max_size_bytes`.
[[nodiscard]] StatusOr<TriangleMesh> ParseSerialized(std::string_view bytes, std::uint64_t index,
                                                     std::uint64_t max_size_bytes);

// [-1, 1]² on the plane z = 0; outward is +z.
[[nodiscard]] TriangleMesh UnitSquare();
// [-1, 1]³.
[[nodiscard]] TriangleMesh UnitCube();

// Normals at the vertices from those of the triangles around them, each weighed by its angle
// there (Thürmer & Wüthrich 1998, "Computing Vertex Normals from Polygonal Facets").
void ComputeNormals(TriangleMesh& mesh);

}  // namespace lucerna
