#include "render/estimate/star_region.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

namespace lucerna {
namespace {

double Dot(Point2 a, Point2 b) {
  return a.x * b.x + a.y * b.y;
}
double Cross(Point2 a, Point2 b) {
  return a.x * b.y - a.y * b.x;
}
Point2 Unit(Point2 a) {
  const double inverse = 1 / std::sqrt(Dot(a, a));
  return {a.x * inverse, a.y * inverse};
}

// Grows with the angle of a direction, from -2 to 2, without an arc tangent.
double OrderOf(Point2 a) {
  const double t = a.y / (std::abs(a.x) + std::abs(a.y));
  return a.x >= 0 ? t : a.y >= 0 ? 2 - t : -2 - t;
}

// The angle from one direction to the next, counter-clockwise, in [0, 2π). Directions that are
// equal but for rounding are equal.
double AngleBetween(Point2 from, Point2 to) {
  const double angle = std::atan2(Cross(from, to), Dot(from, to));
  return angle < -1e-14 ? angle + 2 * std::numbers::pi : std::max(angle, 0.0);
}

// g·x of what lies behind a segment, but for rounding.
constexpr float kBehind = 1 - 1e-6F;

// Calls visit(y, weight) for the nodes of [y0, y1].
template <typename Visit>
void Quadrature(std::span<const QuadratureNode> nodes, double y0, double y1, const Visit& visit) {
  const double middle = (y0 + y1) / 2;
  const double half = (y1 - y0) / 2;
  for (const QuadratureNode& node : nodes) {
    visit(middle - half * node.at, half * node.weight);
    visit(middle + half * node.at, half * node.weight);
  }
}

}  // namespace

// What lies behind a segment is convex: all of another one is there when both of its ends are. In
// float: a segment that is before another by no more than rounding may go, and the same one twice
// must.
bool StarRegion::Hides(Point2 a, Point2 b) const {
  const auto px = static_cast<float>(a.x), py = static_cast<float>(a.y);
  const auto qx = static_cast<float>(b.x), qy = static_cast<float>(b.y);
  for (std::size_t block = 0; block < blocks(); ++block) {
    const Wedges& w = wedges_[block];
    const __m256 ax = LoadLanes(w.ax), ay = LoadLanes(w.ay);
    const __m256 bx = LoadLanes(w.bx), by = LoadLanes(w.by);
    const __m256 gx = LoadLanes(w.gx), gy = LoadLanes(w.gy);
    const auto hides = (ax * py - ay * px >= 0) & (px * by - py * bx >= 0) &
                       (gx * px + gy * py >= kBehind) & (ax * qy - ay * qx >= 0) &
                       (qx * by - qy * bx >= 0) & (gx * qx + gy * qy >= kBehind);
    if (LaneBits(hides) != 0) return true;
  }
  return false;
}

void StarRegion::RemoveHiddenBy(const Segment& segment) {
  const auto f = [](double x) { return static_cast<float>(x); };
  const float ax = f(segment.a.x), ay = f(segment.a.y);
  const float bx = f(segment.b.x), by = f(segment.b.y);
  const float gx = f(segment.g.x), gy = f(segment.g.y);
  std::array<unsigned int, kMostSegments / kLanes> hidden;
  unsigned int any = 0;
  for (std::size_t block = 0; block < blocks(); ++block) {
    const Wedges& w = wedges_[block];
    const auto is_behind = [&](__m256 x, __m256 y) {
      return (ax * y - ay * x >= 0) & (x * by - y * bx >= 0) & (gx * x + gy * y >= kBehind);
    };
    hidden[block] = LaneBits(is_behind(LoadLanes(w.ax), LoadLanes(w.ay)) &
                             is_behind(LoadLanes(w.bx), LoadLanes(w.by)));
    any |= hidden[block];
  }
  if (any == 0) return;
  const std::size_t before = segments_;
  segments_ = 0;
  for (std::size_t i = 0; i < before; ++i) {
    if ((hidden[i / kLanes] >> (i % kLanes) & 1U) == 0) Set(segments_++, exact_[i]);
  }
  for (std::size_t i = segments_; i < before; ++i)
    Set(i, {});
}

void StarRegion::Set(std::size_t number, const Segment& segment) {
  const auto f = [](double x) { return static_cast<float>(x); };
  exact_[number] = segment;
  Wedges& w = wedges_[number / kLanes];
  const std::size_t lane = number % kLanes;
  w.ax[lane] = f(segment.a.x);
  w.ay[lane] = f(segment.a.y);
  w.bx[lane] = f(segment.b.x);
  w.by[lane] = f(segment.b.y);
  w.gx[lane] = f(segment.g.x);
  w.gy[lane] = f(segment.g.y);
}

bool StarRegion::Add(Point2 a, Point2 b) {
  double cross = Cross(a, b);
  if (cross < 0) {
    std::swap(a, b);
    cross = -cross;
  }
  const Point2 along = {b.x - a.x, b.y - a.y};
  if (!(cross > 1e-12 * Dot(along, along)) || !(cross > 1e-30)) return true;
  if (Hides(a, b)) return true;
  const Segment segment = {a, b, {along.y / cross, -along.x / cross}};
  RemoveHiddenBy(segment);
  if (segments_ == kMostSegments) return false;
  if (segments_ % kLanes == 0) wedges_[segments_ / kLanes] = {};
  Set(segments_++, segment);
  return true;
}

void StarRegion::AddPiece(Point2 from, Point2 to, Point2 g) {
  if (pieces_ == kMostPieces) return;
  all_pieces_[pieces_++] = {from, to, g};
}

// The nearest line in a direction u has the largest g·u. That is linear in u, so lines that are
// nearest at both ends of a wedge are nearest in between.
void StarRegion::SplitWedge(Point2 from, Point2 to, const std::size_t* active, std::size_t count,
                            int depth) {
  const auto nearest = [&](Point2 u, Point2 next) {
    std::size_t best = active[0];
    for (std::size_t i = 1; i < count; ++i) {
      const double more = Dot(exact_[active[i]].g, u) - Dot(exact_[best].g, u);
      if (more > 0 || (more == 0 && Dot(exact_[active[i]].g, next) > Dot(exact_[best].g, next))) {
        best = active[i];
      }
    }
    return best;
  };
  const std::size_t first = nearest(from, to);
  const std::size_t last = nearest(to, from);
  const Point2 g = {exact_[first].g.x - exact_[last].g.x, exact_[first].g.y - exact_[last].g.y};
  const double at_from = Dot(g, from);
  const double at_to = -Dot(g, to);
  if (first == last || !(at_from + at_to > 0) || depth == 0) {
    AddPiece(from, to, exact_[first].g);
    return;
  }
  const Point2 crossing = Unit({at_to * from.x + at_from * to.x, at_to * from.y + at_from * to.y});
  const std::size_t between = nearest(crossing, to);
  const double reached = Dot(exact_[first].g, crossing);
  if (Dot(exact_[between].g, crossing) <= reached * (1 + 1e-9)) {
    AddPiece(from, crossing, exact_[first].g);
    AddPiece(crossing, to, exact_[last].g);
    return;
  }
  SplitWedge(from, crossing, active, count, depth - 1);
  SplitWedge(crossing, to, active, count, depth - 1);
}

void StarRegion::Finish() {
  pieces_ = 0;
  if (segments_ == 0) return;
  struct Event {
    double order;
    Point2 direction;
  };
  std::array<Event, 2 * kMostSegments> events;
  std::size_t count = 0;
  for (std::size_t i = 0; i < segments_; ++i) {
    for (const Point2 end : {exact_[i].a, exact_[i].b})
      events[count++] = {OrderOf(end), Unit(end)};
  }
  std::sort(events.begin(), events.begin() + static_cast<std::ptrdiff_t>(count),
            [](const Event& a, const Event& b) { return a.order < b.order; });
  for (std::size_t e = 0; e < count; ++e) {
    const Event& from = events[e];
    const Event& to = events[(e + 1) % count];
    if (e + 1 < count && !(to.order - from.order > 1e-12)) continue;
    std::array<std::size_t, kMostSegments> active;
    std::size_t active_count = 0;
    // A segment covers an interval between neighbouring ends wholly or not at all.
    const Point2 middle = {from.direction.x + to.direction.x, from.direction.y + to.direction.y};
    const bool is_narrow = Cross(from.direction, to.direction) > 0;
    for (std::size_t i = 0; is_narrow && i < segments_; ++i) {
      if (Cross(exact_[i].a, middle) > 0 && Cross(middle, exact_[i].b) > 0)
        active[active_count++] = i;
    }
    if (active_count == 0) {
      AddPiece(from.direction, to.direction, {0, 0});
    } else {
      SplitWedge(from.direction, to.direction, active.data(), active_count, 6);
    }
  }
}

template <typename OnArc, typename OnChord>
void StarRegion::ForEachPart(double scale, const OnArc& on_arc, const OnChord& on_chord) const {
  if (pieces_ == 0) {
    // A whole turn.
    on_arc(Point2{1, 0}, Point2{-1, 0}, std::numbers::pi);
    on_arc(Point2{-1, 0}, Point2{1, 0}, std::numbers::pi);
    return;
  }
  for (std::size_t i = 0; i < pieces_; ++i) {
    const Piece& piece = all_pieces_[i];
    // Less than half a turn.
    const auto arc = [&](Point2 from, Point2 to) {
      on_arc(from, to, std::max(0.0, std::atan2(Cross(from, to), Dot(from, to))));
    };
    const double squared = Dot(piece.g, piece.g) * scale * scale;
    if (!(squared > 1)) {
      on_arc(piece.from, piece.to, AngleBetween(piece.from, piece.to));
      continue;
    }
    const double h = 1 / std::sqrt(squared);
    const Point2 foot = Unit(piece.g);
    const Point2 along = {-foot.y, foot.x};
    const double reach = std::sqrt(std::max(0.0, 1 - h * h));
    const auto place = [&](Point2 u) { return h * Dot(u, along) / Dot(u, foot); };
    const double y_from = place(piece.from);
    const double y_to = place(piece.to);
    const double y0 = std::clamp(y_from, -reach, reach);
    const double y1 = std::clamp(y_to, -reach, reach);
    const auto towards = [&](double y) {
      return Point2{foot.x * h + along.x * y, foot.y * h + along.y * y};
    };
    if (y_from < y0) arc(piece.from, y_to < y0 ? piece.to : towards(y0));
    if (y1 > y0) on_chord(h, foot, along, y0, y1);
    if (y_to > y1) arc(y_from > y1 ? piece.from : towards(y1), piece.to);
  }
}

template <typename GatherKernel>
RegionMoments StarRegion::MomentsWith(double scale) const {
  RegionMoments sum;
  const RayIntegrals whole = GatherKernel::Along(1);
  ForEachPart(
      scale,
      [&](Point2 from, Point2 to, double angle) {
        sum.zeroth += whole.k0 * angle;
        sum.x += whole.k1 * (to.y - from.y);
        sum.y += whole.k1 * (from.x - to.x);
        const double turn = (to.x * to.y - from.x * from.y) / 2;
        sum.xx += whole.k2 * (angle / 2 + turn);
        sum.yy += whole.k2 * (angle / 2 - turn);
        sum.xy += whole.k2 * (to.y * to.y - from.y * from.y) / 2;
      },
      [&](double h, Point2 foot, Point2 along, double y0, double y1) {
        Quadrature(GatherKernel::kNodes, y0, y1, [&](double y, double weight) {
          const RayIntegrals ray = GatherKernel::Along(h * h + y * y);
          const Point2 p = {foot.x * h + along.x * y, foot.y * h + along.y * y};
          weight *= h;
          sum.zeroth += weight * ray.k0;
          sum.x += weight * ray.k1 * p.x;
          sum.y += weight * ray.k1 * p.y;
          sum.xx += weight * ray.k2 * p.x * p.x;
          sum.xy += weight * ray.k2 * p.x * p.y;
          sum.yy += weight * ray.k2 * p.y * p.y;
        });
      });
  return sum;
}

RegionMoments StarRegion::MomentsOf(KernelKind kernel, double scale) const {
  return WithKernel(kernel, [&](auto k) { return MomentsWith<decltype(k)>(scale); });
}

StarRegion::PowerMoments StarRegion::PowerMomentsOf(double scale) const {
  PowerMoments sum;
  ForEachPart(
      scale,
      [&](Point2 from, Point2 to, double angle) {
        for (std::size_t k = 0; k < 3; ++k)
          sum.zeroth[k] += angle / static_cast<double>(2 * k + 2);
        for (std::size_t k = 0; k < 2; ++k) {
          sum.x[k] += (to.y - from.y) / static_cast<double>(2 * k + 3);
          sum.y[k] += (from.x - to.x) / static_cast<double>(2 * k + 3);
        }
        const double turn = (to.x * to.y - from.x * from.y) / 2;
        sum.xx += (angle / 2 + turn) / 4;
        sum.yy += (angle / 2 - turn) / 4;
        sum.xy += (to.y * to.y - from.y * from.y) / 8;
      },
      [&](double h, Point2 foot, Point2 along, double y0, double y1) {
        Quadrature(kFourPoints, y0, y1, [&](double y, double weight) {
          const double s = h * h + y * y;
          const Point2 p = {foot.x * h + along.x * y, foot.y * h + along.y * y};
          weight *= h;
          double power = weight;
          for (std::size_t k = 0; k < 3; ++k) {
            sum.zeroth[k] += power / static_cast<double>(2 * k + 2);
            if (k < 2) {
              sum.x[k] += power * p.x / static_cast<double>(2 * k + 3);
              sum.y[k] += power * p.y / static_cast<double>(2 * k + 3);
            }
            power *= s;
          }
          sum.xx += weight * p.x * p.x / 4;
          sum.xy += weight * p.x * p.y / 4;
          sum.yy += weight * p.y * p.y / 4;
        });
      });
  return sum;
}

RegionWeight WeightFor(const RegionMoments& m, double whole) {
  const double determinant = m.xx * m.yy - m.xy * m.xy;
  double bx = 0;
  double by = 0;
  if (determinant > 1e-9 * m.xx * m.yy) {
    bx = (m.yy * m.x - m.xy * m.y) / determinant;
    by = (m.xx * m.y - m.xy * m.x) / determinant;
    const double length = std::sqrt(bx * bx + by * by);
    if (length > 1) {
      bx /= length;
      by /= length;
    }
  }
  const double constant = whole / (m.zeroth - bx * m.x - by * m.y);
  return {static_cast<float>(constant), static_cast<float>(-constant * bx),
          static_cast<float>(-constant * by)};
}

}  // namespace lucerna
