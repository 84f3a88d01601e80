// What does the image look like on a screen?
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "render/base/status.h"
#include "render/film/display.h"
#include "render/image/image.h"

namespace lucerna {

// What a PNG file of this program says of its writer (the chunk tEXt "Software").
inline constexpr std::string_view kPngOwner{"Software\0Lucerna", 16};

// Linear channels in [0, 1], encoded as sRGB, 8 bit: [pixels × 3].
[[nodiscard]] std::vector<std::uint8_t> ScreenPixels(const std::array<ImageChannel, 3>& shown);

// PNG bytes of the channels R, G and B as they are displayed. Errors: INVALID_ARGUMENT without
// them.
[[nodiscard]] StatusOr<std::string> EncodePng(const Image& image, const Display& display = {});

}  // namespace lucerna
