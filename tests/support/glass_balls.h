// Scenes of a glass ball that disperses, and what is compared of their images.
#pragma once

#include <array>

#include "render/image/image.h"
#include "render/scene/scene.h"

namespace lucerna {

// More dispersive than any glass: indices from 1.43 to 1.77.
inline constexpr float kStrongIndexAtD = 1.5F;
inline constexpr Dispersion kStrongDispersion = {0.08F, 0};

// A floor on which the ball gathers the light of a spot: photons pass the glass.
[[nodiscard]] Scene FocusOfBall(const Material& glass);
// A wall, the right part of it black, seen through the ball: eye paths pass the glass.
[[nodiscard]] Scene WallThroughBall(const Material& glass);

// Means over the left and the right half of an image: [channel + 3 * half].
using Halves = std::array<double, 6>;
[[nodiscard]] Halves HalvesOf(const Image& image);

}  // namespace lucerna
