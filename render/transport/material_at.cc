#include "render/transport/material_at.h"

#include "render/geometry/surface_uv.h"

namespace lucerna::material_at_internal {

const Material& Textured(const Scene& scene, const SurfacePoint& point, const Material& material,
                         std::optional<Material>& storage) {
  const Rgb color = TextureColor(scene.textures, material.texture, UvAt(scene, point));
  Material& here = storage.emplace();
  static_cast<MaterialNumbers&>(here) = static_cast<const MaterialNumbers&>(material);
  SetTexturedParameter(here, TexturedValue(material.kind, color));
  return here;
}

}  // namespace lucerna::material_at_internal
