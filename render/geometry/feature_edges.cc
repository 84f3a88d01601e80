#include "render/geometry/feature_edges.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>
#include <utility>

#include "render/math/double3.h"
#include "render/scene/mesh_edges.h"
#include "render/scene/shape_lists.h"

namespace lucerna {
namespace {

// Of the finest grid, about. A room of few edges has cells of a 64th of its size.
constexpr double kFewestCells = 0x1p18;
constexpr double kMostCells = 0x1p23;
constexpr double kCellsPerSegment = 8;
// A query that meets more is as good as lost in foliage.
constexpr std::size_t kMostCandidates = 512;

// Squared, relative to `reach` squared, so that nothing leaves the range of a float.
float SquaredDistance(Vec3 center, const FeatureSegment& segment, float inverse_reach) {
  const Vec3 a = (segment.ends[0] - center) * inverse_reach;
  const Vec3 along = (segment.ends[1] - segment.ends[0]) * inverse_reach;
  const float squared = LengthSquared(along);
  const float t = squared > 0 ? std::clamp(-Dot(a, along) / squared, 0.0F, 1.0F) : 0.0F;
  return LengthSquared(a + along * t);
}

// Whether a surface goes on across an edge: two faces, or several that lie on each other, that
// leave it in nearly opposite directions.
bool IsSmooth(std::span<const Double3> wings) {
  if (wings.size() < 2) return false;
  constexpr double kSame = 0.9999;
  const Double3 one = wings[0];
  const Double3* other = nullptr;
  for (const Double3& wing : wings.subspan(1)) {
    if (Dot(wing, one) > kSame) continue;
    if (other == nullptr) {
      other = &wing;
    } else if (!(Dot(wing, *other) > kSame)) {
      return false;
    }
  }
  return other != nullptr && Dot(one, *other) < -static_cast<double>(kSameSurfaceCosine);
}

}  // namespace

FeatureEdges::FeatureEdges(const Scene& scene) {
  AddMeshEdges(scene);
  ForEachAnalyticShape(scene, [&](const auto& shape) {
    if constexpr (!std::decay_t<decltype(shape)>::kIsClosed) AddRim(shape, segments_);
  });
  const std::vector<FeatureSegment> crossings = SurfaceCrossings(scene);
  segments_.insert(segments_.end(), crossings.begin(), crossings.end());
  for (const auto& border : scene.sensor_borders)
    segments_.push_back({border});
  BuildLevels();
}

FeatureEdges::FeatureEdges(std::vector<FeatureSegment> segments) : segments_(std::move(segments)) {
  BuildLevels();
}

void FeatureEdges::AddMeshEdges(const Scene& scene) {
  std::size_t vertex_count = 0;
  std::size_t corner_count = 0;
  for (const TriangleMesh& mesh : scene.meshes) {
    vertex_count += mesh.positions.size();
    corner_count += mesh.indices.size();
  }
  // Scenes beyond that are refused elsewhere, or have discs that are not cut.
  if (std::max(vertex_count, corner_count) >= std::numeric_limits<std::uint32_t>::max()) return;
  std::vector<Vec3> positions;
  positions.reserve(vertex_count);
  std::vector<std::uint32_t> corners;
  corners.reserve(corner_count);
  std::vector<std::size_t> kept_begin;  // triangles at which meshes begin, and whether photons stay
  std::vector<bool> keeps;
  for (const TriangleMesh& mesh : scene.meshes) {
    kept_begin.push_back(corners.size() / 3);
    keeps.push_back(Gathers(scene.materials[static_cast<std::size_t>(mesh.traits.material)]));
    const auto first = static_cast<std::uint32_t>(positions.size());
    positions.insert(positions.end(), mesh.positions.begin(), mesh.positions.end());
    for (const std::uint32_t index : mesh.indices)
      corners.push_back(first + index);
  }
  const bool is_mixed = std::ranges::adjacent_find(keeps, std::not_equal_to<>()) != keeps.end();
  const auto keeps_photons = [&](std::uint32_t triangle) {
    const auto next = std::ranges::upper_bound(kept_begin, std::size_t{triangle});
    return keeps[static_cast<std::size_t>(next - kept_begin.begin() - 1)];
  };
  {
    const std::vector<std::uint32_t> welded = WeldVertices(positions, {});
    for (std::uint32_t& corner : corners)
      corner = welded[corner];
  }
  std::vector<Double3> wings;
  ForEachEdge(SidesByEdge(corners, positions.size()), [&](std::span<const TriangleSide> sides) {
    const FeatureSegment segment = {{positions[sides[0].low], positions[sides[0].high]}};
    const Double3 end(segment.ends[0]);
    const Double3 along = Double3(segment.ends[1]) - end;
    const double squared = Dot(along, along);
    if (!(squared > 0)) return;
    wings.clear();
    bool is_border = false;
    for (const TriangleSide& side : sides) {
      const Double3 to_corner = Double3(positions[corners[side.opposite]]) - end;
      const Double3 wing = to_corner - along * (Dot(to_corner, along) / squared);
      const double length = Length(wing);
      // A triangle without area has no side on which it lies.
      if (!(length > 1e-7 * Length(to_corner))) continue;
      wings.push_back(wing * (1 / length));
      is_border |= is_mixed && keeps_photons(side.triangle()) != keeps_photons(sides[0].triangle());
    }
    if (wings.empty()) return;
    if (is_border || !IsSmooth(wings)) segments_.push_back(segment);
  });
}

// Steps along the longest axis, a cell at a time: what lies between two steps is in few cells
// across. A little wider than the segment, for rounding.
template <typename Visit>
void FeatureEdges::ForEachCell(const Level& level, const FeatureSegment& segment,
                               const Visit& visit) const {
  const Vec3 a = segment.ends[0] - low_;
  const Vec3 along = segment.ends[1] - segment.ends[0];
  const float slack = 1e-3F * level.width;
  const Vec3 size = {std::abs(along.x), std::abs(along.y), std::abs(along.z)};
  const int major = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const auto at = [&](float t) { return a + along * t; };
  const float start = std::min(a[major], a[major] + along[major]);
  const float end = std::max(a[major], a[major] + along[major]);
  const int first = level.CellOf(major, start - slack);
  const int last = level.CellOf(major, end + slack);
  for (int step = first; step <= last; ++step) {
    float t0 = 0;
    float t1 = 1;
    if (along[major] != 0 && first != last) {
      const auto t_at = [&](float offset) {
        return std::clamp((offset - a[major]) / along[major], 0.0F, 1.0F);
      };
      t0 = t_at(static_cast<float>(step) * level.width - slack);
      t1 = t_at(static_cast<float>(step + 1) * level.width + slack);
    }
    const Vec3 p = at(t0);
    const Vec3 q = at(t1);
    std::array<std::array<int, 2>, 3> range;
    for (int axis = 0; axis < 3; ++axis) {
      const auto i = static_cast<std::size_t>(axis);
      range[i] = {level.CellOf(axis, std::min(p[axis], q[axis]) - slack),
                  level.CellOf(axis, std::max(p[axis], q[axis]) + slack)};
    }
    range[static_cast<std::size_t>(major)] = {step, step};
    for (int z = range[2][0]; z <= range[2][1]; ++z) {
      for (int y = range[1][0]; y <= range[1][1]; ++y) {
        for (int x = range[0][0]; x <= range[0][1]; ++x)
          visit(level.Row(y, z) + static_cast<std::size_t>(x));
      }
    }
  }
}

void FeatureEdges::BuildLevels() {
  if (segments_.empty()) return;
  Bounds bounds;
  for (const FeatureSegment& segment : segments_) {
    bounds.Add(segment.ends[0]);
    bounds.Add(segment.ends[1]);
  }
  low_ = bounds.low;
  const Vec3 extent = bounds.high - bounds.low;
  const double wanted = std::clamp(kCellsPerSegment * static_cast<double>(segments_.size()),
                                   kFewestCells, kMostCells);
  double width = static_cast<double>(MaxAbs(extent)) / 4096;
  if (!(width > 0)) width = 1;
  const auto cells_along = [](float size, double w) {
    return std::floor(static_cast<double>(size) / w) + 1;
  };
  while (cells_along(extent.x, width) * cells_along(extent.y, width) *
             cells_along(extent.z, width) >
         wanted) {
    width *= 1.1;
  }
  for (;; width *= 2) {
    Level& level = levels_.emplace_back();
    level.width = static_cast<float>(width);
    level.inverse_width = static_cast<float>(1 / width);
    level.cells = {static_cast<int>(cells_along(extent.x, width)),
                   static_cast<int>(cells_along(extent.y, width)),
                   static_cast<int>(cells_along(extent.z, width))};
    const std::size_t cells = static_cast<std::size_t>(level.cells[0]) *
                              static_cast<std::size_t>(level.cells[1]) *
                              static_cast<std::size_t>(level.cells[2]);
    level.first.assign(cells + 1, 0);
    for (const FeatureSegment& segment : segments_)
      ForEachCell(level, segment, [&](std::size_t cell) { ++level.first[cell]; });
    // Counts become ends, and ends, counted down while cells are filled, beginnings.
    std::uint64_t sum = 0;
    for (std::uint32_t& count : level.first) {
      sum += count;
      count = static_cast<std::uint32_t>(sum);
    }
    level.segments.resize(sum);
    for (std::size_t i = segments_.size(); i-- > 0;) {
      ForEachCell(level, segments_[i], [&](std::size_t cell) {
        level.segments[--level.first[cell]] = static_cast<std::uint32_t>(i);
      });
    }
    if (cells == 1) break;
  }
}

std::size_t FeatureEdges::Search(const Level& grid, Vec3 center, float reach, std::array<int, 2> x,
                                 std::array<int, 2> y, std::array<int, 2> z,
                                 std::span<std::uint32_t> found) const {
  const float inverse_reach = 1 / reach;
  std::size_t count = 0;
  std::size_t candidates = 0;
  for (int k = z[0]; k <= z[1]; ++k) {
    for (int j = y[0]; j <= y[1]; ++j) {
      const std::size_t row = grid.Row(j, k);
      const std::uint32_t begin = grid.first[row + static_cast<std::size_t>(x[0])];
      const std::uint32_t end = grid.first[row + static_cast<std::size_t>(x[1]) + 1];
      for (std::uint32_t i = begin; i < end; ++i) {
        if (++candidates > kMostCandidates) return found.size() + 1;
        const std::uint32_t number = grid.segments[i];
        if (!(SquaredDistance(center, segments_[number], inverse_reach) < 1)) continue;
        const auto seen = found.first(count);
        if (std::ranges::find(seen, number) != seen.end()) continue;
        if (count == found.size()) return found.size() + 1;
        found[count++] = number;
      }
    }
  }
  return count;
}

}  // namespace lucerna
