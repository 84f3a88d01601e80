// The scene's colours, ready to be multiplied.
#pragma once

#include "render/scene/scene.h"

namespace lucerna {

// `scene` with every reflectance and every light in the working space (math/color_space.h). The
// indices of metals stay as they are: their reflectance is converted where it is computed.
[[nodiscard]] Scene InWorkingSpace(Scene scene);

}  // namespace lucerna
