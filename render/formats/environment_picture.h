// Environment maps as most files have them: pictures in latitude and longitude.
#pragma once

#include "render/base/status.h"
#include "render/math/transform.h"
#include "render/scene/scene.h"

namespace lucerna {

// The light that shows the picture all around: its top is +y of the map's space, its middle +z, and
// to the right of that is -x. `scale` is what its pixels are multiplied by. The picture is
// resampled to an equal-area square.
// Errors: INVALID_ARGUMENT, as a sentence without a subject ("is stretched ..."), where the
// transform does more than turn and mirror, or where the light is too bright.
[[nodiscard]] StatusOr<InfiniteLight> EnvironmentLight(const Picture& map, double scale,
                                                       const Transform& to_world);

}  // namespace lucerna
