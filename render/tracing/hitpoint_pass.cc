#include "render/tracing/hitpoint_pass.h"

#include <algorithm>
#include <atomic>
#include <cmath>

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

// At most about so many pixels tell where the hitpoints of an image are.
constexpr double kExtentPixels = 16384;

float UnitRadiusOf(const EyePathTracer& tracer, const EyeHitpoint& hitpoint) {
  return tracer.settings().initial_radius == 0 ? HeldWidth(hitpoint.footprint) : 1.0F;
}
float UnitRadiusOf(const EyePathTracer& tracer, const EyeSegment& segment) {
  return tracer.settings().initial_radius == 0 ? kSegmentShare * HeldWidth(segment.to_footprint)
                                               : kSegmentShare;
}

}  // namespace

EyePass TraceHitpointPass(const EyePathTracer& tracer, std::uint64_t pass, FirstHitsOfSet* known,
                          FilmSpread& spread, ThreadTeam& team,
                          const std::function<bool()>& shall_stop) {
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
  std::vector<Rgb> bright(spread.is_needed() ? pixels : 0);

  // A hitpoint as a row, until all tiles are known.
  struct Row {
    std::uint32_t pixel;
    Vec3 position;
    std::uint32_t normal_oct;
    Rgb weight;
    float unit_radius;
  };
  struct Rows {
    std::vector<Row> rows;
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
  std::vector<std::uint64_t> rays(tiles);
  // Once true, it stays so, whatever the caller would say later.
  std::atomic<bool> is_stopped = false;
  const auto stops = [&] {
    if (shall_stop && !is_stopped.load(std::memory_order_relaxed) && shall_stop())
      is_stopped = true;
    return is_stopped.load(std::memory_order_relaxed);
  };
  team.For(tiles, 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t tile = begin; tile < end; ++tile) {
      if (stops()) return;
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
          if (!bright.empty()) bright[pixel] = path.bright;
          out.features[pixel] = path.features;
          rays[tile] += static_cast<std::uint64_t>(path.rays);
          const auto keep = [&](const EyeHitpoint& hitpoint, Rows& rows) {
            if (IsBlack(hitpoint.weight)) return;
            if (hitpoint.is_glossy) {
              rows.glossy.push_back({static_cast<std::uint32_t>(rows.rows.size()),
                                     hitpoint.material, EncodeOctahedral(hitpoint.to_eye),
                                     EncodeOctahedral(hitpoint.shading_normal)});
              rows.places.push_back(hitpoint.place);
            }
            rows.rows.push_back({pixel, hitpoint.position, EncodeOctahedral(hitpoint.normal),
                                 hitpoint.weight, UnitRadiusOf(tracer, hitpoint)});
          };
          keep(path.hitpoint, per_tile[tile].rows);
          keep(path.caustic, per_tile[tile].caustic_rows);
          if (const EyeSegment& segment = path.segment; !IsBlack(segment.weight)) {
            Tile& of = per_tile[tile];
            of.segment_rows.rows.push_back({pixel, segment.from, EncodeOctahedral({0, 0, 1}),
                                            segment.weight, UnitRadiusOf(tracer, segment)});
            of.segments.push_back({segment.to, static_cast<std::uint32_t>(segment.medium),
                                   automatic
                                       ? std::clamp(segment.from_footprint / segment.to_footprint,
                                                    kLeastNarrowing, 1.0F)
                                       : 1.0F});
          }
        }
      }
    }
  });

  if (known != nullptr && !is_stopped) known->is_known = true;
  spread.Add(pass, bright, out.direct, team, stops);
  out.is_whole = !is_stopped;
  if (!out.is_whole) return out;

  std::size_t count = 0;
  bool has_places = false;
  for (const Tile& tile : per_tile) {
    count += tile.rows.rows.size() + tile.caustic_rows.rows.size() + tile.segments.size();
    out.block.caustic_rows += tile.caustic_rows.rows.size();
    for (const Rows* rows : {&tile.rows, &tile.caustic_rows}) {
      has_places = has_places || std::ranges::any_of(rows->places, [](const GlossyPlace& place) {
                     return place != GlossyPlace();
                   });
    }
  }
  out.block.positions.reserve(count);
  out.block.normals_oct.reserve(count);
  out.pixels.reserve(count);
  out.weights.reserve(count);
  out.unit_radii.reserve(count);
  const auto append = [&](Rows& rows) {
    const auto first = static_cast<std::uint32_t>(out.block.size());
    for (GlossyHitpoint glossy : rows.glossy) {
      glossy.hitpoint += first;
      out.block.glossy.push_back(glossy);
    }
    if (has_places) {
      out.block.places.insert(out.block.places.end(), rows.places.begin(), rows.places.end());
    }
    for (const Row& row : rows.rows) {
      out.block.positions.push_back(row.position);
      out.block.normals_oct.push_back(row.normal_oct);
      out.pixels.push_back(row.pixel);
      out.weights.push_back(row.weight);
      out.unit_radii.push_back(row.unit_radius);
    }
    rows = {};
  };
  for (std::size_t tile = 0; tile < tiles; ++tile) {
    out.rays += rays[tile];
    append(per_tile[tile].rows);
  }
  if (out.block.caustic_rows > 0) {
    for (Tile& tile : per_tile)
      append(tile.caustic_rows);
  }
  for (Tile& tile : per_tile) {
    if (tile.segments.empty()) continue;
    append(tile.segment_rows);
    out.block.segments.insert(out.block.segments.end(), tile.segments.begin(), tile.segments.end());
  }
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
