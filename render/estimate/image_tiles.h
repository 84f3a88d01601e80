// By how much is a sum over an image off by chance, where neighbours are alike?
//
// Discs reach over neighbours, so that chance is alike within a few radii. Sums over square tiles
// that are wider than that hardly know of each other, and their spread is that of the whole sum.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>

namespace lucerna {

// Tiles of the image, by pixel.
class ImageTiles {
 public:
  ImageTiles(std::size_t pixels, std::size_t width)
      : width_(width),
        side_(std::max(kLeastSide, static_cast<std::size_t>(std::ceil(
                                       std::sqrt(static_cast<double>(pixels) / kMostTiles))))),
        across_((width + side_ - 1) / side_),
        count_(across_ * ((pixels / width + side_ - 1) / side_)) {}

  [[nodiscard]] std::size_t count() const { return count_; }
  [[nodiscard]] std::size_t Of(std::size_t pixel) const {
    return pixel / width_ / side_ * across_ + pixel % width_ / side_;
  }

 private:
  // Sides of tiles, in pixels, and about how many tiles an image has at most.
  static constexpr std::size_t kLeastSide = 16;
  static constexpr double kMostTiles = 1024;

  std::size_t width_, side_, across_, count_;
};

// Of fewer tiles with light the spread is not known.
inline constexpr double kFewestTiles = 8;

struct SumOfTiles {
  double sum = 0;
  double deviation = 0;  // of the sum
};
// `count` of the tiles bring something, two or more.
[[nodiscard]] inline SumOfTiles SumTiles(std::span<const double> of_tiles, double count) {
  double sum = 0, squares = 0;
  for (const double of_tile : of_tiles) {
    sum += of_tile;
    squares += of_tile * of_tile;
  }
  const double variance = count / (count - 1) * (squares - sum * sum / count);
  return {.sum = sum, .deviation = std::sqrt(std::max(variance, 0.0))};
}

}  // namespace lucerna
