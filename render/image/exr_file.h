// How does an Image become an EXR, and back? The only file that includes OpenEXR.
#pragma once

#include <string>
#include <string_view>

#include "render/base/status.h"
#include "render/image/image.h"

namespace lucerna {

// EXR bytes: scanline, 32-bit float channels, ZIP compression, metadata as string attributes.
// The same Image gives the same bytes.
[[nodiscard]] StatusOr<std::string> EncodeExr(const Image& image);
// The same bytes of an image that is made while it is written, packed by so many threads; 0: all
// that the machine has.
[[nodiscard]] StatusOr<std::string> EncodeExr(const BandedImage& image, int threads);

// Reads any scanline or tiled single-part EXR with half, float or uint channels.
// Errors: INVALID_ARGUMENT when the bytes are not such a file, are truncated, or hold more than
// 2^28 pixels.
[[nodiscard]] StatusOr<Image> DecodeExr(std::string_view bytes);

}  // namespace lucerna
