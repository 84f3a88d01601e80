// How does the density of a medium vary in space?
//
// Densities are given at the points of a regular grid and trilinear between them. Along a straight
// line within one cell of the grid such a density is a cubic polynomial, so that its integral, the
// column density, is exact: transmittance needs no random numbers, and free paths are drawn by
// inverting that integral.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "render/math/transform.h"
#include "render/math/vector.h"

namespace lucerna {

// A density along one cell of a grid, over the share s in [0, 1] of the way through the cell.
struct CellDensity {
  std::array<double, 4> coefficients = {};  // of 1, s, s², s³

  [[nodiscard]] double At(double s) const {
    const auto& [a, b, c, d] = coefficients;
    return a + s * (b + s * (c + s * d));
  }
  // From 0 to s.
  [[nodiscard]] double Integral(double s) const {
    const auto& [a, b, c, d] = coefficients;
    return s * (a + s * (b / 2 + s * (c / 3 + s * (d / 4))));
  }
  // The s up to which the integral is `wanted`, which is between 0 and that up to 1.
  [[nodiscard]] double WhereIntegralIs(double wanted) const;
};

class DensityGrid {
 public:
  // `values`: densities >= 0 at size[0] × size[1] × size[2] points, x fastest. Point (i, j, k) lies
  // at the middle of a cell of the box from `low` to `high`, which has as many cells as points, in
  // the space that `from_world` leads to: where pbrt-v4 has it. Beyond the last points density
  // falls to 0 over one cell, half of which lies in the box; outside of the box it is 0.
  DensityGrid(const std::array<int, 3>& size, std::span<const float> values, Vec3 low, Vec3 high,
              const Transform& from_world);

  // The same for a world whose lengths are `factor` times as many units.
  [[nodiscard]] DensityGrid ScaledBy(double factor) const;

  // How far a ray gets: until its column density [density × scene units] is `column`, but `length`
  // [scene units] at most, which may be infinite.
  struct Way {
    double length = 0, column = 0;
    bool is_through = true;  // through `length`, before `column` was reached
  };
  // `direction` is unit.
  [[nodiscard]] Way Travel(Vec3 origin, Vec3 direction, double length, double column) const;

  // At a point of the world. For tests and messages; rays know more.
  [[nodiscard]] double At(Vec3 position) const;

  [[nodiscard]] const std::array<int, 3>& size() const { return size_; }
  [[nodiscard]] float largest() const { return largest_; }
  [[nodiscard]] std::size_t bytes() const { return values_.size() * sizeof(float); }

 private:
  friend class ColumnTable;
  // Calls on_cell(begin, end, density) for the cells in which a ray finds any density, in order,
  // for the part of the ray from `begin` to `end` [scene units]; ends early when that returns
  // false.
  template <typename OnCell>
  void ForEachCell(Vec3 origin, Vec3 direction, double length, const OnCell& on_cell) const;

  // Cells have the number of their lowest corner, from -1 on. kBlock of them along each axis are a
  // block; blocks without any density are passed in one step.
  static constexpr int kBlock = 8;
  [[nodiscard]] static int BlockOf(int cell) { return (cell + 1) / kBlock; }
  [[nodiscard]] bool IsEmptyBlock(const std::array<int, 3>& cell) const {
    const auto x = static_cast<std::size_t>(BlockOf(cell[0]));
    const auto y = static_cast<std::size_t>(BlockOf(cell[1]));
    const auto z = static_cast<std::size_t>(BlockOf(cell[2]));
    return is_empty_[(z * blocks_[1] + y) * blocks_[0] + x] != 0;
  }
  // Where a grid point is in values_.
  [[nodiscard]] std::size_t IndexOf(int x, int y, int z) const {
    const auto from_border = [](int point) { return static_cast<std::size_t>(point) + 1; };
    return (from_border(z) * stride_[1] + from_border(y)) * stride_[0] + from_border(x);
  }
  void FindEmptyBlocks();
  // The density at the eight corners of a cell, x fastest; false where all are 0.
  [[nodiscard]] bool CornersOf(const std::array<int, 3>& cell,
                               std::array<float, 8>& corners) const {
    const float* const value = &values_[IndexOf(cell[0], cell[1], cell[2])];
    const std::size_t row = stride_[0];
    const std::size_t plane = row * stride_[1];
    corners = {value[0],     value[1],         value[row],         value[row + 1],
               value[plane], value[plane + 1], value[plane + row], value[plane + row + 1]};
    return corners != std::array<float, 8>{};
  }
  // From the world to a space in which point (i, j, k) of the grid is at (i, j, k).
  [[nodiscard]] std::array<double, 3> ToGrid(Vec3 v, double w) const;
  // The density on the way from `from` to `to`, both in [0, 1]³ of a cell.
  [[nodiscard]] static CellDensity AlongCell(const std::array<float, 8>& corners,
                                             const std::array<double, 3>& from,
                                             const std::array<double, 3>& to);

  std::array<int, 3> size_ = {};
  std::array<std::size_t, 2> stride_ = {};  // points with the border along x and y
  std::vector<float> values_;               // with a border of zeros, one point wide
  std::array<std::size_t, 3> blocks_ = {};
  std::vector<std::uint8_t> is_empty_;  // [blocks]
  Transform to_grid_;
  float largest_ = 0;
};

// Column densities at many places of one ray.
class ColumnTable {
 public:
  void Make(const DensityGrid& grid, Vec3 origin, Vec3 direction, double length);
  // From the ray's beginning to the distance `t` [scene units].
  [[nodiscard]] double At(double t) const;

 private:
  struct Cell {
    double begin, end;
    double before;  // column density up to there
    CellDensity density;
  };
  std::vector<Cell> cells_;
};

}  // namespace lucerna
