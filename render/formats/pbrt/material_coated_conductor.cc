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
  ReadCoat("interface.eta", input.parameters, material);
}

}  // namespace lucerna
