// How much light does a baked mesh have at a point?
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "render/bake/mesh_file.h"
#include "render/math/rgb.h"
#include "render/math/vector.h"

namespace lucerna {

class BakedLight {
 public:
  // Keeps a reference to the mesh.
  explicit BakedLight(const BakedMesh& mesh);

  // Irradiance [W·m⁻²] of a surface of this material at a point, on the side of the normal (unit).
  // That of the nearest point of the mesh which is of the material and faces the same way, or where
  // the mesh has nothing of the material near, of any; absent where it has none. Lengths are those
  // of the scene's file. Threads: any.
  [[nodiscard]] std::optional<Rgb> At(const std::string& material, Vec3 position,
                                      Vec3 normal) const;

 private:
  struct Triangle {
    std::uint32_t surface = 0, face = 0;
  };
  // A box around triangles, in two halves or at most kFewTriangles of them.
  struct Node {
    Bounds box;
    std::uint32_t first = 0, count = 0;  // of a leaf: triangles
    std::uint32_t second_half = 0;       // of others; the first half follows the node
  };
  struct Tree {
    std::vector<Triangle> triangles;
    std::vector<Node> nodes;
  };
  struct Nearest {
    Triangle triangle;
    double squared_distance = 0;
    std::array<double, 3> shares = {};  // barycentric
  };

  void Build(Tree& tree, std::size_t first, std::size_t count) const;
  // Of those that face the normal's way. `reach`: how far off a triangle may be, in its longest
  // edges.
  [[nodiscard]] std::optional<Nearest> Find(const Tree& tree, Vec3 position, Vec3 normal,
                                            double reach) const;
  [[nodiscard]] Rgb IrradianceAt(const Nearest& nearest) const;
  [[nodiscard]] Vec3 CornerOf(const Triangle& triangle, std::size_t corner) const {
    const BakedMesh::Surface& surface = mesh_.surfaces[triangle.surface];
    return surface.positions[surface.faces[triangle.face][corner]];
  }

  const BakedMesh& mesh_;
  std::map<std::string, Tree> of_material_;
  Tree all_;
};

}  // namespace lucerna
