// A constant has no detail.
#include "worker/texture_detail.h"

namespace lucerna {

TextureStatistics StatisticsOfConstant(const Texture& texture,
                                       std::span<const TextureStatistics> /*parts*/) {
  return {{}, static_cast<double>(Luminance(texture.color))};
}

}  // namespace lucerna
