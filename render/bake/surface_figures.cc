#include "render/bake/surface_figures.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_format.h"

#include "render/base/escape.h"
#include "render/math/double3.h"

namespace lucerna {

std::vector<SurfaceFigures> FiguresOf(const BakedMesh& mesh) {
  std::vector<SurfaceFigures> figures;
  for (const BakedMesh::Surface& surface : mesh.surfaces) {
    SurfaceFigures of;
    of.name = surface.name;
    of.triangles = surface.faces.size();
    of.lowest = HUGE_VAL;
    double flux = 0;
    for (const auto& face : surface.faces) {
      const double area =
          Length(TriangleCross(surface.positions[face[0]], surface.positions[face[1]],
                               surface.positions[face[2]])) /
          2;
      of.area += area;
      for (const std::uint32_t vertex : face) {
        const auto value = static_cast<double>(Luminance(surface.irradiance[vertex]));
        of.lowest = std::min(of.lowest, value);
        of.highest = std::max(of.highest, value);
        flux += area / 3 * value;
      }
    }
    of.mean = of.area > 0 ? flux / of.area : 0;
    figures.push_back(std::move(of));
  }
  return figures;
}

std::string FiguresTable(const std::vector<SurfaceFigures>& figures, bool in_lux) {
  const double factor = in_lux ? kLumensPerWatt : 1;
  std::size_t width = 7;
  for (const SurfaceFigures& of : figures)
    width = std::max(width, Escaped(of.name).size());
  std::string table = absl::StrFormat("%-*s %9s %10s %10s %10s %10s %6s %6s\n",
                                      static_cast<int>(width), "surface", "triangles", "area m2",
                                      in_lux ? "min lx" : "min W/m2", "mean", "max", "U0", "Ud");
  for (const SurfaceFigures& of : figures) {
    table += absl::StrFormat("%-*s %9d %10.4g %10.4g %10.4g %10.4g %6.3f %6.3f\n",
                             static_cast<int>(width), Escaped(of.name), of.triangles, of.area,
                             of.lowest * factor, of.mean * factor, of.highest * factor,
                             of.uniformity(), of.diversity());
  }
  return table;
}

}  // namespace lucerna
