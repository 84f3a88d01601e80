// A plan of the light that surfaces receive, in false colours with lines of equal irradiance.
#pragma once

#include <string>

#include "render/bake/mesh_file.h"

namespace lucerna {

// An SVG file. Seen against the mean normal of the largest surface: that and all faces that are
// turned less than 30 degrees from it, such as a floor and the table tops above it, the nearer ones
// before the others. Ten to twenty-five bands of even width, the last of which holds all that is
// above what 99 % of the area has; a scale beside them, in lux or W/m². Requires a mesh that is not
// empty.
[[nodiscard]] std::string IrradiancePlan(const BakedMesh& mesh, bool in_lux);

}  // namespace lucerna
