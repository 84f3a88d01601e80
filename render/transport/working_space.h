// The scene's colours, ready to be multiplied, and its coated materials, ready to be evaluated.
#pragma once

#include "render/scene/scene.h"

namespace lucerna {

// `scene` with every reflectance and every light in the working space (math/color_space.h). The
// indices of metals and all pixels stay as they are: what follows from them is converted where it
// is computed. Threads as in ThreadTeam: tables of materials are made by them.
[[nodiscard]] Scene InWorkingSpace(Scene scene, int threads = 1);

}  // namespace lucerna
