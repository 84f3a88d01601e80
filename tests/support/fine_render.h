// An image with next to none of the kernel's blur, to measure other images by.
//
// It is rendered several times as wide and high, with discs whose radius is a pixel of that and
// never changes, and each pixel is the mean of its small ones, weighed by the scene's filter. Blur
// does not reach farther than a small pixel, and as many photons give nearly as much noise as if
// each were counted in the pixel in which it is seen.
#pragma once

#include <cstdint>

#include "render/image/image.h"
#include "render/scene/render_settings.h"
#include "render/scene/scene.h"

namespace lucerna {

// R, G, B: the mean of `passes` passes of as many photons as `overrides` say, which give the size
// of the image too. Each side is `times` as long while it is rendered. Aborts for other filters
// than box and gaussian, and for settings that are wrong.
[[nodiscard]] Image RenderFinely(Scene scene, RenderOverrides overrides, int times, int passes,
                                 int threads = 0);

}  // namespace lucerna
