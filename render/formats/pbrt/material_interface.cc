// Material "interface", also "none" and "".
#include "render/formats/pbrt/material_readers.h"

namespace lucerna {

void ReadInterface(ParameterList& /*parameters*/, const TextureNames& /*names*/,
                   Material& /*material*/) {}

}  // namespace lucerna
