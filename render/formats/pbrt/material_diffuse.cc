// Material "diffuse".
#include "render/formats/pbrt/material_readers.h"

namespace lucerna {

void ReadDiffuse(const MaterialInput& input, Material& material) {
  if (input.parameters.IsTexture("reflectance")) {
    material.texture = FindTexture("reflectance", input);
  } else {
    material.reflectance = input.parameters.FindReflectance("reflectance").value_or(Gray(0.5F));
  }
}

}  // namespace lucerna
