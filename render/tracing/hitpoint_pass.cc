#include "render/tracing/hitpoint_pass.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <functional>
#include <numeric>
#include <utility>

#include "render/base/memory.h"
#include "render/estimate/slice_sums.h"
#include "render/math/octahedral.h"

namespace lucerna {
namespace {

// Pixels of a tile are neighbours on the surfaces they see, so their hitpoints gather from the
// same photons one after the other.
constexpr int kTile = 16;

// A pixel's width at the hitpoint, held where a radius in such units has a square. A camera that
// touches a surface sees it in no width at all.
float HeldWidth(float footprint) {
  return std::clamp(footprint, 1e-17F, 1e14F);
}

// The radius of a segment over that of a surface: a segment finds the photons of its whole length.
constexpr float kSegmentShare = 0.5F;
// The radius at the beginning of a segment is at least this share of that at its end. A photon
// there weighs up to the square of the inverse more than one at the end: with an eighth, few
// photons near a camera in fog were bright dots over the whole image.
constexpr float kLeastNarrowing = 0.5F;

// And its first radius is at most so many mean free paths r. What a disc of radius a finds on a
// surface bent like a ball of radius b lies up to a²/(2b) deeper or less deep than on a flat one:
// 32 r²/b, a third of a free path where b is a hundred of them.
constexpr float kMostFreePaths = 8;

// At most about so many pixels tell where the hitpoints of an image are.
constexpr double kExtentPixels = 16384;

float UnitRadiusOf(const EyePathTracer& tracer, const EyeHitpoint& hitpoint) {
  return tracer.settings().initial_radius == 0 ? HeldWidth(hitpoint.footprint) : 1.0F;
}
float UnitRadiusOf(const EyePathTracer& tracer, const EyeSegment& segment) {
  const RenderSettings& settings = tracer.settings();
  const bool is_given = settings.initial_radius != 0;
  const float unit = kSegmentShare * (is_given ? 1 : HeldWidth(segment.to_footprint));
  const auto first =
      static_cast<float>(is_given ? settings.initial_radius : settings.initial_footprints);
  return std::min(unit, HeldWidth(kMostFreePaths * segment.free_path / first));
}

}  // namespace

EyePass TraceHitpointPass(const EyePathTracer& tracer, std::uint64_t pass, FirstHitsOfSet* known,
                          FilmSpread& spread, ThreadTeam& team,
                          const std::function<bool()>& shall_stop, const EyePathCounts* counts) {
  const int width = tracer.settings().crop_width();
  const int height = tracer.settings().crop_height();
  const int tiles_x = (width + kTile - 1) / kTile;
  const int tiles_y = (height + kTile - 1) / kTile;
  const auto tiles = static_cast<std::size_t>(tiles_x) * static_cast<std::size_t>(tiles_y);
  const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);

  EyePass out;
  out.pass = pass;
  out.direct.resize(pixels);
  const bool has_features = HasFeatures({pass, pass + 1});
  if (has_features) out.features.resize(pixels);
  const bool compares = counts != nullptr && ComparesEyePaths(pass);
  if (compares) out.direct_difference.resize(pixels);
  std::vector<Rgb> bright(spread.is_needed() ? pixels : 0);

  // Each path has at most one ordinary row, so that a tile's rows have room where its paths are;
  // they move together when all tiles are known. Other rows wait beside them.
  struct Row {
    std::uint32_t pixel;
    Vec3 position;
    std::uint32_t normal_oct;
    Rgb weight;
    float unit_radius;
    std::uint8_t path;
  };
  struct Rows {
    std::vector<Row> rows;  // none of ordinary ones
    std::size_t count = 0;
    std::vector<GlossyHitpoint> glossy;  // by row of the tile
    std::vector<GlossyPlace> places;     // [glossy]
  };
  struct Tile {
    Rows rows;
    Rows caustic_rows;
    Rows segment_rows;
    std::vector<MediumSegment> segments;
  };
  const bool automatic = tracer.settings().initial_radius == 0;
  std::vector<Tile> per_tile(tiles);
  const auto corner_of = [&](std::size_t tile) {
    return std::pair(static_cast<int>(tile % static_cast<std::size_t>(tiles_x)) * kTile,
                     static_cast<int>(tile / static_cast<std::size_t>(tiles_x)) * kTile);
  };
  const auto paths_of = [&](std::uint32_t pixel) {
    return counts == nullptr ? 1 : static_cast<int>((*counts)[pixel]);
  };
  const auto for_pixels_of = [&](std::size_t tile, const auto& work) {
    const auto [x0, y0] = corner_of(tile);
    for (int y = y0; y < std::min(y0 + kTile, height); ++y) {
      for (int x = x0; x < std::min(x0 + kTile, width); ++x)
        work(x, y,
             static_cast<std::uint32_t>(y) * static_cast<std::uint32_t>(width) +
                 static_cast<std::uint32_t>(x));
    }
  };
  // [tiles + 1] how many paths the tiles before have.
  std::vector<std::size_t> first_path(tiles + 1);
  team.For(tiles, kTile, [&](std::size_t begin, std::size_t end) {
    for (std::size_t tile = begin; tile < end; ++tile) {
      for_pixels_of(tile, [&](int /*x*/, int /*y*/, std::uint32_t pixel) {
        first_path[tile + 1] += static_cast<std::size_t>(paths_of(pixel));
      });
    }
  });
  std::partial_sum(first_path.begin(), first_path.end(), first_path.begin());
  const std::size_t paths = first_path[tiles];
  // Clearing memory takes as long as filling it in.
  const auto for_columns = [&](const auto& work) {
    const std::array<std::function<void()>, 6> works = {[&] { work(out.block.positions); },
                                                        [&] { work(out.weights); },
                                                        [&] { work(out.block.normals_oct); },
                                                        [&] { work(out.pixels); },
                                                        [&] { work(out.unit_radii); },
                                                        [&] {
                                                          if (compares) work(out.paths);
                                                        }};
    team.For(works.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t column = begin; column < end; ++column)
        works[column]();
    });
  };
  const auto put = [&](std::size_t to, const Row& row) {
    out.block.positions[to] = row.position;
    out.block.normals_oct[to] = row.normal_oct;
    out.pixels[to] = row.pixel;
    out.weights[to] = row.weight;
    out.unit_radii[to] = row.unit_radius;
    if (compares) out.paths[to] = row.path;
  };
  for_columns([&](auto& column) { column.resize(paths); });

  std::vector<std::uint64_t> rays(tiles);
  // Once true, it stays so, whatever the caller would say later.
  std::atomic<bool> is_stopped = false;
  const auto stops = [&] {
    if (shall_stop && !is_stopped.load(std::memory_order_relaxed) && shall_stop())
      is_stopped = true;
    return is_stopped.load(std::memory_order_relaxed);
  };
  team.For(tiles, 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t number = begin; number < end; ++number) {
      if (stops()) return;
      Tile& tile = per_tile[number];
      // Which of the paths of which pixel.
      struct Place {
        std::uint32_t pixel;
        std::uint8_t path;
        float share;
      };
      const auto keep = [&](const Place& place, const EyeHitpoint& hitpoint, Rows& rows) {
        if (IsBlack(hitpoint.weight)) return;
        if (hitpoint.is_glossy) {
          rows.glossy.push_back({static_cast<std::uint32_t>(rows.count), hitpoint.material,
                                 EncodeOctahedral(hitpoint.to_eye),
                                 EncodeOctahedral(hitpoint.shading_normal)});
          rows.places.push_back(hitpoint.place);
        }
        const Row row = {place.pixel,
                         hitpoint.position,
                         EncodeOctahedral(hitpoint.normal),
                         hitpoint.weight * place.share,
                         UnitRadiusOf(tracer, hitpoint),
                         place.path};
        if (&rows == &tile.rows) {
          put(first_path[number] + rows.count, row);
        } else {
          rows.rows.push_back(row);
        }
        ++rows.count;
      };
      const auto keep_all = [&](const Place& place, const EyePath& path) {
        rays[number] += static_cast<std::uint64_t>(path.rays);
        keep(place, path.hitpoint, tile.rows);
        keep(place, path.caustic, tile.caustic_rows);
        if (const EyeSegment& segment = path.segment; !IsBlack(segment.weight)) {
          tile.segment_rows.rows.push_back(
              {place.pixel, segment.from, EncodeOctahedral(segment.border),
               segment.weight * place.share, UnitRadiusOf(tracer, segment), place.path});
          ++tile.segment_rows.count;
          tile.segments.push_back({segment.to, static_cast<std::uint32_t>(segment.medium),
                                   automatic
                                       ? std::clamp(segment.from_footprint / segment.to_footprint,
                                                    kLeastNarrowing, 1.0F)
                                       : 1.0F});
        }
      };
      for_pixels_of(number, [&](int x, int y, std::uint32_t pixel) {
        const EyePathTracer::First first =
            known == nullptr
                ? EyePathTracer::First{}
                : EyePathTracer::First{.shape = &known->shapes[pixel], .is_known = known->is_known};
        const EyePath path = tracer.Trace(x, y, pass, first);
        if (!bright.empty()) bright[pixel] = path.bright;
        if (has_features) out.features[pixel] = path.features;
        const int more = paths_of(pixel) - 1;
        const float share = 1 / static_cast<float>(1 + more);
        keep_all({pixel, 0, share}, path);
        Rgb direct = path.direct;
        // What is bright is left to the first path: it counts for the pixels around as well.
        for (int i = 0; i < more; ++i) {
          const EyePath next = tracer.TraceMore(x, y, pass, i, more);
          keep_all({pixel, static_cast<std::uint8_t>(i + 1), share}, next);
          direct += next.direct;
          if (compares && more == 1) out.direct_difference[pixel] = path.direct - next.direct;
        }
        out.direct[pixel] = direct * share;
      });
    }
  });

  if (known != nullptr && !is_stopped) known->is_known = true;
  spread.Add(pass, bright, out.direct, team, stops);
  FreeMemoryOf(bright);
  out.is_whole = !is_stopped;
  if (!out.is_whole) return out;

  // Where the rows of each tile begin: first all ordinary ones, then the caustic ones, then the
  // segments.
  struct FirstRows {
    std::size_t row, glossy;
  };
  std::vector<FirstRows> first_ordinary(tiles), first_caustic(tiles), first_segment(tiles);
  FirstRows next = {0, 0};
  bool has_places = false;
  const auto count = [&](Rows Tile::*kind, std::vector<FirstRows>& first) {
    for (std::size_t tile = 0; tile < tiles; ++tile) {
      const Rows& rows = per_tile[tile].*kind;
      first[tile] = next;
      next.row += rows.count;
      next.glossy += rows.glossy.size();
      has_places = has_places || std::ranges::any_of(rows.places, [](const GlossyPlace& place) {
                     return place != GlossyPlace();
                   });
    }
  };
  count(&Tile::rows, first_ordinary);
  const std::size_t ordinary = next.row;
  count(&Tile::caustic_rows, first_caustic);
  out.block.caustic_rows = next.row - ordinary;
  const std::size_t segments_begin = next.row;
  count(&Tile::segment_rows, first_segment);
  out.block.glossy.resize(next.glossy);
  if (has_places) out.block.places.resize(next.glossy);
  out.block.segments.resize(next.row - segments_begin);
  for_columns([&](auto& column) {
    for (std::size_t tile = 0; tile < tiles && ordinary < paths; ++tile) {
      const auto from = column.begin() + static_cast<std::ptrdiff_t>(first_path[tile]);
      const auto to = column.begin() + static_cast<std::ptrdiff_t>(first_ordinary[tile].row);
      if (from != to) std::copy_n(from, per_tile[tile].rows.count, to);
    }
    column.resize(next.row);
  });
  const auto place_rows = [&](Rows& rows, const FirstRows& first) {
    for (std::size_t i = 0; i < rows.rows.size(); ++i)
      put(first.row + i, rows.rows[i]);
    for (std::size_t i = 0; i < rows.glossy.size(); ++i) {
      GlossyHitpoint& glossy = out.block.glossy[first.glossy + i];
      glossy = rows.glossy[i];
      glossy.hitpoint += static_cast<std::uint32_t>(first.row);
      if (has_places) out.block.places[first.glossy + i] = rows.places[i];
    }
    rows = {};
  };
  team.For(tiles, 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t number = begin; number < end; ++number) {
      Tile& tile = per_tile[number];
      place_rows(tile.rows, first_ordinary[number]);
      place_rows(tile.caustic_rows, first_caustic[number]);
      place_rows(tile.segment_rows, first_segment[number]);
      std::ranges::copy(tile.segments, out.block.segments.begin() +
                                           static_cast<std::ptrdiff_t>(first_segment[number].row -
                                                                       segments_begin));
    }
  });
  for (const std::uint64_t of_tile : rays)
    out.rays += of_tile;
  return out;
}

HitpointExtent SampleExtent(const EyePathTracer& tracer) {
  const int width = tracer.settings().crop_width();
  const int height = tracer.settings().crop_height();
  const double pixels = static_cast<double>(width) * static_cast<double>(height);
  int step = std::max(1, static_cast<int>(std::ceil(std::sqrt(pixels / kExtentPixels))));
  HitpointExtent extent;
  std::size_t sampled = 0;
  std::size_t rows = 0;
  const auto add = [&](const auto& place, Vec3 position) {
    if (IsBlack(place.weight)) return;
    ++rows;
    extent.bounds.Add(position);
    extent.widest_unit_radius = std::max(extent.widest_unit_radius, UnitRadiusOf(tracer, place));
  };
  const auto sample = [&] {
    sampled = 0;
    for (int y = std::min(step, height) / 2; y < height; y += step) {
      for (int x = std::min(step, width) / 2; x < width; x += step) {
        const EyePath path = tracer.Trace(x, y, /*pass=*/0, {});
        ++sampled;
        add(path.hitpoint, path.hitpoint.position);
        add(path.caustic, path.caustic.position);
        add(path.segment, path.segment.from);
      }
    }
  };
  sample();
  // All that is seen may lie between them.
  if (rows == 0 && step > 1) {
    step = 1;
    sample();
  }
  extent.rows_per_pixel = static_cast<double>(rows) / static_cast<double>(sampled);
  return extent;
}

}  // namespace lucerna
