// The edges of a checkerboard, whose detail has no end, are resolved to an eighth of a square.
#include <algorithm>

#include "render/frequency/spectrum.h"
#include "worker/texture_detail.h"

namespace lucerna {

TextureStatistics StatisticsOfCheckerboard(const Texture& texture,
                                           std::span<const TextureStatistics> parts) {
  const TextureStatistics& even = parts[static_cast<std::size_t>(texture.parts[0])];
  const TextureStatistics& odd = parts[static_cast<std::size_t>(texture.parts[1])];
  constexpr double kTexels = 8;  // of a square's side
  TextureStatistics known;
  known.luminance = 0.5 * (even.luminance + odd.luminance);
  if (texture.is_in_space || texture.mapping.kind != TextureMapping::Kind::kUv)
    return {{}, known.luminance};
  const double step = even.luminance - odd.luminance;
  // The step changes the first and the last texel of each square.
  const double detail = 2 / kTexels * 0.5 *
                        (TexelDetail(step, even.luminance, known.luminance, 1) +
                         TexelDetail(step, odd.luminance, known.luminance, 1));
  const double per_u = static_cast<double>(texture.mapping.scale_u) * kTexels;
  const double per_v = static_cast<double>(texture.mapping.scale_v) * kTexels;
  known.detail = {detail * per_u * per_u + std::max(even.detail.u, odd.detail.u),
                  detail * per_v * per_v + std::max(even.detail.v, odd.detail.v)};
  return known;
}

}  // namespace lucerna
