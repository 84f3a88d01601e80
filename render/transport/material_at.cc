#include "render/transport/material_at.h"

#include "render/geometry/surface_uv.h"

namespace lucerna::material_at_internal {

const Material& Textured(const Scene& scene, const SurfacePoint& point, const Material& material,
                         std::optional<Material>& storage) {
  const Vec2 uv = UvAt(scene, point);
  Material& here = storage.emplace();
  static_cast<MaterialNumbers&>(here) = static_cast<const MaterialNumbers&>(material);
  if (material.texture != kNoTexture) {
    const Rgb color = TextureColor(scene.textures, material.texture, uv);
    SetTexturedParameter(here, TexturedValue(material.kind, color * material.texture_scale));
  }
  if (material.second_texture != kNoTexture) {
    const Rgb color = TextureColor(scene.textures, material.second_texture, uv);
    here.transmittance = TexturedValue(material.kind, color * material.texture_scale);
  }
  return here;
}

}  // namespace lucerna::material_at_internal
