// Parallel light from infinity. Members as in scene/light_list.h.
#pragma once

#include <cstdint>

#include "render/math/rgb.h"
#include "render/math/vector.h"
#include "render/scene/given_spectrum.h"
#include "render/scene/medium.h"

namespace lucerna {

struct DistantLight {
  static constexpr bool kIsAtInfinity = true;

  Vec3 direction;  // unit, the way the light travels
  Rgb irradiance;  // [W·m⁻²] on a plane facing it
  std::int32_t medium = kNoMedium;
  GivenSpectrum spectrum = {};

  [[nodiscard]] Vec3 Place() const { return direction; }
  [[nodiscard]] const Rgb& Strength() const { return irradiance; }
  [[nodiscard]] Rgb& Strength() { return irradiance; }
  [[nodiscard]] static bool Scale(double /*factor*/) { return true; }
};

}  // namespace lucerna
