// Its mean colour; the detail of noise is left out.
#include "worker/texture_detail.h"

namespace lucerna {

TextureStatistics StatisticsOfMarble(const Texture& /*texture*/,
                                     std::span<const TextureStatistics> /*parts*/) {
  return {{}, 0.7};
}

}  // namespace lucerna
