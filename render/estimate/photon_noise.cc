#include "render/estimate/photon_noise.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "render/estimate/relative_error.h"

namespace lucerna {
namespace {

constexpr std::size_t kPixelSample = std::size_t{1} << 17;

// One pixel in each run of them, at places that follow no grid of rows and columns.
std::vector<std::size_t> SamplePixels(std::size_t pixels) {
  const std::size_t run = std::max<std::size_t>(1, pixels / kPixelSample);
  std::vector<std::size_t> sample(pixels / run);
  for (std::size_t i = 0; i < sample.size(); ++i)
    sample[i] = i * run + static_cast<std::uint32_t>(i * 0x9E3779B9U) % run;
  return sample;
}

}  // namespace

double PhotonNoiseShare(const ImageSums& sums) {
  const ImageSums::Whole& whole = sums.whole();
  if (whole.passes < 2) return 1;
  const ImageSums::Columns& columns = whole.columns;
  const double even = whole.weights.even;
  const double odd = whole.weights.odd;
  const double all = whole.weights.all();
  const std::vector<std::size_t> sample = SamplePixels(columns.pixels());
  std::vector<double> luminances(sample.size());
  for (std::size_t i = 0; i < sample.size(); ++i)
    luminances[i] = WorkingLuminance(sums.RadianceAt(sample[i])) / all;
  const double floor = RelativeErrorFloor(luminances);

  double by_halves = 0;
  double by_passes = 0;
  for (std::size_t i = 0; i < sample.size(); ++i) {
    if (!(luminances[i] > 0)) continue;
    const auto sum = [&](const auto& column) {
      return WorkingLuminance(static_cast<double>(column[0][sample[i]]),
                              static_cast<double>(column[1][sample[i]]),
                              static_cast<double>(column[2][sample[i]]));
    };
    const double photons = sum(columns.radiance);
    const double difference =
        sum(columns.half_difference) - static_cast<double>(columns.direct_difference[sample[i]]);
    const double halves = 0.5 * (photons + difference) / even - 0.5 * (photons - difference) / odd;
    by_halves += RelativeSquare(halves * halves, luminances[i], floor);
    by_passes += RelativeSquare(columns.squared_deviations[sample[i]], luminances[i], floor);
  }
  if (!(by_passes > 0)) return 1;
  // To squared noises of the mean of all passes.
  by_halves *= even * odd / (all * all);
  by_passes /= all * static_cast<double>(whole.passes - 1);
  return std::min(1.0, by_halves / by_passes);
}

}  // namespace lucerna
