// Reads MakeNamedMedium directives.
#pragma once

#include "render/formats/pbrt/parameter_list.h"
#include "render/scene/medium.h"

namespace lucerna {

[[nodiscard]] Medium ReadMedium(ParameterList& parameters);

}  // namespace lucerna
