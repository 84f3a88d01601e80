// What shapes of all kinds have in common.
#pragma once

#include <cstdint>

#include "render/math/vector.h"
#include "render/scene/medium.h"
#include "render/scene/motion.h"
#include "render/scene/texture.h"

namespace lucerna {

inline constexpr std::int32_t kNoAreaLight = -1;

inline constexpr std::int32_t kNoSource = -1;

// What every shape carries.
struct ShapeTraits {
  std::int32_t material = 0;
  std::int32_t area_light = kNoAreaLight;
  // The media on the sides that the outward normal points away from and to, as the file names
  // them. Where both are the same, the surface lies within whatever medium is there.
  std::int32_t medium_inside = kNoMedium, medium_outside = kNoMedium;
  // The share of rays that meet the shape; which ones follows from the ray
  // (geometry/intersector.h).
  float alpha = 1;
  std::int32_t alpha_texture = kNoTexture;  // in place of `alpha`, which is its largest number
  std::int32_t motion = kNoMotion;
  std::int32_t source = kNoSource;  // in Scene::sources; only for messages

  [[nodiscard]] bool SeparatesMedia() const { return medium_inside != medium_outside; }
  // Whether the shapes look the same, wherever they are written.
  bool operator==(const ShapeTraits& other) const {
    return material == other.material && area_light == other.area_light &&
           medium_inside == other.medium_inside && medium_outside == other.medium_outside &&
           alpha == other.alpha && alpha_texture == other.alpha_texture && motion == other.motion;
  }
};

// Whether all rays meet the shape.
[[nodiscard]] inline bool IsWhole(const ShapeTraits& traits) {
  return traits.alpha >= 1 && traits.alpha_texture == kNoTexture;
}

// Where the axes of a shape's own space point in the world: unit, at right angles. The texture
// coordinate u of spheres and disks grows from x to y.
struct ShapeAxes {
  Vec3 x = {1, 0, 0}, y = {0, 1, 0}, z = {0, 0, 1};
};

}  // namespace lucerna
