// As fine as the finer of the two; the edges of dots are left out.
#include "worker/texture_detail.h"

namespace lucerna {

TextureStatistics StatisticsOfDots(const Texture& texture,
                                   std::span<const TextureStatistics> parts) {
  return StatisticsBetween(texture, parts);
}

}  // namespace lucerna
