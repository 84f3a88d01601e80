#include "render/scene/degenerate_triangles.h"

#include <cmath>

#include "render/math/double3.h"

namespace lucerna {

std::size_t DropTriangles(TriangleMesh& mesh, double least_area) {
  std::size_t kept = 0;
  const std::size_t count = mesh.indices.size() / 3;
  for (std::size_t triangle = 0; triangle < count; ++triangle) {
    const std::uint32_t* corner = &mesh.indices[3 * triangle];
    const double area = Length(TriangleCross(mesh.positions[corner[0]], mesh.positions[corner[1]],
                                             mesh.positions[corner[2]])) /
                        2;
    if (!(area >= least_area && std::isfinite(area))) continue;
    for (std::size_t i = 0; i < 3; ++i)
      mesh.indices[3 * kept + i] = mesh.indices[3 * triangle + i];
    ++kept;
  }
  mesh.indices.resize(3 * kept);
  return count - kept;
}

}  // namespace lucerna
