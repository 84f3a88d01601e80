#include "render/bake/decimation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>

#include "render/math/double3.h"
#include "render/math/rgb.h"

namespace lucerna {
namespace {

using Corners = std::array<std::uint32_t, 3>;

// New faces are no thinner than this, or than the thinnest that they replace: 4 sqrt(3) times the
// area over the sum of the squared edges, 1 of an equilateral triangle.
constexpr double kThinnest = 0.3;
constexpr int kMostSweeps = 32;

struct Sample {
  Double3 position;
  double luminance = 0;
  double weight = 0;
};

class Decimator {
 public:
  Decimator(const std::vector<MeshVertex>& vertices, const std::vector<MeshFace>& faces,
            const DecimationRules& rules)
      : vertices_(vertices),
        rules_(rules),
        faces_(faces),
        is_removed_(faces.size()),
        samples_(faces.size()),
        faces_of_(vertices.size()) {
    for (std::uint32_t face = 0; face < faces_.size(); ++face) {
      for (const std::uint32_t vertex : faces_[face].vertices) {
        if (faces_of_[vertex].empty()) vertices_at_[vertices_[vertex].place].push_back(vertex);
        faces_of_[vertex].push_back(face);
      }
    }
  }

  void AddPoints(const std::vector<MeasuredPoint>& points) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> face_of;
    for (std::uint32_t face = 0; face < faces_.size(); ++face) {
      const Corners& v = faces_[face].vertices;
      for (std::size_t i = 0; i < 3; ++i)
        face_of.try_emplace(std::minmax(v[i], v[(i + 1) % 3]), face);
    }
    for (const MeasuredPoint& point : points) {
      const auto found = face_of.find(point.edge);
      if (found == face_of.end()) continue;
      samples_[found->second].push_back(
          {(At(point.edge.first) + At(point.edge.second)) * 0.5, point.luminance, point.weight});
    }
  }

  [[nodiscard]] Decimation Run() {
    Decimation done;
    for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
      std::size_t removed = 0;
      for (auto& [place, vertices] : vertices_at_) {
        if (!vertices.empty() && RemovePlace(vertices)) ++removed;
      }
      if (removed == 0) break;
      done.removed += removed;
    }
    for (std::uint32_t face = 0; face < faces_.size(); ++face) {
      if (is_removed_[face]) continue;
      done.faces.push_back(faces_[face]);
      for (const Sample& sample : samples_[face]) {
        const double value = InterpolatedAt(sample.position, faces_[face].vertices).value;
        done.differences.push_back({sample.luminance - value, sample.weight});
      }
    }
    return done;
  }

 private:
  // The faces around one vertex.
  struct Fan {
    std::uint32_t vertex = 0;
    std::map<std::uint32_t, int> neighbours;  // how many faces each shares
    std::vector<std::uint32_t> ends;          // of an open one: two neighbours
    Double3 normal;                           // unit
  };
  // What becomes of a fan when its vertex goes to a neighbour.
  struct Collapse {
    std::vector<Corners> corners;     // of the faces that stay
    std::vector<std::uint32_t> kept;  // those faces
    std::vector<std::uint32_t> gone;
    std::vector<std::vector<Sample>> samples;  // [kept]
    double worst = 0;                          // difference over what is allowed
  };
  struct Interpolated {
    double value = 0;
    double inside = 0;  // the least of the barycentric coordinates
  };

  [[nodiscard]] Double3 At(std::uint32_t vertex) const {
    return Double3(vertices_[vertex].position);
  }
  [[nodiscard]] double LuminanceAt(std::uint32_t vertex) const {
    return static_cast<double>(Luminance(vertices_[vertex].irradiance->value));
  }
  [[nodiscard]] Double3 CrossOf(const Corners& v) const {
    return Cross(At(v[1]) - At(v[0]), At(v[2]) - At(v[0]));
  }
  [[nodiscard]] double ThinnessOf(const Corners& v) const {
    double squares = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const Double3 edge = At(v[(i + 1) % 3]) - At(v[i]);
      squares += Dot(edge, edge);
    }
    return 2 * std::sqrt(3.0) * Length(CrossOf(v)) / squares;
  }
  [[nodiscard]] Interpolated InterpolatedAt(Double3 position, const Corners& v) const {
    const Double3 cross = CrossOf(v);
    const double area = Dot(cross, cross);
    Interpolated at;
    at.inside = HUGE_VAL;
    for (std::size_t i = 0; i < 3; ++i) {
      const Double3 a = At(v[(i + 1) % 3]);
      const double share = Dot(Cross(At(v[(i + 2) % 3]) - a, position - a), cross) / area;
      at.value += share * LuminanceAt(v[i]);
      at.inside = std::min(at.inside, share);
    }
    return at;
  }

  // Absent: faces do not lie around the vertex once, or not in a plane.
  [[nodiscard]] std::optional<Fan> FanOf(std::uint32_t vertex) const {
    Fan fan;
    fan.vertex = vertex;
    for (const std::uint32_t face : faces_of_[vertex]) {
      if (rules_.is_kept_whole[faces_[face].surface]) return std::nullopt;
      const Double3 cross = CrossOf(faces_[face].vertices);
      if (!(Length(cross) > 0)) return std::nullopt;
      if (fan.neighbours.empty()) fan.normal = cross * (1 / Length(cross));
      if (!(Dot(cross, fan.normal) > 0)) return std::nullopt;
      for (const std::uint32_t corner : faces_[face].vertices) {
        if (corner != vertex) ++fan.neighbours[corner];
      }
    }
    for (const auto& [neighbour, count] : fan.neighbours) {
      if (count > 2) return std::nullopt;
      if (count == 1) fan.ends.push_back(neighbour);
      const double off = Dot(fan.normal, At(neighbour) - At(vertex));
      if (!(std::abs(off) <= rules_.flatness)) return std::nullopt;
    }
    if (fan.ends.size() != 0 && fan.ends.size() != 2) return std::nullopt;
    return fan;
  }

  [[nodiscard]] bool IsStraightAt(const Fan& fan) const {
    const Double3 a = At(fan.ends[0]) - At(fan.vertex);
    const Double3 b = At(fan.ends[1]) - At(fan.vertex);
    const Double3 along = b - a;
    return Dot(a, b) < 0 && Length(Cross(a, along)) <= rules_.flatness * Length(along);
  }

  [[nodiscard]] std::optional<Collapse> Try(const Fan& fan, std::uint32_t to) const {
    Collapse collapse;
    double thinnest = kThinnest;
    std::vector<Sample> samples;
    double squares = 0;
    for (const auto& [neighbour, count] : fan.neighbours) {
      const Double3 edge = At(neighbour) - At(fan.vertex);
      squares += Dot(edge, edge) / static_cast<double>(fan.neighbours.size());
    }
    samples.push_back({At(fan.vertex), LuminanceAt(fan.vertex), squares});
    for (const std::uint32_t face : faces_of_[fan.vertex]) {
      Corners corners = faces_[face].vertices;
      thinnest = std::min(thinnest, ThinnessOf(corners));
      samples.insert(samples.end(), samples_[face].begin(), samples_[face].end());
      if (std::ranges::count(corners, to) > 0) {
        collapse.gone.push_back(face);
        continue;
      }
      std::ranges::replace(corners, fan.vertex, to);
      collapse.kept.push_back(face);
      collapse.corners.push_back(corners);
    }
    if (collapse.kept.empty()) return std::nullopt;
    // Both ends of the edge may have no other neighbours in common than its faces' third corners.
    std::size_t common = 0;
    std::vector<std::uint32_t> seen;
    for (const std::uint32_t face : faces_of_[to]) {
      for (const std::uint32_t corner : faces_[face].vertices) {
        if (corner == fan.vertex || !fan.neighbours.contains(corner)) continue;
        if (corner == to || std::ranges::count(seen, corner) > 0) continue;
        seen.push_back(corner);
        ++common;
      }
    }
    if (common != collapse.gone.size()) return std::nullopt;
    for (const Corners& corners : collapse.corners) {
      if (!(Dot(CrossOf(corners), fan.normal) > 0) || ThinnessOf(corners) < thinnest) {
        return std::nullopt;
      }
      for (std::size_t i = 0; i < 3; ++i) {
        const Double3 edge = At(corners[(i + 1) % 3]) - At(corners[i]);
        if (!(Length(edge) <= rules_.longest)) return std::nullopt;
      }
    }
    collapse.samples.resize(collapse.kept.size());
    for (const Sample& sample : samples) {
      std::size_t best = 0;
      Interpolated at_best;
      at_best.inside = -HUGE_VAL;
      for (std::size_t i = 0; i < collapse.corners.size(); ++i) {
        const Interpolated at = InterpolatedAt(sample.position, collapse.corners[i]);
        if (!(at.inside > at_best.inside)) continue;
        best = i;
        at_best = at;
      }
      const double allowed =
          rules_.tolerance * std::max({sample.luminance, at_best.value, rules_.floor});
      const double difference = std::abs(sample.luminance - at_best.value);
      if (!(difference <= allowed)) return std::nullopt;
      if (difference > 0) collapse.worst = std::max(collapse.worst, difference / allowed);
      collapse.samples[best].push_back(sample);
    }
    return collapse;
  }

  void Apply(const Fan& fan, std::uint32_t to, Collapse collapse) {
    for (std::size_t i = 0; i < collapse.kept.size(); ++i) {
      const std::uint32_t face = collapse.kept[i];
      faces_[face].vertices = collapse.corners[i];
      samples_[face] = std::move(collapse.samples[i]);
      faces_of_[to].push_back(face);
    }
    for (const std::uint32_t face : collapse.gone) {
      is_removed_[face] = true;
      samples_[face].clear();
      for (const std::uint32_t corner : faces_[face].vertices)
        std::erase(faces_of_[corner], face);
    }
    faces_of_[fan.vertex].clear();
  }

  // All vertices at one place, if that is right.
  bool RemovePlace(std::vector<std::uint32_t>& vertices) {
    std::vector<Fan> fans;
    for (const std::uint32_t vertex : vertices) {
      std::optional<Fan> fan = FanOf(vertex);
      if (!fan) return false;
      fans.push_back(*std::move(fan));
    }
    const auto place_of = [&](std::uint32_t vertex) { return vertices_[vertex].place; };
    std::vector<std::uint32_t> targets;  // places
    if (fans.front().ends.empty()) {
      if (fans.size() > 1) return false;
      for (const auto& [neighbour, count] : fans.front().neighbours)
        targets.push_back(place_of(neighbour));
    } else {
      for (const std::uint32_t end : fans.front().ends)
        targets.push_back(place_of(end));
      for (const Fan& fan : fans) {
        if (fan.ends.empty() || !IsStraightAt(fan)) return false;
        for (const std::uint32_t end : fan.ends) {
          if (std::ranges::count(targets, place_of(end)) == 0) return false;
        }
      }
    }
    std::optional<std::vector<std::pair<std::uint32_t, Collapse>>> best;  // [fans]
    double least = HUGE_VAL;
    for (const std::uint32_t target : targets) {
      std::vector<std::pair<std::uint32_t, Collapse>> all;
      double worst = 0;
      for (const Fan& fan : fans) {
        // A border's ends, where there are two.
        const auto is_target = [&](const auto& neighbour) {
          return place_of(neighbour.first) == target &&
                 (fan.ends.empty() || std::ranges::count(fan.ends, neighbour.first) > 0);
        };
        const auto to = std::ranges::find_if(fan.neighbours, is_target);
        if (to == fan.neighbours.end()) break;
        std::optional<Collapse> collapse = Try(fan, to->first);
        if (!collapse) break;
        worst = std::max(worst, collapse->worst);
        all.emplace_back(to->first, *std::move(collapse));
      }
      if (all.size() != fans.size() || !(worst < least)) continue;
      least = worst;
      best = std::move(all);
    }
    if (!best) return false;
    for (std::size_t i = 0; i < fans.size(); ++i)
      Apply(fans[i], (*best)[i].first, std::move((*best)[i].second));
    vertices.clear();
    return true;
  }

  const std::vector<MeshVertex>& vertices_;
  const DecimationRules& rules_;
  std::vector<MeshFace> faces_;
  std::vector<bool> is_removed_;              // [faces]
  std::vector<std::vector<Sample>> samples_;  // [faces]
  std::vector<std::vector<std::uint32_t>> faces_of_;
  std::map<std::uint32_t, std::vector<std::uint32_t>> vertices_at_;  // by places
};

}  // namespace

Decimation DecimateMesh(const std::vector<MeshVertex>& vertices, const std::vector<MeshFace>& faces,
                        const std::vector<MeasuredPoint>& points, const DecimationRules& rules) {
  Decimator decimator(vertices, faces, rules);
  decimator.AddPoints(points);
  return decimator.Run();
}

}  // namespace lucerna
