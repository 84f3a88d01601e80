// What does the image look like on a screen?
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "render/base/status.h"
#include "render/image/image.h"

namespace lucerna {

// The R, G and B channels times 2^exposure_stops: clipped to [0, 1] and encoded as sRGB, 8 bit.
// [height × width × 3]. Errors: INVALID_ARGUMENT without R, G, B.
[[nodiscard]] StatusOr<std::vector<std::uint8_t>> ScreenPixels(const Image& image,
                                                               double exposure_stops = 0);

// PNG bytes of the same.
[[nodiscard]] StatusOr<std::string> EncodePng(const Image& image, double exposure_stops = 0);

}  // namespace lucerna
