// Material "coateddiffuse".
#include "render/formats/pbrt/material_readers.h"

namespace lucerna {

void ReadCoatedDiffuse(ParameterList& parameters, const TextureNames& names, Material& material) {
  if (parameters.IsTexture("reflectance")) {
    material.texture = FindTexture("reflectance", parameters, names);
  } else {
    material.reflectance = parameters.FindReflectance("reflectance").value_or(Gray(0.5F));
  }
  ReadRoughness("", parameters, material);
  ReadCoat("eta", parameters, material);
}

}  // namespace lucerna
