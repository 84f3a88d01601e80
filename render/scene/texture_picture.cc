// The pixels of a file, interpolated between the centres of the four nearest.
#include <algorithm>
#include <cmath>

#include "render/scene/texture_lookup.h"

namespace lucerna {
namespace {

// The two pixels around a place along one axis, -1 for one that is black, and the second's share.
struct Neighbours {
  int first = 0, second = 0;
  float share = 0;
};

// Every second copy is turned over: into [0, 1].
float Mirrored(float place) {
  const float within = place - 2 * std::floor(place * 0.5F);
  return within > 1 ? 2 - within : within;
}

Neighbours Around(float place, int count, Texture::Wrap wrap) {
  using Wrap = Texture::Wrap;
  // Repeated before the pixels are counted, clamped to just beyond the picture.
  const float within = wrap == Wrap::kRepeat   ? place - std::floor(place)
                       : wrap == Wrap::kMirror ? Mirrored(place)
                                               : std::min(std::max(place, -1.0F), 2.0F);
  const float pixel = within * static_cast<float>(count) - 0.5F;
  const float below = std::floor(pixel);
  const int first = static_cast<int>(below);
  return {WrappedIndex(first, count, wrap), WrappedIndex(first + 1, count, wrap), pixel - below};
}

// Places that no int can number are numbers of the first pixel.
Rgb NearestColor(const Texture& texture, Vec2 uv) {
  const Picture& picture = *texture.picture;
  const auto nearest = [](float place, int count, Texture::Wrap wrap) {
    const float pixel = std::floor(place * static_cast<float>(count));
    return WrappedIndex(std::abs(pixel) < 0x1p30F ? static_cast<int>(pixel) : 0, count, wrap);
  };
  const int column = nearest(uv.x, picture.width, texture.wrap_u);
  const int row = nearest(1 - uv.y, picture.height, texture.wrap_v);
  return column < 0 || row < 0 ? Rgb{} : picture.At(column, row);
}

}  // namespace

int WrappedIndex(int index, int count, Texture::Wrap wrap) {
  if (index >= 0 && index < count) return index;
  switch (wrap) {
    case Texture::Wrap::kBlack:
      return -1;
    case Texture::Wrap::kClamp:
      return index < 0 ? 0 : count - 1;
    case Texture::Wrap::kRepeat:
      return ((index % count) + count) % count;
    case Texture::Wrap::kMirror: {
      const int twice = 2 * count;
      const int within = ((index % twice) + twice) % twice;
      return within < count ? within : twice - 1 - within;
    }
  }
  return -1;
}

Rgb PictureColor(const Picture& picture, Vec2 uv, Texture::Wrap wrap_u, Texture::Wrap wrap_v) {
  const Neighbours x = Around(uv.x, picture.width, wrap_u);
  const Neighbours y = Around(1 - uv.y, picture.height, wrap_v);
  const auto at = [&](int column, int row) {
    return column < 0 || row < 0 ? Rgb{} : picture.At(column, row);
  };
  const Rgb above = at(x.first, y.first) * (1 - x.share) + at(x.second, y.first) * x.share;
  const Rgb below = at(x.first, y.second) * (1 - x.share) + at(x.second, y.second) * x.share;
  return above * (1 - y.share) + below * y.share;
}

Rgb LookUpPicture(std::span<const Texture> /*textures*/, const Texture& texture,
                  const TexturePlace& place) {
  const Vec2 uv = texture.mapping.Map(place);
  Rgb color = texture.is_nearest
                  ? NearestColor(texture, uv)
                  : PictureColor(*texture.picture, uv, texture.wrap_u, texture.wrap_v);
  color *= texture.scale;
  color *= texture.tint;
  if (texture.is_inverted) {
    color = Gray(1) - color;
    if (texture.is_number) return Gray(std::max(0.0F, color.g));
  }
  return texture.is_number ? color : HeldInUnit(color);
}

}  // namespace lucerna
