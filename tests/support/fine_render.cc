#include "tests/support/fine_render.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "render/base/status.h"
#include "tests/support/local_render.h"

namespace lucerna {
namespace {

// Of the first and every radius, in widths of a small pixel.
constexpr double kFootprints = 1;
constexpr std::array<const char*, 3> kColors = {"R", "G", "B"};

// Of what is `x` pixels from the middle of a pixel, along one axis, up to a factor.
double FilterAt(const PixelFilter& filter, double radius, double x) {
  if (std::abs(x) > radius) return 0;
  if (filter.kind == PixelFilter::Kind::kBox) return 1;
  LUCERNA_CHECK(filter.kind == PixelFilter::Kind::kGaussian);
  const auto gaussian = [&](double at) {
    const auto sigma = static_cast<double>(filter.sigma);
    return std::exp(-at * at / (2 * sigma * sigma));
  };
  return gaussian(x) - gaussian(radius);
}

// One side of the image: `size` pixels, of `times` small ones each, and whole pixels around them.
struct Side {
  int size = 0, times = 0;
  double radius = 0;  // of the filter [pixels]
  [[nodiscard]] int Margin() const { return static_cast<int>(std::ceil(radius - 0.5)); }
  [[nodiscard]] int WithMargins() const { return size + 2 * Margin(); }
  [[nodiscard]] int Small() const { return times * WithMargins(); }
  // Weights of the small pixels that count in a pixel, from the first of its margin on.
  [[nodiscard]] std::vector<double> Weights(const PixelFilter& filter) const {
    std::vector<double> weights(static_cast<std::size_t>(times * (1 + 2 * Margin())));
    double sum = 0;
    for (std::size_t i = 0; i < weights.size(); ++i) {
      const double x = (static_cast<double>(i) + 0.5) / times - Margin() - 0.5;
      weights[i] = FilterAt(filter, radius, x);
      sum += weights[i];
    }
    for (double& weight : weights)
      weight /= sum;
    return weights;
  }
};

std::vector<float> Filtered(const std::vector<float>& small, const Side& across, const Side& down,
                            const PixelFilter& filter) {
  const std::vector<double> of_column = across.Weights(filter);
  const std::vector<double> of_row = down.Weights(filter);
  std::vector<float> pixels;
  for (int y = 0; y < down.size; ++y) {
    for (int x = 0; x < across.size; ++x) {
      double sum = 0;
      for (std::size_t j = 0; j < of_row.size(); ++j) {
        const std::size_t row = static_cast<std::size_t>(y * down.times) + j;
        const std::size_t first = row * static_cast<std::size_t>(across.Small()) +
                                  static_cast<std::size_t>(x * across.times);
        for (std::size_t i = 0; i < of_column.size(); ++i)
          sum += of_row[j] * of_column[i] * static_cast<double>(small[first + i]);
      }
      pixels.push_back(static_cast<float>(sum));
    }
  }
  return pixels;
}

// With `across` and `down` pixels more at each border.
Window Widened(const Window& window, int width, int height, int across, int down) {
  const double x = (window.high_x - window.low_x) / width * across;
  const double y = (window.high_y - window.low_y) / height * down;
  return {window.low_x - x, window.high_x + x, window.low_y - y, window.high_y + y};
}

}  // namespace

Image RenderFinely(Scene scene, RenderOverrides overrides, int times, int passes, int threads) {
  LUCERNA_CHECK(overrides.width.has_value() && overrides.height.has_value() && times > 0 &&
                scene.camera.kind == Camera::Kind::kPerspective);
  const PixelFilter filter = scene.filter;
  const Side across = {*overrides.width, times, static_cast<double>(filter.radius_x)};
  const Side down = {*overrides.height, times, static_cast<double>(filter.radius_y)};
  // What 1 is on the window of a camera whose field of view is a right angle.
  const Window window = ScreenWindow(scene.camera, across.size, down.size);
  scene.camera.fov_deg = 90;
  scene.camera.screen_window =
      Widened(window, across.size, down.size, across.Margin(), down.Margin());
  scene.filter = {
      .kind = PixelFilter::Kind::kBox, .radius_x = 0.5F, .radius_y = 0.5F, .sigma = 0.5F};
  overrides.width = across.Small();
  overrides.height = down.Small();
  overrides.initial_footprints = kFootprints;
  overrides.radius_controller = RadiusControllerKind::kFixed;
  const Image small = RenderLocally(scene, SettingsFor(scene, overrides), passes, threads);
  Image image;
  image.width = across.size;
  image.height = down.size;
  for (const char* const color : kColors)
    image.channels.push_back({color, Filtered(small.Find(color)->pixels, across, down, filter)});
  return image;
}

}  // namespace lucerna
