// A distribution over the cells of a grid: a density that is constant in each, in proportion to
// given weights. Source: Pharr, Jakob & Humphreys 2023, "Physically Based Rendering", section A.5.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "render/math/vector.h"

namespace lucerna {

class PiecewiseConstant2D {
 public:
  // weight(x, y) >= 0, finite. All of them 0: nothing may be drawn.
  template <typename Weight>
  PiecewiseConstant2D(int width, int height, const Weight& weight)
      : width_(static_cast<std::size_t>(width)) {
    columns_.reserve(width_ * static_cast<std::size_t>(height));
    rows_.reserve(static_cast<std::size_t>(height));
    std::vector<double> row(width_);
    for (int y = 0; y < height; ++y) {
      double row_sum = 0;
      for (int x = 0; x < width; ++x) {
        row_sum += static_cast<double>(weight(x, y));
        row[static_cast<std::size_t>(x)] = row_sum;
      }
      for (const double before : row)
        columns_.push_back(row_sum > 0 ? static_cast<float>(before / row_sum) : 1.0F);
      sum_ += row_sum;
      rows_.push_back(sum_);
    }
    if (!(sum_ > 0)) return;
    for (double& share : rows_)
      share /= sum_;
  }

  // Of all weights.
  [[nodiscard]] double sum() const { return sum_; }

  // Draws a place, in units of cells: the row by `u1`, in [0, 1), the column by `u2`.
  [[nodiscard]] Vec2 Sample(float u1, float u2) const {
    const float y = PlaceIn<double>(rows_, u1);
    const auto row = std::min(static_cast<std::size_t>(y), rows_.size() - 1);
    return {PlaceIn<float>(RowOf(row), u2), y};
  }
  // The density with which Sample draws a place, over that of an even one.
  [[nodiscard]] float Density(Vec2 place) const {
    const auto cell = [](float at, std::size_t cells) {
      return std::min(static_cast<std::size_t>(std::max(at, 0.0F)), cells - 1);
    };
    const std::size_t y = cell(place.y, rows_.size());
    const std::size_t x = cell(place.x, width_);
    const std::span<const float> row = RowOf(y);
    const double of_row = rows_[y] - (y == 0 ? 0 : rows_[y - 1]);
    const float in_row = row[x] - (x == 0 ? 0 : row[x - 1]);
    return static_cast<float>(of_row * static_cast<double>(rows_.size())) *
           (in_row * static_cast<float>(width_));
  }
  // With which u1 (x) and u2 (y), in [0, 1], Sample draws this place, about.
  [[nodiscard]] Vec2 NumbersAt(Vec2 place) const {
    const auto within = [](float at, std::size_t cells) {
      return std::clamp(at, 0.0F, std::nextafter(static_cast<float>(cells), 0.0F));
    };
    const float y = within(place.y, rows_.size());
    const auto row = static_cast<std::size_t>(y);
    return {NumberAt<double>(rows_, y), NumberAt<float>(RowOf(row), within(place.x, width_))};
  }

 private:
  // The place of `u` in [0, 1) among cumulative shares that end at 1: in units of cells.
  template <typename Number>
  static float PlaceIn(std::span<const Number> cumulative, float u) {
    const auto value = static_cast<Number>(u);
    // The first whose share ends beyond u; a cell without a share never is.
    auto found = std::upper_bound(cumulative.begin(), cumulative.end(), value);
    if (found == cumulative.end()) --found;
    const auto cell = found - cumulative.begin();
    const Number before = cell == 0 ? Number{0} : *(found - 1);
    const Number within = *found > before ? (value - before) / (*found - before) : Number{0};
    return static_cast<float>(cell) + std::min(static_cast<float>(within), 0x1.fffffep-1F);
  }
  template <typename Number>
  static float NumberAt(std::span<const Number> cumulative, float place) {
    const auto cell = static_cast<std::size_t>(place);
    const Number before = cell == 0 ? Number{0} : cumulative[cell - 1];
    return static_cast<float>(before + (cumulative[cell] - before) *
                                           static_cast<Number>(place - static_cast<float>(cell)));
  }
  [[nodiscard]] std::span<const float> RowOf(std::size_t row) const {
    return std::span(columns_).subspan(row * width_, width_);
  }

  std::size_t width_;
  double sum_ = 0;
  // Shares of the weights before the end of each row in all rows, and of each cell in its row.
  std::vector<double> rows_;
  std::vector<float> columns_;  // [rows × columns]
};

}  // namespace lucerna
