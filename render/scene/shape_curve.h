// A piece of a curve such as a hair. Members as in scene/analytic_shapes.h.
//
// All balls whose centres run from `from` to `to` while their radii run from `from_radius` to
// `to_radius`, together: a cone with round ends. Pieces one after the other, with the same centre
// and radius where they meet, are a tube without gaps. Rays meet the tube from outside only: one
// that begins inside leaves it unseen.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include "render/math/double3.h"
#include "render/scene/scaling.h"
#include "render/scene/shape_traits.h"

namespace lucerna {

struct CurvePiece {
  static constexpr bool kIsFlat = false;
  static constexpr bool kIsClosed = true;
  static constexpr bool kIsThin = true;

  Vec3 from, to;
  float from_radius = 1, to_radius = 1;  // >= 0, not both 0
  float from_u = 0, to_u = 1;            // texture coordinate along the curve
  ShapeTraits traits;
  Vec3 center;  // of `from` and `to`

  // In doubles, for what is computed from it.
  struct Axis {
    Double3 from, along;
    double radius, growth;  // at s: radius + growth·s

    explicit Axis(const CurvePiece& piece)
        : from(piece.from),
          along(Double3(piece.to) - from),
          radius(piece.from_radius),
          growth(static_cast<double>(piece.to_radius) - radius) {}

    // Of all balls, the share s in [0, 1] of the way at which the one is that `point` is deepest
    // in or nearest to: at right angles to the cone, not to its axis.
    [[nodiscard]] double Nearest(Double3 point) const {
      const double length2 = Dot(along, along);
      const double tangent2 = length2 - growth * growth;
      // One end holds the other.
      if (!(tangent2 > 0)) return growth > 0 ? 1 : 0;
      const Double3 off = point - from;
      const double share = Dot(off, along) / length2;
      const double across = Length(off - along * share);
      return std::clamp(share + growth * across / std::sqrt(length2 * tangent2), 0.0, 1.0);
    }
  };

  [[nodiscard]] float Reach() const {
    return 0.5F * Length(to - from) + std::max(from_radius, to_radius);
  }
  // Of the side of the cone alone: what the next piece covers is no surface.
  template <typename Real>
  [[nodiscard]] Real Area() const {
    const Axis axis(*this);
    const double length = Length(axis.along);
    const double tangent2 = length * length - axis.growth * axis.growth;
    if (!(tangent2 > 0)) return 0;
    return static_cast<Real>(std::numbers::pi * (2 * axis.radius + axis.growth) * tangent2 /
                             length);
  }
  void Scale(double factor) {
    from = ScaledBy(from, factor);
    to = ScaledBy(to, factor);
    center = ScaledBy(center, factor);
    from_radius = ScaledBy(from_radius, factor);
    to_radius = ScaledBy(to_radius, factor);
  }
  [[nodiscard]] bool LightsItself() const { return false; }
  [[nodiscard]] double SignedDistance(Double3 point) const {
    const Axis axis(*this);
    const double s = axis.Nearest(point);
    return Length(point - axis.from - axis.along * s) - (axis.radius + axis.growth * s);
  }
};

}  // namespace lucerna
