// Material "thindielectric".
#include "render/formats/pbrt/material_readers.h"

namespace lucerna {

void ReadThinDielectric(ParameterList& parameters, const TextureNames& /*names*/,
                        Material& material) {
  material.ior =
      static_cast<float>(parameters.FindRefractiveIndex("eta", kIndexRange).value_or(1.5));
}

}  // namespace lucerna
