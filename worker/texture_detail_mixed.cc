// As fine as the finer of the two; the detail of the amount is left out.
#include "worker/texture_detail.h"

namespace lucerna {

TextureStatistics StatisticsOfMixed(const Texture& texture,
                                    std::span<const TextureStatistics> parts) {
  return StatisticsBetween(texture, parts);
}

}  // namespace lucerna
