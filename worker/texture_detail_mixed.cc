// As fine as the finer of the two; the detail of the amount is left out.
#include <algorithm>

#include "worker/texture_detail.h"

namespace lucerna {

TextureStatistics StatisticsOfMixed(const Texture& texture,
                                    std::span<const TextureStatistics> parts) {
  const TextureStatistics& first = parts[static_cast<std::size_t>(texture.parts[0])];
  const TextureStatistics& second = parts[static_cast<std::size_t>(texture.parts[1])];
  return {{std::max(first.detail.u, second.detail.u), std::max(first.detail.v, second.detail.v)},
          0.5 * (first.luminance + second.luminance)};
}

}  // namespace lucerna
