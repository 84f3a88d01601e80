// Material "dielectric".
#include "render/formats/pbrt/material_readers.h"

namespace lucerna {

void ReadDielectric(ParameterList& parameters, const TextureNames& /*names*/, Material& material) {
  material.ior =
      static_cast<float>(parameters.FindRefractiveIndex("eta", kIndexRange).value_or(1.5));
  ReadRoughness("", parameters, material);
}

}  // namespace lucerna
