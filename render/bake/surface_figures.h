// How much light do the surfaces of a scene receive?
#pragma once

#include <string>
#include <vector>

#include "render/bake/mesh_file.h"

namespace lucerna {

// Of one surface, of the luminance of its irradiance [W·m⁻²].
struct SurfaceFigures {
  std::string name;
  std::size_t triangles = 0;
  double area = 0;                 // [m²]
  double lowest = 0, highest = 0;  // at vertices
  double mean = 0;                 // over the area, linear on each triangle
  // Lowest over mean, as EN 12464-1 defines the uniformity U0; 0 where there is no light.
  [[nodiscard]] double uniformity() const { return mean > 0 ? lowest / mean : 0; }
  // Lowest over highest, Ud.
  [[nodiscard]] double diversity() const { return highest > 0 ? lowest / highest : 0; }
};

// In the order of the mesh.
[[nodiscard]] std::vector<SurfaceFigures> FiguresOf(const BakedMesh& mesh);

// A table with a line for each. In lux: 683 lm/W times the luminance of the irradiance.
[[nodiscard]] std::string FiguresTable(const std::vector<SurfaceFigures>& figures, bool in_lux);

// Luminous efficacy by which illuminance follows from irradiance [lm/W].
inline constexpr double kLumensPerWatt = 683;

}  // namespace lucerna
