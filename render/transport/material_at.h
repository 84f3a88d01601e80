// Of what is a surface made at one of its points?
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "render/geometry/intersector.h"
#include "render/scene/scene.h"
#include "render/transport/path_wavelength.h"

namespace lucerna {

namespace material_at_internal {
[[nodiscard]] const Material& AtPlace(const Scene& scene, SurfacePoint& point, Vec3 wo,
                                      std::optional<Material>& storage,
                                      const PathWavelength& wavelength);
}  // namespace material_at_internal

// The material of `scene`, or what textures make of it at the point, in `storage` (without the
// name). Scenes are in the working space but for textures, which are converted here.
//
// `point` becomes what the material makes of it: bumps and normal maps turn its shading normal
// (once: not to be called again for the same point), a material that must be turned the right way
// around its normal gives it a tangent, and of a mix the material becomes the one that is chosen
// for the ray that comes from `wo`. Equal points and rays choose alike. Glass that disperses has
// its index at the path's wavelength.
[[nodiscard]] inline const Material& MaterialAt(const Scene& scene, SurfacePoint& point, Vec3 wo,
                                                std::optional<Material>& storage,
                                                const PathWavelength& wavelength = {}) {
  const Material& material = scene.materials[point.material];
  if (!material.DependsOnPlace()) [[likely]]
    return material;
  return material_at_internal::AtPlace(scene, point, wo, storage, wavelength);
}

// The share of rays to a point of a surface that meet it and do not pass through, in
// [kLeastAlpha, 1]. What is left of a surface that lets more through counts for too little.
inline constexpr float kLeastAlpha = 1.0F / 256;
[[nodiscard]] float AlphaAt(const Scene& scene, const SurfacePoint& point);

// What textures of roughness or thickness have made of a material at a place, to be set again where
// the place is not known: alpha_u, alpha_v, base_alpha_u and base_alpha_v, or the thickness of the
// coat and zeros.
[[nodiscard]] std::array<float, 4> NumbersOf(const MaterialNumbers& here);
void SetNumbers(MaterialNumbers& material, const std::array<float, 4>& numbers);

// Where textures are looked up for a point.
[[nodiscard]] TexturePlace PlaceOf(const Scene& scene, const SurfacePoint& point);

}  // namespace lucerna
