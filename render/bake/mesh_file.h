// Files of a mesh that carries irradiance.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "render/bake/surface_mesh.h"
#include "render/base/status.h"
#include "render/math/rgb.h"
#include "render/math/vector.h"

namespace lucerna {

// What a file holds: the kept surfaces, and of the vertices those that faces use, all measured.
struct BakedMesh {
  struct Surface {
    std::string name;           // "3 floor", "4 wall, back"
    std::string material = {};  // "floor"
    std::vector<Vec3> positions, normals;
    std::vector<Rgb> irradiance;  // [W·m⁻²]
    std::vector<float> noise;     // standard deviation of its luminance [W·m⁻²]
    std::vector<Vec2> uvs = {};   // empty: none; v is 0 at an image's top
    std::vector<std::array<std::uint32_t, 3>> faces;
  };
  std::vector<Surface> surfaces;
  std::string scene;    // the scene's file
  double spacing = 0;   // as asked for
  double estimate = 0;  // of the relative error at evenly spread points; 0: none
  // Each four faces in a row are one element, which is quadratic between its corners and the
  // middles of its edges: a, ab, ca; ab, b, bc; ca, bc, c; ab, bc, ca.
  bool is_quadratic = false;
  bool is_indirect = false;  // without what came straight from lights
};

// Of a histogram, each face has vertices of its own. Requires that all vertices of faces, or all
// faces, are measured.
[[nodiscard]] BakedMesh BakedMeshOf(const SurfaceMesh& mesh);

// A PLY file, binary or text: vertices with x y z nx ny nz irradiance_r irradiance_g irradiance_b
// noise, and triangles.
[[nodiscard]] std::string MeshPly(const BakedMesh& mesh, bool is_ascii);

// A binary glTF 2.0 file: a node and a mesh for each surface, with the attributes _IRRADIANCE and
// _NOISE, texture coordinates where there are some, and as COLOR_0, for viewers, the irradiance
// over four times its mean luminance.
[[nodiscard]] std::string MeshGlb(const BakedMesh& mesh);

// Reads such a file back, but for the noise. `path` is for messages.
// Errors: INVALID_ARGUMENT with the first thing that is wrong, for any other glTF file too.
[[nodiscard]] StatusOr<BakedMesh> ReadMeshGlb(const std::string& path, std::string_view bytes);

}  // namespace lucerna
