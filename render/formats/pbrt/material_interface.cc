// Material "interface", also "none" and "".
#include "render/formats/pbrt/material_readers.h"

namespace lucerna {

void ReadInterface(const MaterialInput& /*input*/, Material& /*material*/) {}

}  // namespace lucerna
