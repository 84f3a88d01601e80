#include "render/geometry/rounded_borders.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include "render/geometry/feature_edges.h"
#include "render/math/double3.h"

namespace lucerna {
namespace {

constexpr std::uint32_t kNoCorner = std::numeric_limits<std::uint32_t>::max();
// Faces turned less from each other, by about a degree, lie in one plane.
constexpr float kPlaneCosine = 0.99985F;
// A crest as far away as the face is wide is the next side of a prism, not a rounded border.
constexpr double kWidestBorder = 0.25;  // of the width of the face
// Of the triangles that are looked at around one border. A border of more is not found whole.
constexpr std::size_t kMaxTriangles = 64;

// A triangle that was reached through the edge across from `corner`.
struct Reached {
  std::uint32_t corner = 0;
  bool is_turned_over = false;  // winds the other way round
};

class CrestSearch {
 public:
  CrestSearch(std::span<const Vec3> positions, std::span<const std::uint32_t> corners,
              std::span<const TriangleSide> sides)
      : positions_(positions),
        corners_(corners),
        across_(corners.size()),
        normals_(corners.size() / 3),
        is_crest_(corners.size()),
        reached_in_(corners.size() / 3) {
    for (std::uint32_t i = 0; i < normals_.size(); ++i) {
      const Double3 cross = Cross(At(3 * i + 1) - At(3 * i), At(3 * i + 2) - At(3 * i));
      const double twice_area = Length(cross);
      if (twice_area > 0) normals_[i] = ToFloat(cross * (1 / twice_area));
    }
    ForEachEdge(sides, [&](std::span<const TriangleSide> of_edge) {
      if (of_edge.size() != 2) return;
      const std::uint32_t a = of_edge[0].opposite;
      const std::uint32_t b = of_edge[1].opposite;
      const float cosine = Cosine(a, b, IsTurnedOver(a, b));
      if (cosine < kSameSurfaceCosine) return;
      across_[a] = {b, cosine};
      across_[b] = {a, cosine};
    });
  }

  std::vector<std::array<std::uint32_t, 2>> Crests() {
    for (std::uint32_t corner = 0; corner < corners_.size(); ++corner) {
      if (across_[corner].corner != kNoCorner && across_[corner].cosine <= kPlaneCosine)
        FindBeside(corner);
    }
    std::vector<std::array<std::uint32_t, 2>> crests;
    for (std::uint32_t side = 0; side < corners_.size(); ++side) {
      if (!is_crest_[side]) continue;
      const auto [low, high] = std::minmax(corners_[Next(side)], corners_[Next(Next(side))]);
      crests.push_back({low, high});
    }
    return crests;
  }

 private:
  // Beyond the edge across from a corner.
  struct Across {
    std::uint32_t corner =
        kNoCorner;     // the one across from the edge; none: the surface does not go on
    float cosine = 0;  // by which it turns
  };

  [[nodiscard]] Double3 At(std::uint32_t corner) const {
    return Double3(positions_[corners_[corner]]);
  }
  [[nodiscard]] static std::uint32_t Next(std::uint32_t corner) {
    return corner % 3 == 2 ? corner - 2 : corner + 1;
  }
  // Of the normals of two corners' triangles, once both wind the same way round.
  [[nodiscard]] float Cosine(std::uint32_t corner, std::uint32_t other, bool is_turned_over) const {
    const float cosine = Dot(normals_[corner / 3], normals_[other / 3]);
    return is_turned_over ? -cosine : cosine;
  }
  // Whether two triangles on either side of an edge run along it in the same direction.
  [[nodiscard]] bool IsTurnedOver(std::uint32_t corner, std::uint32_t other) const {
    return corners_[Next(corner)] == corners_[Next(other)];
  }
  // The edges across from its other corners.
  [[nodiscard]] static std::array<std::uint32_t, 2> OtherSides(std::uint32_t corner) {
    return {Next(corner), Next(Next(corner))};
  }

  // How far the plane of the corner's triangle goes on, away from the edge across from the corner.
  double WidthFrom(std::uint32_t corner) {
    const Double3 begin = At(Next(corner));
    const Double3 along = At(Next(Next(corner))) - begin;
    const double squared = Dot(along, along);
    const auto height_of = [&](std::uint32_t of) {
      const Double3 to = At(of) - begin;
      return Length(to - along * (Dot(to, along) / squared));
    };
    double width = height_of(corner);
    BeginAt({corner, false});
    for (std::size_t i = 0; i < reached_.size(); ++i) {
      const Reached here = reached_[i];
      for (const std::uint32_t side : OtherSides(here.corner)) {
        const auto [other, cosine] = across_[side];
        if (other == kNoCorner || cosine <= kPlaneCosine || WasReached(other)) continue;
        const bool is_turned_over = here.is_turned_over != IsTurnedOver(side, other);
        if (Cosine(corner, other, is_turned_over) <= kPlaneCosine) continue;
        width = std::max(width, height_of(other));
        Reach({other, is_turned_over});
      }
    }
    return width;
  }

  // The crests beyond the edge across from the corner, as seen from its triangle.
  void FindBeside(std::uint32_t corner) {
    const std::uint32_t first = across_[corner].corner;
    const Double3 begin = At(Next(corner));
    const Double3 along = At(Next(Next(corner))) - begin;
    const double squared = Dot(along, along);
    const auto distance_of = [&](std::uint32_t of) {
      const Double3 to = At(of) - begin;
      return Length(to - along * std::clamp(Dot(to, along) / squared, 0.0, 1.0));
    };
    const double limit = kWidestBorder * WidthFrom(corner);
    // Each side of the first triangle ends there.
    if (!(distance_of(first) <= limit)) return;
    BeginAt({first, IsTurnedOver(corner, first)});
    for (std::size_t i = 0; i < reached_.size(); ++i) {
      const Reached here = reached_[i];
      for (const std::uint32_t side : OtherSides(here.corner)) {
        const std::uint32_t other = across_[side].corner;
        if (other == kNoCorner || other / 3 == corner / 3) continue;
        if (distance_of(Next(side)) > limit || distance_of(Next(Next(side))) > limit) continue;
        const bool is_turned_over = here.is_turned_over != IsTurnedOver(side, other);
        if (Cosine(corner, other, is_turned_over) < kSameSurfaceCosine) {
          is_crest_[std::min(side, other)] = true;
        } else if (!WasReached(other)) {
          Reach({other, is_turned_over});
        }
      }
    }
  }

  void BeginAt(Reached triangle) {
    ++search_;
    reached_.clear();
    Reach(triangle);
  }
  [[nodiscard]] bool WasReached(std::uint32_t corner) const {
    return reached_in_[corner / 3] == search_;
  }
  void Reach(Reached triangle) {
    if (reached_.size() == kMaxTriangles) return;
    reached_.push_back(triangle);
    reached_in_[triangle.corner / 3] = search_;
  }

  std::span<const Vec3> positions_;
  std::span<const std::uint32_t> corners_;
  std::vector<Across> across_;  // [corners]
  std::vector<Vec3> normals_;   // [triangles] unit, or 0 of one without area
  std::vector<bool> is_crest_;  // [corners] the edge across, at one of its two corners
  std::vector<Reached> reached_;
  std::vector<std::uint32_t> reached_in_;  // [triangles] the last search that did
  std::uint32_t search_ = 0;
};

}  // namespace

std::vector<std::array<std::uint32_t, 2>> CrestsOfRoundedBorders(
    std::span<const Vec3> positions, std::span<const std::uint32_t> corners,
    std::span<const TriangleSide> sides) {
  return CrestSearch(positions, corners, sides).Crests();
}

}  // namespace lucerna
