// Reads pictures from image files.
//
// Every size is checked against the limits before anything of that size is allocated, and no file
// gives pixels that it does not hold: what is cut off is refused.
#pragma once

#include <cstdint>
#include <string_view>

#include "render/base/status.h"
#include "render/scene/texture.h"

namespace lucerna {

inline constexpr std::uint64_t kMaxPicturePixels = std::uint64_t{1} << 28;

// What the whole numbers in a file stand for.
struct PixelEncoding {
  // kStep: 0 below `threshold`, else 1.
  enum class Kind : std::uint8_t { kSrgb, kLinear, kGamma, kStep };

  Kind kind = Kind::kSrgb;
  double gamma = 1;      // kGamma
  double threshold = 0;  // kStep
  // As Mitsuba has it: of JPEG and TGA too, and opacity is no number. pbrt-v4 reads those as sRGB.
  bool is_of_all_files = false;
  // Colours v become v / (1 - returned + v · returned): of a base below a coat that sends this
  // share of its light back to it, where the file says what it reflects as if it were white there.
  double returned = 0;

  // [0, 1] -> [0, 1].
  [[nodiscard]] double Decode(double coded) const;
  // Of a decoded colour, by `returned`.
  [[nodiscard]] double BelowCoat(double color) const;
  bool operator==(const PixelEncoding&) const = default;
};

// What a picture is of. Numbers are as in pbrt-v4: the mean of the three channels, or the opacity
// where that is not 1 everywhere; in EXR and PFM files they may be negative.
// The uses after them are as in glTF 2.0, of PNG and JPEG alone: three channels that are no
// colours, or one channel of four.
enum class PictureUse : std::uint8_t { kColors, kNumbers, kVectors, kRed, kGreen, kBlue, kOpacity };

// Reads PNG, JPEG, TGA, Radiance HDR, PFM or EXR, by the end of `path`. `encoding` is that of PNG,
// of JPEG for the uses of glTF 2.0, and of all whole numbers where it says so; else JPEG and TGA
// are sRGB. The others are linear. Of colours negative numbers become 0, and opacity is dropped.
// Errors: INVALID_ARGUMENT with what is wrong; RESOURCE_EXHAUSTED for more than
// kMaxPicturePixels, or more than `max_size_bytes` of pixels in memory.
[[nodiscard]] StatusOr<Picture> ReadPicture(std::string_view bytes, std::string_view path,
                                            const PixelEncoding& encoding,
                                            std::uint64_t max_size_bytes,
                                            PictureUse use = PictureUse::kColors);

// The size that the pixels take in memory.
[[nodiscard]] std::uint64_t SizeBytes(const Picture& picture);

}  // namespace lucerna
