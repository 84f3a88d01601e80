// A light at a point that shines into a cone. Members as in scene/light_list.h.
#pragma once

#include <cstdint>

#include "render/scene/given_spectrum.h"
#include "render/scene/medium.h"
#include "render/scene/scaling.h"

namespace lucerna {

// Intensity falls from 1 inside cos_falloff_start to 0 at cos_total_width as smoothstep of the
// cosine, as pbrt has it.
struct SpotLight {
  static constexpr bool kIsAtInfinity = false;

  Vec3 position;
  Vec3 direction;  // unit, the axis of the cone
  Rgb intensity;   // [W·sr⁻¹] on the axis
  float cos_falloff_start = 1;
  float cos_total_width = 1;
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
