// Functions on the unit square, bilinear between evenly spaced knots: values, and densities that
// are drawn from. Of several functions with the same knots, mixtures are looked up and drawn from
// alike.
//
// Source: Pharr, Jakob & Humphreys 2023, "Physically Based Rendering", section A.5; the inverse of
// a linear density in the form that does not cancel.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "render/math/vector.h"

namespace lucerna {

// Four functions out of many, with shares that sum to 1. Those whose share is 0 do not count.
struct GridMixture {
  std::array<std::size_t, 4> grid{};
  std::array<float, 4> share{};
};

// Knots of x along rows, of y from row to row; the first and last ones lie at 0 and 1.
struct GridSize {
  std::size_t width = 0, height = 0;  // 2 or more
  [[nodiscard]] std::size_t knots() const { return width * height; }
};

// The cell of a place in [0, 1] on an axis of so many knots, and the place within it.
struct GridCell {
  std::size_t first;
  float within;  // [0, 1]
};
[[nodiscard]] inline GridCell CellAt(float place, std::size_t knots) {
  const float at = std::clamp(place, 0.0F, 1.0F) * static_cast<float>(knots - 1);
  const std::size_t first = std::min(static_cast<std::size_t>(at), knots - 2);
  return {first, at - static_cast<float>(first)};
}

class BilinearGrids {
 public:
  BilinearGrids() = default;
  // `values`: [grids × height × width].
  BilinearGrids(GridSize size, std::vector<float> values)
      : size_(size), values_(std::move(values)) {}

  [[nodiscard]] float At(std::size_t grid, Vec2 place) const {
    const GridCell x = CellAt(place.x, size_.width);
    const GridCell y = CellAt(place.y, size_.height);
    const float* low = &values_[grid * size_.knots() + y.first * size_.width + x.first];
    const float* high = low + size_.width;
    return (1 - y.within) * ((1 - x.within) * low[0] + x.within * low[1]) +
           y.within * ((1 - x.within) * high[0] + x.within * high[1]);
  }

  [[nodiscard]] std::size_t bytes() const { return values_.size() * sizeof(float); }
  bool operator==(const BilinearGrids& o) const { return values_ == o.values_; }

 private:
  GridSize size_;
  std::vector<float> values_;
};

class BilinearDensities {
 public:
  BilinearDensities() = default;
  // `values`: [grids × height × width], zero or more. Each grid is scaled to the integral 1; one of
  // zeros is even.
  BilinearDensities(GridSize size, std::vector<float> values)
      : size_(size), values_(std::move(values)) {
    const std::size_t grids = values_.size() / size_.knots();
    before_in_row_.resize(values_.size());
    rows_before_.resize(grids * size_.height);
    for (std::size_t grid = 0; grid < grids; ++grid)
      Prepare(grid);
  }

  struct Place {
    Vec2 at;
    float density = 0;
  };
  // Draws a place: its y by numbers.y, then its x by numbers.x, both in [0, 1).
  [[nodiscard]] Place Sample(const GridMixture& mixture, Vec2 numbers) const {
    const auto rows_before = [&](std::size_t row) { return RowsBefore(mixture, row); };
    const GridCell y =
        Draw(std::min(numbers.y, kBelowOne), size_.height, rows_before,
             [&](std::size_t row) { return BeforeInRow(mixture, row, size_.width - 1); });
    const auto before = [&](std::size_t x) { return BeforeAt(mixture, y, x); };
    const float whole = before(size_.width - 1);
    const GridCell x = Draw(std::min(numbers.x, kBelowOne) * whole, size_.width, before,
                            [&](std::size_t i) { return ValueAt(mixture, y, i); });
    return {{AxisPlace(x, size_.width), AxisPlace(y, size_.height)}, Density(mixture, x, y)};
  }
  // The numbers with which Sample draws `place`, and its density.
  [[nodiscard]] Place Find(const GridMixture& mixture, Vec2 place) const {
    const GridCell x = CellAt(place.x, size_.width);
    const GridCell y = CellAt(place.y, size_.height);
    const float rows = RowsBefore(mixture, y.first) +
                       Part(y.within, BeforeInRow(mixture, y.first, size_.width - 1),
                            BeforeInRow(mixture, y.first + 1, size_.width - 1)) /
                           static_cast<float>(size_.height - 1);
    const float whole = BeforeAt(mixture, y, size_.width - 1);
    const float part = BeforeAt(mixture, y, x.first) + Part(x.within, ValueAt(mixture, y, x.first),
                                                            ValueAt(mixture, y, x.first + 1)) /
                                                           static_cast<float>(size_.width - 1);
    // Where the whole row is zero, no number leads.
    const float in_row = whole > 0 ? part / whole : place.x;
    return {{std::clamp(in_row, 0.0F, 1.0F), std::clamp(rows, 0.0F, 1.0F)}, Density(mixture, x, y)};
  }
  [[nodiscard]] float Density(const GridMixture& mixture, Vec2 place) const {
    return Density(mixture, CellAt(place.x, size_.width), CellAt(place.y, size_.height));
  }

  [[nodiscard]] std::size_t bytes() const {
    return (values_.size() + before_in_row_.size() + rows_before_.size()) * sizeof(float);
  }
  bool operator==(const BilinearDensities& o) const { return values_ == o.values_; }

 private:
  static constexpr float kBelowOne = 0x1.fffffep-1F;

  void Prepare(std::size_t grid) {
    const std::span<float> values = std::span(values_).subspan(grid * size_.knots(), size_.knots());
    const double cell_width = 1 / static_cast<double>(size_.width - 1);
    const double cell_height = 1 / static_cast<double>(size_.height - 1);
    std::vector<double> of_rows(size_.height);
    double whole = 0;
    const auto add_up = [&] {
      whole = 0;
      for (std::size_t row = 0; row < size_.height; ++row) {
        double sum = 0;
        for (std::size_t x = 0; x + 1 < size_.width; ++x) {
          sum += 0.5 * cell_width *
                 (static_cast<double>(values[row * size_.width + x]) +
                  static_cast<double>(values[row * size_.width + x + 1]));
        }
        of_rows[row] = sum;
        if (row > 0) whole += 0.5 * cell_height * (of_rows[row - 1] + sum);
      }
    };
    add_up();
    if (!(whole > 0)) {
      std::ranges::fill(values, 1.0F);
      add_up();
    }
    double rows = 0;
    for (std::size_t row = 0; row < size_.height; ++row) {
      if (row > 0) rows += 0.5 * cell_height * (of_rows[row - 1] + of_rows[row]);
      rows_before_[grid * size_.height + row] = static_cast<float>(rows / whole);
      double sum = 0;
      for (std::size_t x = 0; x < size_.width; ++x) {
        const std::size_t i = row * size_.width + x;
        // Of values that are not scaled yet: this one and the one before it, which is.
        if (x > 0) {
          sum += 0.5 * cell_width *
                 (static_cast<double>(values[i - 1]) + static_cast<double>(values[i]) / whole);
        }
        values[i] = static_cast<float>(static_cast<double>(values[i]) / whole);
        before_in_row_[grid * size_.knots() + i] = static_cast<float>(sum);
      }
    }
  }

  template <typename Value>
  static float Mixed(const GridMixture& mixture, const Value& value) {
    float sum = 0;
    for (std::size_t i = 0; i < mixture.grid.size(); ++i) {
      if (mixture.share[i] > 0) sum += mixture.share[i] * value(mixture.grid[i]);
    }
    return sum;
  }
  // Of all rows before this one.
  [[nodiscard]] float RowsBefore(const GridMixture& mixture, std::size_t row) const {
    return Mixed(mixture,
                 [&](std::size_t grid) { return rows_before_[grid * size_.height + row]; });
  }
  // The integral along a row up to a knot.
  [[nodiscard]] float BeforeInRow(const GridMixture& mixture, std::size_t row,
                                  std::size_t x) const {
    return Mixed(mixture, [&](std::size_t grid) {
      return before_in_row_[grid * size_.knots() + row * size_.width + x];
    });
  }
  // The same between two rows.
  [[nodiscard]] float BeforeAt(const GridMixture& mixture, GridCell y, std::size_t x) const {
    return (1 - y.within) * BeforeInRow(mixture, y.first, x) +
           y.within * BeforeInRow(mixture, y.first + 1, x);
  }
  [[nodiscard]] float ValueAt(const GridMixture& mixture, GridCell y, std::size_t x) const {
    return Mixed(mixture, [&](std::size_t grid) {
      const float* low = &values_[grid * size_.knots() + y.first * size_.width + x];
      return (1 - y.within) * low[0] + y.within * low[size_.width];
    });
  }
  [[nodiscard]] float Density(const GridMixture& mixture, GridCell x, GridCell y) const {
    return (1 - x.within) * ValueAt(mixture, y, x.first) +
           x.within * ValueAt(mixture, y, x.first + 1);
  }

  // The integral from 0 to t of a density that goes from a to b as t goes from 0 to 1.
  static float Part(float t, float a, float b) { return t * (a + 0.5F * t * (b - a)); }
  // The t at which Part is `part`.
  static float PlaceOfPart(float part, float a, float b) {
    const float root = std::sqrt(std::max(0.0F, a * a + 2 * part * (b - a)));
    const float sum = a + root;
    return sum > 0 ? std::clamp(2 * part / sum, 0.0F, 1.0F) : 0.0F;
  }
  // Where the integral reaches `target`: `before` is the integral up to a knot, `value` the density
  // there.
  template <typename Before, typename Value>
  static GridCell Draw(float target, std::size_t knots, const Before& before, const Value& value) {
    std::size_t low = 0;
    std::size_t high = knots - 1;
    while (high - low > 1) {
      const std::size_t middle = (low + high) / 2;
      (before(middle) <= target ? low : high) = middle;
    }
    const float part = (target - before(low)) * static_cast<float>(knots - 1);
    return {low, PlaceOfPart(std::max(part, 0.0F), value(low), value(low + 1))};
  }
  static float AxisPlace(GridCell cell, std::size_t knots) {
    return (static_cast<float>(cell.first) + cell.within) / static_cast<float>(knots - 1);
  }

  GridSize size_;
  std::vector<float> values_;         // [grids × height × width]
  std::vector<float> before_in_row_;  // [the same]
  std::vector<float> rows_before_;    // [grids × height]
};

}  // namespace lucerna
