// How fast does the curvature of a mesh change along it?
//
// At vertices spread evenly over the mesh, about one in four, the normals of the surroundings are
// fitted with a polynomial of third degree over the tangent plane. Its second and third derivatives
// are the first and second of the curvature by arc length: exactly so where the plane touches,
// whatever the slope elsewhere, and 0 for a sphere and a cylinder.
//
// Normals are rounded, and positions: what that makes of a third difference grows with the inverse
// cube of the distance of vertices. So the same is done again on coarser and coarser selections of
// the vertices, and a place takes the finest where the change stands clear of the noise, which
// is measured by what the fits leave over. That only as long as what they leave over may be the
// rounding of normals written with six digits: anything rougher is detail that light sees.
//
// Where a mesh has eight sides to a wave or more, the second derivative is at least 0.85 of the
// true one for gentle waves; for six about 0.7. Work and memory are linear: every selection is
// about a quarter of the one before.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "render/math/vector.h"
#include "render/scene/mesh_edges.h"

namespace lucerna {

// The largest over the surroundings of a vertex, some sides wide, of the derivatives by arc length
// of the normal curvature along any direction, in any direction. Infinity: unknown.
struct CurvatureChange {
  double first = 0;   // [1/unit²]
  double second = 0;  // [1/unit³]
  // Whether there is such a change, beyond what noise explains.
  bool first_is_clear = false, second_is_clear = false;
};

// For each vertex [positions]; vertices on no side, or without a normal, are unknown. `corners`
// [triangles × 3] are welded with their normals, `sides` are theirs by edge: nothing is compared
// across a crease. The result does not depend on how the vertices are numbered.
[[nodiscard]] std::vector<CurvatureChange> CurvatureChanges(std::span<const Vec3> positions,
                                                            std::span<const Vec3> normals,
                                                            std::span<const std::uint32_t> corners,
                                                            std::span<const TriangleSide> sides);

}  // namespace lucerna
