// Where has a surface turned away beside a face that is wider than the bend?
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

// The edges [vertices of either end, the lower first] at which a mesh has turned from a face by
// kSameSurfaceCosine, and which lie no further from a border of that face than half its width: the
// greatest distance from the border of the face and of those in one plane around it. Every edge
// once. Edges at which the mesh turns so far at once, or ends, or more than two triangles
// meet, are none of them, nor does the search cross them.
//
// `corners` [triangles × 3] as for SidesByEdge, `sides` what that makes of them; the vertices are
// places in `positions`. Time: some 0.1 µs a triangle; memory: 40 bytes a triangle while it works.
[[nodiscard]] std::vector<std::array<std::uint32_t, 2>> CrestsOfRoundedBorders(
    std::span<const Vec3> positions, std::span<const std::uint32_t> corners,
    std::span<const TriangleSide> sides);

}  // namespace lucerna
