// Material "diffuse".
#include "render/formats/pbrt/material_readers.h"

namespace lucerna {

void ReadDiffuse(ParameterList& parameters, const TextureNames& names, Material& material) {
  if (parameters.IsTexture("reflectance")) {
    material.texture = FindTexture("reflectance", parameters, names);
  } else {
    material.reflectance = parameters.FindReflectance("reflectance").value_or(Gray(0.5F));
  }
}

}  // namespace lucerna
