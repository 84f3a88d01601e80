#include "render/image/image.h"

#include <algorithm>
#include <bit>
#include <cstdint>

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

}  // namespace lucerna
