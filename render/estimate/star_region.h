// Which part of a disc can be seen from its centre, and what is a kernel's integral over it?
//
// A hitpoint's disc is cut where its surface ends or turns: at segments in the tangent plane. What
// is left is the star-shaped region of the points that can be joined with the centre by a straight
// line that crosses no segment. Kernels and their moments are integrated over it exactly
// (polynomial kernels) or by a quadrature good for 1e-7 (the Gaussian), so that a photon density
// that is gathered in the region alone can be normalised.
//
// Every length is relative to the radius of the hitpoint. The plane has an origin, the hitpoint.
#pragma once

#include <array>
#include <cstddef>

#include "render/math/float_lanes.h"
#include "render/math/kernel.h"

namespace lucerna {

// Without initial values, because arrays of them are made for every disc that is cut.
struct Point2 {
  double x, y;
};

// Integrals of a function over the region, times 1, the place, and its products.
struct RegionMoments {
  double zeroth = 0;
  double x = 0, y = 0;
  double xx = 0, xy = 0, yy = 0;
};

class StarRegion {
 public:
  // Of segments that do not hide each other.
  static constexpr std::size_t kMostSegments = 64;

  // Nothing of what lies behind the segment is in the region. False when there is no room for
  // another: then the region is of no use. A segment that points at the origin hides nothing, and
  // one that lies behind another takes no room.
  // Requires finite ends; far ends lose precision (cut segments to the disc first).
  bool Add(Point2 a, Point2 b);
  // Whether all of a segment lies behind one that was added: then Add would change nothing.
  [[nodiscard]] bool Hides(Point2 a, Point2 b) const;
  // After the last Add, before anything below.
  void Finish();
  void Clear() { segments_ = pieces_ = 0; }

  [[nodiscard]] std::size_t segments() const { return segments_; }

  // Whether no segment lies between the origin and the point.
  [[nodiscard]] bool Sees(float x, float y) const {
    for (std::size_t block = 0; block < blocks(); ++block) {
      const Wedges& w = wedges_[block];
      const auto hidden = (LoadLanes(w.ax) * y - LoadLanes(w.ay) * x > 0) &
                          (x * LoadLanes(w.by) - y * LoadLanes(w.bx) > 0) &
                          (LoadLanes(w.gx) * x + LoadLanes(w.gy) * y > 1);
      if (LaneBits(hidden) != 0) return false;
    }
    return true;
  }

  // Moments of K(|x|²) over the part of the region within `scale`, where K is the kernel's shape
  // and x the place over `scale`: a whole disc has the moments of the kernel.
  [[nodiscard]] RegionMoments MomentsOf(KernelKind kernel, double scale) const;

  // The same of the powers u^k = |x|^(2k), k = 0 to 2; `second` of u^0 only.
  struct PowerMoments {
    std::array<double, 3> zeroth = {};
    std::array<double, 2> x = {}, y = {};
    double xx = 0, xy = 0, yy = 0;
  };
  [[nodiscard]] PowerMoments PowerMomentsOf(double scale) const;

 private:
  static constexpr std::size_t kLanes = 8;
  // Of each of eight segments the cone between its ends a and b (counter-clockwise) and the line
  // g·x = 1 across it. Those that there are not are 0 and hide nothing.
  struct Wedges {
    alignas(32) std::array<float, kLanes> ax{}, ay{}, bx{}, by{}, gx{}, gy{};
  };
  // Between two directions (unit, counter-clockwise) the region ends at the line g·x = 1; with
  // g = 0 it does not end.
  struct Piece {
    Point2 from, to, g;
  };
  // Each of at most 2n intervals has at most n pieces, but all of them together only as many as
  // the lower envelope of n segments: fewer than 8n for so few.
  static constexpr std::size_t kMostPieces = 8 * kMostSegments;

  void SplitWedge(Point2 from, Point2 to, const std::size_t* active, std::size_t count, int depth);
  void AddPiece(Point2 from, Point2 to, Point2 g);
  template <typename GatherKernel>
  [[nodiscard]] RegionMoments MomentsWith(double scale) const;
  template <typename OnArc, typename OnChord>
  void ForEachPart(double scale, const OnArc& on_arc, const OnChord& on_chord) const;

  std::size_t segments_ = 0;
  std::size_t pieces_ = 0;
  struct Segment {
    Point2 a, b, g;
  };
  [[nodiscard]] std::size_t blocks() const { return (segments_ + kLanes - 1) / kLanes; }
  void Set(std::size_t number, const Segment& segment);
  void RemoveHiddenBy(const Segment& segment);

  std::array<Segment, kMostSegments> exact_;
  // The same, eight at a time.
  std::array<Wedges, kMostSegments / kLanes> wedges_;
  std::array<Piece, kMostPieces> all_pieces_;
};

// How a photon at x counts, beside the kernel's shape: by constant + x·slope, so that over the
// region the kernel keeps its integral and its first moments vanish, as far as that needs no weight
// below 0. (At a straight border and for Epanechnikov's kernel, the estimate of light that changes
// by 1 a radius is then off by 0.26, 0.13 and 0.015 at 0, 0.2 and 0.4 radii from it, and by 0 from
// 0.45 on; without a slope it is 0.34, 0.23 and 0.135. Slopes that take away all first moments
// everywhere need weights below 0 and made the border 1.5 times as noisy.)
struct RegionWeight {
  float constant = 1;
  float slope_x = 0, slope_y = 0;

  [[nodiscard]] float At(float x, float y) const { return constant + slope_x * x + slope_y * y; }
};

// `whole` is the kernel's integral over the whole disc. The weight is >= 0 within the disc, up to
// rounding.
// Source: Fan & Gijbels 1992, "Variable bandwidth and local linear regression smoothers".
[[nodiscard]] RegionWeight WeightFor(const RegionMoments& moments, double whole);

}  // namespace lucerna
