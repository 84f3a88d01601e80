#include "server/hitpoint_pass.h"

#include <algorithm>

#include "render/math/octahedral.h"

namespace lucerna {
namespace {

// Pixels of a tile are neighbours on the surfaces they see, so their hitpoints gather from the
// same photons one after the other.
constexpr int kTile = 16;

// A pixel's width at the hitpoint, held where a radius in such units has a square. A camera that
// touches a surface sees it in no width at all.
float UnitRadius(const EyePath& path) {
  return std::clamp(path.footprint, 1e-17F, 1e14F);
}

}  // namespace

EyePass TraceHitpointPass(const EyePathTracer& tracer, std::uint64_t pass, FirstHitsOfSet* known,
                          ThreadTeam& team) {
  const int width = tracer.settings().crop_width();
  const int height = tracer.settings().crop_height();
  const int tiles_x = (width + kTile - 1) / kTile;
  const int tiles_y = (height + kTile - 1) / kTile;
  const auto tiles = static_cast<std::size_t>(tiles_x) * static_cast<std::size_t>(tiles_y);
  const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);

  EyePass out;
  out.pass = pass;
  out.direct.resize(pixels);
  out.features.resize(pixels);

  // A hitpoint as a row, until all tiles are known.
  struct Row {
    std::uint32_t pixel;
    Vec3 position;
    std::uint32_t normal_oct;
    Rgb weight;
    float unit_radius;
  };
  struct Tile {
    std::vector<Row> rows;
    std::vector<GlossyHitpoint> glossy;  // by row of the tile
  };
  const bool automatic = tracer.settings().initial_radius == 0;
  std::vector<Tile> per_tile(tiles);
  std::vector<std::uint64_t> rays(tiles);
  team.For(tiles, 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t tile = begin; tile < end; ++tile) {
      const int x0 = static_cast<int>(tile % static_cast<std::size_t>(tiles_x)) * kTile;
      const int y0 = static_cast<int>(tile / static_cast<std::size_t>(tiles_x)) * kTile;
      for (int y = y0; y < std::min(y0 + kTile, height); ++y) {
        for (int x = x0; x < std::min(x0 + kTile, width); ++x) {
          const auto pixel = static_cast<std::uint32_t>(y) * static_cast<std::uint32_t>(width) +
                             static_cast<std::uint32_t>(x);
          const EyePathTracer::First first =
              known == nullptr ? EyePathTracer::First{}
                               : EyePathTracer::First{.shape = &known->shapes[pixel],
                                                      .is_known = known->is_known};
          const EyePath path = tracer.Trace(x, y, pass, first);
          out.direct[pixel] = path.direct;
          out.features[pixel] = path.features;
          rays[tile] += static_cast<std::uint64_t>(path.rays);
          if (!path.has_hitpoint || IsBlack(path.weight)) continue;
          if (path.is_glossy) {
            per_tile[tile].glossy.push_back({static_cast<std::uint32_t>(per_tile[tile].rows.size()),
                                             path.material, EncodeOctahedral(path.to_eye),
                                             EncodeOctahedral(path.shading_normal)});
          }
          per_tile[tile].rows.push_back({pixel, path.position, EncodeOctahedral(path.normal),
                                         path.weight, automatic ? UnitRadius(path) : 1.0F});
        }
      }
    }
  });

  if (known != nullptr) known->is_known = true;

  std::size_t count = 0;
  for (const Tile& tile : per_tile)
    count += tile.rows.size();
  out.block.positions.reserve(count);
  out.block.normals_oct.reserve(count);
  out.pixels.reserve(count);
  out.weights.reserve(count);
  out.unit_radii.reserve(count);
  for (std::size_t tile = 0; tile < tiles; ++tile) {
    out.rays += rays[tile];
    const auto first = static_cast<std::uint32_t>(out.block.size());
    for (GlossyHitpoint glossy : per_tile[tile].glossy) {
      glossy.hitpoint += first;
      out.block.glossy.push_back(glossy);
    }
    for (const Row& row : per_tile[tile].rows) {
      out.block.positions.push_back(row.position);
      out.block.normals_oct.push_back(row.normal_oct);
      out.pixels.push_back(row.pixel);
      out.weights.push_back(row.weight);
      out.unit_radii.push_back(row.unit_radius);
    }
    per_tile[tile] = {};
  }
  return out;
}

}  // namespace lucerna
