#include "render/film/png_file.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <stb/stb_image_write.h>
#include <zlib.h>

namespace lucerna {
namespace {

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

}  // namespace

void AppendBytes(void* target, void* bytes, int size_bytes) {
  static_cast<std::string*>(target)->append(static_cast<const char*>(bytes),
                                            static_cast<std::size_t>(size_bytes));
}

std::uint8_t EncodeSrgb(double linear) {
  if (!(linear > 0)) return 0;
  const double clipped = std::min(linear, 1.0);
  const double encoded =
      clipped <= 0.0031308 ? 12.92 * clipped : 1.055 * std::pow(clipped, 1 / 2.4) - 0.055;
  return static_cast<std::uint8_t>(std::lround(255 * encoded));
}

StatusOr<std::string> EncodePng(const Image& image, const Display& display) {
  LUCERNA_ASSIGN_OR_RETURN(const DisplayedImage shown, DisplayedImage::Create(image, display));
  const std::size_t count = image.Find("R")->pixels.size();
  std::vector<std::uint8_t> pixels;
  pixels.reserve(3 * count);
  for (std::size_t i = 0; i < count; ++i) {
    for (const double value : shown.At(i))
      pixels.push_back(EncodeSrgb(value));
  }
  std::string bytes;
  if (stbi_write_png_to_func(AppendBytes, &bytes, image.width, image.height, 3, pixels.data(),
                             3 * image.width) == 0) {
    return absl::ResourceExhaustedError("there is not enough memory to write the PNG");
  }
  // After the signature and the header: 8 and 12 + 13 bytes.
  bytes.insert(33, TextChunk(kPngOwner));
  return bytes;
}

}  // namespace lucerna
