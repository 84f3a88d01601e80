// PNG, JPEG and TGA are stb_image's, compiled here with those decoders alone. It trusts its input
// more than we may: what is cut off it makes up from whatever lies in memory, and a JPEG can make
// it read and write beyond its tables. So its memory begins as zeros, which keeps pixels the same
// in every process, and files are checked for all that it does not check. HDR and PFM are read
// here.
#include "render/formats/image_file.h"

#include <algorithm>
#include <bit>
#include <cctype>
#include <charconv>
#include <climits>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <utility>

// stb_image's implementation, in this file alone.
#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#define STBI_ONLY_JPEG
#define STBI_ONLY_PNG
#define STBI_ONLY_TGA
#define STBI_NO_STDIO
#define STBI_NO_LINEAR
#define STBI_ASSERT(condition) static_cast<void>(0)
#define STBI_MALLOC(size) std::calloc(1, size)
#define STBI_FREE(memory) std::free(memory)
#define STBI_REALLOC_SIZED(memory, old_size, size) \
  lucerna::image_file_internal::Grow(memory, old_size, size)

namespace lucerna::image_file_internal {
namespace {

void* Grow(void* memory, std::size_t old_size, std::size_t size) {
  void* grown = std::calloc(1, size);
  if (grown == nullptr) return nullptr;
  if (memory != nullptr) std::memcpy(grown, memory, std::min(old_size, size));
  std::free(memory);
  return grown;
}

}  // namespace
}  // namespace lucerna::image_file_internal

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#include <stb/stb_image.h>
#pragma GCC diagnostic pop

#include "render/base/text.h"
#include "render/image/exr_file.h"

namespace lucerna {
namespace {

Status Bad(std::string_view what) {
  return absl::InvalidArgumentError(Concat("not a usable image: ", what));
}

// Whether a picture of this size may be made, of a file of `file_bytes`.
Status CheckSize(std::uint64_t width, std::uint64_t height, std::uint64_t pixel_bytes,
                 std::uint64_t file_bytes, std::uint64_t max_size_bytes) {
  if (width == 0 || height == 0) return Bad("it has no pixels");
  if (width > kMaxPicturePixels || height > kMaxPicturePixels / width) {
    return absl::ResourceExhaustedError(Concat("the image has ", width, " x ", height,
                                               " pixels, more than the 2^28 that are allowed"));
  }
  const std::uint64_t pixels = width * height;
  if (pixels * pixel_bytes > max_size_bytes) {
    return absl::ResourceExhaustedError(Concat("the image would take ", pixels * pixel_bytes,
                                               " bytes of memory, and ", max_size_bytes,
                                               " are left for the scene's images"));
  }
  // No format here puts so many into a byte.
  constexpr std::uint64_t kMostPixelsPerByte = 16'384;
  if (pixels / kMostPixelsPerByte > file_bytes)
    return Bad("it is too short for its size in pixels");
  return absl::OkStatus();
}

std::uint8_t ByteAt(std::string_view bytes, std::size_t i) {
  return static_cast<std::uint8_t>(bytes[i]);
}

// ---- stb_image

// From the first scan on, JPEG has no lengths, only an end marker.
Status CheckJpeg(std::string_view bytes) {
  if (bytes.size() < 4 || ByteAt(bytes, 0) != 0xFF || ByteAt(bytes, 1) != 0xD8) {
    return Bad("it does not begin like a JPEG");
  }
  constexpr std::uint8_t kStartOfScan = 0xDA;
  for (std::size_t at = 2; at + 4 <= bytes.size();) {
    const std::uint8_t marker = ByteAt(bytes, at + 1);
    if (ByteAt(bytes, at) != 0xFF) return Bad("its JPEG segments are damaged");
    if (marker == 0xFF) {  // fill
      ++at;
      continue;
    }
    if (marker == kStartOfScan) {
      if (bytes.find("\xFF\xD9", at) == std::string_view::npos) return Bad("it is cut off");
      return absl::OkStatus();
    }
    at += 2 + (std::size_t{ByteAt(bytes, at + 2)} << 8) + ByteAt(bytes, at + 3);
  }
  return Bad("it is cut off");
}

// Whether every Huffman table has as many codes as there is room for. Asked wherever a table may
// begin, in a segment or not: which bytes the decoder comes by is its own affair.
Status CheckHuffmanTables(std::string_view bytes) {
  constexpr std::string_view kDefineTables = "\xFF\xC4";
  constexpr std::size_t kCounts = 16;
  for (std::size_t at = bytes.find(kDefineTables); at != std::string_view::npos;
       at = bytes.find(kDefineTables, at + 1)) {
    std::string_view rest = bytes.substr(at + 2);
    if (rest.size() < 2) break;
    int left = ByteAt(rest, 0) * 256 + ByteAt(rest, 1) - 2;
    rest.remove_prefix(2);
    while (left > 0 && !rest.empty()) {
      const std::uint8_t table = ByteAt(rest, 0);
      if (table > 0x1F || (table & 0x0FU) > 3) break;  // which the decoder refuses
      // The decoder reads zeros beyond the end.
      std::size_t codes = 0;
      for (std::size_t i = 1; i <= std::min(kCounts, rest.size() - 1); ++i)
        codes += ByteAt(rest, i);
      if (codes > 256) return Bad("one of its JPEG Huffman tables is too long");
      left -= static_cast<int>(1 + kCounts + codes);
      rest.remove_prefix(std::min(rest.size(), 1 + kCounts + codes));
    }
  }
  return absl::OkStatus();
}

// The JPEG with all eight Huffman tables defined before anything else, each by one code: a scan
// that refers to one that the file does not define finds no bounds otherwise.
std::string WithHuffmanTables(std::string_view bytes) {
  constexpr std::size_t kStart = 2;  // of the image
  std::string with(bytes.substr(0, kStart));
  constexpr int kTables = 8;
  constexpr int kTableBytes = 18;
  with += "\xFF\xC4";
  with += '\0';
  with += static_cast<char>(2 + kTables * kTableBytes);
  for (int table = 0; table < kTables; ++table) {
    with += static_cast<char>(table % 4 + (table / 4) * 16);
    with += '\x01';
    with.append(16, '\0');  // no longer codes, and the value 0
  }
  with += bytes.substr(kStart);
  return with;
}

// Walks the chunks: the decoder makes room for what one says it holds before it reads it.
Status CheckPng(std::string_view bytes) {
  constexpr std::string_view kSignature = "\x89PNG\r\n\x1A\n";
  constexpr std::size_t kSizeOffset = 16;  // of width and height in the first chunk
  if (!bytes.starts_with(kSignature)) return Bad("it does not begin like a PNG");
  if (bytes.size() < kSizeOffset + 8) return Bad("it is cut off");
  const auto number = [&](std::size_t at) {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < 4; ++i)
      value = value << 8 | ByteAt(bytes, at + i);
    return value;
  };
  constexpr std::size_t kAroundChunk = 12;  // length, type; behind the data a checksum
  for (std::size_t at = kSignature.size(); bytes.substr(at + 4, 4) != "IEND";) {
    const std::size_t left = bytes.size() - at;
    if (left < kAroundChunk || number(at) > left - kAroundChunk) return Bad("it is cut off");
    at += number(at) + kAroundChunk;
    if (bytes.size() - at < kAroundChunk - 4) return Bad("it is cut off");
  }
  return CheckSize(number(kSizeOffset), number(kSizeOffset + 4), 1, bytes.size(), UINT64_MAX);
}

// Walks the packets: the decoder would not notice that they end early.
Status CheckTga(std::string_view bytes) {
  constexpr std::size_t kHeaderBytes = 18;
  if (bytes.size() < kHeaderBytes) return Bad("it is cut off");
  const auto word = [&](std::size_t at) {
    return std::size_t{ByteAt(bytes, at)} | std::size_t{ByteAt(bytes, at + 1)} << 8;
  };
  const std::uint8_t has_palette = ByteAt(bytes, 1);
  const std::uint8_t type = ByteAt(bytes, 2);
  const std::uint8_t depth = ByteAt(bytes, 16);
  const bool is_packed = type >= 9;
  const int kind = is_packed ? type - 8 : type;  // 1 palette, 2 colour, 3 grey
  const bool is_known_depth = kind == 2   ? depth == 15 || depth == 16 || depth == 24 || depth == 32
                              : kind == 3 ? depth == 8 || depth == 16
                                          : depth == 8;
  if (has_palette > 1 || (kind == 1) != (has_palette == 1) || kind < 1 || kind > 3 ||
      !is_known_depth) {
    return Bad("it does not begin like a TGA with 8-bit grey, palette or colour pixels");
  }
  const std::uint64_t pixels = std::uint64_t{word(12)} * word(14);
  const std::size_t pixel_bytes = (std::size_t{depth} + 7) / 8;
  std::uint64_t at = kHeaderBytes + ByteAt(bytes, 0);
  if (has_palette == 1) {
    if (word(3) != 0) return Bad("its TGA palette begins late, which is not supported");
    const std::uint8_t palette_depth = ByteAt(bytes, 7);
    if (palette_depth != 24 && palette_depth != 32) {
      return Bad("its TGA palette is not of 24 or 32 bits");
    }
    at += word(5) * (std::size_t{palette_depth} / 8);
  }
  if (!is_packed) {
    return at + pixels * pixel_bytes <= bytes.size() ? absl::OkStatus() : Bad("it is cut off");
  }
  for (std::uint64_t done = 0; done < pixels;) {
    if (at >= bytes.size()) return Bad("it is cut off");
    const std::uint8_t packet = ByteAt(bytes, static_cast<std::size_t>(at));
    const std::uint64_t count = (packet & 0x7FU) + 1U;
    done += count;
    at += 1 + pixel_bytes * ((packet & 0x80U) != 0 ? 1 : count);
  }
  return at <= bytes.size() ? absl::OkStatus() : Bad("it is cut off");
}

// Of a use that takes one channel of four, its number.
std::optional<std::size_t> OneChannelOf(PictureUse use) {
  switch (use) {
    case PictureUse::kRed:
      return 0;
    case PictureUse::kGreen:
      return 1;
    case PictureUse::kBlue:
      return 2;
    case PictureUse::kOpacity:
      return 3;
    case PictureUse::kColors:
    case PictureUse::kNumbers:
    case PictureUse::kVectors:
      break;
  }
  return std::nullopt;
}

// Of a picture with four channels, whose values these are: leaves one of them.
template <typename Value>
void TakeChannel(std::vector<Value>& values, std::size_t channel, Picture& picture) {
  picture.channels = 1;
  const std::size_t pixels = values.size() / 4;
  for (std::size_t i = 0; i < pixels; ++i)
    values[i] = values[4 * i + channel];
  values.resize(pixels);
  values.shrink_to_fit();
}

struct StbFree {
  void operator()(void* pixels) const { stbi_image_free(pixels); }
};

// The numbers of a picture of colours.
Picture MeansOf(const Picture& colors) {
  if (colors.channels == 1) return colors;
  Picture numbers;
  numbers.width = colors.width;
  numbers.height = colors.height;
  numbers.channels = 1;
  numbers.linear.reserve(static_cast<std::size_t>(colors.width) *
                         static_cast<std::size_t>(colors.height));
  for (int y = 0; y < colors.height; ++y) {
    for (int x = 0; x < colors.width; ++x) {
      const Rgb color = colors.At(x, y);
      numbers.linear.push_back((color.r + color.g + color.b) / 3);
    }
  }
  return numbers;
}

// Of a picture with four channels, whose values these are: leaves the opacity, or where all is
// opaque the colours.
template <typename Value>
void TakeOpacity(std::vector<Value>& values, Value opaque, Picture& picture) {
  bool is_opaque = true;
  for (std::size_t i = 3; i < values.size(); i += 4)
    is_opaque = is_opaque && values[i] == opaque;
  picture.channels = is_opaque ? 3 : 1;
  std::size_t to = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if ((i % 4 == 3) != is_opaque) values[to++] = values[i];
  }
  values.resize(to);
}

StatusOr<Picture> ReadByStb(std::string_view bytes, const PixelEncoding& encoding,
                            std::uint64_t max_size_bytes, PictureUse use) {
  if (bytes.size() > INT_MAX) return Bad("the file is larger than 2 GiB");
  const auto* data = reinterpret_cast<const stbi_uc*>(bytes.data());
  const int size = static_cast<int>(bytes.size());
  int width = 0;
  int height = 0;
  int file_channels = 0;
  if (stbi_info_from_memory(data, size, &width, &height, &file_channels) == 0) {
    return Bad(stbi_failure_reason());
  }
  const bool is_16_bit = stbi_is_16_bit_from_memory(data, size) != 0;
  Picture picture;
  const bool may_be_opacity =
      use == PictureUse::kNumbers && file_channels == 4 && !encoding.is_of_all_files;
  const std::optional<std::size_t> one_channel = OneChannelOf(use);
  picture.channels = one_channel.has_value()       ? 4
                     : use == PictureUse::kVectors ? 3
                     : file_channels <= 2          ? 1
                     : may_be_opacity              ? 4
                                                   : 3;
  const auto channels = static_cast<std::uint64_t>(picture.channels);
  // Of numbers, the means of the channels come beside them.
  const std::uint64_t beside = use == PictureUse::kNumbers ? sizeof(float) : 0;
  LUCERNA_RETURN_IF_ERROR(CheckSize(static_cast<std::uint64_t>(std::max(width, 0)),
                                    static_cast<std::uint64_t>(std::max(height, 0)),
                                    channels * (is_16_bit ? 4 : 1) + beside, bytes.size(),
                                    max_size_bytes));
  int decoded_width = 0;
  int decoded_height = 0;
  const auto values =
      static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height) * channels;
  const auto is_as_promised = [&] { return decoded_width == width && decoded_height == height; };
  picture.width = width;
  picture.height = height;
  if (is_16_bit) {
    const std::unique_ptr<stbi_us, StbFree> pixels(stbi_load_16_from_memory(
        data, size, &decoded_width, &decoded_height, &file_channels, picture.channels));
    if (pixels == nullptr) return Bad(stbi_failure_reason());
    if (!is_as_promised()) return Bad("its size is ambiguous");
    picture.linear.reserve(values);
    for (std::uint64_t i = 0; i < values; ++i) {
      picture.linear.push_back(static_cast<float>(encoding.Decode(pixels.get()[i] / 65535.0)));
    }
    if (may_be_opacity) TakeOpacity(picture.linear, 1.0F, picture);
    if (one_channel.has_value()) TakeChannel(picture.linear, *one_channel, picture);
    return picture;
  }
  const std::unique_ptr<stbi_uc, StbFree> pixels(stbi_load_from_memory(
      data, size, &decoded_width, &decoded_height, &file_channels, picture.channels));
  if (pixels == nullptr) return Bad(stbi_failure_reason());
  if (!is_as_promised()) return Bad("its size is ambiguous");
  picture.coded.assign(pixels.get(), pixels.get() + values);
  for (std::size_t i = 0; i < picture.decoded.size(); ++i) {
    picture.decoded[i] = static_cast<float>(encoding.Decode(static_cast<double>(i) / 255));
  }
  if (may_be_opacity) TakeOpacity(picture.coded, std::uint8_t{255}, picture);
  if (one_channel.has_value()) TakeChannel(picture.coded, *one_channel, picture);
  return picture;
}

// ---- Radiance HDR

// The next line without its end; empty optional when there is none.
std::optional<std::string_view> TakeLine(std::string_view& bytes) {
  constexpr std::size_t kMaxLine = 4096;
  const std::size_t end = bytes.substr(0, kMaxLine).find('\n');
  if (end == std::string_view::npos) return std::nullopt;
  std::string_view line = bytes.substr(0, end);
  bytes.remove_prefix(end + 1);
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  return line;
}

std::optional<std::uint32_t> WholeNumber(std::string_view text) {
  std::uint32_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

// One scanline as [4 × width]: all of one component, then all of the next. False when the bytes
// are not one.
bool TakeScanline(std::string_view& bytes, std::size_t width, std::string& planes) {
  constexpr std::size_t kMinPacked = 8;
  constexpr std::size_t kMaxPacked = 32'767;
  planes.resize(4 * width);
  if (bytes.size() < 4) return false;
  const bool is_packed = width >= kMinPacked && width <= kMaxPacked && bytes[0] == 2 &&
                         bytes[1] == 2 && ByteAt(bytes, 2) < 0x80;
  if (!is_packed) {
    if (bytes.size() < 4 * width) return false;
    for (std::size_t x = 0; x < width; ++x) {
      // An older packing repeats the pixel before where a pixel is 1 1 1.
      if (bytes[4 * x] == 1 && bytes[4 * x + 1] == 1 && bytes[4 * x + 2] == 1) return false;
      for (std::size_t c = 0; c < 4; ++c)
        planes[c * width + x] = bytes[4 * x + c];
    }
    bytes.remove_prefix(4 * width);
    return true;
  }
  if ((std::size_t{ByteAt(bytes, 2)} << 8 | ByteAt(bytes, 3)) != width) return false;
  bytes.remove_prefix(4);
  for (std::size_t c = 0; c < 4; ++c) {
    for (std::size_t x = 0; x < width;) {
      if (bytes.size() < 2) return false;
      const std::size_t code = ByteAt(bytes, 0);
      const bool is_run = code > 128;
      const std::size_t count = is_run ? code - 128 : code;
      if (count == 0 || count > width - x || bytes.size() < 1 + (is_run ? 1 : count)) return false;
      if (is_run) {
        std::memset(&planes[c * width + x], bytes[1], count);
      } else {
        std::memcpy(&planes[c * width + x], &bytes[1], count);
      }
      bytes.remove_prefix(1 + (is_run ? 1 : count));
      x += count;
    }
  }
  return true;
}

StatusOr<Picture> ReadHdr(std::string_view bytes, std::uint64_t max_size_bytes) {
  const std::size_t file_bytes = bytes.size();
  std::optional<std::string_view> line = TakeLine(bytes);
  if (!line.has_value() || !line->starts_with("#?")) return Bad("it does not begin like an HDR");
  bool is_rgbe = false;
  while (true) {
    line = TakeLine(bytes);
    if (!line.has_value()) return Bad("its HDR header is cut off");
    if (line->empty()) break;
    is_rgbe = is_rgbe || *line == "FORMAT=32-bit_rle_rgbe";
  }
  if (!is_rgbe) return Bad("its HDR format is not 32-bit_rle_rgbe");
  line = TakeLine(bytes);
  const std::vector<std::string_view> words = WordsOf(line.value_or(""));
  if (words.size() != 4 || words[0] != "-Y" || words[2] != "+X") {
    return Bad("its HDR size is not given as -Y height +X width");
  }
  const std::optional<std::uint32_t> height = WholeNumber(words[1]);
  const std::optional<std::uint32_t> width = WholeNumber(words[3]);
  if (!height.has_value() || !width.has_value()) return Bad("its HDR size is not a number");
  LUCERNA_RETURN_IF_ERROR(
      CheckSize(*width, *height, 3 * sizeof(float), file_bytes, max_size_bytes));
  Picture picture;
  picture.width = static_cast<int>(*width);
  picture.height = static_cast<int>(*height);
  std::string planes;
  // Memory grows with the scanlines that are really there.
  for (std::uint32_t y = 0; y < *height; ++y) {
    if (!TakeScanline(bytes, *width, planes)) {
      return Bad(Concat("its HDR scanline ", y, " is damaged or cut off"));
    }
    for (std::size_t x = 0; x < *width; ++x) {
      const int exponent = ByteAt(planes, 3 * std::size_t{*width} + x);
      const float unit = exponent == 0 ? 0.0F : std::ldexp(1.0F, exponent - (128 + 8));
      for (std::size_t c = 0; c < 3; ++c) {
        picture.linear.push_back(static_cast<float>(ByteAt(planes, c * *width + x)) * unit);
      }
    }
  }
  return picture;
}

// ---- floating point

// S1: what is not finite is refused. Negative numbers, which filters leave, are no light.
Status MakeSound(Picture& picture, PictureUse use) {
  for (float& value : picture.linear) {
    if (!std::isfinite(value)) return Bad("it has a pixel that is not finite");
    if (use == PictureUse::kColors) value = std::max(value, 0.0F);
  }
  return absl::OkStatus();
}

StatusOr<Picture> ReadPfm(std::string_view bytes, std::uint64_t max_size_bytes, PictureUse use) {
  const std::size_t file_bytes = bytes.size();
  std::vector<std::string> words;
  // Three lines by rule; some writers put the size on two.
  while (words.size() < 4) {
    const std::optional<std::string_view> line = TakeLine(bytes);
    if (!line.has_value()) return Bad("its PFM header is cut off");
    for (const std::string_view word : WordsOf(*line))
      words.emplace_back(word);
  }
  double scale = 0;
  const auto [end, error] =
      std::from_chars(words[3].data(), words[3].data() + words[3].size(), scale);
  const std::optional<std::uint32_t> width = WholeNumber(words[1]);
  const std::optional<std::uint32_t> height = WholeNumber(words[2]);
  if (words.size() != 4 || (words[0] != "PF" && words[0] != "Pf") || !width.has_value() ||
      !height.has_value() || error != std::errc() || end != words[3].data() + words[3].size() ||
      !std::isfinite(scale) || scale == 0) {
    return Bad("its PFM header is damaged");
  }
  Picture picture;
  picture.channels = words[0] == "PF" ? 3 : 1;
  const auto channels = static_cast<std::size_t>(picture.channels);
  LUCERNA_RETURN_IF_ERROR(
      CheckSize(*width, *height, channels * sizeof(float), file_bytes, max_size_bytes));
  const std::size_t row = *width * channels;
  if (bytes.size() / sizeof(float) / row < *height) return Bad("it is cut off");
  picture.width = static_cast<int>(*width);
  picture.height = static_cast<int>(*height);
  picture.linear.resize(row * *height);
  static_assert(std::endian::native == std::endian::little);
  for (std::size_t y = 0; y < *height; ++y) {
    // The file begins with the lowest row.
    float* to = &picture.linear[(*height - 1 - y) * row];
    std::memcpy(to, bytes.data() + y * row * sizeof(float), row * sizeof(float));
    for (std::size_t i = 0; i < row; ++i) {
      if (scale > 0)
        to[i] = std::bit_cast<float>(__builtin_bswap32(std::bit_cast<std::uint32_t>(to[i])));
      to[i] *= static_cast<float>(std::abs(scale));
    }
  }
  LUCERNA_RETURN_IF_ERROR(MakeSound(picture, use));
  return picture;
}

StatusOr<Picture> PictureOfExr(std::string_view bytes, std::uint64_t max_size_bytes, PictureUse use,
                               bool may_be_opacity) {
  LUCERNA_ASSIGN_OR_RETURN(Image image, DecodeExr(bytes));
  std::vector<const ImageChannel*> channels = {image.Find("R"), image.Find("G"), image.Find("B")};
  if (std::find(channels.begin(), channels.end(), nullptr) != channels.end()) {
    channels = {image.Find("Y")};
    if (channels[0] == nullptr) return Bad("it has neither the channels R, G and B nor Y");
  }
  const ImageChannel* opacity = image.Find("A");
  if (may_be_opacity && channels.size() == 3 && opacity != nullptr &&
      std::ranges::any_of(opacity->pixels, [](float value) { return value != 1; })) {
    channels = {opacity};
  }
  Picture picture;
  picture.width = image.width;
  picture.height = image.height;
  picture.channels = static_cast<int>(channels.size());
  LUCERNA_RETURN_IF_ERROR(CheckSize(static_cast<std::uint64_t>(image.width),
                                    static_cast<std::uint64_t>(image.height),
                                    channels.size() * sizeof(float), bytes.size(), max_size_bytes));
  const std::size_t pixels = channels[0]->pixels.size();
  picture.linear.resize(pixels * channels.size());
  for (std::size_t i = 0; i < pixels; ++i) {
    for (std::size_t c = 0; c < channels.size(); ++c) {
      picture.linear[i * channels.size() + c] = channels[c]->pixels[i];
    }
  }
  LUCERNA_RETURN_IF_ERROR(MakeSound(picture, use));
  return picture;
}

StatusOr<Picture> ReadOfEitherUse(std::string_view bytes, std::string_view path,
                                  const PixelEncoding& encoding, std::uint64_t max_size_bytes,
                                  PictureUse use);

}  // namespace

double PixelEncoding::Decode(double coded) const {
  switch (kind) {
    case Kind::kSrgb:
      return BelowCoat(coded <= 0.04045 ? coded / 12.92 : std::pow((coded + 0.055) / 1.055, 2.4));
    case Kind::kLinear:
      return BelowCoat(coded);
    case Kind::kGamma:
      return BelowCoat(std::pow(coded, gamma));
    case Kind::kStep:
      return coded >= threshold ? 1 : 0;
  }
  return coded;
}

double PixelEncoding::BelowCoat(double color) const {
  return returned > 0 ? color / (1 - returned + color * returned) : color;
}

StatusOr<Picture> ReadPicture(std::string_view bytes, std::string_view path,
                              const PixelEncoding& encoding, std::uint64_t max_size_bytes,
                              PictureUse use) {
  LUCERNA_ASSIGN_OR_RETURN(Picture picture,
                           ReadOfEitherUse(bytes, path, encoding, max_size_bytes, use));
  return use == PictureUse::kNumbers ? MeansOf(picture) : std::move(picture);
}

namespace {

// Of a file of numbers, which are not decoded.
StatusOr<Picture> BelowCoat(StatusOr<Picture> picture, const PixelEncoding& encoding) {
  if (!picture.ok() || !(encoding.returned > 0)) return picture;
  for (float& value : picture->linear)
    value = static_cast<float>(encoding.BelowCoat(static_cast<double>(value)));
  return picture;
}

StatusOr<Picture> ReadOfEitherUse(std::string_view bytes, std::string_view path,
                                  const PixelEncoding& encoding, std::uint64_t max_size_bytes,
                                  PictureUse use) {
  const std::size_t dot = path.rfind('.');
  std::string extension(dot == std::string_view::npos ? "" : path.substr(dot + 1));
  for (char& c : extension)
    c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (extension == "png") {
    LUCERNA_RETURN_IF_ERROR(CheckPng(bytes));
    return ReadByStb(bytes, encoding, max_size_bytes, use);
  }
  if (extension == "jpg" || extension == "jpeg") {
    LUCERNA_RETURN_IF_ERROR(CheckJpeg(bytes));
    LUCERNA_RETURN_IF_ERROR(CheckHuffmanTables(bytes));
    const bool is_srgb =
        (use == PictureUse::kColors || use == PictureUse::kNumbers) && !encoding.is_of_all_files;
    return ReadByStb(WithHuffmanTables(bytes), is_srgb ? PixelEncoding() : encoding, max_size_bytes,
                     use);
  }
  if (extension == "tga") {
    LUCERNA_RETURN_IF_ERROR(CheckTga(bytes));
    return ReadByStb(bytes, encoding.is_of_all_files ? encoding : PixelEncoding(), max_size_bytes,
                     use);
  }
  if (extension == "hdr") return BelowCoat(ReadHdr(bytes, max_size_bytes), encoding);
  if (extension == "pfm") return BelowCoat(ReadPfm(bytes, max_size_bytes, use), encoding);
  if (extension == "exr") {
    const bool may_be_opacity = use == PictureUse::kNumbers && !encoding.is_of_all_files;
    return BelowCoat(PictureOfExr(bytes, max_size_bytes, use, may_be_opacity), encoding);
  }
  return absl::InvalidArgumentError(
      "images are read as .png, .jpg, .tga, .hdr, .pfm and .exr only");
}

}  // namespace

std::uint64_t SizeBytes(const Picture& picture) {
  return picture.coded.size() + picture.linear.size() * sizeof(float);
}

}  // namespace lucerna
