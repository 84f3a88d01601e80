// Which edges of a mesh are the crests of rounded borders?
//
// The top of a table may have a rounded border of a few narrow strips, each of which turns by less
// than would make an edge (geometry/feature_edges.h). A disc on the top that is wider than the
// border reaches beyond it, where nothing is. It must be cut where the surface has turned from the
// top by about 45 degrees, as beside an edge: photons beyond that are not the top's.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "render/math/vector.h"
#include "render/scene/mesh_edges.h"

namespace lucerna {

// The edges [vertices of either end, the lower first], each once, at which a mesh has turned from a
// face by kSameSurfaceCosine and both ends of which are nearer to a border of that face than a
// quarter of the face's width. The width is the greatest distance from the border to any corner of
// the face and of the faces in one plane around it. The search crosses no edge at which the mesh
// ends, turns by as much at once, or has more than two triangles: those are feature edges already.
//
// `corners` [triangles × 3] as for SidesByEdge, `sides` its result; vertices are indices into
// `positions`. Time: 0.2 to 0.5 µs a triangle, on one thread. Memory: 40 bytes a triangle while it
// works.
[[nodiscard]] std::vector<std::array<std::uint32_t, 2>> CrestsOfRoundedBorders(
    std::span<const Vec3> positions, std::span<const std::uint32_t> corners,
    std::span<const TriangleSide> sides);

}  // namespace lucerna
