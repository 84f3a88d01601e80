// Material "dielectric".
#include "render/formats/pbrt/material_readers.h"

namespace lucerna {

void ReadDielectric(const MaterialInput& input, Material& material) {
  material.ior =
      static_cast<float>(input.parameters.FindRefractiveIndex("eta", kIndexRange).value_or(1.5));
  ReadRoughness("", Facets::kSurface, input, material);
}

}  // namespace lucerna
