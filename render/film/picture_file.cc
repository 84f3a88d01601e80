#include "render/film/picture_file.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstring>
#include <set>
#include <vector>

#include <stb/stb_image_write.h>

#include "render/film/png_file.h"
#include "render/image/exr_file.h"

namespace lucerna {
namespace {

constexpr std::string_view kHdrMagic = "#?RADIANCE\n";
constexpr std::string_view kHdrOwner = "# Lucerna\n";  // a comment

// [height × width × 3].
StatusOr<std::vector<float>> Interleaved(const Image& image, bool is_bottom_up) {
  LUCERNA_ASSIGN_OR_RETURN(const auto channels, ColorChannels(image));
  const auto width = static_cast<std::size_t>(image.width);
  const auto height = static_cast<std::size_t>(image.height);
  std::vector<float> values;
  values.reserve(3 * width * height);
  for (std::size_t row = 0; row < height; ++row) {
    const std::size_t y = is_bottom_up ? height - 1 - row : row;
    for (std::size_t x = 0; x < width; ++x) {
      for (const ImageChannel* channel : channels)
        values.push_back(channel->pixels[y * width + x]);
    }
  }
  return values;
}

StatusOr<std::string> EncodePfm(const Image& image) {
  LUCERNA_ASSIGN_OR_RETURN(const std::vector<float> values, Interleaved(image, true));
  // A scale below 0 says that the bytes are little-endian.
  std::string bytes = absl::StrCat("PF\n", image.width, " ", image.height, "\n-1.0\n");
  const std::size_t head = bytes.size();
  bytes.resize(head + values.size() * sizeof(float));
  std::memcpy(bytes.data() + head, values.data(), values.size() * sizeof(float));
  return bytes;
}

StatusOr<std::string> EncodeHdr(const Image& image) {
  LUCERNA_ASSIGN_OR_RETURN(std::vector<float> values, Interleaved(image, false));
  // The format knows nothing below 0.
  for (float& value : values)
    value = value > 0 ? value : 0;
  std::string bytes;
  if (stbi_write_hdr_to_func(AppendBytes, &bytes, image.width, image.height, 3, values.data()) == 0)
    return absl::ResourceExhaustedError("there is not enough memory to write the file");
  if (bytes.starts_with(kHdrMagic)) bytes.insert(kHdrMagic.size(), kHdrOwner);
  return bytes;
}

Image PictureOf(const Image& image, const std::array<const ImageChannel*, 3>& channels,
                bool are_directions) {
  Image picture{.width = image.width, .height = image.height, .channels = {}, .metadata = {}};
  constexpr std::array kNames = {"R", "G", "B"};
  for (std::size_t c = 0; c < 3; ++c) {
    ImageChannel& channel = picture.channels.emplace_back();
    channel.name = kNames[c];
    channel.pixels = channels[c]->pixels;
    if (!are_directions) continue;
    for (float& value : channel.pixels)
      value = 0.5F * value + 0.5F;
  }
  return picture;
}

}  // namespace

StatusOr<PictureFormat> PictureFormatOf(std::string_view path) {
  std::string ending(path.substr(std::min(path.rfind('.'), path.size())));
  std::ranges::transform(ending, ending.begin(), [](unsigned char letter) {
    return static_cast<char>(std::tolower(letter));
  });
  if (ending == ".exr") return PictureFormat::kExr;
  if (ending == ".png") return PictureFormat::kPng;
  if (ending == ".pfm") return PictureFormat::kPfm;
  if (ending == ".hdr") return PictureFormat::kHdr;
  return absl::InvalidArgumentError("its name must end with .exr, .png, .pfm or .hdr");
}

StatusOr<std::string> EncodePicture(const Image& image, PictureFormat format,
                                    const Display& display) {
  switch (format) {
    case PictureFormat::kExr:
      return EncodeExr(image);
    case PictureFormat::kPng:
      return EncodePng(image, display);
    case PictureFormat::kPfm:
      return EncodePfm(image);
    case PictureFormat::kHdr:
      return EncodeHdr(image);
  }
  return absl::InternalError("unknown format");
}

StatusOr<Image> PictureOfLayer(const Image& image, const std::string& name) {
  const auto three = [&](std::array<const char*, 3> endings) {
    std::array<const ImageChannel*, 3> channels{};
    std::ranges::transform(endings, channels.begin(), [&](const char* ending) {
      return image.Find(absl::StrCat(name, ending));
    });
    return channels;
  };
  const auto has_all = [](const auto& channels) {
    return std::ranges::find(channels, nullptr) == channels.end();
  };
  if (const auto colors = three({".R", ".G", ".B"}); has_all(colors))
    return PictureOf(image, colors, false);
  if (const auto axes = three({".X", ".Y", ".Z"}); has_all(axes))
    return PictureOf(image, axes, true);
  if (const ImageChannel* grey = image.Find(name); grey != nullptr)
    return PictureOf(image, {grey, grey, grey}, false);
  std::set<std::string> layers;
  for (const ImageChannel& channel : image.channels) {
    const std::size_t dot = channel.name.rfind('.');
    if (dot != std::string::npos || channel.name.size() > 1)
      layers.insert(channel.name.substr(0, dot));
  }
  std::string known;
  for (const std::string& layer : layers)
    known += (known.empty() ? "" : ", ") + layer;
  return absl::NotFoundError(
      absl::StrCat("there is no layer ", name, "; there are ", known.empty() ? "none" : known));
}

bool IsOwnPicture(std::string_view first_bytes) {
  return first_bytes.find("lucerna.") != std::string_view::npos ||
         first_bytes.find(kPngOwner) != std::string_view::npos ||
         first_bytes.find(kHdrOwner) != std::string_view::npos;
}

}  // namespace lucerna
