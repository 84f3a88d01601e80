// Material "dielectric".
#include "render/formats/pbrt/material_readers.h"

namespace lucerna {

void ReadDielectric(const MaterialInput& input, Material& material) {
  const RefractiveIndex index =
      input.parameters.FindRefractiveIndex("eta", kIndexRange).value_or(RefractiveIndex{});
  material.ior = index.at_d;
  material.dispersion = index.dispersion;
  ReadRoughness("", Facets::kSurface, input, material);
  if (!index.dispersion.is_none() && !material.Disperses()) input.parameters.WarnOfOneIndex("eta");
}

}  // namespace lucerna
