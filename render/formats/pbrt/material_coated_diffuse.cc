// Material "coateddiffuse".
#include <utility>

#include "render/formats/pbrt/material_readers.h"

namespace lucerna {

void ReadCoatedDiffuse(const MaterialInput& input, Material& material) {
  if (input.parameters.IsTexture("reflectance")) {
    material.texture = FindTexture("reflectance", input);
  } else {
    MaterialSpectra given;
    material.reflectance =
        input.parameters.FindReflectance("reflectance", &given.reflectance).value_or(Gray(0.5F));
    material.given = OwnedSpectra(std::move(given));
  }
  ReadRoughness("", Facets::kSurface, input, material);
  ReadCoat("eta", input, material);
}

}  // namespace lucerna
