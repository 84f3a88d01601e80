// Where do surfaces end, turn or meet?
//
// Segments at which the disc of a hitpoint must be cut, because what lies beyond is another
// surface, or none:
//   * open edges of meshes, and edges at which the faces turn by more than about 45 degrees
//     (kSameSurfaceCosine) or at which more than two faces meet. Corners in the same place to the
//     bit are the same corner, whatever mesh they belong to;
//   * edges between a surface on which photons are kept and one on which none are;
//   * rims of open analytic shapes (AddRim in geometry/shape_NAME.cc);
//   * where surfaces pass through each other (surface_crossings.h);
//   * the borders that a scene's sensors bring (Scene::sensor_borders).
//
// A segment that a surface merely passes by is harmless: discs are normalised by what is left of
// them, so cutting too much costs noise and no bias. So near misses (corners that are equal but for
// rounding, neighbours that do not share their corners) need no care.
//
// Segments are found by uniform grids of several widths, one inside the other: a query looks at the
// one whose cells are about as wide as its ball.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "render/geometry/surface_crossings.h"
#include "render/math/vector.h"
#include "render/scene/scene.h"

namespace lucerna {

// Surfaces turned less than this from each other count as one.
inline constexpr float kSameSurfaceCosine = 0.7F;

// Memory: 24 bytes a segment and about 40 in the grids, at least 1.2 MB when there are any; while
// it is built 24 per vertex and 40 per triangle of the scene.
class FeatureEdges {
 public:
  explicit FeatureEdges(const Scene& scene);
  // For tests.
  explicit FeatureEdges(std::vector<FeatureSegment> segments);

  [[nodiscard]] std::span<const FeatureSegment> segments() const { return segments_; }
  [[nodiscard]] bool empty() const { return segments_.empty(); }

  // Writes the numbers of the segments closer to `center` than `reach` to `found`, each once, in an
  // order that depends on the arguments alone. Returns how many there are; more than found.size()
  // when not all had room, or when there were too many to go through. Threads: any.
  [[nodiscard]] std::size_t Find(Vec3 center, float reach, std::span<std::uint32_t> found) const {
    if (levels_.empty()) return 0;
    std::size_t level = 0;
    while (level + 1 < levels_.size() && levels_[level].width < 2 * reach)
      ++level;
    const Level& grid = levels_[level];
    const std::array<int, 2> x = grid.Range(0, center.x - low_.x, reach);
    const std::array<int, 2> y = grid.Range(1, center.y - low_.y, reach);
    const std::array<int, 2> z = grid.Range(2, center.z - low_.z, reach);
    std::uint32_t any = 0;
    for (int k = z[0]; k <= z[1]; ++k) {
      for (int j = y[0]; j <= y[1]; ++j) {
        const std::size_t row = grid.Row(j, k);
        any |= grid.first[row + static_cast<std::size_t>(x[1]) + 1] -
               grid.first[row + static_cast<std::size_t>(x[0])];
      }
    }
    if (any == 0) return 0;
    return Search(grid, center, reach, x, y, z, found);
  }

 private:
  struct Level {
    float width = 0;
    float inverse_width = 0;
    std::array<int, 3> cells = {1, 1, 1};
    std::vector<std::uint32_t> first;     // [cells + 1] into `segments`
    std::vector<std::uint32_t> segments;  // of each cell, ascending

    [[nodiscard]] std::array<int, 2> Range(int axis, float offset, float reach) const {
      return {CellOf(axis, offset - reach), CellOf(axis, offset + reach)};
    }
    [[nodiscard]] int CellOf(int axis, float offset) const {
      const float cell = offset * inverse_width;
      const int last = cells[static_cast<std::size_t>(axis)] - 1;
      return cell > 0 ? (cell < static_cast<float>(last) ? static_cast<int>(cell) : last) : 0;
    }
    [[nodiscard]] std::size_t Row(int y, int z) const {
      return (static_cast<std::size_t>(z) * static_cast<std::size_t>(cells[1]) +
              static_cast<std::size_t>(y)) *
             static_cast<std::size_t>(cells[0]);
    }
  };

  void AddMeshEdges(const Scene& scene);
  void BuildLevels();
  template <typename Visit>
  void ForEachCell(const Level& level, const FeatureSegment& segment, const Visit& visit) const;
  [[nodiscard]] std::size_t Search(const Level& grid, Vec3 center, float reach,
                                   std::array<int, 2> x, std::array<int, 2> y, std::array<int, 2> z,
                                   std::span<std::uint32_t> found) const;

  std::vector<FeatureSegment> segments_;
  Vec3 low_;
  std::vector<Level> levels_;
};

}  // namespace lucerna
