// What does the image look like on a screen?
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "render/base/status.h"
#include "render/film/display.h"
#include "render/image/image.h"

namespace lucerna {

// What a PNG file of this program says of its writer (the chunk tEXt "Software").
inline constexpr std::string_view kPngOwner{"Software\0Lucerna", 16};

// `linear`, clipped to [0, 1], as sRGB has it; what is not a number is black.
[[nodiscard]] std::uint8_t EncodeSrgb(double linear);

// What the writers of stb call with their bytes; `target` is a std::string.
void AppendBytes(void* target, void* bytes, int size_bytes);

// PNG bytes of the channels R, G and B as they are displayed. Errors: INVALID_ARGUMENT without
// them.
[[nodiscard]] StatusOr<std::string> EncodePng(const Image& image, const Display& display = {});

}  // namespace lucerna
