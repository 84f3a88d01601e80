// Finds the lights whose light never reaches what the camera can see.
//
// Light never passes an opaque closed surface, and never passes a closed surface of any kind in a
// straight line (enclosures.h). Only what is proved is left out.
#pragma once

#include "render/scene/scene.h"
#include "render/transport/unreachable_lights.h"

namespace lucerna {

// Tests every triangle, and builds closed surfaces only when some light might be separated.
[[nodiscard]] UnreachableLights FindUnreachableLights(const Scene& scene);

}  // namespace lucerna
