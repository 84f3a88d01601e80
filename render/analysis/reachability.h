// Finds the lights whose light never reaches what the camera can see.
//
// Light never passes an opaque closed surface, and never passes a closed surface of any kind in a
// straight line (enclosures.h). Only what is proved is left out.
#pragma once

#include "render/scene/scene.h"
#include "render/transport/unreachable_lights.h"

namespace lucerna {

// Builds closed surfaces only when rays find walls between the view and a light. None are found
// where memory does not suffice.
[[nodiscard]] UnreachableLights FindUnreachableLights(const Scene& scene);

}  // namespace lucerna
