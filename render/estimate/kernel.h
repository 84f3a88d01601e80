// How much does a photon count at a distance from the hitpoint?
//
// A kernel is K(x) = norm · shape(|x|²/r²) / r², with integral 1 over the disc of radius r. The
// worker applies the shape, in [0, 1]; the coordinator the norm and 1/r².
#pragma once

#include <numbers>

#include "render/scene/render_settings.h"

namespace lucerna {

struct Kernel {
  KernelKind kind = KernelKind::kEpanechnikov;

  // `t2` = |x|²/r², in [0, 1].
  [[nodiscard]] constexpr float Shape(float t2) const {
    return kind == KernelKind::kConstant ? 1.0F : 1.0F - t2;
  }
  [[nodiscard]] constexpr double Norm() const {
    return (kind == KernelKind::kConstant ? 1 : 2) / std::numbers::pi;
  }
};

}  // namespace lucerna
