// Numbers of a scene whose unit of length changes: `factor` times as many units make up a length.
#pragma once

#include <cmath>

#include "render/math/rgb.h"
#include "render/math/vector.h"

namespace lucerna {

[[nodiscard]] inline float ScaledBy(float value, double factor) {
  return static_cast<float>(static_cast<double>(value) * factor);
}

[[nodiscard]] inline Vec3 ScaledBy(Vec3 v, double factor) {
  return {ScaledBy(v.x, factor), ScaledBy(v.y, factor), ScaledBy(v.z, factor)};
}

// An intensity [W·sr⁻¹] is radiance times an area. False when it is too large for a float.
[[nodiscard]] inline bool ScaleIntensity(Rgb& intensity, double factor) {
  for (float* channel : {&intensity.r, &intensity.g, &intensity.b})
    *channel = ScaledBy(*channel, factor * factor);
  return std::isfinite(MaxChannel(intensity));
}

}  // namespace lucerna
