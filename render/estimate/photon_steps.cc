#include "render/estimate/photon_steps.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "render/base/status.h"
#include "render/estimate/relative_error.h"

namespace lucerna {
namespace {

// What an eye path with its direct light costs over what a photon path with its gathering does,
// on scenes of the project. It must not be measured in a job, or images would depend on machines.
constexpr double kEyePathCost = 2.0 / 3;
// A pixel that varies more than this is one that rare light has met, and says nothing of the
// others.
constexpr double kLargestVariance = 4;

}  // namespace

std::uint64_t PhotonsOf(const PhotonSteps& steps, std::uint64_t pass) {
  LUCERNA_CHECK(!steps.empty() && steps.front().first_pass == 0);
  std::uint64_t photons = 0;
  for (const PhotonStep& step : steps) {
    if (step.first_pass <= pass) photons = step.photons_per_pass;
  }
  return photons;
}

std::uint64_t PassesFor(const PhotonSteps& steps, std::uint64_t photons) {
  LUCERNA_CHECK(!steps.empty() && steps.front().first_pass == 0);
  std::uint64_t left = photons;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const std::uint64_t each = steps[i].photons_per_pass;
    const std::uint64_t passes = left / each + (left % each != 0 ? 1 : 0);
    if (i + 1 == steps.size() || passes <= steps[i + 1].first_pass - steps[i].first_pass) {
      return steps[i].first_pass + passes;
    }
    left -= each * (steps[i + 1].first_pass - steps[i].first_pass);
  }
  return 0;
}

VarianceSplit SplitVariance(const ImageSums& sums, double kernel_noise) {
  const auto passes = static_cast<double>(sums.passes());
  const std::size_t pixels = sums.pixels();
  std::vector<double> luminances(pixels);
  const auto luminance_of = [](const RgbSum& c) { return WorkingLuminance(c[0], c[1], c[2]); };
  for (std::size_t pixel = 0; pixel < pixels; ++pixel)
    luminances[pixel] = luminance_of(sums.At(pixel).radiance()) / passes;
  const double floor = RelativeErrorFloor(luminances);
  VarianceSplit split;
  if (!(floor > 0)) return split;
  for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
    const ImageSums::Pixel of_pixel = sums.At(pixel);
    const double weight = 1 / (luminances[pixel] * luminances[pixel] + floor);
    const double total =
        std::min(kLargestVariance, weight * of_pixel.squared_deviations / (passes - 1));
    split.total += total;
    if (!(of_pixel.photon_count > 0)) continue;
    const double of_photons = luminance_of(of_pixel.photons) / passes;
    split.photons += std::min(
        total, weight * of_photons * of_photons * kernel_noise * passes / of_pixel.photon_count);
  }
  split.total /= static_cast<double>(pixels);
  split.photons /= static_cast<double>(pixels);
  return split;
}

double BestPhotonFactor(const VarianceSplit& split, double photons_per_pixel) {
  const double eye = split.total - split.photons;
  if (!(split.photons > 0)) return 0;
  if (!(eye > 0)) return std::numeric_limits<double>::infinity();
  return std::sqrt(split.photons * kEyePathCost / (eye * photons_per_pixel));
}

}  // namespace lucerna
