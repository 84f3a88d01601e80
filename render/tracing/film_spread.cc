#include "render/tracing/film_spread.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace lucerna {
namespace {

constexpr int kTile = 16;

// Two pixels' filters overlap where their centres are less than two radii apart.
int ReachOf(float radius) {
  return std::max(static_cast<int>(std::ceil(2 * radius)) - 1, 0);
}

// Σ_q p_q along one axis, at `offset` from the centre of pixel `pixel`, over the pixels
// [begin, end) of the image.
float DensityOfAll(const FilterSampler& filter, float offset, int pixel, int begin, int end) {
  const int radius = static_cast<int>(std::ceil(filter.radius() + std::abs(offset)));
  float sum = 0;
  for (int q = std::max(pixel - radius, begin); q < std::min(pixel + radius + 1, end); ++q)
    sum += filter.At(offset + static_cast<float>(pixel - q)).density;
  return sum;
}

}  // namespace

FilmSpread::FilmSpread(const EyePathTracer& tracer)
    : tracer_(tracer),
      width_(tracer.settings().crop_width()),
      height_(tracer.settings().crop_height()),
      reach_x_(ReachOf(tracer.filter_x().radius())),
      reach_y_(ReachOf(tracer.filter_y().radius())),
      image_({-tracer.settings().crop_x0, -tracer.settings().crop_y0,
              tracer.settings().width - tracer.settings().crop_x0,
              tracer.settings().height - tracer.settings().crop_y0}) {}

void FilmSpread::FindCentres(ThreadTeam& team) {
  if (centres_are_known_) return;
  centres_are_known_ = true;
  centres_.resize(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  team.For(static_cast<std::size_t>(height_), 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t y = begin; y < end; ++y) {
      for (int x = 0; x < width_; ++x) {
        centres_[y * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x)] =
            tracer_.BrightAtCentre(x, static_cast<int>(y));
      }
    }
  });
  if (std::ranges::all_of(centres_, [](const Rgb& c) { return IsBlack(c); })) {
    centres_.clear();
    centres_.shrink_to_fit();
  }
}

void FilmSpread::Add(std::uint64_t pass, const std::vector<Rgb>& bright, std::vector<Rgb>& direct,
                     ThreadTeam& team) {
  if (!is_needed()) return;
  FindCentres(team);
  const int tiles_x = (width_ + kTile - 1) / kTile;
  const int tiles_y = (height_ + kTile - 1) / kTile;
  team.For(static_cast<std::size_t>(tiles_x) * static_cast<std::size_t>(tiles_y), 4,
           [&](std::size_t begin, std::size_t end) {
             for (std::size_t tile = begin; tile < end; ++tile) {
               const int x0 = static_cast<int>(tile % static_cast<std::size_t>(tiles_x)) * kTile;
               const int y0 = static_cast<int>(tile / static_cast<std::size_t>(tiles_x)) * kTile;
               AddTile(pass, {x0, y0, std::min(x0 + kTile, width_), std::min(y0 + kTile, height_)},
                       bright, direct);
             }
           });
}

void FilmSpread::AddTile(std::uint64_t pass, const Window& tile, const std::vector<Rgb>& bright,
                         std::vector<Rgb>& direct) const {
  const auto pixel_at = [&](int x, int y) {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
           static_cast<std::size_t>(x);
  };
  const auto is_in_crop = [&](int x, int y) {
    return x >= 0 && x < width_ && y >= 0 && y < height_;
  };
  const auto centre_at = [&](int x, int y) {
    return centres_.empty() ? Rgb{} : centres_[pixel_at(x, y)];
  };
  // The pixels whose paths count in the tile.
  const Window around = {
      std::max(tile.x0 - reach_x_, image_.x0), std::max(tile.y0 - reach_y_, image_.y0),
      std::min(tile.x1 + reach_x_, image_.x1), std::min(tile.y1 + reach_y_, image_.y1)};
  struct Path {
    Rgb bright;
    float x = 0, y = 0;         // from the centre of its pixel
    float inverse_density = 0;  // 1 / Σ_s p_s(f)
  };
  std::vector<Path> paths;
  paths.reserve(static_cast<std::size_t>(around.x1 - around.x0) *
                static_cast<std::size_t>(around.y1 - around.y0));
  bool is_dark = true;
  for (int y = around.y0; y < around.y1; ++y) {
    for (int x = around.x0; x < around.x1; ++x) {
      const Rgb found = is_in_crop(x, y) ? bright[pixel_at(x, y)] : tracer_.TraceBright(x, y, pass);
      is_dark = is_dark && IsBlack(found);
      paths.push_back({.bright = found});
    }
  }
  for (int y = tile.y0; is_dark && y < tile.y1; ++y) {
    for (int x = tile.x0; is_dark && x < tile.x1; ++x)
      is_dark = IsBlack(centre_at(x, y));
  }
  if (is_dark) return;

  auto path = paths.begin();
  for (int y = around.y0; y < around.y1; ++y) {
    for (int x = around.x0; x < around.x1; ++x, ++path) {
      const EyePathTracer::FilmOffset offset = tracer_.FilmOffsetOf(x, y, pass);
      path->x = offset.x;
      path->y = offset.y;
      const float density = DensityOfAll(tracer_.filter_x(), offset.x, x, image_.x0, image_.x1) *
                            DensityOfAll(tracer_.filter_y(), offset.y, y, image_.y0, image_.y1);
      path->inverse_density = density > 0 ? 1 / density : 0;
    }
  }
  for (int y = tile.y0; y < tile.y1; ++y) {
    for (int x = tile.x0; x < tile.x1; ++x) {
      const Rgb centre = centre_at(x, y);
      Rgb sum = centre;
      for (int qy = std::max(y - reach_y_, around.y0); qy < std::min(y + reach_y_ + 1, around.y1);
           ++qy) {
        for (int qx = std::max(x - reach_x_, around.x0); qx < std::min(x + reach_x_ + 1, around.x1);
             ++qx) {
          const Path& of_q = paths[static_cast<std::size_t>(qy - around.y0) *
                                       static_cast<std::size_t>(around.x1 - around.x0) +
                                   static_cast<std::size_t>(qx - around.x0)];
          const Rgb excess = of_q.bright - centre;
          if (IsBlack(excess)) continue;
          const float weight = tracer_.filter_x().At(of_q.x + static_cast<float>(qx - x)).filter *
                               tracer_.filter_y().At(of_q.y + static_cast<float>(qy - y)).filter *
                               of_q.inverse_density;
          sum += excess * weight;
        }
      }
      direct[pixel_at(x, y)] += sum;
    }
  }
}

}  // namespace lucerna
