// A texture that is scaled keeps its relative detail.
#include "worker/texture_detail.h"

namespace lucerna {

TextureStatistics StatisticsOfScaled(const Texture& texture,
                                     std::span<const TextureStatistics> parts) {
  TextureStatistics scaled = parts[static_cast<std::size_t>(texture.parts[0])];
  scaled.luminance *= static_cast<double>(texture.scale);
  return scaled;
}

}  // namespace lucerna
