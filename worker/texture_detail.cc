#include "worker/texture_detail.h"

#include <algorithm>

namespace lucerna {

TextureStatistics StatisticsBetween(const Texture& texture,
                                    std::span<const TextureStatistics> parts) {
  const TextureStatistics& first = parts[static_cast<std::size_t>(texture.parts[0])];
  const TextureStatistics& second = parts[static_cast<std::size_t>(texture.parts[1])];
  return {{std::max(first.detail.u, second.detail.u), std::max(first.detail.v, second.detail.v)},
          0.5 * (first.luminance + second.luminance)};
}

std::vector<TextureDetail> TextureDetails(const std::vector<Texture>& textures) {
  std::vector<TextureStatistics> statistics;
  std::vector<TextureDetail> details;
  for (const Texture& texture : textures) {
    TextureStatistics here;
    switch (texture.kind) {
#define LUCERNA_CASE(Name, name)                    \
  case Texture::Kind::k##Name:                      \
    here = StatisticsOf##Name(texture, statistics); \
    break;
      LUCERNA_TEXTURES(LUCERNA_CASE)
#undef LUCERNA_CASE
    }
    statistics.push_back(here);
    details.push_back(here.detail);
  }
  return details;
}

}  // namespace lucerna
