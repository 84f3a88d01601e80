// What does a small render measure, and how sure is it?
#pragma once

#include <string_view>

#include "render/image/image.h"
#include "render/scene/render_settings.h"
#include "render/scene/scene.h"
#include "tests/support/chi_square.h"

namespace lucerna {

// The mean over the pixels of one channel.
[[nodiscard]] double ChannelMean(const Image& image, std::string_view channel);

// The mean of a channel over the image, from `parts` renders that differ in their seed alone.
[[nodiscard]] MeasuredMean Measure(const Scene& scene, RenderSettings settings, int passes,
                                   int parts, std::string_view channel);

}  // namespace lucerna
