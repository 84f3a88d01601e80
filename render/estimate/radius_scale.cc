#include "render/estimate/radius_scale.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include "render/estimate/image_tiles.h"
#include "render/estimate/relative_error.h"

namespace lucerna {
namespace {

// Factors that are looked at: 1, 0.99 and so on to 0.09.
constexpr double kStep = 0.99;
constexpr std::size_t kSteps = 240;

constexpr double kDeviationsTaken = 2;

double Square(double x) {
  return x * x;
}

// Sums of squared bias, and what chance makes of them.
struct SquaredBias {
  double sum = 0, chance = 0;

  void Add(double bias, double by_chance) {
    sum += bias;
    chance += by_chance;
  }
};

// Of one tile: B, and B p².
struct TileBias {
  SquaredBias bias, with_past;
};

}  // namespace

double RadiusScale(const ImageSums& sums, const PixelRadii& radii, const NoiseSample& sample,
                   std::size_t width) {
  const ImageSums::Whole& whole = sums.whole();
  if (sample.pixels.empty()) return 1;
  const PassesTaken taken = {
      .passes = whole.passes,
      .rounds = RoundsUntil(whole.passes),
      .photons = whole.weights.all() * static_cast<double>(whole.photons_per_pass)};
  const ImageTiles tiles(whole.columns.pixels(), width);
  // Noise, and squared bias by tiles, of the pixels whose radii a factor makes smaller from this
  // step on.
  std::array<double, kSteps> noises{};
  std::vector<TileBias> biases(kSteps * tiles.count());
  std::vector<bool> lit(tiles.count());
  for (const NoiseSample::Pixel& pixel : sample.pixels) {
    const std::optional<ScaledRadius> scaled = radii.ScaledAt(pixel.index, taken);
    if (!scaled.has_value()) return 1;
    const double steps = std::log(scaled->most) / std::log(kStep);
    const auto step =
        steps > 0 ? static_cast<std::size_t>(std::min(steps, static_cast<double>(kSteps - 1))) : 0;
    const std::size_t tile = tiles.Of(pixel.index);
    lit[tile] = true;
    noises[step] +=
        RelativeSquare(pixel.noise * Square(scaled->use), pixel.luminance, sample.floor);
    const double even = scaled->even_bias;
    const double odd = scaled->odd_bias;
    const double square = RelativeSquare(scaled->most * even * odd, pixel.luminance, sample.floor);
    // It scatters as the product does, whatever the bias, and has none in the mean.
    const double chance = RelativeSquare(scaled->most * 0.5 * (Square(even) - Square(odd)),
                                         pixel.luminance, sample.floor);
    const double past = Square(scaled->blurred);
    TileBias& of_tile = biases[step * tiles.count() + tile];
    of_tile.bias.Add(square, chance);
    of_tile.with_past.Add(past * square, past * chance);
  }
  if (static_cast<double>(std::ranges::count(lit, true)) < kFewestTiles) return 1;

  double noise = 0;
  std::vector<TileBias> of_tiles(tiles.count());
  // The error less that of a factor of 1, along the steps.
  double error = 0, least_error = 0, best = 1, from = 1;
  for (std::size_t step = 0; step < kSteps; ++step) {
    noise += noises[step];
    SquaredBias bias, with_past;
    for (std::size_t tile = 0; tile < tiles.count(); ++tile) {
      const TileBias& more = biases[step * tiles.count() + tile];
      TileBias& of_tile = of_tiles[tile];
      of_tile.bias.Add(more.bias.sum, more.bias.chance);
      of_tile.with_past.Add(more.with_past.sum, more.with_past.chance);
      bias.Add(of_tile.bias.sum, Square(of_tile.bias.chance));
      with_past.Add(of_tile.with_past.sum, Square(of_tile.with_past.chance));
    }
    const auto sure = [](const SquaredBias& squared) {
      return squared.sum - kDeviationsTaken * std::sqrt(squared.chance);
    };
    // B p⁴ is there with any factor.
    const auto error_at = [&](double scale) {
      const double scale2 = Square(scale);
      return noise / scale2 + (2 * sure(with_past) + sure(bias) * scale2) * scale2;
    };
    const double to = from * kStep;
    error += error_at(to) - error_at(from);
    if (error < least_error) {
      least_error = error;
      best = to;
    }
    from = to;
  }
  return best;
}

}  // namespace lucerna
