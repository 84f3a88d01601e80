// Material "coatedconductor".
#include "render/formats/pbrt/material_readers.h"

namespace lucerna {

void ReadCoatedConductor(ParameterList& parameters, const TextureNames& names, Material& material) {
  ReadMetal({"conductor.eta", "conductor.k"}, parameters, names, material);
  ReadRoughness("conductor.", parameters, material);
  material.base_alpha_u = material.alpha_u;
  material.base_alpha_v = material.alpha_v;
  material.alpha_u = 0;
  material.alpha_v = 0;
  ReadRoughness("interface.", parameters, material);
  ReadCoat("interface.eta", parameters, material);
}

}  // namespace lucerna
