#include "worker/texture_detail.h"

namespace lucerna {

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
