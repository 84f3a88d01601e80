// A light at a point that shines the same in all directions. Members as in scene/light_list.h.
#pragma once

#include <cstdint>

#include "render/scene/given_spectrum.h"
#include "render/scene/medium.h"
#include "render/scene/scaling.h"

namespace lucerna {

struct PointLight {
  static constexpr bool kIsAtInfinity = false;

  Vec3 position;
  Rgb intensity;  // [W·sr⁻¹]
  std::int32_t medium = kNoMedium;
  GivenSpectrum spectrum = {};

  [[nodiscard]] Vec3 Place() const { return position; }
  [[nodiscard]] const Rgb& Strength() const { return intensity; }
  [[nodiscard]] Rgb& Strength() { return intensity; }
  [[nodiscard]] bool Scale(double factor) {
    position = ScaledBy(position, factor);
    return ScaleIntensity(intensity, factor);
  }
};

}  // namespace lucerna
