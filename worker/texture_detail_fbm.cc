// Numbers, whose detail no photon carries.
#include "worker/texture_detail.h"

namespace lucerna {

TextureStatistics StatisticsOfFbm(const Texture& /*texture*/,
                                  std::span<const TextureStatistics> /*parts*/) {
  return {};
}

}  // namespace lucerna
