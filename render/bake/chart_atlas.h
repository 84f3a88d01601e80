// Where on surfaces are the texels of a light map?
//
// Faces that meet without a crease and are turned less than 45 degrees from the first of them form
// a chart: their projection onto its plane, in which no two of them lie over each other. Charts
// stand beside each other in one image, at least two texels apart. Texels around a chart measure
// the nearest point of it, so that bilinear look-ups need no others.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "render/bake/mesh_file.h"
#include "render/bake/surface_figures.h"
#include "render/bake/surface_mesh.h"
#include "render/base/status.h"
#include "render/image/image.h"
#include "render/math/vector.h"
#include "render/scene/scene.h"

namespace lucerna {

struct ChartAtlas {
  struct Texel {
    int x = 0, y = 0;  // row 0 is the top
    std::uint32_t chart = 0, face = 0;
    double area = 0;  // of the surface [m²]; 0: the texel's middle is beside the chart
    Sensor sensor;
  };
  int width = 0, height = 0;
  std::size_t charts = 0;
  std::vector<Texel> texels;                // row by row
  std::vector<std::uint32_t> chart_of;      // [faces]
  std::vector<std::array<Vec2, 3>> places;  // [faces] of corners [texels], y down
};

inline constexpr std::size_t kMostTexels = std::size_t{1} << 26;
// Of the faces of a mesh; texels have edges of `texel`.
// Errors: RESOURCE_EXHAUSTED beyond `max_texels` in the image.
[[nodiscard]] StatusOr<ChartAtlas> ChartAtlasOf(const SurfaceMesh& mesh, double texel,
                                                std::size_t max_texels = kMostTexels);

// The image of a light map: R, G and B and `noise` [W·m⁻²], the point `P` and normal `N` of each
// texel, its `chart` from 1 (0: none), and `inside`, 1 where the texel's middle is on the chart.
// `measured`: [texels].
[[nodiscard]] Image AtlasImage(const ChartAtlas& atlas, const std::vector<Irradiance>& measured);

// The faces with texture coordinates for that image, and at vertices what the image has there.
[[nodiscard]] BakedMesh AtlasMesh(const SurfaceMesh& mesh, const ChartAtlas& atlas,
                                  const Image& image);

// Of the texels whose middle is on a chart.
[[nodiscard]] std::vector<SurfaceFigures> FiguresOf(const SurfaceMesh& mesh,
                                                    const ChartAtlas& atlas,
                                                    const std::vector<Irradiance>& measured);

}  // namespace lucerna
