// Numbers, whose detail no photon carries.
#include "worker/texture_detail.h"

namespace lucerna {

TextureStatistics StatisticsOfWindy(const Texture& /*texture*/,
                                    std::span<const TextureStatistics> /*parts*/) {
  return {};
}

}  // namespace lucerna
