// Of what is a surface made at one of its points?
#pragma once

#include <optional>

#include "render/geometry/intersector.h"
#include "render/scene/scene.h"

namespace lucerna {

namespace material_at_internal {
[[nodiscard]] const Material& Textured(const Scene& scene, const SurfacePoint& point,
                                       const Material& material, std::optional<Material>& storage);
}  // namespace material_at_internal

// The material of `scene`, or with a texture, looked up at the point, in `storage` (without the
// name). Scenes are in the working space but for textures, which are converted here.
[[nodiscard]] inline const Material& MaterialAt(const Scene& scene, const SurfacePoint& point,
                                                std::optional<Material>& storage) {
  const Material& material = scene.materials[point.material];
  if (!material.HasTexture()) [[likely]]
    return material;
  return material_at_internal::Textured(scene, point, material, storage);
}

}  // namespace lucerna
