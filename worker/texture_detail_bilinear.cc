// Slopes alone, which have no detail.
#include "worker/texture_detail.h"

namespace lucerna {

TextureStatistics StatisticsOfBilinear(const Texture& texture,
                                       std::span<const TextureStatistics> parts) {
  double sum = 0;
  for (const std::int32_t part : texture.parts)
    sum += parts[static_cast<std::size_t>(part)].luminance;
  return {{}, sum / 4};
}

}  // namespace lucerna
