// The detail of a picture, from the second differences of its pixels.
#include <algorithm>
#include <cstddef>
#include <vector>

#include "render/frequency/spectrum.h"
#include "worker/texture_detail.h"

namespace lucerna {

TextureStatistics StatisticsOfPicture(const Texture& texture,
                                      std::span<const TextureStatistics> /*parts*/) {
  if (texture.is_number) return {};
  const Picture& picture = *texture.picture;
  const auto width = static_cast<std::size_t>(picture.width);
  const auto height = static_cast<std::size_t>(picture.height);
  std::vector<float> albedo;
  albedo.reserve(width * height);
  double sum = 0;
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      Rgb color = picture.At(x, y) * texture.scale;
      color *= texture.tint;
      if (texture.is_inverted) color = Gray(1) - color;
      albedo.push_back(std::clamp(Luminance(color), 0.0F, 1.0F));
      sum += static_cast<double>(albedo.back());
    }
  }
  TextureStatistics known;
  known.luminance = sum / static_cast<double>(albedo.size());
  // Beyond the edge lies the other edge, or more of this one.
  using Wrap = Texture::Wrap;
  const auto after = [](std::size_t i, std::size_t count, Wrap wrap) {
    return i + 1 < count ? i + 1 : wrap == Wrap::kRepeat ? 0 : i;
  };
  const auto before = [](std::size_t i, std::size_t count, Wrap wrap) {
    return i > 0 ? i - 1 : wrap == Wrap::kRepeat ? count - 1 : i;
  };
  const auto at = [&](std::size_t x, std::size_t y) {
    return static_cast<double>(albedo[y * width + x]);
  };
  for (std::size_t y = 0; y < height; ++y) {
    for (std::size_t x = 0; x < width; ++x) {
      const double here = at(x, y);
      const double along_u = at(before(x, width, texture.wrap_u), y) +
                             at(after(x, width, texture.wrap_u), y) - 2 * here;
      const double along_v = at(x, before(y, height, texture.wrap_v)) +
                             at(x, after(y, height, texture.wrap_v)) - 2 * here;
      known.detail.u += TexelDetail(along_u, here, known.luminance, 1);
      known.detail.v += TexelDetail(along_v, here, known.luminance, 1);
    }
  }
  const TextureMapping& mapping = texture.mapping;
  if (!mapping.IsOfUv()) return {{}, known.luminance};
  // From pixels to u and v: pixels along x and y for 1 of u, and of v.
  const bool is_affine = mapping.kind == TextureMapping::Kind::kUvAffine;
  const auto texels = static_cast<double>(albedo.size());
  const auto squared = [texels](float scale, std::size_t side) {
    const double pixels = static_cast<double>(scale) * static_cast<double>(side);
    return pixels * pixels / texels;
  };
  const double along_x = known.detail.u;
  const double along_y = known.detail.v;
  known.detail.u = along_x * squared(is_affine ? mapping.axis_u.x : mapping.scale_u, width);
  known.detail.v = along_y * squared(is_affine ? mapping.axis_v.y : mapping.scale_v, height);
  if (is_affine) {
    known.detail.u += along_y * squared(mapping.axis_v.x, height);
    known.detail.v += along_x * squared(mapping.axis_u.y, width);
  }
  return known;
}

}  // namespace lucerna
