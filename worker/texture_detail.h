// How fine is the detail of a texture?
//
// For photons that leave a textured surface diffusely: the pattern is then part of the source. One
// pair of numbers stands for a whole texture, computed once from its pixels.
#pragma once

#include <vector>

#include "render/scene/texture.h"

namespace lucerna {

// The spectral variance of the albedo along each texture coordinate, u and v before the texture's
// own mapping [1/uv²].
struct TextureDetail {
  double u = 0, v = 0;
};

// [textures]. A constant has none; a checkerboard's edges, which have no end, are told apart to an
// eighth of a square.
[[nodiscard]] std::vector<TextureDetail> TextureDetails(const std::vector<Texture>& textures);

}  // namespace lucerna
