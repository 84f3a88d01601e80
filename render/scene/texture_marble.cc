// Layers of colours, disturbed by noise.
#include <algorithm>
#include <array>
#include <cmath>

#include "render/scene/noise.h"
#include "render/scene/texture_lookup.h"

namespace lucerna {
namespace {

// The colours of pbrt-v4's marble: control points of cubic Bézier pieces, each of which begins one
// point after the one before.
constexpr std::array<Rgb, 9> kMarble = {{{0.58F, 0.58F, 0.6F},
                                         {0.58F, 0.58F, 0.6F},
                                         {0.58F, 0.58F, 0.6F},
                                         {0.5F, 0.5F, 0.5F},
                                         {0.6F, 0.59F, 0.58F},
                                         {0.58F, 0.58F, 0.6F},
                                         {0.58F, 0.58F, 0.6F},
                                         {0.2F, 0.2F, 0.33F},
                                         {0.58F, 0.58F, 0.6F}}};
constexpr int kPieces = 6;

}  // namespace

Rgb LookUpMarble(std::span<const Texture> /*textures*/, const Texture& texture,
                 const TexturePlace& place) {
  const Vec3 at = texture.mapping.MapToSpace(place) * texture.scale;
  const float height = at.y + texture.variation * FbmAt(at, texture.roughness, texture.octaves);
  const float along = (0.5F + 0.5F * std::sin(height)) * kPieces;
  const int piece = std::clamp(static_cast<int>(std::floor(along)), 0, kPieces - 1);
  const float t = along - static_cast<float>(piece);
  const float s = 1 - t;
  const auto point = [&](int i) { return kMarble[static_cast<std::size_t>(piece + i)]; };
  return (point(0) * (s * s * s) + point(1) * (3 * s * s * t) + point(2) * (3 * s * t * t) +
          point(3) * (t * t * t)) *
         1.5F;
}

}  // namespace lucerna
