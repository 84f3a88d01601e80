#include "render/geometry/feature_edges.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <type_traits>
#include <utility>

#include <immintrin.h>

#include "render/geometry/rounded_borders.h"
#include "render/math/double3.h"
#include "render/math/float_lanes.h"
#include "render/scene/mesh_edges.h"
#include "render/scene/shape_lists.h"

namespace lucerna {
namespace {

// Into which work is cut that threads share.
constexpr std::size_t kPieces = 256;

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

FeatureEdges::FeatureEdges(const Scene& scene, int threads) {
  ThreadTeam team(threads);
  std::size_t vertex_count = 0;
  std::size_t corner_count = 0;
  for (const TriangleMesh& mesh : scene.meshes) {
    vertex_count += mesh.positions.size();
    corner_count += mesh.indices.size();
  }
  // Scenes beyond that are refused elsewhere, or have discs that are not cut.
  const bool is_too_large =
      std::max(vertex_count, corner_count) >= std::numeric_limits<std::uint32_t>::max();
  {
    const WeldedTriangles triangles = is_too_large ? WeldedTriangles{} : WeldMeshes(scene.meshes);
    AddMeshEdges(scene, triangles, team);
    ForEachAnalyticShape(scene, [&](const auto& shape) {
      if constexpr (!std::decay_t<decltype(shape)>::kIsClosed) AddRim(shape, segments_);
    });
    if (!is_too_large) {
      const std::vector<FeatureSegment> crossings = SurfaceCrossings(scene, triangles);
      segments_.insert(segments_.end(), crossings.begin(), crossings.end());
    }
  }
  for (const auto& border : scene.sensor_borders)
    segments_.push_back({border});
  BuildTree(team);
}

FeatureEdges::FeatureEdges(std::vector<FeatureSegment> segments) : segments_(std::move(segments)) {
  ThreadTeam team(1);
  BuildTree(team);
}

void FeatureEdges::AddMeshEdges(const Scene& scene, const WeldedTriangles& triangles,
                                ThreadTeam& team) {
  const std::vector<Vec3>& positions = triangles.positions;
  const std::vector<std::uint32_t>& corners = triangles.corners;
  std::vector<std::size_t> kept_begin;  // triangles at which meshes begin, and whether photons stay
  std::vector<bool> keeps;
  std::size_t begin = 0;
  for (const TriangleMesh& mesh : scene.meshes) {
    kept_begin.push_back(begin);
    keeps.push_back(Gathers(scene.materials[static_cast<std::size_t>(mesh.traits.material)]));
    begin += mesh.indices.size() / 3;
  }
  const bool is_mixed = std::ranges::adjacent_find(keeps, std::not_equal_to<>()) != keeps.end();
  const auto keeps_photons = [&](std::uint32_t triangle) {
    const auto next = std::ranges::upper_bound(kept_begin, std::size_t{triangle});
    return keeps[static_cast<std::size_t>(next - kept_begin.begin() - 1)];
  };
  const std::vector<TriangleSide> all_sides = SidesByEdge(corners, positions.size());
  for (const auto& [low, high] : CrestsOfRoundedBorders(positions, corners, all_sides))
    segments_.push_back({{positions[low], positions[high]}});

  // The segment of an edge at which discs are cut.
  const auto feature_of = [&](std::span<const TriangleSide> sides,
                              std::vector<Double3>& wings) -> std::optional<FeatureSegment> {
    const FeatureSegment segment = {{positions[sides[0].low], positions[sides[0].high]}};
    const Double3 end(segment.ends[0]);
    const Double3 along = Double3(segment.ends[1]) - end;
    const double squared = Dot(along, along);
    if (!(squared > 0)) return std::nullopt;
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
    if (wings.empty() || (!is_border && IsSmooth(wings))) return std::nullopt;
    return segment;
  };
  const std::vector<std::size_t> pieces = CutBetweenEdges(all_sides, kPieces);
  std::vector<std::vector<FeatureSegment>> found(pieces.size() - 1);
  team.For(found.size(), 1, [&](std::size_t first, std::size_t last) {
    std::vector<Double3> wings;
    for (std::size_t i = first; i < last; ++i) {
      ForEachEdge(std::span(all_sides).subspan(pieces[i], pieces[i + 1] - pieces[i]),
                  [&](std::span<const TriangleSide> sides) {
                    if (const auto segment = feature_of(sides, wings)) found[i].push_back(*segment);
                  });
    }
  });
  for (const std::vector<FeatureSegment>& of_piece : found)
    segments_.insert(segments_.end(), of_piece.begin(), of_piece.end());
}

namespace {

// Puts the segments that lie lower along the widest axis before the others, and returns how many
// those are: about a half, in whole groups of `lanes`, of groups of such groups, and so on. 0 of so
// few that they are one group.
std::size_t Halve(std::span<FeatureSegment> segments, std::size_t lanes) {
  if (segments.size() <= lanes) return 0;
  std::size_t of_child = lanes;
  while (of_child * lanes < segments.size())
    of_child *= lanes;
  const std::size_t children = (segments.size() + of_child - 1) / of_child;
  const std::size_t half = children / 2 * of_child;
  const auto middle = [](const FeatureSegment& s) { return s.ends[0] * 0.5F + s.ends[1] * 0.5F; };
  Bounds bounds;
  for (const FeatureSegment& segment : segments)
    bounds.Add(middle(segment));
  const Vec3 size = bounds.high - bounds.low;
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  std::nth_element(segments.begin(), segments.begin() + static_cast<std::ptrdiff_t>(half),
                   segments.end(), [&](const FeatureSegment& a, const FeatureSegment& b) {
                     return middle(a)[axis] < middle(b)[axis];
                   });
  return half;
}

// Sorts segments so that each eight that follow each other are near each other, each eight of such
// groups too, and so on.
void Arrange(std::span<FeatureSegment> segments, std::size_t lanes) {
  const std::size_t half = Halve(segments, lanes);
  if (half == 0) return;
  Arrange(segments.first(half), lanes);
  Arrange(segments.subspan(half), lanes);
}

// The same. The first halves are those of all segments, so all threads take part from then on.
void Arrange(std::span<FeatureSegment> segments, std::size_t lanes, ThreadTeam& team) {
  std::vector<std::span<FeatureSegment>> parts = {segments};
  while (parts.size() < kPieces) {
    std::vector<std::span<FeatureSegment>> halves(2 * parts.size());
    team.For(parts.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const std::size_t half = Halve(parts[i], lanes);
        halves[2 * i] = parts[i].first(half);
        halves[2 * i + 1] = parts[i].subspan(half);
      }
    });
    parts = std::move(halves);
  }
  team.For(parts.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      Arrange(parts[i], lanes);
  });
}

}  // namespace

void FeatureEdges::BuildTree(ThreadTeam& team) {
  if (segments_.empty()) return;
  segments_.shrink_to_fit();
  Arrange(segments_, kLanes, team);
  const auto set = [](Lanes& lanes, std::size_t lane, Vec3 low, Vec3 high) {
    for (int axis = 0; axis < 3; ++axis) {
      lanes.low[static_cast<std::size_t>(axis)][lane] = low[axis];
      lanes.high[static_cast<std::size_t>(axis)][lane] = high[axis];
    }
  };
  const auto groups = [](std::size_t count) { return (count + kLanes - 1) / kLanes; };
  constexpr float kFar = std::numeric_limits<float>::infinity();
  Lanes none;
  for (std::size_t lane = 0; lane < kLanes; ++lane)
    set(none, lane, {kFar, kFar, kFar}, {kFar, kFar, kFar});
  levels_.emplace_back(groups(segments_.size()), none);
  for (std::size_t i = 0; i < segments_.size(); ++i)
    set(levels_[0][i / kLanes], i % kLanes, segments_[i].ends[0], segments_[i].ends[1]);
  while (levels_.back().size() > 1) {
    const std::vector<Lanes>& below = levels_.back();
    std::vector<Lanes> level(groups(below.size()), none);
    for (std::size_t i = 0; i < below.size(); ++i) {
      Bounds bounds;
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        const auto corner = [&](const std::array<std::array<float, kLanes>, 3>& of) {
          return Vec3{of[0][lane], of[1][lane], of[2][lane]};
        };
        if (corner(below[i].low).x == kFar) continue;
        bounds.Add(corner(below[i].low));
        bounds.Add(corner(below[i].high));
      }
      set(level[i / kLanes], i % kLanes, bounds.low, bounds.high);
    }
    levels_.push_back(std::move(level));
  }
}

namespace {

struct Vec3Lanes {
  __m256 x, y, z;
};

Vec3Lanes Load(const std::array<std::array<float, 8>, 3>& of) {
  return {LoadLanes(of[0]), LoadLanes(of[1]), LoadLanes(of[2])};
}
Vec3Lanes operator-(const Vec3Lanes& a, Vec3 b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
Vec3Lanes operator-(const Vec3Lanes& a, const Vec3Lanes& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
Vec3Lanes operator+(const Vec3Lanes& a, const Vec3Lanes& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
Vec3Lanes operator*(const Vec3Lanes& a, float s) {
  return {a.x * s, a.y * s, a.z * s};
}
Vec3Lanes operator*(const Vec3Lanes& a, __m256 s) {
  return {a.x * s, a.y * s, a.z * s};
}
__m256 Dot(const Vec3Lanes& a, const Vec3Lanes& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
__m256 Dot(const Vec3Lanes& a, Vec3 b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
__m256 MaxAbs(const Vec3Lanes& a) {
  const auto max_abs = [](__m256 b, __m256 c) { return _mm256_max_ps(_mm256_max_ps(b, -b), c); };
  return max_abs(a.x, max_abs(a.y, max_abs(a.z, _mm256_setzero_ps())));
}

// Of what is added to a height, relative to the lengths that it is computed from, for rounding.
constexpr float kHeightRounding = 1e-6F;

}  // namespace

// Relative to `reach`, so that squares do not leave the range of a float.
unsigned int FeatureEdges::SegmentsNear(const Lanes& segments, const DiscSlab& slab) {
  const float scale = 1 / slab.reach;
  const Vec3Lanes a = (Load(segments.low) - slab.center) * scale;
  const Vec3Lanes b = (Load(segments.high) - slab.center) * scale;
  const __m256 height_a = Dot(a, slab.normal);
  const __m256 height_b = Dot(b, slab.normal);
  const __m256 height = slab.height * scale + kHeightRounding * (MaxAbs(a) + MaxAbs(b));
  const auto in_slab = (_mm256_min_ps(height_a, height_b) <= height) &
                       (_mm256_max_ps(height_a, height_b) >= -height);
  if (LaneBits(in_slab) == 0) return 0;
  const Vec3Lanes along = b - a;
  // A segment without length is where it begins: the maximum of no number and 0 is 0.
  const __m256 share = -Dot(a, along) / Dot(along, along);
  const __m256 t = _mm256_min_ps(_mm256_max_ps(share, _mm256_setzero_ps()), _mm256_set1_ps(1));
  const Vec3Lanes nearest = a + along * t;
  return LaneBits(in_slab & (Dot(nearest, nearest) < 1));
}

unsigned int FeatureEdges::BoxesNear(const Lanes& boxes, const DiscSlab& slab) {
  const float scale = 1 / slab.reach;
  const Vec3Lanes low = (Load(boxes.low) - slab.center) * scale;
  const Vec3Lanes high = (Load(boxes.high) - slab.center) * scale;
  const auto beyond = [](__m256 from, __m256 to) {
    return _mm256_max_ps(_mm256_max_ps(from, -to), _mm256_setzero_ps());
  };
  const Vec3Lanes outside = {beyond(low.x, high.x), beyond(low.y, high.y), beyond(low.z, high.z)};
  // The lowest and the highest corner.
  const auto corner = [](float n, __m256 from, __m256 to) { return (n >= 0 ? from : to) * n; };
  const Vec3 n = slab.normal;
  const __m256 lowest =
      corner(n.x, low.x, high.x) + corner(n.y, low.y, high.y) + corner(n.z, low.z, high.z);
  const __m256 highest =
      corner(n.x, high.x, low.x) + corner(n.y, high.y, low.y) + corner(n.z, high.z, low.z);
  const __m256 height = slab.height * scale + kHeightRounding * (MaxAbs(low) + MaxAbs(high));
  return LaneBits((Dot(outside, outside) < 1 + 1e-5F) & (lowest <= height) & (highest >= -height));
}

}  // namespace lucerna
