// What does the image look like on a screen?
#pragma once

#include <string>

#include "render/base/status.h"
#include "render/image/image.h"

namespace lucerna {

// PNG bytes of the R, G and B channels times 2^exposure_stops: clipped to [0, 1] and encoded as
// sRGB, 8 bit. Errors: INVALID_ARGUMENT without R, G, B.
[[nodiscard]] StatusOr<std::string> EncodePng(const Image& image, double exposure_stops = 0);

}  // namespace lucerna
