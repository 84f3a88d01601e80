#include "render/film/png_file.h"

#include <algorithm>
#include <cmath>

#include <stb/stb_image_write.h>

namespace lucerna {
namespace {

// `linear` is clipped to [0, 1]; what is not a number becomes black.
std::uint8_t EncodeSrgb(double linear) {
  if (!(linear > 0)) return 0;
  const double clipped = std::min(linear, 1.0);
  const double encoded =
      clipped <= 0.0031308 ? 12.92 * clipped : 1.055 * std::pow(clipped, 1 / 2.4) - 0.055;
  return static_cast<std::uint8_t>(std::lround(255 * encoded));
}

void Append(void* target, void* bytes, int size_bytes) {
  static_cast<std::string*>(target)->append(static_cast<const char*>(bytes),
                                            static_cast<std::size_t>(size_bytes));
}

}  // namespace

StatusOr<std::vector<std::uint8_t>> ScreenPixels(const Image& image, double exposure_stops) {
  const ImageChannel* planes[] = {image.Find("R"), image.Find("G"), image.Find("B")};
  const double gain = std::exp2(exposure_stops);
  std::vector<std::uint8_t> pixels;
  for (std::size_t channel = 0; channel < 3; ++channel) {
    if (planes[channel] == nullptr) {
      return absl::InvalidArgumentError(
          "a PNG needs the channels R, G and B, and this image does not have all of them");
    }
    const std::vector<float>& plane = planes[channel]->pixels;
    pixels.resize(3 * plane.size());
    for (std::size_t i = 0; i < plane.size(); ++i) {
      pixels[3 * i + channel] = EncodeSrgb(gain * static_cast<double>(plane[i]));
    }
  }
  return pixels;
}

StatusOr<std::string> EncodePng(const Image& image, double exposure_stops) {
  LUCERNA_ASSIGN_OR_RETURN(const std::vector<std::uint8_t> pixels,
                           ScreenPixels(image, exposure_stops));
  std::string bytes;
  if (stbi_write_png_to_func(Append, &bytes, image.width, image.height, 3, pixels.data(),
                             3 * image.width) == 0) {
    return absl::ResourceExhaustedError("there is not enough memory to write the PNG");
  }
  return bytes;
}

}  // namespace lucerna
