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
      if (texture.is_inverted) color = Gray(1) - color;
      albedo.push_back(std::clamp(Luminance(color), 0.0F, 1.0F));
      sum += static_cast<double>(albedo.back());
    }
  }
  TextureStatistics known;
  known.luminance = sum / static_cast<double>(albedo.size());
  // Beyond the edge lies the other edge, or more of this one.
  const bool repeats = texture.wrap == Texture::Wrap::kRepeat;
  const auto after = [&](std::size_t i, std::size_t count) {
    return i + 1 < count ? i + 1 : repeats ? 0 : i;
  };
  const auto before = [&](std::size_t i, std::size_t count) {
    return i > 0 ? i - 1 : repeats ? count - 1 : i;
  };
  const auto at = [&](std::size_t x, std::size_t y) {
    return static_cast<double>(albedo[y * width + x]);
  };
  for (std::size_t y = 0; y < height; ++y) {
    for (std::size_t x = 0; x < width; ++x) {
      const double here = at(x, y);
      const double along_u = at(before(x, width), y) + at(after(x, width), y) - 2 * here;
      const double along_v = at(x, before(y, height)) + at(x, after(y, height)) - 2 * here;
      known.detail.u += TexelDetail(along_u, here, known.luminance, 1);
      known.detail.v += TexelDetail(along_v, here, known.luminance, 1);
    }
  }
  if (texture.mapping.kind != TextureMapping::Kind::kUv) return {{}, known.luminance};
  // From pixels to u and v.
  const auto texels = static_cast<double>(albedo.size());
  const double per_u = static_cast<double>(texture.mapping.scale_u) * static_cast<double>(width);
  const double per_v = static_cast<double>(texture.mapping.scale_v) * static_cast<double>(height);
  known.detail.u *= per_u * per_u / texels;
  known.detail.v *= per_v * per_v / texels;
  return known;
}

}  // namespace lucerna
