// Where do surfaces end, turn or meet?
//
// Segments at which the disc of a hitpoint must be cut, because what lies beyond is another
// surface, or none:
//   * open edges of meshes, and edges at which the faces turn by about 45 degrees or more
//     (kSameSurfaceCosine) or at which more than two faces meet. Corners in the same place to the
//     bit are the same corner, whatever mesh they belong to;
//   * where a rounded border has turned by as much from a face that is much wider
//     (rounded_borders.h);
//   * edges between a surface on which photons are kept and one on which none are;
//   * rims of open analytic shapes (AddRim in geometry/shape_NAME.cc);
//   * where surfaces pass through each other (surface_crossings.h);
//   * the borders that a scene's sensors bring (Scene::sensor_borders).
//
// A segment that a surface merely passes by is harmless: discs are normalised by what is left of
// them, so cutting too much costs noise and no bias. So near misses (corners that are equal but for
// rounding, neighbours that do not share their corners) need no care.
//
// Segments are found by a tree of boxes with eight children each, of which a query tests all at
// once. (Grids of cells had, in a scene much wider than a disc, hundreds of segments in a cell.)
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "render/base/parallel.h"
#include "render/geometry/surface_crossings.h"
#include "render/math/vector.h"
#include "render/scene/mesh_edges.h"
#include "render/scene/scene.h"

namespace lucerna {

// Surfaces turned less than this from each other count as one: a little less than 45 degrees, so
// that the sides of an octagonal bar do not.
inline constexpr float kSameSurfaceCosine = 0.71F;

// A disc with what bends it out of its plane: what lies closer to its center than `reach` and
// closer to the plane through it than `height`.
struct DiscSlab {
  Vec3 center;
  Vec3 normal;  // unit
  float reach = 0;
  float height = 0;
};

// Memory: 24 bytes a segment and about 28 in the tree; while it is built 24 per vertex and 80 per
// triangle of the scene.
class FeatureEdges {
 public:
  // Threads as ThreadTeam has them; the result does not depend on them.
  explicit FeatureEdges(const Scene& scene, int threads = 1);
  // For tests.
  explicit FeatureEdges(std::vector<FeatureSegment> segments);

  // In an order of their own.
  [[nodiscard]] std::span<const FeatureSegment> segments() const { return segments_; }
  [[nodiscard]] bool empty() const { return segments_.empty(); }

  // Calls visit(segment) for each segment of which a part lies within `reach` and of which a part,
  // not always the same, lies within `height`, and for a few that come so near but for rounding, in
  // an order that depends on the arguments alone, until it returns false. Threads: any.
  template <typename Visit>
  void ForEachNear(const DiscSlab& slab, const Visit& visit) const {
    if (levels_.empty()) return;
    struct Group {
      std::uint32_t level, number;
    };
    std::array<Group, kLanes * kMostLevels> open;
    std::size_t count = 0;
    open[count++] = {static_cast<std::uint32_t>(levels_.size() - 1), 0};
    while (count > 0) {
      const Group group = open[--count];
      const Lanes& lanes = levels_[group.level][group.number];
      for (unsigned int near = group.level == 0 ? SegmentsNear(lanes, slab)
                                                : BoxesNear(lanes, slab);
           near != 0; near &= near - 1) {
        const auto child = static_cast<std::uint32_t>(kLanes * group.number) +
                           static_cast<std::uint32_t>(std::countr_zero(near));
        if (group.level > 0) {
          open[count++] = {group.level - 1, child};
        } else if (!visit(segments_[child])) {
          return;
        }
      }
    }
  }
  // Whether any segment comes closer to `center` than `reach`.
  [[nodiscard]] bool HasNear(Vec3 center, float reach) const {
    bool has_any = false;
    ForEachNear({center, {0, 0, 1}, reach, HUGE_VALF},
                [&](const FeatureSegment&) { return !(has_any = true); });
    return has_any;
  }

 private:
  static constexpr std::size_t kLanes = 8;
  // Enough for 2^33 segments.
  static constexpr std::size_t kMostLevels = 11;
  // Of eight segments the ends, or of eight boxes the corners; those that there are not are far
  // away. By axis.
  struct alignas(32) Lanes {
    std::array<std::array<float, kLanes>, 3> low, high;
  };

  void AddMeshEdges(const Scene& scene, const WeldedTriangles& triangles, ThreadTeam& team);
  void BuildTree(ThreadTeam& team);
  // A bit for each that is near.
  [[nodiscard]] static unsigned int SegmentsNear(const Lanes& segments, const DiscSlab& slab);
  [[nodiscard]] static unsigned int BoxesNear(const Lanes& boxes, const DiscSlab& slab);

  std::vector<FeatureSegment> segments_;
  // The first is that of the segments, the last has one group. The boxes of a level hold the groups
  // of the one before.
  std::vector<std::vector<Lanes>> levels_;
};

}  // namespace lucerna
