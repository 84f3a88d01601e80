// Files of the picture alone, without layers, for other programs.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "render/base/status.h"
#include "render/film/display.h"
#include "render/image/image.h"

namespace lucerna {

enum class PictureFormat : unsigned char { kExr, kPng, kPfm, kHdr };
// By the ending of the name, in any case. Errors: INVALID_ARGUMENT for another ending.
[[nodiscard]] StatusOr<PictureFormat> PictureFormatOf(std::string_view path);

// Bytes of a file in this format: EXR with all layers, PNG as displayed, PFM (Debevec's portable
// float map, little-endian) and Radiance HDR with the channels R, G and B as they are.
// Errors: INVALID_ARGUMENT without these.
[[nodiscard]] StatusOr<std::string> EncodePicture(const Image& image, PictureFormat format,
                                                  const Display& display);

// One layer as a picture of its own: NAME.R, .G and .B; directions NAME.X, .Y and .Z, of which -1
// is black and 1 is white; or one channel NAME as grey.
// Errors: NOT_FOUND that lists the layers there are.
[[nodiscard]] StatusOr<Image> PictureOfLayer(const Image& image, const std::string& name);

// Whether these first bytes of a file say that this program wrote it: it may be replaced without a
// question.
inline constexpr std::size_t kBytesThatTell = 4096;
[[nodiscard]] bool IsOwnPicture(std::string_view first_bytes);

}  // namespace lucerna
