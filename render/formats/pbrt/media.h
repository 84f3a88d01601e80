// Reads MakeNamedMedium directives.
#pragma once

#include "render/formats/pbrt/parameter_list.h"
#include "render/math/transform.h"
#include "render/scene/medium.h"

namespace lucerna {

// `to_world`: of the directive; for densities.
[[nodiscard]] Medium ReadMedium(ParameterList& parameters, const Transform& to_world);

}  // namespace lucerna
