#include "render/estimate/eye_path_counts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "render/base/status.h"
#include "render/estimate/image_tiles.h"
#include "render/estimate/relative_error.h"

namespace lucerna {
namespace {

// A pixel's variance is that of so many around it: two comparisons of two paths say little of it.
constexpr std::size_t kReach = 3;
// Beside its first path a pixel has none or a power of two, so that those of one pass are a part of
// a Sobol' sequence that is spread evenly by itself.
constexpr std::array kCounts = {1, 2, 3, 5, 9};
static_assert(kCounts.back() == kMostEyePaths);
// Paths beside the first ones, in the mean of the pixels: memory of a pass grows with them.
constexpr double kMostMore = 2;
// Scales of the numbers are looked at in such steps, from the one that leaves all at 1 on.
constexpr double kScaleStep = std::numbers::sqrt2;
constexpr int kScales = 24;
// Of so many pixels at most, evenly spaced, the sums are taken that decide.
constexpr std::size_t kSample = 65536;
// Smaller gains are not worth the memory.
constexpr double kLeastGain = 0.03;
// The passes are to be for images of several times as many: bias is counted as if it did not fall
// until there are so many times as many, and what low discrepancy leaves of the variance of eye
// paths, over that of independent ones, with this power (it falls as a power of the passes).
constexpr double kLaterPasses = 8;
constexpr double kSpacing = 1.5;
// Less is not known after eight passes.
constexpr double kLeastLeft = 0.05;
// In half of these eight passes half of the pixels have two paths: paths of a pixel and pass, and
// their variance over that of one.
constexpr double kMeanPaths = 1.25;
constexpr double kMeanVariance = 0.875;

// The value that all but the pixels which errors leave out have at most.
float LargestKept(std::vector<float> values) {
  const auto kept = values.begin() + static_cast<std::ptrdiff_t>(KeptPixels(values.size())) - 1;
  std::ranges::nth_element(values, kept);
  return *kept;
}

// Means over (2 kReach + 1)² pixels, fewer at borders.
std::vector<float> Smoothed(const std::vector<float>& values, std::size_t width) {
  // Along lines of `length` values that are `step` apart.
  const auto along = [](const std::vector<float>& from, std::size_t lines, std::size_t line_step,
                        std::size_t length, std::size_t step) {
    std::vector<float> to(from.size());
    for (std::size_t line = 0; line < lines; ++line) {
      const auto index = [&](std::size_t i) { return line * line_step + i * step; };
      for (std::size_t i = 0; i < length; ++i) {
        const std::size_t first = i > kReach ? i - kReach : 0;
        const std::size_t last = std::min(length, i + kReach + 1);
        double sum = 0;
        for (std::size_t j = first; j < last; ++j)
          sum += static_cast<double>(from[index(j)]);
        to[index(i)] = static_cast<float>(sum / static_cast<double>(last - first));
      }
    }
    return to;
  };
  const std::size_t height = values.size() / width;
  return along(along(values, height, width, width, 1), width, 1, height, width);
}

// The number that is nearest to `wanted` as a ratio.
int CountFor(double wanted) {
  int count = kCounts.front();
  for (const int next : kCounts) {
    if (wanted * wanted > static_cast<double>(count) * next) count = next;
  }
  return count;
}

// The mean over the pixels of the squared relative bias, as far as it is more than chance: less a
// deviation.
double SquaredBias(const ImageSums& sums, std::size_t width) {
  const PassWeights weights = sums.weights();
  std::vector<double> luminances(sums.pixels());
  for (std::size_t i = 0; i < luminances.size(); ++i)
    luminances[i] = WorkingLuminance(sums.RadianceAt(i)) / weights.all();
  const double floor = RelativeErrorFloor(luminances);
  std::vector<float> sizes(luminances.size());
  std::vector<double> products(luminances.size());
  for (std::size_t i = 0; i < products.size(); ++i) {
    const ImageSums::Pixel pixel = sums.At(i);
    products[i] = RelativeSquare(pixel.even_bias / weights.even * pixel.odd_bias / weights.odd,
                                 luminances[i], floor);
    sizes[i] = static_cast<float>(std::abs(products[i]));
  }
  const auto largest = static_cast<double>(LargestKept(std::move(sizes)));
  const ImageTiles tiles(products.size(), width);
  std::vector<double> of_tiles(tiles.count());
  std::vector<bool> lit(tiles.count());
  for (std::size_t i = 0; i < products.size(); ++i) {
    of_tiles[tiles.Of(i)] += std::clamp(products[i], -largest, largest);
    if (luminances[i] > 0) lit[tiles.Of(i)] = true;
  }
  const auto lit_tiles = static_cast<double>(std::ranges::count(lit, true));
  if (lit_tiles < kFewestTiles) return 0;
  const SumOfTiles sum = SumTiles(of_tiles, lit_tiles);
  return std::max(0.0, sum.sum - sum.deviation) / static_cast<double>(products.size());
}

// Numbers of paths in proportion to the deviations of pixels.
struct Scaled {
  double scale = 0;
  double variance = 0, paths = 0;  // of a pixel and pass, as means over the image
};

// From one path each on to as many paths as there may be.
std::vector<Scaled> ScalesOf(const std::vector<float>& deviations) {
  const std::size_t step = 1 + deviations.size() / kSample;
  const auto with = [&](double scale) {
    Scaled scaled = {.scale = scale};
    double pixels = 0;
    for (std::size_t i = step / 2; i < deviations.size(); i += step) {
      const auto deviation = static_cast<double>(deviations[i]);
      const double count = CountFor(scale * deviation);
      scaled.variance += deviation * deviation / count;
      scaled.paths += count;
      ++pixels;
    }
    scaled.variance /= pixels;
    scaled.paths /= pixels;
    return scaled;
  };
  std::vector<Scaled> scales = {with(0)};
  const auto largest = static_cast<double>(std::ranges::max(deviations));
  if (!(largest > 0)) return scales;
  const double most = 1 + std::min(kMostMore, static_cast<double>(kMostMoreEyePaths) /
                                                  static_cast<double>(deviations.size()));
  for (int i = 1; i <= kScales; ++i) {
    const Scaled next = with(std::pow(kScaleStep, i) / largest);
    if (next.paths > most) break;
    scales.push_back(next);
  }
  return scales;
}

}  // namespace

Samples ChooseSamples(const PassVariance& variance, const ImageSums& sums, double kernel_noise,
                      std::uint64_t present, std::uint64_t most, std::size_t width) {
  LUCERNA_CHECK(sums.passes() == kEyePathsCompared);
  std::vector<float> deviations = variance.OfEyePaths(sums);
  if (deviations.empty()) return {present, nullptr};
  const float largest = LargestKept(deviations);
  for (float& of_pixel : deviations)
    of_pixel = std::min(of_pixel, largest);
  deviations = Smoothed(deviations, width);
  for (float& of_pixel : deviations)
    of_pixel = std::sqrt(of_pixel);
  const std::vector<Scaled> scales = ScalesOf(deviations);
  const double of_eye_paths = scales.front().variance;

  const PassVariance::Parts parts = variance.Split(sums, kernel_noise);
  const double of_photons =
      std::max(parts.deviations - kMeanVariance * of_eye_paths, parts.photons);
  const double left =
      of_eye_paths > 0
          ? std::pow(std::clamp((parts.halves - of_photons) / (kMeanVariance * of_eye_paths),
                                kLeastLeft, 1.0),
                     kSpacing)
          : 1;
  const auto passes = static_cast<double>(sums.passes());
  const double of_bias = kLaterPasses * passes * SquaredBias(sums, width);

  const PassVariance::Costs costs = PassVariance::CostsOf(sums);
  const double weight = sums.weights().all();
  const double eye_path_cost = costs.eye_paths / (passes * kMeanPaths);
  const double gathering_cost = costs.gathering / (weight * kMeanPaths);
  const double photon_cost = (costs.photons - costs.gathering) / weight;

  double least = HUGE_VAL;
  std::uint64_t photons = present;
  double scale = 0;
  std::uint64_t fewest = present;
  while (PassVariance::IsStarved(sums) && 2 * fewest <= most)
    fewest *= 2;
  for (std::uint64_t next = fewest; next <= most; next *= 2) {
    const double rise = static_cast<double>(next) / static_cast<double>(present);
    for (const Scaled& eye_paths : scales) {
      const double product =
          (of_photons / rise + left * eye_paths.variance + of_bias) *
          (rise * photon_cost + (rise * gathering_cost + eye_path_cost) * eye_paths.paths);
      if (product / (eye_paths.scale > 0 ? 1 - kLeastGain : 1) >= least) continue;
      least = product / (eye_paths.scale > 0 ? 1 - kLeastGain : 1);
      photons = next;
      scale = eye_paths.scale;
    }
    // With another number they would begin at another place of their sequence.
    if (parts.is_evenly_spaced) break;
  }
  if (scale == 0) return {photons, nullptr};
  EyePathCounts counts(deviations.size());
  std::ranges::transform(deviations, counts.begin(), [&](float deviation) {
    return static_cast<std::uint8_t>(CountFor(scale * static_cast<double>(deviation)));
  });
  return {photons, std::make_shared<const EyePathCounts>(std::move(counts))};
}

EyePathCounts ComparedEyePaths(std::size_t pixels, std::size_t width, std::uint64_t pass) {
  LUCERNA_CHECK(ComparesEyePaths(pass));
  EyePathCounts counts(pixels);
  for (std::size_t i = 0; i < pixels; ++i)
    counts[i] = static_cast<std::uint8_t>(1 + (i / width + i % width + pass / 2) % 2);
  return counts;
}

}  // namespace lucerna
