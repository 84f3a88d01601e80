#include "render/estimate/radius_scale.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "render/estimate/image_tiles.h"
#include "render/estimate/relative_error.h"

namespace lucerna {
namespace {

// Factors are looked at in steps, 1 to 0.97 and so on to 0.09; within each the best is exact.
constexpr double kStep = 0.97;
constexpr std::size_t kSteps = 80;

double Square(double x) {
  return x * x;
}

}  // namespace

double RadiusScale(const ImageSums& sums, const PixelRadii& radii, const NoiseSample& sample,
                   std::size_t width) {
  const ImageSums::Whole& whole = sums.whole();
  if (sample.pixels.empty()) return 1;
  const std::uint64_t rounds = RoundsUntil(whole.passes);
  const ImageSums::Columns& columns = whole.columns;
  const ImageTiles tiles(columns.pixels(), width);
  // Noise, and squared bias by tiles, of the pixels whose radii a factor makes smaller from this
  // step on.
  std::array<double, kSteps> noises{};
  std::vector<double> biases(kSteps * tiles.count());
  std::vector<bool> lit(tiles.count());
  for (const NoiseSample::Pixel& pixel : sample.pixels) {
    const std::optional<ScaledRadius> scaled = radii.ScaledAt(pixel.index, whole.passes, rounds);
    if (!scaled.has_value()) return 1;
    const double squared_use = Square(scaled->use);
    const double even = static_cast<double>(columns.even_bias[pixel.index]) / whole.weights.even;
    const double odd = static_cast<double>(columns.odd_bias[pixel.index]) / whole.weights.odd;
    const double steps = std::log(scaled->most) / std::log(kStep);
    const auto step =
        steps > 0 ? static_cast<std::size_t>(std::min(steps, static_cast<double>(kSteps - 1))) : 0;
    const std::size_t tile = tiles.Of(pixel.index);
    lit[tile] = true;
    noises[step] += RelativeSquare(pixel.noise * squared_use, pixel.luminance, sample.floor);
    biases[step * tiles.count() + tile] +=
        RelativeSquare(even * odd / Square(squared_use), pixel.luminance, sample.floor);
  }
  const auto lit_tiles = static_cast<double>(std::ranges::count(lit, true));
  if (lit_tiles < kFewestTiles) return 1;

  double noise = 0;
  std::vector<double> of_tiles(tiles.count());
  // The error less that of a factor of 1, along the steps.
  double error = 0, least_error = 0, best = 1, from = 1;
  for (std::size_t step = 0; step < kSteps; ++step) {
    noise += noises[step];
    for (std::size_t tile = 0; tile < tiles.count(); ++tile)
      of_tiles[tile] += biases[step * tiles.count() + tile];
    const SumOfTiles sum = SumTiles(of_tiles, lit_tiles);
    const double bias = sum.sum - sum.deviation;
    const auto error_at = [&](double scale) {
      return error + noise * (1 / Square(scale) - 1 / Square(from)) +
             bias * (Square(Square(scale)) - Square(Square(from)));
    };
    const double to = from * kStep;
    // That of least error on the way.
    const double least =
        bias > 0 ? std::clamp(std::cbrt(std::sqrt(noise / (2 * bias))), to, from) : from;
    if (error_at(least) < least_error) {
      least_error = error_at(least);
      best = least;
    }
    error = error_at(to);
    from = to;
  }
  return best;
}

}  // namespace lucerna
