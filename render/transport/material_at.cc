#include "render/transport/material_at.h"

#include "render/geometry/surface_uv.h"
#include "render/math/color_space.h"

namespace lucerna::material_at_internal {

const Material& Textured(const Scene& scene, const SurfacePoint& point, const Material& material,
                         std::optional<Material>& storage) {
  const Rgb color = TextureColor(scene.textures, material.texture, UvAt(scene, point));
  Material& here = storage.emplace();
  here.kind = material.kind;
  here.texture = material.texture;
  here.alpha_u = material.alpha_u;
  here.alpha_v = material.alpha_v;
  if (material.kind == Material::Kind::kDiffuse) {
    here.reflectance = ToWorking(color);
  } else {
    // Like the indices of all metals, these stay in Rec. 709.
    here.eta = Gray(1);
    here.k = {AbsorptionFor(color.r), AbsorptionFor(color.g), AbsorptionFor(color.b)};
  }
  return here;
}

}  // namespace lucerna::material_at_internal
