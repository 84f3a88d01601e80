// Files of a mesh that carries irradiance.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "client/bake/surface_mesh.h"
#include "render/math/rgb.h"
#include "render/math/vector.h"

namespace lucerna {

// What a file holds: the kept surfaces, and of the vertices those that faces use, all measured.
struct BakedMesh {
  struct Surface {
    std::string name;  // "3 floor", "4 wall, back"
    std::vector<Vec3> positions, normals;
    std::vector<Rgb> irradiance;  // [W·m⁻²]
    std::vector<float> noise;     // standard deviation of its luminance [W·m⁻²]
    std::vector<std::array<std::uint32_t, 3>> faces;
  };
  std::vector<Surface> surfaces;
  std::string scene;    // the scene's file
  double spacing = 0;   // as asked for
  double estimate = 0;  // of the relative error at evenly spread points; 0: none
};

// Of a histogram, each face has vertices of its own. Requires that all vertices of faces, or all
// faces, are measured.
[[nodiscard]] BakedMesh BakedMeshOf(const SurfaceMesh& mesh);

// A PLY file, binary or text: vertices with x y z nx ny nz irradiance_r irradiance_g irradiance_b
// noise, and triangles.
[[nodiscard]] std::string MeshPly(const BakedMesh& mesh, bool is_ascii);

// A binary glTF 2.0 file: a node and a mesh for each surface, with the attributes _IRRADIANCE and
// _NOISE, and as COLOR_0, for viewers, the irradiance over four times its mean luminance.
[[nodiscard]] std::string MeshGlb(const BakedMesh& mesh);

}  // namespace lucerna
