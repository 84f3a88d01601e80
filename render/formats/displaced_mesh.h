// Meshes whose vertices a texture moves along their normals, as pbrt-v4's "plymesh" has them.
#pragma once

#include <cstddef>
#include <functional>

#include "render/base/status.h"
#include "render/math/transform.h"
#include "render/scene/scene.h"

namespace lucerna {

// The height of a vertex, in the unit of the mesh's space.
using HeightOf = std::function<double(Vec3 position, Vec2 uv, Vec3 normal)>;

// Halves the longest edge of every triangle until none is longer than `edge_length` in the world,
// so that two triangles that share an edge share what becomes of it, moves each vertex along its
// normal by its height, and gives it a new normal: the mean of the triangles around it. Where the
// mesh has no normals, they are made so before it is split, too.
//
// Requires indices in range, texture coordinates, finite positions, and edge_length > 0. Errors:
// RESOURCE_EXHAUSTED with more than `most_triangles`; INVALID_ARGUMENT when a vertex is moved out
// of the finite numbers.
[[nodiscard]] Status Displace(double edge_length, const Transform& to_world,
                              std::size_t most_triangles, const HeightOf& height,
                              TriangleMesh& mesh);

}  // namespace lucerna
