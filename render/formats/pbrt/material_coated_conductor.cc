// Material "coatedconductor".
#include "render/formats/pbrt/material_readers.h"

namespace lucerna {

void ReadCoatedConductor(const MaterialInput& input, Material& material) {
  ReadMetal({"conductor.eta", "conductor.k"}, input, material);
  ReadRoughness("conductor.", Facets::kBase, input, material);
  ReadRoughness("interface.", Facets::kSurface, input, material);
  const auto& textures = material.roughness_textures;
  if ((textures[0] & textures[1]) != kNoTexture && (textures[2] & textures[3]) != kNoTexture) {
    input.parameters.Error("conductor.roughness",
                           "and interface.roughness cannot both be textures; give one a number");
  }
  ReadCoat("interface.eta", input, material);
  const bool is_mirror = material.base_alpha_u == 0 && material.base_alpha_v == 0 &&
                         material.alpha_u == 0 && material.alpha_v == 0 &&
                         !material.HasRoughnessTexture();
  // A mirror with haze: as the narrowest rough metal, of which haze is a part.
  if (is_mirror && material.HasHaze()) material.base_alpha_u = material.base_alpha_v = kSmoothAlpha;
}

}  // namespace lucerna
