// A light at a point that throws a picture, as a slide projector does. Members as in
// scene/light_list.h.
#pragma once

#include <cmath>
#include <cstdint>
#include <memory>

#include "render/math/color_space.h"
#include "render/math/piecewise_constant.h"
#include "render/math/uplift.h"
#include "render/scene/given_spectrum.h"
#include "render/scene/medium.h"
#include "render/scene/scaling.h"
#include "render/scene/shape_traits.h"
#include "render/scene/texture.h"

namespace lucerna {

struct ProjectionLight {
  static constexpr bool kIsAtInfinity = false;

  Vec3 position;
  Rgb intensity;  // [W·sr⁻¹] where the picture is 1
  std::shared_ptr<const Picture> map;
  // Pixels are cut into parts × parts cells, within which cosines hardly change.
  int parts = 1;
  std::shared_ptr<const PiecewiseConstant2D> cells = nullptr;  // by WeightOf
  ShapeAxes axes;  // z: where it shines; x and y: along the picture's rows, and up
  // Half of the picture's width and height at distance 1.
  float half_width = 1, half_height = 1;
  std::int32_t medium = kNoMedium;
  GivenSpectrum spectrum = {};

  [[nodiscard]] int columns() const { return map->width * parts; }
  [[nodiscard]] int rows() const { return map->height * parts; }
  // Of a cell, in the working space.
  [[nodiscard]] Rgb ColorOf(int x, int y) const { return ToWorking(map->At(x / parts, y / parts)); }
  // The same at a pass's wavelengths; `uplift` nullptr: in the working space.
  [[nodiscard]] Rgb ColorOf(int x, int y, const Uplift* uplift) const {
    return uplift == nullptr ? ColorOf(x, y) : uplift->Unbounded(map->At(x / parts, y / parts));
  }
  // The place [cells] that shines in a direction away from the light with these slopes x/z and y/z.
  [[nodiscard]] Vec2 PlaceOf(float x_slope, float y_slope) const {
    return {(x_slope / half_width + 1) * 0.5F * static_cast<float>(columns()),
            (1 - y_slope / half_height) * 0.5F * static_cast<float>(rows())};
  }
  // The direction, in the light's axes and with z = 1, of a place [cells].
  [[nodiscard]] Vec3 TowardsPlace(Vec2 place) const {
    return {half_width * (2 * place.x / static_cast<float>(columns()) - 1),
            half_height * (1 - 2 * place.y / static_cast<float>(rows())), 1};
  }
  // The solid angle of a small piece of the plane at distance 1 over its area, at such a place.
  [[nodiscard]] static float SolidAngleOverArea(Vec3 towards) {
    const float squared = LengthSquared(towards);
    return 1 / (squared * std::sqrt(squared));
  }
  // About the light that goes through a cell, but for a factor that all share.
  [[nodiscard]] Rgb LightOf(int x, int y) const {
    return ColorOf(x, y) * SolidAngleOverArea(TowardsPlace(
                               {static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F}));
  }
  [[nodiscard]] float WeightOf(int x, int y) const { return Luminance(LightOf(x, y)); }
  // What `intensity` is multiplied by in a direction away from the light, in the working space.
  [[nodiscard]] Rgb FactorAt(Vec3 direction, const Uplift* uplift = nullptr) const {
    const float z = Dot(direction, axes.z);
    if (!(z > 0)) return {};
    const Vec2 place = PlaceOf(Dot(direction, axes.x) / z, Dot(direction, axes.y) / z);
    const bool is_inside = place.x >= 0 && place.y >= 0 &&
                           place.x < static_cast<float>(columns()) &&
                           place.y < static_cast<float>(rows());
    return is_inside ? ColorOf(static_cast<int>(place.x), static_cast<int>(place.y), uplift)
                     : Rgb{};
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
