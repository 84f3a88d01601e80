// Material "thindielectric".
#include "render/formats/pbrt/material_readers.h"

namespace lucerna {

void ReadThinDielectric(const MaterialInput& input, Material& material) {
  material.ior =
      static_cast<float>(input.parameters.FindRefractiveIndex("eta", kIndexRange).value_or(1.5));
}

}  // namespace lucerna
