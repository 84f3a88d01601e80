#include "render/estimate/photon_steps.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "render/base/status.h"
#include "render/estimate/relative_error.h"

namespace lucerna {
namespace {

// Processor time, in photon rays, of an eye path with its direct light and of its part in the sums
// of the pass; of each of its rays; and of a photon that a hitpoint gathers. Fitted to the scenes
// of tests/scenes (docs/measurements/photons-a-pass.md): the ratio of the costs of eye paths and
// photons, which goes from 0.5 to 4.6 there, follows within 22 % (root mean square).
constexpr double kEyePathCost = 3;
constexpr double kEyeRayCost = 0.75;
constexpr double kPairCost = 0.1;

// Of fewer photons found for each pixel, over all passes, variances tell nothing, if they bring
// such a share of the light.
constexpr double kFewestFound = 1;
constexpr double kShareThatCounts = 0.1;

// Photons that vary so many times less than independent ones are spaced by low discrepancy.
constexpr double kEvenlySpaced = 1.25;

// Squares of what a float holds may not fit in one.
float Held(double value) {
  return static_cast<float>(
      std::min(value, static_cast<double>(std::numeric_limits<float>::max())));
}

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

bool PassVariance::IsStarved(const ImageSums& sums) {
  double found = 0;
  double photons = 0;
  double all = 0;
  for (std::size_t i = 0; i < sums.pixels(); ++i) {
    const ImageSums::Pixel pixel = sums.At(i);
    found += pixel.photon_count;
    photons += WorkingLuminance(pixel.photons);
    all += WorkingLuminance(pixel.radiance());
  }
  return found < kFewestFound * static_cast<double>(sums.pixels()) &&
         photons > kShareThatCounts * all;
}

void PassVariance::Add(const SliceSums& pass, const ImageSums& before) {
  LUCERNA_CHECK(pass.passes == (PassRange{before.passes(), before.passes() + 1}) &&
                pass.pixels() == pixels_.size() && before.pixels() == pixels_.size());
  const double weight = before.weights().all();
  const auto add = [](float& sum, double value) { sum = Held(static_cast<double>(sum) + value); };
  for (std::size_t i = 0; i < pixels_.size(); ++i) {
    const auto at = [&](std::size_t column) { return static_cast<double>(pass.At(column, i)); };
    const double photons =
        WorkingLuminance(at(kPhotonRadiance), at(kPhotonRadiance + 1), at(kPhotonRadiance + 2));
    if (weight > 0) {
      add(pixels_[i].deviations,
          DeviationBetween(weight, WorkingLuminance(before.At(i).photons), 1, photons));
    }
    if (before.passes() % 2 == 0) add(pixels_[i].even, photons);
    if (HasFeatures(pass.passes))
      add(pixels_[i].of_paths, at(pass.first_feature() + kPathVariance));
  }
}

void PassVariance::Discount(double factor) {
  if (factor == 1) return;
  for (Pixel& pixel : pixels_) {
    pixel.even = Held(factor * static_cast<double>(pixel.even));
    pixel.deviations = Held(factor * static_cast<double>(pixel.deviations));
  }
}

std::vector<PassVariance::Variances> PassVariance::OfPixels(const ImageSums& sums,
                                                            double kernel_noise) const {
  LUCERNA_CHECK(sums.passes() >= 2 && sums.whole_passes() == sums.passes() &&
                sums.pixels() == pixels_.size());
  const auto passes = static_cast<double>(sums.passes());
  const PassWeights weights = sums.weights();
  const double weight_of_all = weights.all();
  double floor = 0;
  {
    std::vector<double> luminances;
    luminances.reserve(pixels_.size());
    for (std::size_t i = 0; i < pixels_.size(); ++i)
      luminances.push_back(WorkingLuminance(sums.RadianceAt(i)) / weight_of_all);
    floor = RelativeErrorFloor(luminances);
  }
  if (!(floor > 0)) return {};

  std::vector<Variances> variances;
  variances.reserve(pixels_.size());
  // From the squared difference of the halves' means to the variance of a pass. Of direct light all
  // passes weigh the same.
  const PassWeights counts = WeightsOf({0, sums.passes()});
  const double halves = counts.even * counts.odd / passes;
  for (std::size_t i = 0; i < pixels_.size(); ++i) {
    const ImageSums::Pixel pixel = sums.At(i);
    const double sum = WorkingLuminance(pixel.radiance());
    const double photon_sum = WorkingLuminance(pixel.photons);
    const double weight = 1 / (sum / weight_of_all * (sum / weight_of_all) + floor);
    const auto difference = [&](double of_all, double even) {
      return even / weights.even - (of_all - even) / weights.odd;
    };
    const double all = difference(sum, 0.5 * (sum + WorkingLuminance(pixel.half_difference)));
    const double of_photons = difference(photon_sum, static_cast<double>(pixels_[i].even));
    const double photons = photon_sum / weight_of_all;
    const double count = pixel.photon_count;
    variances.push_back(
        {.all = Held(weight * pixel.squared_deviations / (passes - 1)),
         .halves = Held(weight * all * all * weights.even * weights.odd / weight_of_all),
         .photons = Held(weight * static_cast<double>(pixels_[i].deviations) / (passes - 1)),
         .photons_found =
             count > 0 ? Held(weight * photons * photons * kernel_noise * weight_of_all / count)
                       : 0,
         // N equals whose squares are expected to be k times that of their mean: of the square of
         // their sum N k of N k + N (N - 1).
         .independent = count > 0 ? Held(weight * photons * photons * kernel_noise * weight_of_all /
                                         (count + kernel_noise - 1))
                                  : 0,
         .eye_paths = Held(weight * (all * all - of_photons * of_photons) * halves)});
  }
  return variances;
}

namespace {

// Weights follow from photons, whose variance per weight they make even. Eye paths scatter alike in
// every pass, so that of passes that weigh little they say too little.
double EyePathsPerDeviation(const ImageSums& sums) {
  const PassWeights weights = sums.weights();
  return (static_cast<double>(sums.passes()) - 1) /
         (weights.all() - weights.squares / weights.all());
}

}  // namespace

std::vector<float> PassVariance::OfEyePaths(const ImageSums& sums) const {
  const double weight = sums.weights().all();
  std::vector<double> luminances;
  luminances.reserve(pixels_.size());
  for (std::size_t i = 0; i < pixels_.size(); ++i)
    luminances.push_back(WorkingLuminance(sums.RadianceAt(i)) / weight);
  const double floor = RelativeErrorFloor(luminances);
  if (!(floor > 0)) return {};
  std::vector<float> of_pixels;
  of_pixels.reserve(pixels_.size());
  for (std::size_t i = 0; i < pixels_.size(); ++i) {
    of_pixels.push_back(Held(static_cast<double>(pixels_[i].of_paths) / kComparisonsOfPixel /
                             (luminances[i] * luminances[i] + floor)));
  }
  return of_pixels;
}

PassVariance::Parts PassVariance::Split(const ImageSums& sums, double kernel_noise) const {
  std::vector<Variances> variances = OfPixels(sums, kernel_noise);
  if (variances.empty()) return {};
  const std::size_t kept = KeptPixels(variances.size());
  std::ranges::nth_element(variances, variances.begin() + static_cast<std::ptrdiff_t>(kept) - 1, {},
                           &Variances::all);
  const auto mean = [&](float Variances::*of) {
    double sum = 0;
    for (std::size_t i = 0; i < kept; ++i)
      sum += static_cast<double>(variances[i].*of);
    return sum / static_cast<double>(kept);
  };
  // What photons brought varies by their number, and by where eye paths end. Photons that arrive
  // one by one as equals explain the first part; more than there is where many pixels have found
  // hardly any, or where low discrepancy spaces them evenly.
  const double all_photons = mean(&Variances::photons);
  const double photons = std::min(mean(&Variances::photons_found), all_photons);
  return {.photons = photons,
          .eye_paths = std::max(0.0, mean(&Variances::eye_paths)) +
                       EyePathsPerDeviation(sums) * (all_photons - photons),
          .is_evenly_spaced = mean(&Variances::independent) > kEvenlySpaced * all_photons,
          .deviations = mean(&Variances::all),
          .halves = mean(&Variances::halves)};
}

PassVariance::Costs PassVariance::CostsOf(const ImageSums& sums) {
  const BatchTally tally = sums.tally();
  return {.photons = static_cast<double>(tally.rays) + kPairCost * static_cast<double>(tally.pairs),
          .eye_paths = kEyePathCost * static_cast<double>(sums.passes()) *
                           static_cast<double>(sums.pixels()) +
                       kEyeRayCost * static_cast<double>(sums.eye_rays()),
          .gathering = kPairCost * static_cast<double>(tally.pairs)};
}

double PassVariance::BestPhotons(const ImageSums& sums, double kernel_noise) const {
  if (IsStarved(sums)) return std::numeric_limits<double>::infinity();
  const Parts variance = Split(sums, kernel_noise);
  if (!(variance.photons > 0)) return 0;
  const double weight = sums.weights().all();
  const double present = static_cast<double>(sums.tally().photons) / weight;
  if (variance.is_evenly_spaced) return present;
  if (!(variance.eye_paths > 0)) return std::numeric_limits<double>::infinity();
  const Costs costs = CostsOf(sums);
  const double eye_paths = costs.eye_paths / static_cast<double>(sums.passes());
  const double photons = costs.photons / weight;
  return present * std::sqrt(variance.photons * eye_paths / (variance.eye_paths * photons));
}

std::uint64_t NextPhotons(std::uint64_t present, std::uint64_t most, double best) {
  std::uint64_t next = present;
  // Between a number and twice as many lies the one from which twice as many are better.
  while (2 * next <= most && best >= std::numbers::sqrt2 * static_cast<double>(next))
    next *= 2;
  return next;
}

}  // namespace lucerna
