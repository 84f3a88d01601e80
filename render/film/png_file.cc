#include "render/film/png_file.h"

#include <algorithm>
#include <cmath>

#include <stb/stb_image_write.h>
#include <zlib.h>

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

std::string BigEndian(std::uint32_t number) {
  return {static_cast<char>(number >> 24), static_cast<char>(number >> 16),
          static_cast<char>(number >> 8), static_cast<char>(number)};
}

// A chunk tEXt of PNG (ISO/IEC 15948): length, type, keyword and text, and a checksum of the last
// three.
std::string TextChunk(std::string_view keyword_and_text) {
  const std::string body = "tEXt" + std::string(keyword_and_text);
  const uLong checksum =
      crc32(0, reinterpret_cast<const Bytef*>(body.data()), static_cast<uInt>(body.size()));
  return BigEndian(static_cast<std::uint32_t>(keyword_and_text.size())) + body +
         BigEndian(static_cast<std::uint32_t>(checksum));
}

void Append(void* target, void* bytes, int size_bytes) {
  static_cast<std::string*>(target)->append(static_cast<const char*>(bytes),
                                            static_cast<std::size_t>(size_bytes));
}

}  // namespace

std::vector<std::uint8_t> ScreenPixels(const std::array<ImageChannel, 3>& shown) {
  std::vector<std::uint8_t> pixels(3 * shown[0].pixels.size());
  for (std::size_t channel = 0; channel < 3; ++channel) {
    for (std::size_t i = 0; i < shown[channel].pixels.size(); ++i)
      pixels[3 * i + channel] = EncodeSrgb(static_cast<double>(shown[channel].pixels[i]));
  }
  return pixels;
}

StatusOr<std::string> EncodePng(const Image& image, const Display& display) {
  LUCERNA_ASSIGN_OR_RETURN(const auto shown, DisplayedChannels(image, display));
  const std::vector<std::uint8_t> pixels = ScreenPixels(shown);
  std::string bytes;
  if (stbi_write_png_to_func(Append, &bytes, image.width, image.height, 3, pixels.data(),
                             3 * image.width) == 0) {
    return absl::ResourceExhaustedError("there is not enough memory to write the PNG");
  }
  // After the signature and the header: 8 and 12 + 13 bytes.
  bytes.insert(33, TextChunk(kPngOwner));
  return bytes;
}

}  // namespace lucerna
