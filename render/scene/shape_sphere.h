// A whole sphere. Members as in scene/analytic_shapes.h.
#pragma once

#include <numbers>

#include "render/math/double3.h"
#include "render/scene/scaling.h"
#include "render/scene/shape_traits.h"

namespace lucerna {

struct Sphere {
  static constexpr bool kIsFlat = false;
  static constexpr bool kIsClosed = true;
  static constexpr bool kIsThin = false;

  Vec3 center;
  float radius = 1;     // > 0
  bool inward = false;  // the outward normal points to the centre
  ShapeTraits traits;
  ShapeAxes axes = {};

  [[nodiscard]] float Reach() const { return radius; }
  template <typename Real>
  [[nodiscard]] Real Area() const {
    const Real r = radius;
    return 4 * std::numbers::pi_v<Real> * r * r;
  }
  void Scale(double factor) {
    center = ScaledBy(center, factor);
    radius = ScaledBy(radius, factor);
  }
  [[nodiscard]] bool LightsItself() const { return inward; }
  [[nodiscard]] double SignedDistance(Double3 point) const {
    return Length(point - Double3(center)) - static_cast<double>(radius);
  }
};

}  // namespace lucerna
