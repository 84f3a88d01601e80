#include "render/scene/density_grid.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "render/base/status.h"

namespace lucerna {

double CellDensity::WhereIntegralIs(double wanted) const {
  // Newton's method within a bracket, since the integral grows and its slope may be 0.
  double low = 0;
  double high = 1;
  const double whole = Integral(1);
  double s = whole > 0 ? std::clamp(wanted / whole, 0.0, 1.0) : 1;
  constexpr int kMostSteps = 60;
  for (int i = 0; i < kMostSteps; ++i) {
    const double over = Integral(s) - wanted;
    (over > 0 ? high : low) = s;
    constexpr double kExact = 1e-12;
    if (std::abs(over) <= kExact * whole || high - low < kExact) break;
    const double step = s - over / At(s);
    s = step > low && step < high ? step : (low + high) / 2;
  }
  return s;
}

DensityGrid::DensityGrid(const std::array<int, 3>& size, std::span<const float> values, Vec3 low,
                         Vec3 high, const Transform& from_world)
    : size_(size) {
  std::size_t count = 1;
  std::size_t with_border = 1;
  for (const int points : size_) {
    count *= static_cast<std::size_t>(points);
    with_border *= static_cast<std::size_t>(points + 2);
  }
  LUCERNA_CHECK(count == values.size());
  stride_ = {static_cast<std::size_t>(size_[0] + 2), static_cast<std::size_t>(size_[1] + 2)};
  largest_ = *std::ranges::max_element(values);
  values_.resize(with_border);
  const auto row = static_cast<std::size_t>(size_[0]);
  for (int z = 0; z < size_[2]; ++z) {
    for (int y = 0; y < size_[1]; ++y) {
      std::ranges::copy(values.first(row), &values_[IndexOf(0, y, z)]);
      values = values.subspan(row);
    }
  }
  FindEmptyBlocks();
  const auto points_per_unit = [&](std::size_t axis, float from, float to) {
    return size_[axis] / (static_cast<double>(to) - static_cast<double>(from));
  };
  to_grid_ = Transform::Translate(-0.5, -0.5, -0.5) *
             Transform::Scale(points_per_unit(0, low.x, high.x), points_per_unit(1, low.y, high.y),
                              points_per_unit(2, low.z, high.z)) *
             Transform::Translate(-static_cast<double>(low.x), -static_cast<double>(low.y),
                                  -static_cast<double>(low.z)) *
             from_world;
}

void DensityGrid::FindEmptyBlocks() {
  std::size_t count = 1;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    blocks_[axis] = static_cast<std::size_t>(BlockOf(size_[axis] - 1)) + 1;
    count *= blocks_[axis];
  }
  is_empty_.assign(count, 1);
  std::array<float, 8> corners{};
  for (int z = -1; z < size_[2]; ++z) {
    for (int y = -1; y < size_[1]; ++y) {
      const std::size_t row = (static_cast<std::size_t>(BlockOf(z)) * blocks_[1] +
                               static_cast<std::size_t>(BlockOf(y))) *
                              blocks_[0];
      for (int x = -1; x < size_[0]; ++x) {
        if (CornersOf({x, y, z}, corners))
          is_empty_[row + static_cast<std::size_t>(BlockOf(x))] = 0;
      }
    }
  }
}

DensityGrid DensityGrid::ScaledBy(double factor) const {
  DensityGrid scaled = *this;
  scaled.to_grid_ = to_grid_ * Transform::Scale(1 / factor, 1 / factor, 1 / factor);
  return scaled;
}

std::array<double, 3> DensityGrid::ToGrid(Vec3 v, double w) const {
  const auto& rows = to_grid_.rows();
  std::array<double, 3> result{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    result[axis] = rows[axis][0] * static_cast<double>(v.x) +
                   rows[axis][1] * static_cast<double>(v.y) +
                   rows[axis][2] * static_cast<double>(v.z) + rows[axis][3] * w;
  }
  return result;
}

CellDensity DensityGrid::AlongCell(const std::array<float, 8>& corners,
                                   const std::array<double, 3>& from,
                                   const std::array<double, 3>& to) {
  // Each coordinate is linear in s, so interpolation along one axis after the other raises the
  // degree by one.
  const std::array<double, 3> step = {to[0] - from[0], to[1] - from[1], to[2] - from[2]};
  const auto edge = [&](std::size_t first) {
    const auto low = static_cast<double>(corners[first]);
    const double difference = static_cast<double>(corners[first + 1]) - low;
    return std::array<double, 2>{low + from[0] * difference, step[0] * difference};
  };
  const auto face = [&](std::size_t first) {
    const std::array<double, 2> near = edge(first);
    const std::array<double, 2> far = edge(first + 2);
    const double a = far[0] - near[0];
    const double b = far[1] - near[1];
    return std::array<double, 3>{near[0] + from[1] * a, near[1] + from[1] * b + step[1] * a,
                                 step[1] * b};
  };
  const std::array<double, 3> near = face(0);
  const std::array<double, 3> far = face(4);
  const double a = far[0] - near[0];
  const double b = far[1] - near[1];
  const double c = far[2] - near[2];
  return {{near[0] + from[2] * a, near[1] + from[2] * b + step[2] * a,
           near[2] + from[2] * c + step[2] * b, step[2] * c}};
}

template <typename OnCell>
void DensityGrid::ForEachCell(Vec3 origin, Vec3 direction, double length,
                              const OnCell& on_cell) const {
  const std::array<double, 3> from = ToGrid(origin, 1);
  const std::array<double, 3> along = ToGrid(direction, 0);
  double begin = 0;
  double end = length;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double low = -0.5;
    const double high = size_[axis] - 0.5;
    if (along[axis] == 0) {
      if (!(from[axis] > low && from[axis] < high)) return;
      continue;
    }
    const double at_low = (low - from[axis]) / along[axis];
    const double at_high = (high - from[axis]) / along[axis];
    begin = std::max(begin, std::min(at_low, at_high));
    end = std::min(end, std::max(at_low, at_high));
  }
  const auto is_finite = [](const std::array<double, 3>& v) {
    return std::isfinite(v[0] + v[1] + v[2]);
  };
  if (!(begin < end) || !is_finite(from) || !is_finite(along)) return;

  std::array<int, 3> cell{};
  // Where the ray leaves the cells up to number `last` (in its direction) along an axis.
  const auto leaves_at = [&](std::size_t axis, int last) {
    const int plane = last + (along[axis] > 0 ? 1 : 0);
    return along[axis] == 0 ? HUGE_VAL : (plane - from[axis]) / along[axis];
  };
  std::array<double, 3> leaves_cell_at{};
  const auto enter = [&](std::size_t axis, int number) {
    cell[axis] = number;
    leaves_cell_at[axis] = leaves_at(axis, number);
  };
  const auto cell_at = [&](std::size_t axis, double t, int least, int greatest) {
    const double at = std::floor(from[axis] + t * along[axis]);
    return static_cast<int>(
        std::clamp(at, static_cast<double>(least), static_cast<double>(greatest)));
  };
  const auto first_of = [](const std::array<double, 3>& times) {
    const std::size_t first = times[0] < times[1] ? 0 : 1;
    return times[2] < times[first] ? std::size_t{2} : first;
  };
  // Into the next cell of this axis; false behind the last.
  const auto pass = [&](std::size_t axis, int number) {
    const int next = number + (along[axis] > 0 ? 1 : -1);
    if (next < -1 || next >= size_[axis]) return false;
    enter(axis, next);
    return true;
  };
  for (std::size_t axis = 0; axis < 3; ++axis)
    enter(axis, cell_at(axis, begin, -1, size_[axis] - 1));
  std::array<float, 8> corners{};
  while (begin < end) {
    if (IsEmptyBlock(cell)) {
      std::array<int, 3> low{};
      std::array<double, 3> leaves_block_at{};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        low[axis] = BlockOf(cell[axis]) * kBlock - 1;
        leaves_block_at[axis] =
            leaves_at(axis, along[axis] > 0 ? low[axis] + kBlock - 1 : low[axis]);
      }
      const std::size_t next = first_of(leaves_block_at);
      begin = std::max(begin, leaves_block_at[next]);
      if (!(begin < end)) return;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        if (axis == next) continue;
        const int high = std::min(low[axis] + kBlock - 1, size_[axis] - 1);
        enter(axis, cell_at(axis, begin, low[axis], high));
      }
      if (!pass(next, along[next] > 0 ? low[next] + kBlock - 1 : low[next])) return;
      continue;
    }
    const std::size_t next = first_of(leaves_cell_at);
    const double to = std::min(leaves_cell_at[next], end);
    if (to > begin) {
      if (CornersOf(cell, corners)) {
        std::array<double, 3> entry{};
        std::array<double, 3> exit{};
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const double corner = from[axis] - cell[axis];
          entry[axis] = std::clamp(corner + begin * along[axis], 0.0, 1.0);
          exit[axis] = std::clamp(corner + to * along[axis], 0.0, 1.0);
        }
        if (!on_cell(begin, to, AlongCell(corners, entry, exit))) return;
      }
      begin = to;
    }
    if (!pass(next, cell[next])) return;
  }
}

DensityGrid::Way DensityGrid::Travel(Vec3 origin, Vec3 direction, double length,
                                     double column) const {
  Way way = {length, 0, true};
  ForEachCell(origin, direction, length, [&](double begin, double end, const CellDensity& density) {
    const double span = end - begin;
    const double here = std::max(0.0, density.Integral(1)) * span;
    if (way.column + here < column) {
      way.column += here;
      return true;
    }
    way = {begin + span * density.WhereIntegralIs((column - way.column) / span), column, false};
    return false;
  });
  return way;
}

double DensityGrid::At(Vec3 position) const {
  const std::array<double, 3> at = ToGrid(position, 1);
  std::array<int, 3> cell{};
  std::array<double, 3> within{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!(at[axis] > -0.5 && at[axis] < size_[axis] - 0.5)) return 0;
    cell[axis] = static_cast<int>(std::floor(at[axis]));
    within[axis] = at[axis] - cell[axis];
  }
  std::array<float, 8> corners{};
  return CornersOf(cell, corners) ? AlongCell(corners, within, within).At(0) : 0;
}

void ColumnTable::Make(const DensityGrid& grid, Vec3 origin, Vec3 direction, double length) {
  cells_.clear();
  double before = 0;
  grid.ForEachCell(origin, direction, length,
                   [&](double begin, double end, const CellDensity& density) {
                     cells_.push_back({begin, end, before, density});
                     before += std::max(0.0, density.Integral(1)) * (end - begin);
                     return true;
                   });
}

double ColumnTable::At(double t) const {
  const auto after = std::ranges::upper_bound(cells_, t, {}, &Cell::begin);
  if (after == cells_.begin()) return 0;
  const Cell& cell = *std::prev(after);
  const double span = cell.end - cell.begin;
  const double share = std::min((t - cell.begin) / span, 1.0);
  return cell.before + std::max(0.0, cell.density.Integral(share)) * span;
}

}  // namespace lucerna
