// As fine as the finer of the two.
#include "worker/texture_detail.h"

namespace lucerna {

TextureStatistics StatisticsOfDirectionMixed(const Texture& texture,
                                             std::span<const TextureStatistics> parts) {
  return StatisticsBetween(texture, parts);
}

}  // namespace lucerna
