#include "render/formats/mesh_placement.h"

#include <utility>

namespace lucerna {
namespace {

void SwapTriangle(TriangleMesh& mesh, std::size_t triangle) {
  std::swap(mesh.indices[3 * triangle + 1], mesh.indices[3 * triangle + 2]);
}

}  // namespace

void SwapWinding(TriangleMesh& mesh) {
  for (std::size_t i = 0; i < mesh.indices.size() / 3; ++i)
    SwapTriangle(mesh, i);
}

void WindByNormals(TriangleMesh& mesh, bool turned_over) {
  for (std::size_t triangle = 0; triangle < mesh.indices.size() / 3; ++triangle) {
    bool swap = turned_over;
    if (!mesh.normals.empty()) {
      const Vec3 towards = mesh.normals[mesh.indices[3 * triangle]] +
                           mesh.normals[mesh.indices[3 * triangle + 1]] +
                           mesh.normals[mesh.indices[3 * triangle + 2]];
      const double agreement = Dot(EdgeCross(mesh, triangle), Double3(towards));
      if (agreement != 0) swap = agreement < 0;
    }
    if (swap) SwapTriangle(mesh, triangle);
  }
}

Double3 EdgeCross(const TriangleMesh& mesh, std::size_t triangle) {
  return TriangleCross(mesh.positions[mesh.indices[3 * triangle]],
                       mesh.positions[mesh.indices[3 * triangle + 1]],
                       mesh.positions[mesh.indices[3 * triangle + 2]]);
}

std::uint64_t SizeBytes(const TriangleMesh& mesh) {
  return sizeof(mesh) + mesh.positions.size() * sizeof(Vec3) +
         mesh.indices.size() * sizeof(std::uint32_t) + mesh.normals.size() * sizeof(Vec3) +
         mesh.uvs.size() * sizeof(Vec2) + mesh.colors.size() * sizeof(Rgb);
}

}  // namespace lucerna
