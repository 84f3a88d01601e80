// Which vertices does a mesh of irradiance not need?
//
// A vertex is removed by moving its faces' corners to a neighbour (half-edge collapse), where the
// surface is flat around it and the mesh stays right: at no point that was measured, of this vertex
// and of all that were removed before, may linear interpolation differ by more than is allowed. All
// vertices at a place go together, so that there are no cracks; at borders and creases only along
// straight lines.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "render/bake/surface_mesh.h"

namespace lucerna {

// A point in the middle of an edge, given by its vertices in order.
struct MeasuredPoint {
  std::pair<std::uint32_t, std::uint32_t> edge;
  double luminance = 0;  // of the irradiance
  double weight = 0;
};

struct DecimationRules {
  double tolerance = 0;  // of differences, over the luminance or `floor` where that is more
  double floor = 0;
  double longest = 0;               // of edges
  double flatness = 0;              // how far a removed vertex may lie off the surface
  std::vector<bool> is_kept_whole;  // [surfaces] nothing of it is removed
};

struct Decimation {
  std::vector<MeshFace> faces;
  std::size_t removed = 0;  // places
  // Of points that were measured and are no vertices.
  struct Difference {
    double value = 0, weight = 0;
  };
  std::vector<Difference> differences;
};

// Requires that all vertices of faces are measured.
[[nodiscard]] Decimation DecimateMesh(const std::vector<MeshVertex>& vertices,
                                      const std::vector<MeshFace>& faces,
                                      const std::vector<MeasuredPoint>& points,
                                      const DecimationRules& rules);

}  // namespace lucerna
