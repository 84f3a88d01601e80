// Colours of vertices have no detail between them that is counted; those of a texture that they are
// multiplied by have theirs.
#include "worker/texture_detail.h"

namespace lucerna {

TextureStatistics StatisticsOfVertexColor(const Texture& texture,
                                          std::span<const TextureStatistics> parts) {
  if (texture.parts[0] == kNoTexture) return {{}, static_cast<double>(Luminance(texture.tint))};
  return parts[static_cast<std::size_t>(texture.parts[0])];
}

}  // namespace lucerna
