// A distribution over the cells of a grid, of which any rectangle may be asked for: a density that
// is constant in each cell, in proportion to given weights, and zero outside of the rectangle.
// Source: Bitterli, Novák & Jarosz 2015, "Portal-Masked Environment Map Sampling".
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "render/math/vector.h"

namespace lucerna {

// Places are in units of cells.
struct GridWindow {
  double low_x = 0, high_x = 0, low_y = 0, high_y = 0;

  [[nodiscard]] bool Has(Vec2 place) const {
    const auto x = static_cast<double>(place.x);
    const auto y = static_cast<double>(place.y);
    return x >= low_x && x <= high_x && y >= low_y && y <= high_y;
  }
};

class WindowedConstant2D {
 public:
  WindowedConstant2D() = default;
  // `weights`: [height × width], >= 0 and finite.
  WindowedConstant2D(int width, int height, const std::vector<double>& weights)
      : width_(static_cast<std::size_t>(width)), height_(static_cast<std::size_t>(height)) {
    sums_.assign((width_ + 1) * (height_ + 1), 0);
    for (std::size_t y = 0; y < height_; ++y) {
      double row = 0;
      for (std::size_t x = 0; x < width_; ++x) {
        row += weights[y * width_ + x];
        sums_[(y + 1) * (width_ + 1) + x + 1] = sums_[y * (width_ + 1) + x + 1] + row;
      }
    }
  }

  // Of the weights in the window, those of cells in part in proportion.
  [[nodiscard]] double SumIn(const GridWindow& w) const {
    return SumBelow(w.high_x, w.high_y) - SumBelow(w.low_x, w.high_y) -
           SumBelow(w.high_x, w.low_y) + SumBelow(w.low_x, w.low_y);
  }
  // The weight of the cell.
  [[nodiscard]] double WeightAt(Vec2 place) const {
    const std::size_t x = CellOf(static_cast<double>(place.x), width_);
    const std::size_t y = CellOf(static_cast<double>(place.y), height_);
    return std::max(0.0, Corner(x + 1, y + 1) - Corner(x, y + 1) - Corner(x + 1, y) + Corner(x, y));
  }

  // Draws a place in a window of a positive sum: the column by `u1`, in [0, 1), then the row.
  [[nodiscard]] Vec2 Sample(const GridWindow& window, double u1, double u2) const {
    const double x = PlaceIn(window.low_x, window.high_x, u1, [&](double to) {
      return SumIn({window.low_x, to, window.low_y, window.high_y});
    });
    const auto column = static_cast<double>(CellOf(x, width_));
    const double y = PlaceIn(window.low_y, window.high_y, u2, [&](double to) {
      return SumIn({column, column + 1, window.low_y, to});
    });
    return {static_cast<float>(x), static_cast<float>(y)};
  }

 private:
  [[nodiscard]] static std::size_t CellOf(double place, std::size_t cells) {
    return std::min(static_cast<std::size_t>(std::max(place, 0.0)), cells - 1);
  }
  [[nodiscard]] double Corner(std::size_t x, std::size_t y) const {
    return sums_[y * (width_ + 1) + x];
  }
  // Of all to the left of and above a place.
  [[nodiscard]] double SumBelow(double x, double y) const {
    const std::size_t column = CellOf(x, width_);
    const std::size_t row = CellOf(y, height_);
    const double s = x - static_cast<double>(column);
    const double t = y - static_cast<double>(row);
    return (1 - t) * ((1 - s) * Corner(column, row) + s * Corner(column + 1, row)) +
           t * ((1 - s) * Corner(column, row + 1) + s * Corner(column + 1, row + 1));
  }
  // Where the share `u` of sum_to(high) is reached; sum_to is linear within cells.
  template <typename SumTo>
  static double PlaceIn(double low, double high, double u, const SumTo& sum_to) {
    const double wanted = u * sum_to(high);
    double first = std::floor(low);
    double last = std::ceil(high);
    while (last - first > 1) {
      const double middle = std::floor(0.5 * (first + last));
      (sum_to(middle) <= wanted ? first : last) = middle;
    }
    first = std::max(first, low);
    last = std::min(last, high);
    const double before = sum_to(first);
    const double within = sum_to(last) - before;
    const double share = within > 0 ? std::clamp((wanted - before) / within, 0.0, 1.0) : 0.5;
    return first + share * (last - first);
  }

  std::size_t width_ = 0, height_ = 0;
  std::vector<double> sums_;  // [height + 1 × width + 1] of all cells to the left and above
};

}  // namespace lucerna
