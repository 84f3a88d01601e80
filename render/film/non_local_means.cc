#include "render/film/non_local_means.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "render/base/status.h"

namespace lucerna {
namespace {

// A patch of the image on its own, with as much around it as filtering it looks at; beyond the
// image's border as at it.
constexpr int kTileWidth = 64, kTileHeight = 32;
constexpr int kMargin = kFilterReach + kPatchReach;
constexpr int kStride = kTileWidth + 2 * kMargin;
constexpr int kRows = kTileHeight + 2 * kMargin;
constexpr std::size_t kPatched = static_cast<std::size_t>(kStride) * kRows;
using TileColumn = std::array<float, kPatched>;
using TileValues = std::array<float, static_cast<std::size_t>(kTileWidth) * kTileHeight>;

// Differences between features at which a pixel weighs four ninths of what it would.
constexpr float kNormalScale = 0.15F;
constexpr float kAlbedoScale = 0.1F;
// Of depth, over what the slope of the surface lets expect, and a share of the depth itself.
constexpr float kSlopeFactor = 2;
constexpr float kDepthShare = 1e-3F;

struct TileData {
  std::array<std::array<TileColumn, 3>, 2> halves;
  std::array<TileColumn, 3> variance, albedo, normal;
  TileColumn normal_variance, depth, slope_x, slope_y;
};
struct TileSums {
  std::array<TileValues, 3> color{};
  TileValues weight{};
};

constexpr std::size_t At(int x, int y) {
  return static_cast<std::size_t>(y) * kStride + static_cast<std::size_t>(x);
}

class TileFilter {
 public:
  TileFilter(std::span<const float> strengths, int width, int height, int x0, int y0)
      : strengths_(strengths),
        width_(width),
        height_(height),
        x0_(x0),
        y0_(y0),
        columns_(std::min(kTileWidth, width - x0)),
        rows_(std::min(kTileHeight, height - y0)) {}

  void Load(const ImageHalves& halves, const ColorColumns& variance,
            const SurfaceFeatures* features) {
    for (std::size_t half = 0; half < 2; ++half) {
      for (std::size_t c = 0; c < 3; ++c)
        Copy(halves[half][c], data_.halves[half][c]);
    }
    for (std::size_t c = 0; c < 3; ++c)
      Copy(variance[c], data_.variance[c]);
    has_features_ = features != nullptr;
    if (!has_features_) return;
    for (std::size_t c = 0; c < 3; ++c) {
      Copy(features->albedo[c], data_.albedo[c]);
      Copy(features->normal[c], data_.normal[c]);
    }
    Copy(features->normal_variance, data_.normal_variance);
    Copy(features->distance, data_.depth);
    // Nothing was hit: far from all that was.
    for (float& depth : data_.depth) {
      if (!std::isfinite(depth)) depth = 0;
    }
    // The lesser of both sides, so that an edge is no slope; of pixels around, since depth behind
    // rough glass is noise.
    const auto slopes = [&](std::size_t step, TileColumn& slope) {
      TileColumn single{};
      for (std::size_t i = kStride; i + kStride < kPatched; ++i) {
        const float here = data_.depth[i];
        single[i] = std::min(std::abs(data_.depth[i + step] - here),
                             std::abs(here - data_.depth[i - step]));
      }
      for (std::size_t i = 2 * kStride; i + 2 * kStride < kPatched; ++i) {
        float sum = 0;
        for (const std::size_t row : {i - kStride, i, i + kStride})
          sum += single[row - 1] + single[row] + single[row + 1];
        slope[i] = sum / 9;
      }
    };
    slopes(1, data_.slope_x);
    slopes(kStride, data_.slope_y);
  }

  void Filter() {
    sums_.assign(strengths_.size(), {});
    for (int dy = -kFilterReach; dy <= kFilterReach; ++dy) {
      for (int dx = -kFilterReach; dx <= kFilterReach; ++dx) {
        CompareFeatures(dx, dy);
        ComparePatches(dx, dy);
        for (std::size_t half = 0; half < 2; ++half) {
          SumPatches(differences_[half]);
          AddNeighbours(half, dx, dy);
        }
      }
    }
  }

  void Store(std::vector<ImageHalves>& filtered) const {
    for (std::size_t k = 0; k < strengths_.size(); ++k) {
      for (std::size_t half = 0; half < 2; ++half) {
        const TileSums& sums = sums_[k][half];
        for (std::size_t c = 0; c < 3; ++c) {
          for (int y = 0; y < rows_; ++y) {
            for (int x = 0; x < columns_; ++x) {
              // A pixel weighs 1 for itself.
              filtered[k][half][c][Pixel(x0_ + x, y0_ + y)] =
                  sums.color[c][InTile(x, y)] / sums.weight[InTile(x, y)];
            }
          }
        }
      }
    }
  }

 private:
  [[nodiscard]] std::size_t Pixel(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
           static_cast<std::size_t>(x);
  }
  [[nodiscard]] bool IsInImage(int x, int y) const {
    return x >= 0 && x < width_ && y >= 0 && y < height_;
  }
  static constexpr std::size_t InTile(int x, int y) {
    return static_cast<std::size_t>(y) * kTileWidth + static_cast<std::size_t>(x);
  }

  void Copy(const std::vector<float>& from, TileColumn& to) const {
    for (int y = 0; y < kRows; ++y) {
      const int row = std::clamp(y0_ + y - kMargin, 0, height_ - 1);
      for (int x = 0; x < kStride; ++x)
        to[At(x, y)] = from[Pixel(std::clamp(x0_ + x - kMargin, 0, width_ - 1), row)];
    }
  }

  // Weights of the pixels (dx, dy) away by what they show.
  void CompareFeatures(int dx, int dy) {
    constexpr float kPerAlbedo = 1 / (3 * kAlbedoScale * kAlbedoScale);
    constexpr float kThird = 1.0F / 3;
    const auto across = static_cast<float>(std::abs(dx)), down = static_cast<float>(std::abs(dy));
    feature_weights_.fill(1);
    for (int y = 0; has_features_ && y < rows_; ++y) {
      const std::size_t p = At(kMargin, kMargin + y);
      const std::size_t q = At(kMargin + dx, kMargin + y + dy);
      float* const weights = &feature_weights_[InTile(0, y)];
      for (std::size_t x = 0; x < kTileWidth; ++x) {
        float normal = 0, albedo = 0;
        for (std::size_t c = 0; c < 3; ++c) {
          const float of_normal = data_.normal[c][q + x] - data_.normal[c][p + x];
          const float of_albedo = data_.albedo[c][q + x] - data_.albedo[c][p + x];
          normal += of_normal * of_normal;
          albedo += of_albedo * of_albedo;
        }
        // What chance makes of normals is no difference. It is in both halves: no comparison of
        // these would find it.
        const float by_chance = data_.normal_variance[p + x] + data_.normal_variance[q + x];
        normal = std::max(0.0F, normal - 2 * by_chance) / (kNormalScale * kNormalScale + by_chance);
        const float expected =
            kSlopeFactor * (data_.slope_x[p + x] * across + data_.slope_y[p + x] * down) +
            kDepthShare * data_.depth[p + x] + 1e-30F;
        // No further than where the weight is 0 in any case, so that the square is finite.
        const float depth =
            std::min(std::abs(data_.depth[q + x] - data_.depth[p + x]) / expected, 2.0F);
        const float away = normal * kThird + albedo * kPerAlbedo + depth * depth * kThird;
        const float weight = std::max(0.0F, 1 - away);
        weights[x] = weight * weight;
      }
    }
    // What lies outside of the image does not count.
    for (int y = 0; y < rows_; ++y) {
      for (int x = 0; x < kTileWidth; ++x) {
        if (!IsInImage(x0_ + x + dx, y0_ + y + dy)) feature_weights_[InTile(x, y)] = 0;
      }
    }
  }

  // Squared differences of single pixels over what noise lets expect, of the tile and a patch
  // around it.
  void ComparePatches(int dx, int dy) {
    for (int y = kFilterReach; y < kRows - kFilterReach; ++y) {
      const std::size_t p = At(kFilterReach, y);
      const std::size_t q = At(kFilterReach + dx, y + dy);
      constexpr std::size_t kAcross = kStride - 2 * kFilterReach;
      std::array<float*, 2> to = {&differences_[0][p], &differences_[1][p]};
      for (std::size_t x = 0; x < kAcross; ++x) {
        float first = 0, second = 0;
        for (std::size_t c = 0; c < 3; ++c) {
          const float expected = data_.variance[c][p + x] + data_.variance[c][q + x];
          const float a = data_.halves[0][c][q + x] - data_.halves[0][c][p + x];
          const float b = data_.halves[1][c][q + x] - data_.halves[1][c][p + x];
          first += a * a / expected;
          second += b * b / expected;
        }
        // Patches of surfaces that have nothing in common are far enough apart with less.
        constexpr float kMost = 1e6F;
        to[0][x] = std::min(first, kMost);
        to[1][x] = std::min(second, kMost);
      }
    }
  }

  // Means over patches and channels, less what noise lets expect, but not below 0.
  void SumPatches(const TileColumn& differences) {
    constexpr int kSide = 2 * kPatchReach + 1;
    constexpr float kPerTerm = 1.0F / (3 * kSide * kSide);
    for (int y = 0; y < rows_; ++y) {
      std::array<float, kStride> down{};
      for (int i = 0; i < kSide; ++i) {
        const float* const row = &differences[At(0, y + kFilterReach + i)];
        for (std::size_t x = 0; x < kStride; ++x)
          down[x] += row[x];
      }
      float* const to = &distances_[InTile(0, y)];
      for (std::size_t x = 0; x < kTileWidth; ++x) {
        const float* const from = &down[x + kFilterReach];
        to[x] = std::max(0.0F, (from[0] + from[1] + from[2] + from[3] + from[4]) * kPerTerm - 1);
      }
    }
    static_assert(kSide == 5);
  }

  void AddNeighbours(std::size_t half, int dx, int dy) {
    for (std::size_t k = 0; k < strengths_.size(); ++k) {
      const float per_distance = 1 / (3 * strengths_[k] * strengths_[k]);
      TileSums& sums = sums_[k][half];
      for (int y = 0; y < rows_; ++y) {
        const std::size_t q = At(kMargin + dx, kMargin + y + dy);
        const std::size_t first = InTile(0, y);
        const float* const red = &data_.halves[half][0][q];
        const float* const green = &data_.halves[half][1][q];
        const float* const blue = &data_.halves[half][2][q];
        for (std::size_t x = 0; x < kTileWidth; ++x) {
          const float near = std::max(0.0F, 1 - distances_[first + x] * per_distance);
          const float weight = near * near * feature_weights_[first + x];
          sums.weight[first + x] += weight;
          sums.color[0][first + x] += weight * red[x];
          sums.color[1][first + x] += weight * green[x];
          sums.color[2][first + x] += weight * blue[x];
        }
      }
    }
  }

  std::span<const float> strengths_;
  int width_, height_, x0_, y0_, columns_, rows_;
  bool has_features_ = false;
  TileData data_;
  std::vector<std::array<TileSums, 2>> sums_;  // [strength][half]
  TileValues feature_weights_, distances_;
  std::array<TileColumn, 2> differences_{};
};

}  // namespace

std::vector<ImageHalves> FilterHalves(int width, int height, const ImageHalves& halves,
                                      const ColorColumns& variance, const SurfaceFeatures* features,
                                      std::span<const float> strengths, ThreadTeam& team) {
  LUCERNA_CHECK(width > 0 && height > 0);
  std::vector<ImageHalves> filtered(strengths.size());
  const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  for (ImageHalves& both : filtered) {
    for (ColorColumns& half : both) {
      for (std::vector<float>& channel : half)
        channel.resize(pixels);
    }
  }
  const int across = (width + kTileWidth - 1) / kTileWidth;
  const int down = (height + kTileHeight - 1) / kTileHeight;
  team.For(static_cast<std::size_t>(across) * static_cast<std::size_t>(down), 1,
           [&](std::size_t begin, std::size_t end) {
             for (std::size_t tile = begin; tile < end; ++tile) {
               const int column = static_cast<int>(tile) % across;
               const int row = static_cast<int>(tile) / across;
               const auto filter = std::make_unique<TileFilter>(
                   strengths, width, height, column * kTileWidth, row * kTileHeight);
               filter->Load(halves, variance, features);
               filter->Filter();
               filter->Store(filtered);
             }
           });
  return filtered;
}

}  // namespace lucerna
