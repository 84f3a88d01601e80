#include "server/hitpoint_pass.h"

#include "render/math/octahedral.h"

namespace lucerna {
namespace {

// Pixels of a tile are neighbours on the surfaces they see, so their hitpoints gather from the
// same photons one after the other.
constexpr int kTile = 16;

}  // namespace

EyePass TraceHitpointPass(const EyePathTracer& tracer, std::uint64_t pass, ThreadTeam& team) {
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

  struct Ended {
    std::uint32_t pixel;
    EyePath path;
  };
  std::vector<std::vector<Ended>> per_tile(tiles);
  std::vector<std::uint64_t> rays(tiles);
  team.For(tiles, 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t tile = begin; tile < end; ++tile) {
      const int x0 = static_cast<int>(tile % static_cast<std::size_t>(tiles_x)) * kTile;
      const int y0 = static_cast<int>(tile / static_cast<std::size_t>(tiles_x)) * kTile;
      for (int y = y0; y < std::min(y0 + kTile, height); ++y) {
        for (int x = x0; x < std::min(x0 + kTile, width); ++x) {
          const auto pixel = static_cast<std::uint32_t>(y) * static_cast<std::uint32_t>(width) +
                             static_cast<std::uint32_t>(x);
          const EyePath path = tracer.Trace(x, y, pass);
          out.direct[pixel] = path.direct;
          out.features[pixel] = path.features;
          rays[tile] += static_cast<std::uint64_t>(path.rays);
          if (path.has_hitpoint && !IsBlack(path.weight)) per_tile[tile].push_back({pixel, path});
        }
      }
    }
  });

  const bool automatic = tracer.settings().initial_radius == 0;
  std::size_t count = 0;
  for (const auto& tile : per_tile) count += tile.size();
  out.block.positions.reserve(count);
  out.block.normals_oct.reserve(count);
  out.pixels.reserve(count);
  out.weights.reserve(count);
  out.unit_radii.reserve(count);
  for (std::size_t tile = 0; tile < tiles; ++tile) {
    out.rays += rays[tile];
    for (const auto& [pixel, path] : per_tile[tile]) {
      const auto row = static_cast<std::uint32_t>(out.block.size());
      out.block.positions.push_back(path.position);
      out.block.normals_oct.push_back(EncodeOctahedral(path.normal));
      if (path.is_glossy) {
        out.block.glossy.push_back({row, path.material, EncodeOctahedral(path.to_eye),
                                    EncodeOctahedral(path.shading_normal)});
      }
      out.pixels.push_back(pixel);
      out.weights.push_back(path.weight);
      out.unit_radii.push_back(automatic ? path.footprint : 1.0F);
    }
  }
  return out;
}

}  // namespace lucerna
