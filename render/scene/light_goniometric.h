// A light at a point whose intensity is a picture over the directions, as luminaires are measured.
// Members as in scene/light_list.h.
#pragma once

#include <cstdint>
#include <memory>

#include "render/math/piecewise_constant.h"
#include "render/scene/given_spectrum.h"
#include "render/scene/medium.h"
#include "render/scene/scaling.h"
#include "render/scene/shape_traits.h"
#include "render/scene/texture.h"

namespace lucerna {

struct GoniometricLight {
  static constexpr bool kIsAtInfinity = false;

  Vec3 position;
  Rgb intensity;  // [W·sr⁻¹] where the picture is 1
  // A square, equal-area as an environment map's (scene/infinite_light.h); of a colour its mean
  // counts.
  std::shared_ptr<const Picture> map;
  std::shared_ptr<const PiecewiseConstant2D> directions;  // in proportion to the picture
  ShapeAxes axes;                                         // of the map, in the world
  std::int32_t medium = kNoMedium;
  GivenSpectrum spectrum = {};

  // Of a pixel of the map.
  [[nodiscard]] static float GrayOf(const Picture& map, int x, int y) {
    const Rgb color = map.At(x, y);
    return (color.r + color.g + color.b) / 3;
  }
  [[nodiscard]] Vec3 Place() const { return position; }
  [[nodiscard]] const Rgb& Strength() const { return intensity; }
  [[nodiscard]] Rgb& Strength() { return intensity; }
  [[nodiscard]] bool Scale(double factor) {
    position = ScaledBy(position, factor);
    return ScaleIntensity(intensity, factor);
  }
};

}  // namespace lucerna
