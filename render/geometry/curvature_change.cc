#include "render/geometry/curvature_change.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <utility>

#include "render/math/double3.h"

namespace lucerna {
namespace {

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
constexpr double kUnknown = std::numeric_limits<double>::infinity();

// The standard deviation of a component of a unit normal that is rounded to float, and of that of a
// position by its largest coordinate. The points of a regular grid share their rounding along its
// lines, so that a fit sees few independent ones and leaves over too little: twice the deviation
// stands for that.
constexpr double kDeviationOfNormals = 0x1p-25;
constexpr double kPositionRounding = 0x1p-24;

// A change this many times as large as its noise is one of the surface. Of noise alone the largest
// around a vertex is two to three times.
constexpr double kClear = 6;
constexpr double kDoubtful = 4;

// What deviates from the fits by more than normals written with six digits do, or by more than so
// many times the rounding of positions does, is not noise but detail too fine for the mesh. Light
// sees it.
constexpr double kLargestNoise = 4e-6;
constexpr double kLargestRounding = 4;

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
Graph Coarsen(const Graph& graph, const std::vector<std::uint32_t>& nodes,
              const std::vector<std::uint32_t>& of) {
  Graph coarse;
  coarse.begin.push_back(0);
  std::vector<std::uint32_t> seen_by(nodes.size(), kNone);
  for (std::uint32_t s = 0; s < nodes.size(); ++s) {
    const std::uint32_t node = nodes[s];
    coarse.vertex.push_back(graph.vertex[node]);
    seen_by[s] = s;
    const auto see_around = [&](std::uint32_t i) {
      for (const std::uint32_t j : graph.Around(i)) {
        const std::uint32_t other = of[j];
        if (seen_by[other] == s) continue;
        seen_by[other] = s;
        coarse.neighbors.push_back(other);
      }
    };
    see_around(node);
    for (const std::uint32_t i : graph.Around(node)) {
      if (of[i] == s) see_around(i);
    }
    std::sort(coarse.neighbors.begin() + coarse.begin.back(), coarse.neighbors.end());
    coarse.begin.push_back(static_cast<std::uint32_t>(coarse.neighbors.size()));
  }
  return coarse;
}

// The first and second derivative at a place, and the root mean square of what noise makes of them.
struct Estimates {
  std::array<double, 2> value = {kUnknown, kUnknown};
  std::array<double, 2> noise{};
  bool is_rough = false;  // deviates from the fits by more than noise does

  [[nodiscard]] bool IsKnown() const { return value[0] < kUnknown && value[1] < kUnknown; }
};

// The terms of the fits: x^a y^b for each of these a and b.
constexpr std::size_t kTerms = 10;
constexpr std::array<std::array<std::size_t, 2>, kTerms> kExponents = {
    {{0, 0}, {1, 0}, {0, 1}, {2, 0}, {1, 1}, {0, 2}, {3, 0}, {2, 1}, {1, 2}, {0, 3}}};

// A least squares fit of two functions of the plane at once.
class CubicFit {
 public:
  void Add(double x, double y, double p, double q) {
    // Rows of lengths that suit the processor, of which a few entries are for nothing.
    const double x2 = x * x, x3 = x2 * x, y2 = y * y;
    const std::array<double, 4> low = {1, x, x2, x3};
    const std::array<double, 4> high = {x2 * x2, x2 * x3, x3 * x3, 0};
    const std::array<double, 7> y_powers = {1, y, y2, y2 * y, y2 * y2, y2 * y2 * y, y2 * y2 * y2};
    for (std::size_t b = 0; b < 7; ++b)
      Accumulate(low, y_powers[b], low_moments_[b]);
    for (std::size_t b = 0; b < 3; ++b)
      Accumulate(high, y_powers[b], high_moments_[b]);
    for (std::size_t b = 0; b < 4; ++b) {
      Accumulate(low, y_powers[b] * p, p_moments_[b]);
      Accumulate(low, y_powers[b] * q, q_moments_[b]);
    }
    squares_ += p * p + q * q;
    ++count_;
  }

  // Whether there are more points than terms. A term that the points leave open becomes 0: of a
  // ribbon one knows only how it bends lengthwise.
  bool Solve() {
    std::array<double, kTerms> whole;
    for (std::size_t i = 0; i < kTerms; ++i) {
      const auto [a, b] = kExponents[i];
      for (std::size_t j = 0; j < kTerms; ++j)
        a_[i][j] = Moment(a + kExponents[j][0], b + kExponents[j][1]);
      a_[i][kTerms] = p_moments_[b][a];
      a_[i][kTerms + 1] = q_moments_[b][a];
      whole[i] = a_[i][i];
    }
    // Cholesky's, by columns kept as rows. Whole rows go along, though only what is right of the
    // diagonal counts: their length is known to the compiler.
    std::size_t terms = 0;
    double explained = 0;
    for (std::size_t i = 0; i < kTerms; ++i) {
      const double pivot = a_[i][i];
      inverse_[i] = pivot > 1e-3 * whole[i] ? 1 / std::sqrt(pivot) : 0;
      if (inverse_[i] > 0) ++terms;
      for (double& entry : a_[i])
        entry *= inverse_[i];
      p_[i] = a_[i][kTerms];
      q_[i] = a_[i][kTerms + 1];
      explained += p_[i] * p_[i] + q_[i] * q_[i];
      for (std::size_t k = i + 1; k < kTerms; ++k)
        Accumulate(a_[i], -a_[i][k], a_[k]);
    }
    if (count_ < terms + 2) return false;
    variance_ = std::max(0.0, squares_ - explained) / static_cast<double>(2 * (count_ - terms));
    for (std::size_t i = kTerms; i-- > 0;) {
      for (std::size_t k = i + 1; k < kTerms; ++k) {
        p_[i] -= a_[i][k] * p_[k];
        q_[i] -= a_[i][k] * q_[k];
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
  [[nodiscard]] double Variance() const { return variance_; }

  // Of each of the two coefficients of x² and of all later terms, where it is 1 at each point.
  [[nodiscard]] std::array<double, kTerms> Variances() const {
    std::array<double, kTerms> variances{};
    for (std::size_t j = 3; j < kTerms; ++j) {
      // A column of the inverse of the triangular matrix.
      Row column{};
      column[j] = 1;
      for (std::size_t i = j; i < kTerms; ++i) {
        const double entry = column[i] * inverse_[i];
        variances[j] += entry * entry;
        Accumulate(a_[i], -entry, column);
      }
    }
    return variances;
  }

 private:
  using Row = std::array<double, kTerms + 2>;  // the right sides last

  // Adds `row` so many times.
  template <std::size_t kSize>
  static void Accumulate(const std::array<double, kSize>& row, double times,
                         std::array<double, kSize>& sum) {
    for (std::size_t i = 0; i < kSize; ++i)
      sum[i] += row[i] * times;
  }

  // The sum of x^a y^b.
  [[nodiscard]] double Moment(std::size_t a, std::size_t b) const {
    return a < 4 ? low_moments_[b][a] : high_moments_[b][a - 4];
  }

  // Sums of x^a y^b, of x^(a+4) y^b, and of the first times a function, at [b][a].
  std::array<std::array<double, 4>, 7> low_moments_{};
  std::array<std::array<double, 4>, 3> high_moments_{};
  std::array<std::array<double, 4>, 4> p_moments_{}, q_moments_{};
  std::array<Row, kTerms> a_;             // the triangular matrix, above its diagonal
  std::array<double, kTerms> p_{}, q_{};  // the coefficients
  std::array<double, kTerms> inverse_{};
  double squares_ = 0;
  double variance_ = 0;
  std::size_t count_ = 0;
};

// Half a turn in sixteen steps. Between two of them a third harmonic may be larger by the inverse
// of the cosine of 16.9 degrees, and no harmonic here is higher.
constexpr double kBetweenDirections = 1.046;
const std::array<std::array<double, 2>, 16> sixteen_directions = [] {
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
  for (const auto& [c, s] : sixteen_directions) {
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
  for (const auto& [c, s] : sixteen_directions) {
    const double c2 = c * c - s * s, s2 = 2 * c * s;
    const Symmetric at = {even.a + cosine.a * c2 + sine.a * s2,
                          even.b + cosine.b * c2 + sine.b * s2,
                          even.c + cosine.c * c2 + sine.c * s2};
    largest = std::max(largest, at.Norm());
  }
  return std::min(largest * kBetweenDirections, even.Norm() + Norm(cosine.Norm(), sine.Norm()));
}

// Fits the normals around one vertex.
class NeighborhoodFit {
 public:
  NeighborhoodFit(std::span<const Vec3> positions, std::span<const Vec3> normals)
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
    if (count == 0) return {};
    const double weight = 1 / static_cast<double>(count);
    xx *= weight;
    xy *= weight;
    yy *= weight;
    const double root = std::sqrt((xx - yy) * (xx - yy) + 4 * xy * xy);
    const double larger = 0.5 * (xx + yy + root);
    if (!(larger > 0)) return {};
    const double smaller = std::max((xx * yy - xy * xy) / larger, 1e-12 * larger);
    // Smaller numbers have no finite inverse.
    if (!(smaller > 0x1p-1022)) return {};
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
    const double variance =
        fit.Variance() + kDeviationOfNormals * kDeviationOfNormals + shifted * shifted;
    std::array<double, kTerms> noise = fit.Variances();
    for (std::size_t i = 3; i < kTerms; ++i)
      noise[i] *= 2 * variance * scale[i] * scale[i];

    Estimates estimates;
    estimates.value[0] = LargestOfForm(p[3], (2 * p[4] + q[3]) / 3, (p[5] + 2 * q[4]) / 3, q[5]);
    estimates.noise[0] = std::sqrt(noise[3] + 2 * noise[4] + noise[5]);
    // With w and t unit, the second derivative towards t of the curvature along w is w' M w with
    // M = xx cos² + 2 xy cos sin + yy sin² of t's angle.
    const Symmetric xx = {p[6], 0.5 * (p[7] + q[6]), q[7]};
    const Symmetric xy = {p[7], 0.5 * (p[8] + q[7]), q[8]};
    const Symmetric yy = {p[8], 0.5 * (p[9] + q[8]), q[9]};
    estimates.value[1] =
        LargestNorm({0.5 * (xx.a + yy.a), 0.5 * (xx.b + yy.b), 0.5 * (xx.c + yy.c)},
                    {0.5 * (xx.a - yy.a), 0.5 * (xx.b - yy.b), 0.5 * (xx.c - yy.c)}, xy);
    estimates.noise[1] = std::sqrt(noise[6] + 3 * noise[7] + 3 * noise[8] + noise[9]);
    estimates.is_rough =
        fit.Variance() >
        kLargestNoise * kLargestNoise + kLargestRounding * kLargestRounding * shifted * shifted;
    for (std::size_t order = 0; order < 2; ++order) {
      // Without noise there was no term to fit.
      if (!std::isfinite(estimates.value[order]) || !std::isfinite(estimates.noise[order]) ||
          !(estimates.noise[order] > 0)) {
        return {};
      }
    }
    return estimates;
  }

  std::span<const Vec3> positions_, normals_;
  const Graph* graph_ = nullptr;
  std::vector<std::uint32_t> seen_by_;
  std::vector<std::uint32_t> found_;
  std::array<Point, kMostPoints> points_;
};

// The largest change around a place.
struct Bound {
  enum class Trust : std::uint8_t {
    kUnsure,  // it may be all noise
    kRough,   // a bound for the detail of its selection, but what a coarser one says of it is
              // blurred
    kSure,
  };
  double value = kUnknown;
  double noise = 0;
  Trust trust = Trust::kUnsure;

  [[nodiscard]] bool IsClearBy(double factor) const {
    return value < kUnknown && value >= factor * noise;
  }
};
using BothBounds = std::array<Bound, 2>;

// The fits at the selected of one graph.
struct Level {
  std::vector<std::uint32_t> of;     // [nodes] the selected one that stands for it
  Graph selected;                    // the graph of the selected
  std::vector<Estimates> estimates;  // [selected]; unknown where not selected
  std::vector<BothBounds> bounds;    // [selected] from these estimates alone
};

// The bound from the estimates around a place: those of the neighbors count, since a derivative has
// its zeros.
Bound BoundAround(const Level& level, std::uint32_t s, std::size_t order) {
  const Estimates& own = level.estimates[s];
  if (!own.IsKnown()) return {};
  Bound bound = {own.value[order], own.noise[order]};
  bool is_rough = own.is_rough;
  double count = 1;
  for (const std::uint32_t other : level.selected.Around(s)) {
    const Estimates& estimates = level.estimates[other];
    if (!estimates.IsKnown()) continue;
    bound.value = std::max(bound.value, estimates.value[order]);
    bound.noise += estimates.noise[order];
    is_rough |= estimates.is_rough;
    count += 1;
  }
  bound.noise /= count;
  if (bound.IsClearBy(kClear)) {
    bound.trust = Bound::Trust::kSure;
  } else if (is_rough) {
    bound.trust = Bound::Trust::kRough;
  }
  return bound;
}

// Between a bound and the one that was chosen from the coarser selections.
Bound Choose(const Bound& fine, const Bound& coarse) {
  if (fine.trust != Bound::Trust::kUnsure || coarse.value == kUnknown) return fine;
  if (coarse.trust == Bound::Trust::kRough) return {fine.value, fine.noise, Bound::Trust::kSure};
  if (coarse.trust == Bound::Trust::kSure) {
    return {std::min(fine.value, coarse.value), coarse.noise, Bound::Trust::kSure};
  }
  // Both may be all noise, and what is may be anything smaller.
  if (fine.IsClearBy(kDoubtful) && !coarse.IsClearBy(fine.value / fine.noise)) return fine;
  if (coarse.IsClearBy(kDoubtful)) return coarse;
  return {std::min(fine.value, coarse.value), coarse.noise};
}

// Whether a place needs no coarser selection.
bool IsSettled(const BothBounds& bounds) {
  return bounds[0].trust != Bound::Trust::kUnsure && bounds[1].trust != Bound::Trust::kUnsure;
}

// The level of `graph`, which is that of the selected of `finer`, if there is one.
Level NextLevel(const Graph& graph, const Level* finer, NeighborhoodFit& surroundings) {
  Level level;
  Selection selection = SelectFrom(graph);
  level.of = std::move(selection.of);
  level.selected = Coarsen(graph, selection.nodes, level.of);
  // With the neighbors of those that are needed.
  std::vector<bool> is_wanted(selection.nodes.size(), finer == nullptr);
  for (std::uint32_t i = 0; finer != nullptr && i < graph.size(); ++i) {
    if (IsSettled(finer->bounds[i])) continue;
    is_wanted[level.of[i]] = true;
    for (const std::uint32_t other : level.selected.Around(level.of[i]))
      is_wanted[other] = true;
  }
  surroundings.Prepare(graph);
  level.estimates.resize(selection.nodes.size());
  for (std::size_t s = 0; s < selection.nodes.size(); ++s) {
    if (is_wanted[s]) level.estimates[s] = surroundings.At(selection.nodes[s]);
  }
  const Bound not_asked = {kUnknown, 0, Bound::Trust::kSure};
  level.bounds.assign(selection.nodes.size(), {not_asked, not_asked});
  for (std::uint32_t s = 0; s < level.bounds.size(); ++s) {
    if (is_wanted[s]) level.bounds[s] = {BoundAround(level, s, 0), BoundAround(level, s, 1)};
  }
  return level;
}

}  // namespace

std::vector<CurvatureChange> CurvatureChanges(std::span<const Vec3> positions,
                                              std::span<const Vec3> normals,
                                              std::span<const std::uint32_t> corners,
                                              std::span<const TriangleSide> sides) {
  const Graph all = GraphOf(normals, corners, sides);
  std::vector<Level> levels;
  NeighborhoodFit surroundings(positions, normals);
  for (bool is_settled = false; !is_settled;) {
    const Graph& graph = levels.empty() ? all : levels.back().selected;
    if (graph.neighbors.empty()) break;
    levels.push_back(NextLevel(graph, levels.empty() ? nullptr : &levels.back(), surroundings));
    is_settled = std::ranges::all_of(levels.back().bounds, IsSettled);
  }

  std::vector<CurvatureChange> changes(positions.size(), {kUnknown, kUnknown, false, false});
  if (levels.empty()) return changes;
  for (std::size_t l = levels.size() - 1; l-- > 0;) {
    std::vector<BothBounds>& fine = levels[l].bounds;
    for (std::uint32_t s = 0; s < fine.size(); ++s) {
      for (std::size_t order = 0; order < 2; ++order) {
        fine[s][order] = Choose(fine[s][order], levels[l + 1].bounds[levels[l + 1].of[s]][order]);
      }
    }
  }
  const auto is_clear = [](const Bound& bound) {
    return bound.trust != Bound::Trust::kUnsure || bound.IsClearBy(kDoubtful);
  };
  for (std::uint32_t i = 0; i < all.size(); ++i) {
    const auto& [first, second] = levels[0].bounds[levels[0].of[i]];
    changes[all.vertex[i]] = {first.value, second.value, is_clear(first), is_clear(second)};
  }
  return changes;
}

}  // namespace lucerna
