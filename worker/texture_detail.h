// How fine is the detail of a texture?
//
// For photons that leave a textured surface diffusely: the pattern is then part of the source. One
// pair of numbers stands for a whole texture, computed once from its pixels. Textures that are not
// placed by u and v, and noise, count as even.
#pragma once

#include <span>
#include <vector>

#include "render/scene/texture.h"

namespace lucerna {

// The spectral variance of the albedo along each texture coordinate, u and v before the texture's
// own mapping [1/uv²].
struct TextureDetail {
  double u = 0, v = 0;
};

// Detail and mean luminance.
struct TextureStatistics {
  TextureDetail detail;
  double luminance = 0;
};

// Of each kind of texture, defined in texture_detail_NAME.cc. `parts`: of textures with lower
// numbers, by number.
#define LUCERNA_DECLARE(Name, name)                                          \
  [[nodiscard]] TextureStatistics StatisticsOf##Name(const Texture& texture, \
                                                     std::span<const TextureStatistics> parts);
LUCERNA_TEXTURES(LUCERNA_DECLARE)
#undef LUCERNA_DECLARE

// Of a texture between two of `parts`, as fine as the finer one.
[[nodiscard]] TextureStatistics StatisticsBetween(const Texture& texture,
                                                  std::span<const TextureStatistics> parts);

// [textures].
[[nodiscard]] std::vector<TextureDetail> TextureDetails(const std::vector<Texture>& textures);

}  // namespace lucerna
