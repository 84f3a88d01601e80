#include "render/geometry/curvature_change.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <utility>

#include "render/geometry/double3.h"

namespace lucerna {
namespace {

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
constexpr double kUnknown = std::numeric_limits<double>::infinity();

// The standard deviation of a component of a unit normal that is rounded to float, and of that of a
// position by its largest coordinate. The points of a regular grid share their rounding along its
// lines, so that a fit sees few independent ones and leaves over too little: twice the deviation
// stands for that.
constexpr double kNormalRounding = 0x1p-25;
constexpr double kPositionRounding = 0x1p-24;

// A change this many times as large as its noise is one of the surface. Of noise alone the largest
// around a vertex is two to three times.
constexpr double kClear = 6;
constexpr double kDoubtful = 4;

// Enough points for a fit, and a limit for the vertices where a great many sides meet.
constexpr std::size_t kEnoughPoints = 14;
constexpr std::size_t kMostPoints = 96;
constexpr std::uint32_t kMostNeighbors = 32;

// Vertices and which are next to each other.
struct Graph {
  std::vector<std::uint32_t> vertex;  // [nodes] of the mesh
  std::vector<std::uint32_t> begin;   // [nodes + 1] into neighbors
  std::vector<std::uint32_t> neighbors;

  [[nodiscard]] std::uint32_t size() const { return static_cast<std::uint32_t>(vertex.size()); }
  [[nodiscard]] std::span<const std::uint32_t> Around(std::uint32_t node) const {
    return {neighbors.data() + begin[node], neighbors.data() + begin[node + 1]};
  }
};

// Nodes are numbered by where they first appear in `corners`.
Graph GraphOf(std::span<const Vec3> normals, std::span<const std::uint32_t> corners,
              std::span<const TriangleSide> sides) {
  Graph graph;
  std::vector<std::uint32_t> node_of(normals.size(), kNone);
  for (const std::uint32_t corner : corners) {
    if (node_of[corner] != kNone || !(LengthSquared(normals[corner]) > 0.5F)) continue;
    node_of[corner] = graph.size();
    graph.vertex.push_back(corner);
  }
  const auto for_each_pair = [&](const auto& visit) {
    ForEachEdge(sides, [&](std::span<const TriangleSide> edge) {
      const std::uint32_t a = node_of[edge[0].low];
      const std::uint32_t b = node_of[edge[0].high];
      if (a != kNone && b != kNone) visit(a, b);
    });
  };
  graph.begin.assign(std::size_t{graph.size()} + 1, 0);
  for_each_pair([&](std::uint32_t a, std::uint32_t b) {
    ++graph.begin[a + 1];
    ++graph.begin[b + 1];
  });
  for (std::uint32_t i = 0; i < graph.size(); ++i)
    graph.begin[i + 1] += graph.begin[i];
  graph.neighbors.resize(graph.begin.back());
  std::vector<std::uint32_t> next(graph.begin.begin(), graph.begin.end() - 1);
  for_each_pair([&](std::uint32_t a, std::uint32_t b) {
    graph.neighbors[next[a]++] = b;
    graph.neighbors[next[b]++] = a;
  });
  for (std::uint32_t i = 0; i < graph.size(); ++i) {
    std::sort(graph.neighbors.begin() + graph.begin[i],
              graph.neighbors.begin() + graph.begin[i + 1]);
  }
  return graph;
}

// A selection of nodes no two of which are next to each other, and for each node the one that
// stands for it: itself or a neighbor.
struct Selection {
  std::vector<std::uint32_t> nodes;
  std::vector<std::uint32_t> of;  // [all nodes] into nodes
};

Selection SelectFrom(const Graph& graph) {
  Selection selection;
  selection.of.assign(graph.size(), kNone);
  for (std::uint32_t i = 0; i < graph.size(); ++i) {
    if (selection.of[i] != kNone) continue;
    const auto index = static_cast<std::uint32_t>(selection.nodes.size());
    selection.nodes.push_back(i);
    selection.of[i] = index;
    for (const std::uint32_t neighbor : graph.Around(i)) {
      if (selection.of[neighbor] == kNone) selection.of[neighbor] = index;
    }
  }
  return selection;
}

// Two of the selected are next to each other where the nodes that they stand for are.
Graph Coarsen(const Graph& graph, const Selection& selection) {
  Graph coarse;
  coarse.begin.push_back(0);
  std::vector<std::uint32_t> seen_by(selection.nodes.size(), kNone);
  for (std::uint32_t s = 0; s < selection.nodes.size(); ++s) {
    const std::uint32_t node = selection.nodes[s];
    coarse.vertex.push_back(graph.vertex[node]);
    seen_by[s] = s;
    const auto see_around = [&](std::uint32_t i) {
      for (const std::uint32_t j : graph.Around(i)) {
        const std::uint32_t other = selection.of[j];
        if (seen_by[other] == s) continue;
        seen_by[other] = s;
        coarse.neighbors.push_back(other);
      }
    };
    see_around(node);
    for (const std::uint32_t i : graph.Around(node)) {
      if (selection.of[i] == s) see_around(i);
    }
    std::sort(coarse.neighbors.begin() + coarse.begin.back(), coarse.neighbors.end());
    coarse.begin.push_back(static_cast<std::uint32_t>(coarse.neighbors.size()));
  }
  return coarse;
}

// A derivative at a place, and the root mean square of what noise makes of it.
struct Estimate {
  double value = kUnknown;
  double noise = 0;
};
using Estimates = std::array<Estimate, 2>;  // of the first and the second derivative

constexpr std::size_t kTerms = 10;  // 1, x, y, x², xy, y², x³, x²y, xy², y³

std::array<double, kTerms> TermsAt(double x, double y) {
  return {1, x, y, x * x, x * y, y * y, x * x * x, x * x * y, x * y * y, y * y * y};
}

// A least squares fit of two functions of the plane at once.
class CubicFit {
 public:
  void Add(double x, double y, double p, double q) {
    const std::array<double, kTerms> terms = TermsAt(x, y);
    for (std::size_t i = 0; i < kTerms; ++i) {
      for (std::size_t j = 0; j <= i; ++j)
        a_[i][j] += terms[i] * terms[j];
      p_[i] += terms[i] * p;
      q_[i] += terms[i] * q;
    }
    squares_ += p * p + q * q;
    ++count_;
  }

  // Whether there are more points than terms. A term that the points leave open becomes 0: of a
  // ribbon one knows only how it bends lengthwise.
  bool Solve() {
    std::size_t terms = 0;
    double explained = 0;
    for (std::size_t i = 0; i < kTerms; ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        double sum = a_[i][j];
        for (std::size_t k = 0; k < j; ++k)
          sum -= a_[i][k] * a_[j][k];
        a_[i][j] = sum * inverse_[j];
      }
      double pivot = a_[i][i];
      for (std::size_t k = 0; k < i; ++k)
        pivot -= a_[i][k] * a_[i][k];
      inverse_[i] = pivot > 1e-3 * a_[i][i] ? 1 / std::sqrt(pivot) : 0;
      if (inverse_[i] > 0) ++terms;
      for (std::size_t k = 0; k < i; ++k) {
        p_[i] -= a_[i][k] * p_[k];
        q_[i] -= a_[i][k] * q_[k];
      }
      p_[i] *= inverse_[i];
      q_[i] *= inverse_[i];
      explained += p_[i] * p_[i] + q_[i] * q_[i];
    }
    if (count_ < terms + 2) return false;
    variance_ = std::max(0.0, squares_ - explained) / static_cast<double>(2 * (count_ - terms));
    for (std::size_t i = kTerms; i-- > 0;) {
      for (std::size_t k = i + 1; k < kTerms; ++k) {
        p_[i] -= a_[k][i] * p_[k];
        q_[i] -= a_[k][i] * q_[k];
      }
      p_[i] *= inverse_[i];
      q_[i] *= inverse_[i];
    }
    return true;
  }

  // Of the two functions.
  [[nodiscard]] std::array<double, 2> Coefficient(std::size_t term) const {
    return {p_[term], q_[term]};
  }

  // Of what the fit leaves over, at each point and for each function.
  [[nodiscard]] double variance() const { return variance_; }

  // Of each of the two coefficients of x² and of all later terms, where it is 1 at each point.
  [[nodiscard]] std::array<double, kTerms> Variances() const {
    std::array<double, kTerms> variances{};
    for (std::size_t j = 3; j < kTerms; ++j) {
      // A column of the inverse of the triangular matrix.
      std::array<double, kTerms> column{};
      column[j] = inverse_[j];
      variances[j] = column[j] * column[j];
      for (std::size_t i = j + 1; i < kTerms; ++i) {
        double sum = 0;
        for (std::size_t k = j; k < i; ++k)
          sum -= a_[i][k] * column[k];
        column[i] = sum * inverse_[i];
        variances[j] += column[i] * column[i];
      }
    }
    return variances;
  }

 private:
  std::array<std::array<double, kTerms>, kTerms> a_{};
  std::array<double, kTerms> p_{}, q_{}, inverse_{};
  double squares_ = 0;
  double variance_ = 0;
  std::size_t count_ = 0;
};

// Half a turn in sixteen steps. Between two of them a third harmonic may be larger by the inverse
// of the cosine of 16.9 degrees, and no harmonic here is higher.
constexpr double kBetweenDirections = 1.046;
const std::array<std::array<double, 2>, 16> kDirections = [] {
  std::array<std::array<double, 2>, 16> directions{};
  for (std::size_t i = 0; i < directions.size(); ++i) {
    const double angle = static_cast<double>(i) * std::numbers::pi / 16;
    directions[i] = {std::cos(angle), std::sin(angle)};
  }
  return directions;
}();

double Norm(double x, double y) {
  return std::sqrt(x * x + y * y);
}

// The largest |d/dt of the curvature along t|, over unit t: Codazzi's tensor is symmetric, so no
// two directions do better than one. As a form in the cosine and sine of t's angle it is a first
// and a third harmonic.
double LargestOfForm(double xxx, double xxy, double xyy, double yyy) {
  const double c1 = 0.75 * (xxx + xyy), s1 = 0.75 * (xxy + yyy);
  const double c3 = 0.25 * (xxx - 3 * xyy), s3 = 0.25 * (3 * xxy - yyy);
  double largest = 0;
  for (const auto& [c, s] : kDirections) {
    // cos 3a + i sin 3a = (c + i s)³
    const double third = c3 * c * (c * c - 3 * s * s) + s3 * s * (3 * c * c - s * s);
    largest = std::max(largest, std::abs(c1 * c + s1 * s + third));
  }
  return std::min(largest * kBetweenDirections, Norm(c1, s1) + Norm(c3, s3));
}

// A symmetric matrix [[a, b], [b, c]].
struct Symmetric {
  double a = 0, b = 0, c = 0;

  // The eigenvalue that is largest in magnitude, without its sign.
  [[nodiscard]] double Norm() const {
    return 0.5 * (std::abs(a + c) + std::sqrt((a - c) * (a - c) + 4 * b * b));
  }
};

// The largest norm of even + cosine cos 2a + sine sin 2a over all angles a.
double LargestNorm(const Symmetric& even, const Symmetric& cosine, const Symmetric& sine) {
  double largest = 0;
  for (const auto& [c, s] : kDirections) {
    const double c2 = c * c - s * s, s2 = 2 * c * s;
    const Symmetric at = {even.a + cosine.a * c2 + sine.a * s2,
                          even.b + cosine.b * c2 + sine.b * s2,
                          even.c + cosine.c * c2 + sine.c * s2};
    largest = std::max(largest, at.Norm());
  }
  return std::min(largest * kBetweenDirections, even.Norm() + Norm(cosine.Norm(), sine.Norm()));
}

// Fits the normals around one vertex.
class Surroundings {
 public:
  Surroundings(std::span<const Vec3> positions, std::span<const Vec3> normals)
      : positions_(positions), normals_(normals) {}

  void Prepare(const Graph& graph) {
    graph_ = &graph;
    seen_by_.assign(graph.size(), kNone);
  }

  Estimates At(std::uint32_t node) {
    Gather(node);
    const Vec3 normal = normals_[graph_->vertex[node]];
    const Frame frame(normal);
    const Double3 center(positions_[graph_->vertex[node]]);
    const Double3 s(frame.s), t(frame.t);
    // The points over the tangent plane, and how far they spread along its axes.
    std::size_t count = 0;
    double xx = 0, xy = 0, yy = 0;
    for (const std::uint32_t i : found_) {
      const Vec3 n = normals_[graph_->vertex[i]];
      // Beyond a fold the tangent plane is no map of the surface.
      if (!(Dot(n, normal) > 0.3F)) continue;
      const Double3 offset = Double3(positions_[graph_->vertex[i]]) - center;
      points_[count] = {Dot(offset, s), Dot(offset, t), n};
      xx += points_[count].x * points_[count].x;
      xy += points_[count].x * points_[count].y;
      yy += points_[count].y * points_[count].y;
      ++count;
    }
    const double weight = 1 / static_cast<double>(count);
    xx *= weight;
    xy *= weight;
    yy *= weight;
    const double root = std::sqrt((xx - yy) * (xx - yy) + 4 * xy * xy);
    const double larger = 0.5 * (xx + yy + root);
    const double smaller = std::max((xx * yy - xy * xy) / larger, 1e-12 * larger);
    if (!(larger > 0) || !std::isfinite(1 / smaller)) return {};
    // The unit direction of the larger: from the row that is farther from 0.
    double c = xx > yy ? 0.5 * (xx - yy + root) : xy;
    double d = xx > yy ? xy : 0.5 * (yy - xx + root);
    const double length = std::sqrt(c * c + d * d);
    c = length > 0 ? c / length : 1;
    d = length > 0 ? d / length : 0;
    const double a = 1 / std::sqrt(larger);
    const double b = 1 / std::sqrt(smaller);
    const Double3 along = s * c + t * d;
    const Double3 across = t * c - s * d;

    CubicFit fit;
    for (std::size_t i = 0; i < count; ++i) {
      const Point& point = points_[i];
      const Double3 n(point.normal);
      fit.Add((point.x * c + point.y * d) * a, (point.y * c - point.x * d) * b, Dot(n, along),
              Dot(n, across));
    }
    if (!fit.Solve()) return {};
    return EstimatesOf(
        fit, a, b,
        kPositionRounding * static_cast<double>(MaxAbs(positions_[graph_->vertex[node]])));
  }

 private:
  struct Point {
    double x = 0, y = 0;
    Vec3 normal;
  };

  // Two rings, or three where those are few.
  void Gather(std::uint32_t node) {
    found_.assign(1, node);
    seen_by_[node] = node;
    std::size_t ring_begin = 0;
    for (int ring = 1; ring <= 3; ++ring) {
      if (ring == 3 && found_.size() >= kEnoughPoints) return;
      const std::size_t ring_end = found_.size();
      for (; ring_begin < ring_end; ++ring_begin) {
        const std::span<const std::uint32_t> around = graph_->Around(found_[ring_begin]);
        const std::size_t step = around.size() / kMostNeighbors + 1;
        for (std::size_t k = 0; k < around.size(); k += step) {
          if (seen_by_[around[k]] == node) continue;
          if (found_.size() == kMostPoints) return;
          seen_by_[around[k]] = node;
          found_.push_back(around[k]);
        }
      }
    }
  }

  // Coordinates were multiplied by a and b; positions are known up to `position_error`.
  static Estimates EstimatesOf(const CubicFit& fit, double a, double b, double position_error) {
    // Derivatives of the normal's two components p and q, from the coefficients.
    const std::array<double, kTerms> scale = {1,
                                              a,
                                              b,
                                              2 * a * a,
                                              a * b,
                                              2 * b * b,
                                              6 * a * a * a,
                                              2 * a * a * b,
                                              2 * a * b * b,
                                              6 * b * b * b};
    std::array<double, kTerms> p{}, q{};
    for (std::size_t i = 1; i < kTerms; ++i) {
      p[i] = fit.Coefficient(i)[0] * scale[i];
      q[i] = fit.Coefficient(i)[1] * scale[i];
    }
    const double bend = Symmetric{p[1], 0.5 * (p[2] + q[1]), q[2]}.Norm();
    const double shifted = bend * position_error;
    const double variance = fit.variance() + kNormalRounding * kNormalRounding + shifted * shifted;
    std::array<double, kTerms> noise = fit.Variances();
    for (std::size_t i = 3; i < kTerms; ++i)
      noise[i] *= 2 * variance * scale[i] * scale[i];

    Estimates estimates;
    estimates[0].value = LargestOfForm(p[3], (2 * p[4] + q[3]) / 3, (p[5] + 2 * q[4]) / 3, q[5]);
    estimates[0].noise = std::sqrt(noise[3] + 2 * noise[4] + noise[5]);
    // With w and t unit, the second derivative towards t of the curvature along w is w' M w with
    // M = xx cos² + 2 xy cos sin + yy sin² of t's angle.
    const Symmetric xx = {p[6], 0.5 * (p[7] + q[6]), q[7]};
    const Symmetric xy = {p[7], 0.5 * (p[8] + q[7]), q[8]};
    const Symmetric yy = {p[8], 0.5 * (p[9] + q[8]), q[9]};
    estimates[1].value =
        LargestNorm({0.5 * (xx.a + yy.a), 0.5 * (xx.b + yy.b), 0.5 * (xx.c + yy.c)},
                    {0.5 * (xx.a - yy.a), 0.5 * (xx.b - yy.b), 0.5 * (xx.c - yy.c)}, xy);
    estimates[1].noise = std::sqrt(noise[6] + 3 * noise[7] + 3 * noise[8] + noise[9]);
    for (const Estimate& estimate : estimates) {
      if (!std::isfinite(estimate.value) || !std::isfinite(estimate.noise)) return {};
    }
    return estimates;
  }

  std::span<const Vec3> positions_, normals_;
  const Graph* graph_ = nullptr;
  std::vector<std::uint32_t> seen_by_;
  std::vector<std::uint32_t> found_;
  std::array<Point, kMostPoints> points_;
};

// The fits at the selected of one graph.
struct Level {
  std::vector<std::uint32_t> of;     // [nodes] the selected one that stands for it
  Graph selected;                    // the graph of the selected
  std::vector<Estimates> estimates;  // [selected]
};

// The largest change around a place, and the noise in it.
struct Bound {
  double value = kUnknown;
  double noise = kUnknown;

  [[nodiscard]] bool IsClearBy(double factor) const {
    return value < kUnknown && value >= factor * noise;
  }
};
using BothBounds = std::array<Bound, 2>;

// The neighbors count, since a derivative has its zeros.
Bound BoundAround(const Level& level, std::uint32_t s, std::size_t order) {
  const Estimate& own = level.estimates[s][order];
  if (own.value == kUnknown) return {};
  Bound bound = {own.value, own.noise};
  double count = 1;
  for (const std::uint32_t other : level.selected.Around(s)) {
    const Estimate& estimate = level.estimates[other][order];
    if (estimate.value == kUnknown) continue;
    bound.value = std::max(bound.value, estimate.value);
    bound.noise += estimate.noise;
    count += 1;
  }
  bound.noise /= count;
  return bound;
}

Bound Choose(const Bound& fine, const Bound& coarse) {
  if (fine.IsClearBy(kClear)) return fine;
  // From one selection to the next noise falls to an eighth. Where it does not, it is detail that
  // the coarse one blurs.
  if (!(coarse.noise < 0.5 * fine.noise)) return fine;
  if (coarse.IsClearBy(kClear)) return {std::min(fine.value, coarse.value), coarse.noise};
  // Neither is sure. What is more noise than change may be anything smaller.
  if (fine.IsClearBy(kDoubtful) && !coarse.IsClearBy(fine.value / fine.noise)) return fine;
  if (coarse.IsClearBy(kDoubtful)) return coarse;
  return {std::min(fine.value, coarse.value), coarse.noise};
}

}  // namespace

std::vector<CurvatureChange> CurvatureChanges(std::span<const Vec3> positions,
                                              std::span<const Vec3> normals,
                                              std::span<const std::uint32_t> corners,
                                              std::span<const TriangleSide> sides) {
  const Graph all = GraphOf(normals, corners, sides);
  std::vector<Level> levels;
  Surroundings surroundings(positions, normals);
  while (true) {
    const Graph& graph = levels.empty() ? all : levels.back().selected;
    if (graph.neighbors.empty()) break;
    Selection selection = SelectFrom(graph);
    Level level;
    level.selected = Coarsen(graph, selection);
    surroundings.Prepare(graph);
    level.estimates.reserve(selection.nodes.size());
    for (const std::uint32_t node : selection.nodes)
      level.estimates.push_back(surroundings.At(node));
    level.of = std::move(selection.of);
    levels.push_back(std::move(level));
  }

  std::vector<BothBounds> chosen;  // of the level above, from the coarsest down
  for (std::size_t l = levels.size(); l-- > 0;) {
    const Level& level = levels[l];
    std::vector<BothBounds> finer(level.estimates.size());
    for (std::uint32_t s = 0; s < finer.size(); ++s) {
      for (std::size_t order = 0; order < 2; ++order) {
        finer[s][order] = BoundAround(level, s, order);
        if (l + 1 == levels.size()) continue;
        finer[s][order] = Choose(finer[s][order], chosen[levels[l + 1].of[s]][order]);
      }
    }
    chosen = std::move(finer);
  }

  std::vector<CurvatureChange> changes(positions.size(), {kUnknown, kUnknown, false, false});
  if (levels.empty()) return changes;
  for (std::uint32_t i = 0; i < all.size(); ++i) {
    const BothBounds& bounds = chosen[levels[0].of[i]];
    changes[all.vertex[i]] = {bounds[0].value, bounds[1].value, bounds[0].IsClearBy(kDoubtful),
                              bounds[1].IsClearBy(kDoubtful)};
  }
  return changes;
}

}  // namespace lucerna
