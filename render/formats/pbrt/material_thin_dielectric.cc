// Material "thindielectric".
#include "render/formats/pbrt/material_readers.h"

namespace lucerna {

void ReadThinDielectric(const MaterialInput& input, Material& material) {
  material.ior = input.parameters.OneRefractiveIndex("eta", kIndexRange);
}

}  // namespace lucerna
