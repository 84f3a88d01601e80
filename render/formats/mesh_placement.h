// How a mesh gets from its own space into the world, and which way its triangles face there.
#pragma once

#include <cstddef>
#include <cstdint>

#include "render/math/double3.h"
#include "render/math/transform.h"
#include "render/scene/scene.h"

namespace lucerna {

// The area of what the unit of the scene may yet make large enough (scene_unit.h).
inline constexpr double kLeastArea = 1e-90;

// Copies of one object are written out as meshes while all that are have no more triangles
// together, some 200 MB with their trees (docs/decisions/instances.md).
inline constexpr std::uint64_t kMaxWrittenOut = std::uint64_t{1} << 20;
// Of an instance, in the scene and in Embree's tree, measured.
inline constexpr std::uint64_t kInstanceBytes = 1024;
// Shapes have numbers of 32 bits.
inline constexpr std::uint64_t kMaxInstanced = std::uint64_t{4'000'000'000};

// Turns all triangles over.
void SwapWinding(TriangleMesh& mesh);

// Winds the triangles so that their outward sides are those of the normals; without normals
// `turned_over` decides.
void WindByNormals(TriangleMesh& mesh, bool turned_over);

// Along the outward normal, twice as long as the triangle's area.
[[nodiscard]] Double3 EdgeCross(const TriangleMesh& mesh, std::size_t triangle);

// The size in memory.
[[nodiscard]] std::uint64_t SizeBytes(const TriangleMesh& mesh);

}  // namespace lucerna
