#include "render/scene/texture.h"

#include <algorithm>
#include <cfloat>
#include <cmath>

#include "render/math/warp.h"
#include "render/scene/texture_lookup.h"

namespace lucerna {

Rgb ValueAt(std::span<const Texture> textures, std::int32_t number, const TexturePlace& place) {
  const Texture& texture = textures[static_cast<std::size_t>(number)];
  switch (texture.kind) {
#define LUCERNA_CASE(Name, name) \
  case Texture::Kind::k##Name:   \
    return LookUp##Name(textures, texture, place);
    LUCERNA_TEXTURES(LUCERNA_CASE)
#undef LUCERNA_CASE
  }
  return {};
}

float Picture::Largest() const {
  if (!linear.empty()) return *std::max_element(linear.begin(), linear.end());
  float largest = 0;
  for (const std::uint8_t value : coded)
    largest = std::max(largest, decoded[value]);
  return largest;
}

float Picture::Smallest() const {
  if (!linear.empty()) return *std::min_element(linear.begin(), linear.end());
  float smallest = HUGE_VALF;
  for (const std::uint8_t value : coded)
    smallest = std::min(smallest, decoded[value]);
  return smallest;
}

Vec2 TextureMapping::Map(const TexturePlace& place) const {
  if (kind == Kind::kUv) [[likely]] {
    return {HeldPlace(scale_u * place.uv.x + delta_u), HeldPlace(scale_v * place.uv.y + delta_v)};
  }
  if (kind == Kind::kUvAffine) {
    return {HeldPlace(axis_u.x * place.uv.x + axis_u.y * place.uv.y + delta_u),
            HeldPlace(axis_v.x * place.uv.x + axis_v.y * place.uv.y + delta_v)};
  }
  const Vec3 p = MapToSpace(place);
  switch (kind) {
    case Kind::kUv:
    case Kind::kUvAffine:
      break;
    case Kind::kPlanar:
      return {HeldPlace(Dot(p, axis_u) + delta_u), HeldPlace(Dot(p, axis_v) + delta_v)};
    case Kind::kSpherical: {
      const float around = std::atan2(p.y, p.x);
      return {std::atan2(std::sqrt(p.x * p.x + p.y * p.y), p.z) * kInversePi,
              (around < 0 ? around + 2 * kPi : around) * (0.5F * kInversePi)};
    }
    case Kind::kCylindrical:
      return {(kPi + std::atan2(p.y, p.x)) * (0.5F * kInversePi), p.z};
  }
  return {};
}

Vec3 TextureMapping::MapToSpace(const TexturePlace& place) const {
  const Vec3 p = from_world.Point(place.position);
  return {HeldPlace(p.x), HeldPlace(p.y), HeldPlace(p.z)};
}

Rgb TextureColor(std::span<const Texture> textures, std::int32_t number,
                 const TexturePlace& place) {
  return HeldInUnit(ValueAt(textures, number, place));
}

float TextureNumber(std::span<const Texture> textures, std::int32_t number,
                    const TexturePlace& place) {
  const float value = ValueAt(textures, number, place).g;
  return value >= -FLT_MAX ? std::min(value, FLT_MAX) : value < 0 ? -FLT_MAX : 0.0F;
}

Vec2 SlopeStep(std::span<const Texture> textures, std::int32_t number) {
  constexpr float kLargest = 0.0005F;
  // Floats of a texture coordinate of some size would not tell nearer places apart.
  constexpr float kLeast = 0x1p-20F;
  const Texture& texture = textures[static_cast<std::size_t>(number)];
  Vec2 step = {kLargest, kLargest};
  if (texture.picture != nullptr && texture.mapping.kind == TextureMapping::Kind::kUv) {
    const auto quarter_pixel = [&](float scale, int pixels) {
      return std::max(kLeast, 0.25F / (std::abs(scale) * static_cast<float>(pixels)));
    };
    step = {std::min(step.x, quarter_pixel(texture.mapping.scale_u, texture.picture->width)),
            std::min(step.y, quarter_pixel(texture.mapping.scale_v, texture.picture->height))};
  }
  for (const std::int32_t part : texture.parts) {
    if (part == kNoTexture) continue;
    const Vec2 of_part = SlopeStep(textures, part);
    step = {std::min(step.x, of_part.x), std::min(step.y, of_part.y)};
  }
  return step;
}

}  // namespace lucerna
