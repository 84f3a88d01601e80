#include "render/formats/loop_subdivision.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <unordered_map>
#include <utility>
#include <vector>

#include "render/math/double3.h"

namespace lucerna {
namespace {

constexpr std::uint32_t kNone = UINT32_MAX;

struct Level {
  std::vector<Double3> positions;
  std::vector<std::uint32_t> indices;  // [triangles × 3]
};

std::uint64_t KeyOf(std::uint32_t from, std::uint32_t to) {
  return (std::uint64_t{from} << 32) | to;
}

// The neighbours of a vertex in the order of the triangles around it, which turns as they are
// wound. At a boundary the first and the last are those along it.
struct Ring {
  std::vector<std::uint32_t> vertices;
  bool is_boundary = false;
};

// From each directed edge to the third corner of the triangle on its left.
class Neighbours {
 public:
  Status Build(const Level& level) {
    opposite_.reserve(level.indices.size());
    start_.assign(level.positions.size(), kNone);
    triangles_at_.assign(level.positions.size(), 0);
    for (std::size_t i = 0; i < level.indices.size(); ++i) {
      const std::size_t first = i - i % 3;
      const std::uint32_t a = level.indices[i];
      const std::uint32_t b = level.indices[first + (i + 1) % 3];
      const std::uint32_t c = level.indices[first + (i + 2) % 3];
      if (a == b) return Bad("has a triangle with two equal corners");
      if (!opposite_.emplace(KeyOf(a, b), c).second) {
        return Bad("has an edge that two triangles run along in the same direction");
      }
      start_[a] = b;
      ++triangles_at_[a];
    }
    // The ring of a boundary vertex begins where no triangle lies before.
    for (const auto& [key, corner] : opposite_) {
      const auto a = static_cast<std::uint32_t>(key >> 32);
      const auto b = static_cast<std::uint32_t>(key);
      if (!opposite_.contains(KeyOf(b, a))) start_[a] = b;
    }
    return absl::OkStatus();
  }

  [[nodiscard]] bool IsUsed(std::uint32_t vertex) const { return start_[vertex] != kNone; }

  // Requires a vertex that is used. Errors: INVALID_ARGUMENT when the triangles at the vertex are
  // not one fan.
  [[nodiscard]] Status FindRing(std::uint32_t vertex, Ring& ring) const {
    ring.vertices.clear();
    ring.is_boundary = false;
    std::uint32_t neighbour = start_[vertex];
    for (std::uint32_t fans = 0; fans < triangles_at_[vertex]; ++fans) {
      ring.vertices.push_back(neighbour);
      const auto next = opposite_.find(KeyOf(vertex, neighbour));
      if (next == opposite_.end()) return Bad("joins surfaces in a vertex");
      neighbour = next->second;
    }
    if (neighbour == ring.vertices.front()) return absl::OkStatus();
    if (opposite_.contains(KeyOf(vertex, neighbour))) return Bad("joins surfaces in a vertex");
    ring.vertices.push_back(neighbour);
    ring.is_boundary = true;
    return absl::OkStatus();
  }

  [[nodiscard]] std::uint32_t Opposite(std::uint32_t from, std::uint32_t to) const {
    const auto found = opposite_.find(KeyOf(from, to));
    return found == opposite_.end() ? kNone : found->second;
  }

 private:
  static Status Bad(const char* what) {
    return absl::InvalidArgumentError(absl::StrCat(what, ", which is no surface to subdivide"));
  }

  std::unordered_map<std::uint64_t, std::uint32_t> opposite_;
  std::vector<std::uint32_t> start_;
  std::vector<std::uint32_t> triangles_at_;
};

double Beta(std::size_t valence) {
  return valence == 3 ? 3.0 / 16 : 3.0 / (8 * static_cast<double>(valence));
}

Double3 Sum(const Level& level, const Ring& ring) {
  Double3 sum;
  for (const std::uint32_t vertex : ring.vertices)
    sum = sum + level.positions[vertex];
  return sum;
}

// The weighted mean of a vertex and its ring: `weight` for each neighbour, at a boundary for the
// two along it.
Double3 Weighted(const Level& level, std::uint32_t vertex, const Ring& ring, double weight) {
  const Double3 own = level.positions[vertex];
  if (ring.is_boundary) {
    const Double3 ends =
        level.positions[ring.vertices.front()] + level.positions[ring.vertices.back()];
    return own * (1 - 2 * weight) + ends * weight;
  }
  const auto valence = static_cast<double>(ring.vertices.size());
  return own * (1 - valence * weight) + Sum(level, ring) * weight;
}

StatusOr<Level> Subdivide(const Level& level) {
  Neighbours neighbours;
  LUCERNA_RETURN_IF_ERROR(neighbours.Build(level));
  Level finer;
  finer.positions.resize(level.positions.size());
  Ring ring;
  for (std::uint32_t vertex = 0; vertex < level.positions.size(); ++vertex) {
    if (!neighbours.IsUsed(vertex)) {
      finer.positions[vertex] = level.positions[vertex];
      continue;
    }
    LUCERNA_RETURN_IF_ERROR(neighbours.FindRing(vertex, ring));
    const double weight = ring.is_boundary            ? 1.0 / 8
                          : ring.vertices.size() == 6 ? 1.0 / 16
                                                      : Beta(ring.vertices.size());
    finer.positions[vertex] = Weighted(level, vertex, ring, weight);
  }
  std::unordered_map<std::uint64_t, std::uint32_t> middles;
  middles.reserve(level.indices.size());
  const auto middle = [&](std::uint32_t a, std::uint32_t b) {
    const auto [found, is_new] = middles.try_emplace(
        KeyOf(std::min(a, b), std::max(a, b)), static_cast<std::uint32_t>(finer.positions.size()));
    if (is_new) {
      const Double3 ends = level.positions[a] + level.positions[b];
      const std::uint32_t left = neighbours.Opposite(a, b);
      const std::uint32_t right = neighbours.Opposite(b, a);
      finer.positions.push_back(left == kNone || right == kNone
                                    ? ends * 0.5
                                    : ends * 0.375 +
                                          (level.positions[left] + level.positions[right]) * 0.125);
    }
    return found->second;
  };
  finer.indices.reserve(4 * level.indices.size());
  for (std::size_t i = 0; i < level.indices.size(); i += 3) {
    const std::uint32_t a = level.indices[i];
    const std::uint32_t b = level.indices[i + 1];
    const std::uint32_t c = level.indices[i + 2];
    const std::uint32_t ab = middle(a, b);
    const std::uint32_t bc = middle(b, c);
    const std::uint32_t ca = middle(c, a);
    finer.indices.insert(finer.indices.end(), {a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca});
  }
  return finer;
}

// Two tangents of the limit surface, in the order of the ring.
Double3 LimitNormal(const Level& level, std::uint32_t vertex, const Ring& ring) {
  const std::size_t count = ring.vertices.size();
  const auto at = [&](std::size_t i) { return level.positions[ring.vertices[i]]; };
  Double3 s;
  Double3 t;
  if (!ring.is_boundary) {
    for (std::size_t i = 0; i < count; ++i) {
      const double angle =
          2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(count);
      s = s + at(i) * std::cos(angle);
      t = t + at(i) * std::sin(angle);
    }
    return Cross(s, t);
  }
  // Along the boundary, and across it.
  const Double3 own = level.positions[vertex];
  s = at(count - 1) - at(0);
  if (count == 2) {
    t = at(0) + at(1) - own * 2;
  } else if (count == 3) {
    t = at(1) - own;
  } else if (count == 4) {
    t = at(0) * -1 + at(1) * 2 + at(2) * 2 - at(3) - own * 2;
  } else {
    const double theta = std::numbers::pi / static_cast<double>(count - 1);
    t = (at(0) + at(count - 1)) * std::sin(theta);
    for (std::size_t i = 1; i + 1 < count; ++i) {
      t = t + at(i) * ((2 * std::cos(theta) - 2) * std::sin(static_cast<double>(i) * theta));
    }
    t = t * -1;
  }
  return Cross(t, s);
}

}  // namespace

StatusOr<TriangleMesh> LoopSubdivide(const TriangleMesh& control, int levels) {
  Level level;
  level.indices = control.indices;
  for (const Vec3& position : control.positions)
    level.positions.emplace_back(position);
  for (int i = 0; i < levels; ++i) {
    LUCERNA_ASSIGN_OR_RETURN(level, Subdivide(level));
  }
  Neighbours neighbours;
  LUCERNA_RETURN_IF_ERROR(neighbours.Build(level));
  Level limit = level;
  Ring ring;
  TriangleMesh mesh;
  mesh.indices = std::move(level.indices);
  for (std::uint32_t vertex = 0; vertex < limit.positions.size(); ++vertex) {
    if (!neighbours.IsUsed(vertex)) continue;
    LUCERNA_RETURN_IF_ERROR(neighbours.FindRing(vertex, ring));
    const auto valence = static_cast<double>(ring.vertices.size());
    const double weight =
        ring.is_boundary ? 1.0 / 6 : 1 / (valence + 3 / (8 * Beta(ring.vertices.size())));
    limit.positions[vertex] = Weighted(level, vertex, ring, weight);
  }
  for (const Double3& position : limit.positions)
    mesh.positions.push_back(ToFloat(position));
  for (std::uint32_t vertex = 0; vertex < limit.positions.size(); ++vertex) {
    Double3 normal;
    if (neighbours.IsUsed(vertex)) {
      LUCERNA_RETURN_IF_ERROR(neighbours.FindRing(vertex, ring));
      normal = LimitNormal(level, vertex, ring);
    }
    const double length = Length(normal);
    mesh.normals.push_back(length > 0 ? ToFloat(normal * (1 / length)) : Vec3());
  }
  return mesh;
}

}  // namespace lucerna
