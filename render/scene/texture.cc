#include "render/scene/texture.h"

#include <algorithm>
#include <cmath>

namespace lucerna {
namespace {

// Into [0, 1]. What is not a number, as no colour times an infinite scale, becomes 0.
float Held(float value) {
  return value > 0 ? std::min(value, 1.0F) : 0.0F;
}

Rgb Held(Rgb color) {
  return {Held(color.r), Held(color.g), Held(color.b)};
}

// Far from the origin no digit is left to tell one place from the next, and a place must be fit to
// be made a whole number.
float Bounded(float place) {
  constexpr float kFarthest = 1e9F;
  return std::abs(place) <= kFarthest ? place : 0.0F;
}

Vec2 Mapped(const UvMapping& mapping, Vec2 uv) {
  return {Bounded(mapping.scale_u * uv.x + mapping.delta_u),
          Bounded(mapping.scale_v * uv.y + mapping.delta_v)};
}

// The two pixels around a place along one axis, -1 for one that is black, and the second's share.
struct Neighbours {
  int first = 0, second = 0;
  float share = 0;
};

Neighbours Around(float place, int count, Texture::Wrap wrap) {
  using Wrap = Texture::Wrap;
  // Repeated before the pixels are counted, clamped to just beyond the picture.
  const float within =
      wrap == Wrap::kRepeat ? place - std::floor(place) : std::min(std::max(place, -1.0F), 2.0F);
  const float pixel = within * static_cast<float>(count) - 0.5F;
  const float below = std::floor(pixel);
  const auto index = [&](int i) {
    if (i >= 0 && i < count) return i;
    if (wrap == Wrap::kBlack) return -1;
    if (wrap == Wrap::kClamp) return i < 0 ? 0 : count - 1;
    return i < 0 ? i + count : i - count;
  };
  const int first = static_cast<int>(below);
  return {index(first), index(first + 1), pixel - below};
}

Rgb Interpolated(const Picture& picture, Texture::Wrap wrap, Vec2 uv) {
  const Neighbours x = Around(uv.x, picture.width, wrap);
  const Neighbours y = Around(1 - uv.y, picture.height, wrap);
  const auto at = [&](int column, int row) {
    return column < 0 || row < 0 ? Rgb{} : picture.At(column, row);
  };
  const Rgb above = at(x.first, y.first) * (1 - x.share) + at(x.second, y.first) * x.share;
  const Rgb below = at(x.first, y.second) * (1 - x.share) + at(x.second, y.second) * x.share;
  return above * (1 - y.share) + below * y.share;
}

}  // namespace

float Picture::Largest() const {
  if (!linear.empty()) return *std::max_element(linear.begin(), linear.end());
  float largest = 0;
  for (const std::uint8_t value : coded)
    largest = std::max(largest, decoded[value]);
  return largest;
}

Rgb TextureColor(std::span<const Texture> textures, std::int32_t number, Vec2 uv) {
  float factor = 1;
  while (true) {
    const Texture& texture = textures[static_cast<std::size_t>(number)];
    switch (texture.kind) {
      case Texture::Kind::kConstant:
        return Held(texture.color * factor);
      case Texture::Kind::kPicture: {
        Rgb color = Interpolated(*texture.picture, texture.wrap, Mapped(texture.mapping, uv));
        color *= texture.scale;
        if (texture.is_inverted) color = Gray(1) - color;
        return Held(Held(color) * factor);
      }
      case Texture::Kind::kScaled:
        factor *= texture.scale;
        number = texture.parts[0];
        break;
      case Texture::Kind::kCheckerboard: {
        const Vec2 place = Mapped(texture.mapping, uv);
        const float squares = std::floor(place.x) + std::floor(place.y);
        number = texture.parts[std::fmod(squares, 2.0F) == 0 ? 0 : 1];
        break;
      }
    }
  }
}

}  // namespace lucerna
