#include "render/image/image.h"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>

namespace lucerna {
namespace {

constexpr std::string_view kRunPrefix = "lucerna.run.";

void AddNumber(Sha256Stream& stream, std::uint64_t number) {
  std::array<char, 8> bytes{};
  for (char& byte : bytes) {
    byte = static_cast<char>(number & 0xFF);
    number >>= 8;
  }
  stream.Add({bytes.data(), bytes.size()});
}

// The length goes first, so that no two lists of texts give the same bytes.
void AddText(Sha256Stream& stream, std::string_view text) {
  AddNumber(stream, text.size());
  stream.Add(text);
}

}  // namespace

const ImageChannel* Image::Find(std::string_view name) const {
  for (const ImageChannel& channel : channels) {
    if (channel.name == name) return &channel;
  }
  return nullptr;
}

Digest Image::PixelDigest() const {
  // Pixels go in as they lie in memory.
  static_assert(std::endian::native == std::endian::little);
  Sha256Stream stream;
  AddText(stream, "lucerna image 1");
  AddNumber(stream, static_cast<std::uint64_t>(width));
  AddNumber(stream, static_cast<std::uint64_t>(height));

  std::vector<const ImageChannel*> by_name;
  by_name.reserve(channels.size());
  for (const ImageChannel& channel : channels)
    by_name.push_back(&channel);
  std::ranges::sort(by_name, {}, [](const ImageChannel* channel) { return channel->name; });
  AddNumber(stream, by_name.size());
  for (const ImageChannel* channel : by_name) {
    AddText(stream, channel->name);
    AddText(stream, {reinterpret_cast<const char*>(channel->pixels.data()),
                     channel->pixels.size() * sizeof(float)});
  }

  for (const auto& [key, value] : metadata) {
    if (key.starts_with(kRunPrefix)) continue;
    AddText(stream, key);
    AddText(stream, value);
  }
  return stream.Finish();
}

Image BandedImage::Whole() const {
  Image whole = head;
  const std::size_t pixels =
      static_cast<std::size_t>(whole.width) * static_cast<std::size_t>(whole.height);
  ForBands(whole.width, whole.height, [&](int first, int last) {
    std::vector<ImageChannel> band = rows(first, last);
    if (whole.channels.empty()) {
      for (const ImageChannel& channel : band) {
        whole.channels.push_back({channel.name, {}});
        whole.channels.back().pixels.reserve(pixels);
      }
    }
    LUCERNA_CHECK(band.size() == whole.channels.size());
    for (std::size_t c = 0; c < band.size(); ++c) {
      std::vector<float>& all = whole.channels[c].pixels;
      all.insert(all.end(), band[c].pixels.begin(), band[c].pixels.end());
    }
  });
  return whole;
}

BandedImage InBands(Image whole) {
  BandedImage banded;
  std::vector<ImageChannel> channels = std::exchange(whole.channels, {});
  banded.head = std::move(whole);
  // Functions can be copied; the pixels are not.
  const auto shared = std::make_shared<const std::vector<ImageChannel>>(std::move(channels));
  banded.rows = [shared, width = banded.head.width](int first, int last) {
    const std::ptrdiff_t begin = std::ptrdiff_t{first} * width;
    const std::ptrdiff_t end = std::ptrdiff_t{last} * width;
    std::vector<ImageChannel> band;
    band.reserve(shared->size());
    for (const ImageChannel& channel : *shared)
      band.push_back(
          {channel.name, {channel.pixels.begin() + begin, channel.pixels.begin() + end}});
    return band;
  };
  return banded;
}

void ForBands(int width, int height, const std::function<void(int first, int last)>& body) {
  constexpr int kPixelsPerBand = 1 << 16;
  const int rows = std::max(1, kPixelsPerBand / std::max(1, width));
  for (int first = 0; first < height; first += rows)
    body(first, std::min(height, first + rows));
}

}  // namespace lucerna
