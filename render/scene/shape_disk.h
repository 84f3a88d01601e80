// A disk, or a ring. Members as in scene/analytic_shapes.h.
#pragma once

#include <numbers>

#include "render/scene/scaling.h"
#include "render/scene/shape_traits.h"

namespace lucerna {

struct Disk {
  static constexpr bool kIsFlat = true;
  static constexpr bool kIsClosed = false;
  static constexpr bool kIsThin = false;

  Vec3 center;
  Vec3 normal;  // unit, outward
  float radius = 1;
  float inner_radius = 0;
  ShapeTraits traits;
  ShapeAxes axes = {};

  [[nodiscard]] float Reach() const { return radius; }
  template <typename Real>
  [[nodiscard]] Real Area() const {
    const Real r = radius;
    const Real inner = inner_radius;
    return std::numbers::pi_v<Real> * (r * r - inner * inner);
  }
  void Scale(double factor) {
    center = ScaledBy(center, factor);
    radius = ScaledBy(radius, factor);
    inner_radius = ScaledBy(inner_radius, factor);
  }
  [[nodiscard]] bool LightsItself() const { return false; }
};

}  // namespace lucerna
