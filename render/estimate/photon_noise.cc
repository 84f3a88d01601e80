#include "render/estimate/photon_noise.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "render/estimate/relative_error.h"

namespace lucerna {
namespace {

constexpr std::size_t kPixelSample = std::size_t{1} << 17;
// As many pixels of independent rounds are added to those that show the noise of blur: some 35
// discs.
constexpr double kPixelsOfDoubt = 1000;

}  // namespace

NoiseSample SampleNoise(const ImageSums& sums) {
  NoiseSample sample;
  const ImageSums::Whole& whole = sums.whole();
  if (whole.passes < 2) return sample;
  const ImageSums::Columns& columns = whole.columns;
  const double even = whole.weights.even;
  const double odd = whole.weights.odd;
  const double all = whole.weights.all();
  sample.stride = std::max<std::size_t>(1, columns.pixels() / kPixelSample);
  std::vector<double> luminances(columns.pixels() / sample.stride);
  sample.pixels.reserve(luminances.size());
  for (std::size_t i = 0; i < luminances.size(); ++i) {
    // One pixel in each run of them, at places that follow no grid of rows and columns.
    const std::size_t pixel =
        i * sample.stride + static_cast<std::uint32_t>(i * 0x9E3779B9U) % sample.stride;
    luminances[i] = WorkingLuminance(sums.RadianceAt(pixel)) / all;
    if (!(luminances[i] > 0)) continue;
    const auto sum = [&](const auto& column) {
      return WorkingLuminance(static_cast<double>(column[0][pixel]),
                              static_cast<double>(column[1][pixel]),
                              static_cast<double>(column[2][pixel]));
    };
    const double photons = sum(columns.radiance);
    const double difference =
        sum(columns.half_difference) - static_cast<double>(columns.direct_difference[pixel]);
    const double halves = 0.5 * (photons + difference) / even - 0.5 * (photons - difference) / odd;
    sample.pixels.push_back({.index = pixel,
                             .luminance = luminances[i],
                             .noise = halves * halves * (even * odd / (all * all))});
  }
  sample.floor = RelativeErrorFloor(luminances);
  return sample;
}

double PhotonNoiseShare(const ImageSums& sums, const NoiseSample& sample) {
  const ImageSums::Whole& whole = sums.whole();
  double by_halves = 0;
  double by_passes = 0;
  for (const NoiseSample::Pixel& pixel : sample.pixels) {
    by_halves += RelativeSquare(pixel.noise, pixel.luminance, sample.floor);
    by_passes += RelativeSquare(whole.columns.squared_deviations[pixel.index], pixel.luminance,
                                sample.floor);
  }
  if (!(by_passes > 0)) return 1;
  // To the squared noise of the mean of all passes.
  by_passes /= whole.weights.all() * static_cast<double>(whole.passes - 1);
  return std::min(1.0, by_halves / by_passes);
}

double BlurNoiseShare(const ImageSums& sums, const NoiseSample& sample) {
  const ImageSums::Whole& whole = sums.whole();
  const auto rounds = static_cast<double>(RoundsUntil(whole.passes));
  const double all = whole.weights.all();
  double by_halves = 0;
  double by_rounds = 0;
  for (const NoiseSample::Pixel& pixel : sample.pixels) {
    const double even = static_cast<double>(whole.columns.even_bias[pixel.index]);
    const double odd = static_cast<double>(whole.columns.odd_bias[pixel.index]);
    const double mean = (even + odd) / all;
    const double difference = even / whole.weights.even - odd / whole.weights.odd;
    by_halves += RelativeSquare(difference * difference, pixel.luminance, sample.floor);
    by_rounds +=
        RelativeSquare(std::max(whole.columns.bias_squares[pixel.index] / all - mean * mean, 0.0),
                       pixel.luminance, sample.floor);
  }
  if (!(by_rounds > 0)) return 1;
  // To squared noises of the mean of all passes.
  by_halves *= whole.weights.even * whole.weights.odd / (all * all);
  by_rounds /= rounds - 1;
  const double doubt = kPixelsOfDoubt / static_cast<double>(sample.pixels.size() * sample.stride);
  return std::min(1.0, (by_halves / by_rounds + doubt) / (1 + doubt));
}

}  // namespace lucerna
