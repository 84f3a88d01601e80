#include "render/tracing/film_spread.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <utility>

#include "render/base/memory.h"
#include "render/tracing/bright_outlines.h"

namespace lucerna {
namespace {

constexpr int kSpreadTile = 16;

int TilesOf(int pixels) {
  return (pixels + kSpreadTile - 1) / kSpreadTile;
}

// Two pixels' filters overlap where their centres are less than two radii apart.
int ReachOf(float radius) {
  return std::max(static_cast<int>(std::ceil(2 * radius)) - 1, 0);
}

// Σ_q f_q along one axis, the filter's parts at `offset` from the centre of pixel `pixel`, over the
// pixels [begin, end) of the image. `parts_at`: of an offset from a pixel's own centre.
template <typename PartsAt>
FilterSampler::Parts PartsOfAll(const PartsAt& parts_at, float filter_radius, float offset,
                                int pixel, int begin, int end) {
  const int radius = static_cast<int>(std::ceil(filter_radius + std::abs(offset)));
  FilterSampler::Parts sum;
  for (int q = std::max(pixel - radius, begin); q < std::min(pixel + radius + 1, end); ++q) {
    const FilterSampler::Parts parts = parts_at(offset + static_cast<float>(pixel - q));
    sum.positive += parts.positive;
    sum.negative += parts.negative;
  }
  return sum;
}

}  // namespace

FilmSpread::FilmSpread(const EyePathTracer& tracer)
    : tracer_(tracer),
      width_(tracer.settings().crop_width()),
      height_(tracer.settings().crop_height()),
      reach_x_(ReachOf(tracer.filter().radius_x())),
      reach_y_(ReachOf(tracer.filter().radius_y())),
      image_({-tracer.settings().crop_x0, -tracer.settings().crop_y0,
              tracer.settings().width - tracer.settings().crop_x0,
              tracer.settings().height - tracer.settings().crop_y0}) {}

FilmSpread::FilmSpread(const EyePathTracer& tracer, Glints glints) : FilmSpread(tracer) {
  finds_glints_ = false;
  glints_ = std::move(glints);
}

FilmRegion FilmSpread::OnFilm(const Window& pixels) const {
  const auto reach_x = static_cast<double>(tracer_.filter().radius_x());
  const auto reach_y = static_cast<double>(tracer_.filter().radius_y());
  return {pixels.x0 - image_.x0 + 0.5 - reach_x, pixels.y0 - image_.y0 + 0.5 - reach_y,
          pixels.x1 - image_.x0 - 0.5 + reach_x, pixels.y1 - image_.y0 - 0.5 + reach_y};
}

void FilmSpread::Prepare(ThreadTeam& team) {
  if (is_prepared_ || !is_needed()) return;
  is_prepared_ = true;
  // One more on each side: an outline lies between two centres that differ.
  around_ = {std::max(-reach_x_ - 1, image_.x0), std::max(-reach_y_ - 1, image_.y0),
             std::min(width_ + reach_x_ + 1, image_.x1),
             std::min(height_ + reach_y_ + 1, image_.y1)};
  const auto columns = static_cast<std::size_t>(around_.x1 - around_.x0);
  const auto rows = static_cast<std::size_t>(around_.y1 - around_.y0);
  const auto tiles_x = static_cast<std::size_t>(TilesOf(around_.x1 - around_.x0));
  const auto tiles_y = static_cast<std::size_t>(TilesOf(around_.y1 - around_.y0));
  centres_.resize(tiles_x * tiles_y);
  team.For(centres_.size(), 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t tile = begin; tile < end; ++tile) {
      const int x0 = around_.x0 + static_cast<int>(tile % tiles_x) * kSpreadTile;
      const int y0 = around_.y0 + static_cast<int>(tile / tiles_x) * kSpreadTile;
      std::array<Rgb, static_cast<std::size_t>(kSpreadTile) * kSpreadTile> centres{};
      for (int y = y0; y < std::min(y0 + kSpreadTile, around_.y1); ++y) {
        for (int x = x0; x < std::min(x0 + kSpreadTile, around_.x1); ++x)
          centres[static_cast<std::size_t>((y - y0) * kSpreadTile + x - x0)] =
              tracer_.BrightAtCentre(x, y);
      }
      if (!std::ranges::all_of(centres, IsBlack))
        centres_[tile].assign(centres.begin(), centres.end());
    }
  });

  const BrightOutlines outlines = FindBrightOutlines(tracer_);
  const double pixels = static_cast<double>(tracer_.settings().width) *
                        static_cast<double>(tracer_.settings().height);
  const double affordable = outlines.count > 0
                                ? kBrightPathsAPixel * pixels / static_cast<double>(outlines.count)
                                : static_cast<double>(kMostBrightPaths);
  bright_paths_ = static_cast<int>(std::min<double>(affordable, kMostBrightPaths));
  if (bright_paths_ >= 2) {
    is_near_outline_.resize(columns * rows);
    bool is_any_near = false;
    for (int y = around_.y0; y < around_.y1; ++y) {
      for (int x = around_.x0; x < around_.x1; ++x) {
        bool is_near = false;
        if (!outlines.is_near.empty()) {
          is_near = outlines.is_near[static_cast<std::size_t>(y - image_.y0) *
                                         static_cast<std::size_t>(image_.x1 - image_.x0) +
                                     static_cast<std::size_t>(x - image_.x0)] != 0;
        }
        const Rgb centre = CentreAt(x, y);
        for (int ny = std::max(y - 1, around_.y0); ny < std::min(y + 2, around_.y1); ++ny) {
          for (int nx = std::max(x - 1, around_.x0); nx < std::min(x + 2, around_.x1); ++nx)
            is_near = is_near || CentreAt(nx, ny) != centre;
        }
        is_near_outline_[IndexOf(x, y)] = is_near ? 1 : 0;
        is_any_near = is_any_near || is_near;
      }
    }
    if (!is_any_near) FreeMemoryOf(is_near_outline_);
  }

  if (finds_glints_) glints_ = Glints(tracer_, OnFilm({0, 0, width_, height_}), team);
  first_path_of_glint_ = {0};
  for (const Glint& glint : glints_.all()) {
    first_path_of_glint_.push_back(first_path_of_glint_.back() +
                                   static_cast<std::size_t>(glint.paths));
  }
}

std::vector<FilmSpread::GlintPath> FilmSpread::TraceGlints(std::uint64_t pass,
                                                           ThreadTeam& team) const {
  std::vector<GlintPath> paths(first_path_of_glint_.back());
  team.For(glints_.all().size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Glint& glint = glints_.all()[i];
      const PixelSampler sampler(tracer_.settings().seed, glint.key, pass, pass);
      for (int number = 0; number < glint.paths; ++number) {
        const BrightSample sample = sampler.ForBright(number, glint.paths);
        GlintPath& path = paths[first_path_of_glint_[i] + static_cast<std::size_t>(number)];
        path.glint = i;
        path.from.on_lens = tracer_.OnLens(sample.camera[2], sample.camera[3]);
        const Glint::FilmPoint place =
            glint.Sample(sample.camera[0], sample.camera[1], path.from.on_lens);
        const double column = std::floor(place.x);
        const double row = std::floor(place.y);
        path.x = image_.x0 + static_cast<int>(column);
        path.y = image_.y0 + static_cast<int>(row);
        path.from.x = static_cast<float>(place.x - column - 0.5);
        path.from.y = static_cast<float>(place.y - row - 0.5);
        path.bright =
            tracer_.BrightOf(tracer_.CameraRayThrough(place.x, place.y, path.from.on_lens),
                             sample.branches, tracer_.WavelengthOf(sample.wavelength()));
      }
    }
  });
  return paths;
}

Rgb FilmSpread::CentreAt(int x, int y) const {
  const int column = x - around_.x0;
  const int row = y - around_.y0;
  const int tiles_x = TilesOf(around_.x1 - around_.x0);
  const std::vector<Rgb>& tile =
      centres_[static_cast<std::size_t>(row / kSpreadTile * tiles_x + column / kSpreadTile)];
  if (tile.empty()) return {};
  return tile[static_cast<std::size_t>(row % kSpreadTile * kSpreadTile + column % kSpreadTile)];
}

int FilmSpread::BrightPathsOf(int x, int y) const {
  if (is_near_outline_.empty()) return 0;
  return is_near_outline_[IndexOf(x, y)] != 0 ? bright_paths_ : 0;
}

void FilmSpread::Add(std::uint64_t pass, const std::vector<Rgb>& bright, std::vector<Rgb>& direct,
                     ThreadTeam& team, const std::function<bool()>& shall_stop) {
  if (!is_needed() || (shall_stop && shall_stop())) return;
  Prepare(team);
  const std::vector<GlintPath> glint_paths = TraceGlints(pass, team);
  const int tiles_x = TilesOf(width_);
  const int tiles_y = TilesOf(height_);
  team.For(
      static_cast<std::size_t>(tiles_x) * static_cast<std::size_t>(tiles_y), 4,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t tile = begin; tile < end; ++tile) {
          if (shall_stop && shall_stop()) return;
          const int x0 = static_cast<int>(tile % static_cast<std::size_t>(tiles_x)) * kSpreadTile;
          const int y0 = static_cast<int>(tile / static_cast<std::size_t>(tiles_x)) * kSpreadTile;
          AddTile(pass,
                  {x0, y0, std::min(x0 + kSpreadTile, width_), std::min(y0 + kSpreadTile, height_)},
                  bright, glint_paths, direct);
        }
      });
}

void FilmSpread::AddTile(std::uint64_t pass, const Window& tile, const std::vector<Rgb>& bright,
                         const std::vector<GlintPath>& glint_paths,
                         std::vector<Rgb>& direct) const {
  const auto pixel_at = [&](int x, int y) {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
           static_cast<std::size_t>(x);
  };
  const auto is_in_crop = [&](int x, int y) {
    return x >= 0 && x < width_ && y >= 0 && y < height_;
  };
  // The pixels whose paths count in the tile.
  const Window around = {
      std::max(tile.x0 - reach_x_, image_.x0), std::max(tile.y0 - reach_y_, image_.y0),
      std::min(tile.x1 + reach_x_, image_.x1), std::min(tile.y1 + reach_y_, image_.y1)};
  struct Path {
    Rgb bright;
    EyePathTracer::FilmOffset from;  // the centre of its pixel
    float inverse_density = 0;       // of all that could have drawn it, over the paths of its pixel
  };
  std::vector<Path> paths;
  // [pixels around + 1] of the first path of each, row by row.
  std::vector<std::size_t> first_path;
  const auto pixels_around = static_cast<std::size_t>(around.x1 - around.x0) *
                             static_cast<std::size_t>(around.y1 - around.y0);
  paths.reserve(pixels_around);
  first_path.reserve(pixels_around + 1);
  bool is_dark = true;
  for (int y = around.y0; y < around.y1; ++y) {
    for (int x = around.x0; x < around.x1; ++x) {
      first_path.push_back(paths.size());
      if (const int count = BrightPathsOf(x, y); count > 0) {
        for (int number = 0; number < count; ++number) {
          const EyePathTracer::BrightPath path = tracer_.TraceBrightPath(x, y, pass, number, count);
          is_dark = is_dark && IsBlack(path.bright);
          paths.push_back({.bright = path.bright, .from = path.from});
        }
        continue;
      }
      const Rgb found = is_in_crop(x, y) ? bright[pixel_at(x, y)] : tracer_.TraceBright(x, y, pass);
      is_dark = is_dark && IsBlack(found);
      paths.push_back({.bright = found, .from = {}});
    }
  }
  first_path.push_back(paths.size());
  std::vector<std::size_t> glints_near;
  glints_.ForEachNear(OnFilm(tile), [&](std::size_t glint) { glints_near.push_back(glint); });
  for (const std::size_t glint : glints_near) {
    for (const GlintPath& path : PathsOf(glint_paths, glint))
      is_dark = is_dark && IsBlack(path.bright);
  }
  for (int y = tile.y0; is_dark && y < tile.y1; ++y) {
    for (int x = tile.x0; is_dark && x < tile.x1; ++x)
      is_dark = IsBlack(CentreAt(x, y));
  }
  if (is_dark) return;

  const auto paths_of = [&](int x, int y) {
    const std::size_t pixel =
        static_cast<std::size_t>(y - around.y0) * static_cast<std::size_t>(around.x1 - around.x0) +
        static_cast<std::size_t>(x - around.x0);
    return std::span(paths).subspan(first_path[pixel], first_path[pixel + 1] - first_path[pixel]);
  };
  const FilterSampler& filter = tracer_.filter();
  // Σ_s p_s(f) + Σ_g n_g p_g(f); `drawn_by`: the glint that a path was drawn for, if any.
  const auto density_at = [&](int x, int y, const EyePathTracer::FilmOffset& from,
                              std::optional<std::size_t> drawn_by) {
    const float of_pixels =
        filter.Density(PartsOfAll([&](float at) { return filter.AlongX(at); }, filter.radius_x(),
                                  from.x, x, image_.x0, image_.x1),
                       PartsOfAll([&](float at) { return filter.AlongY(at); }, filter.radius_y(),
                                  from.y, y, image_.y0, image_.y1));
    const Glint::FilmPoint place = {x - image_.x0 + 0.5 + static_cast<double>(from.x),
                                    y - image_.y0 + 0.5 + static_cast<double>(from.y)};
    double of_glints = 0;
    for (const std::size_t i : glints_near) {
      const Glint& glint = glints_.all()[i];
      // Of its own a path is no nearer than rounding to the rim.
      of_glints += glint.paths *
                   (drawn_by == i ? glint.LargestDensity() : glint.Density(place, from.on_lens));
    }
    return of_pixels + static_cast<float>(of_glints);
  };
  for (int y = around.y0; y < around.y1; ++y) {
    for (int x = around.x0; x < around.x1; ++x) {
      const std::span<Path> of_pixel = paths_of(x, y);
      if (BrightPathsOf(x, y) == 0) of_pixel[0].from = tracer_.FilmOffsetOf(x, y, pass);
      for (Path& path : of_pixel) {
        const float density =
            density_at(x, y, path.from, std::nullopt) * static_cast<float>(of_pixel.size());
        path.inverse_density = density > 0 ? 1 / density : 0;
      }
    }
  }
  const int filter_reach_x = static_cast<int>(std::ceil(filter.radius_x() + 0.5F));
  const int filter_reach_y = static_cast<int>(std::ceil(filter.radius_y() + 0.5F));
  // Of a pixel whose neighbour (dx, dy) the path belongs to.
  const auto filter_at = [&](int dx, int dy, const EyePathTracer::FilmOffset& from) {
    return FilterSampler::Value(filter.AlongX(from.x + static_cast<float>(dx)),
                                filter.AlongY(from.y + static_cast<float>(dy)));
  };
  for (int y = tile.y0; y < tile.y1; ++y) {
    for (int x = tile.x0; x < tile.x1; ++x) {
      const Rgb centre = CentreAt(x, y);
      Rgb sum = centre;
      for (int qy = std::max(y - reach_y_, around.y0); qy < std::min(y + reach_y_ + 1, around.y1);
           ++qy) {
        for (int qx = std::max(x - reach_x_, around.x0); qx < std::min(x + reach_x_ + 1, around.x1);
             ++qx) {
          for (const Path& of_q : paths_of(qx, qy)) {
            const Rgb excess = of_q.bright - centre;
            if (IsBlack(excess)) continue;
            sum += excess * (filter_at(qx - x, qy - y, of_q.from) * of_q.inverse_density);
          }
        }
      }
      direct[pixel_at(x, y)] += sum;
    }
  }
  for (const std::size_t glint : glints_near) {
    for (const GlintPath& path : PathsOf(glint_paths, glint)) {
      const float density = density_at(path.x, path.y, path.from, glint);
      const int low_x = std::max(path.x - filter_reach_x, tile.x0);
      const int high_x = std::min(path.x + filter_reach_x + 1, tile.x1);
      for (int y = std::max(path.y - filter_reach_y, tile.y0);
           y < std::min(path.y + filter_reach_y + 1, tile.y1); ++y) {
        for (int x = low_x; x < high_x; ++x) {
          direct[pixel_at(x, y)] += (path.bright - CentreAt(x, y)) *
                                    (filter_at(path.x - x, path.y - y, path.from) / density);
        }
      }
    }
  }
}

}  // namespace lucerna
