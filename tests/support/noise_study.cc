#include "tests/support/noise_study.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "tests/support/local_render.h"

namespace lucerna {

std::vector<NoiseDecile> StudyNoise(const Scene& scene, const NoiseStudySize& size) {
  RenderOverrides overrides;
  overrides.width = size.side;
  overrides.height = size.side;
  overrides.photons_per_pass = std::int64_t{size.side} * size.side;
  overrides.initial_radius = 0;
  overrides.max_depth = 12;
  const auto pixels = static_cast<std::size_t>(size.side) * static_cast<std::size_t>(size.side);
  std::vector<double> sum(pixels), squares(pixels), layer(pixels);
  for (int render = 0; render < size.renders; ++render) {
    overrides.seed = 3000 + static_cast<std::uint64_t>(render);
    const Image image = RenderLocally(scene, SettingsFor(scene, overrides), size.passes);
    const auto at = [&](const char* channel, std::size_t i) {
      return static_cast<double>(image.Find(channel)->pixels[i]);
    };
    for (std::size_t i = 0; i < pixels; ++i) {
      const double luminance = LuminanceOf({at("R", i), at("G", i), at("B", i)});
      sum[i] += luminance;
      squares[i] += luminance * luminance;
      layer[i] += at("noise", i) * at("noise", i);
    }
  }

  std::vector<std::size_t> order(pixels);
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return sum[i]; });
  std::vector<NoiseDecile> deciles;
  const double renders = size.renders;
  for (std::size_t part = 0; part < 10; ++part) {
    NoiseDecile decile;
    std::vector<double> ratios;
    const std::size_t first = pixels * part / 10;
    const std::size_t end = pixels * (part + 1) / 10;
    for (std::size_t k = first; k < end; ++k) {
      const std::size_t i = order[k];
      const double variance = std::max(0.0, squares[i] - sum[i] * sum[i] / renders) / (renders - 1);
      decile.mean += sum[i] / renders;
      decile.deviation += variance;
      decile.layer += layer[i] / renders;
      if (variance > 0 && layer[i] > 0) ratios.push_back(std::sqrt(variance * renders / layer[i]));
    }
    const auto count = static_cast<double>(end - first);
    decile.mean /= count;
    decile.deviation = std::sqrt(decile.deviation / count);
    decile.layer = std::sqrt(decile.layer / count);
    if (!ratios.empty()) {
      const auto middle = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
      std::ranges::nth_element(ratios, middle);
      decile.median_ratio = *middle;
    }
    deciles.push_back(decile);
  }
  return deciles;
}

}  // namespace lucerna
