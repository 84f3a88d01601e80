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

void PassVariance::Add(const SliceSums& pass) {
  LUCERNA_CHECK(pass.passes == (PassRange{sums_.passes, sums_.passes + 1}) &&
                pass.pixels() == sums_.pixels.size());
  const auto passes = static_cast<double>(sums_.passes);
  const auto add = [](float& sum, double value) { sum = Held(static_cast<double>(sum) + value); };
  for (std::size_t i = 0; i < sums_.pixels.size(); ++i) {
    const auto at = [&](std::size_t column) { return static_cast<double>(pass.At(column, i)); };
    const auto luminance = [&](std::size_t column) {
      return WorkingLuminance(at(column), at(column + 1), at(column + 2));
    };
    const double photons = luminance(kPhotonRadiance);
    const double direct = luminance(kDirectRadiance);
    Pixel& sum = sums_.pixels[i];
    if (sums_.passes > 0) {
      const auto before = static_cast<double>(sum.photons);
      add(sum.photon_deviations, DeviationBetween(passes, before, 1, photons));
      add(sum.deviations,
          DeviationBetween(passes, before + static_cast<double>(sum.direct), 1, photons + direct));
    }
    add(sum.photons, photons);
    add(sum.direct, direct);
    if (sums_.passes % 2 == 0) {
      add(sum.even_photons, photons);
      add(sum.even, photons + direct);
    }
    add(sum.count, at(kPhotonCount));
  }
  sums_.photons += pass.tally.photons;
  sums_.photon_rays += pass.tally.rays;
  sums_.pairs += pass.tally.pairs;
  sums_.eye_rays += pass.eye_rays;
  ++sums_.passes;
}

PassVariance::Parts PassVariance::Split(double kernel_noise) const {
  LUCERNA_CHECK(sums_.passes >= 2);
  const auto passes = static_cast<double>(sums_.passes);
  const double even_passes = std::ceil(passes / 2);
  const double odd_passes = passes - even_passes;
  const auto sum_of = [](const Pixel& pixel) {
    return static_cast<double>(pixel.photons) + static_cast<double>(pixel.direct);
  };
  std::vector<double> luminances;
  luminances.reserve(sums_.pixels.size());
  for (const Pixel& pixel : sums_.pixels)
    luminances.push_back(sum_of(pixel) / passes);
  const double floor = RelativeErrorFloor(luminances);
  if (!(floor > 0)) return {};

  // Of one pixel, relative.
  struct Variances {
    double all = 0;            // of passes
    double photons = 0;        // of what photons brought
    double photons_found = 0;  // that the number of photons found explains
    double independent = 0;    // the same, without bias where few were found
    double eye_paths = 0;      // of halves, beyond what photons brought to them
  };
  std::vector<Variances> variances;
  variances.reserve(sums_.pixels.size());
  const double halves = even_passes * odd_passes / passes;
  for (std::size_t i = 0; i < sums_.pixels.size(); ++i) {
    const Pixel& pixel = sums_.pixels[i];
    const double weight = 1 / (luminances[i] * luminances[i] + floor);
    const auto difference = [&](double sum, double even) {
      return even / even_passes - (sum - even) / odd_passes;
    };
    const double all = difference(sum_of(pixel), static_cast<double>(pixel.even));
    const double of_photons =
        difference(static_cast<double>(pixel.photons), static_cast<double>(pixel.even_photons));
    const double photons = static_cast<double>(pixel.photons) / passes;
    const auto count = static_cast<double>(pixel.count);
    variances.push_back(
        {.all = weight * static_cast<double>(pixel.deviations) / (passes - 1),
         .photons = weight * static_cast<double>(pixel.photon_deviations) / (passes - 1),
         .photons_found =
             count > 0 ? weight * photons * photons * kernel_noise * passes / count : 0,
         // N equals whose squares are expected to be k times that of their mean: of the square of
         // their sum N k of N k + N (N - 1).
         .independent = count > 0 ? weight * photons * photons * kernel_noise * passes /
                                        (count + kernel_noise - 1)
                                  : 0,
         .eye_paths = weight * (all * all - of_photons * of_photons) * halves});
  }
  const std::size_t kept = KeptPixels(variances.size());
  std::ranges::nth_element(variances, variances.begin() + static_cast<std::ptrdiff_t>(kept) - 1, {},
                           &Variances::all);
  Variances mean;
  for (std::size_t i = 0; i < kept; ++i) {
    mean.photons += variances[i].photons / static_cast<double>(kept);
    mean.photons_found += variances[i].photons_found / static_cast<double>(kept);
    mean.independent += variances[i].independent / static_cast<double>(kept);
    mean.eye_paths += variances[i].eye_paths / static_cast<double>(kept);
  }
  // What photons brought varies by their number, and by where eye paths end. Photons that arrive
  // one by one as equals explain the first part; more than there is where many pixels have found
  // hardly any, or where low discrepancy spaces them evenly.
  const double photons = std::min(mean.photons_found, mean.photons);
  return {.photons = photons,
          .eye_paths = std::max(0.0, mean.eye_paths) + mean.photons - photons,
          .is_evenly_spaced = mean.independent > kEvenlySpaced * mean.photons};
}

PassVariance::Costs PassVariance::CostsSoFar() const {
  return {.photons =
              static_cast<double>(sums_.photon_rays) + kPairCost * static_cast<double>(sums_.pairs),
          .eye_paths = kEyePathCost * static_cast<double>(sums_.passes) *
                           static_cast<double>(sums_.pixels.size()) +
                       kEyeRayCost * static_cast<double>(sums_.eye_rays)};
}

bool PassVariance::IsStarved() const {
  double found = 0;
  double photons = 0;
  double all = 0;
  for (const Pixel& pixel : sums_.pixels) {
    found += static_cast<double>(pixel.count);
    photons += static_cast<double>(pixel.photons);
    all += static_cast<double>(pixel.photons) + static_cast<double>(pixel.direct);
  }
  return found < kFewestFound * static_cast<double>(sums_.pixels.size()) &&
         photons > kShareThatCounts * all;
}

double PassVariance::BestPhotons(double kernel_noise) const {
  if (IsStarved()) return std::numeric_limits<double>::infinity();
  const Parts variance = Split(kernel_noise);
  if (!(variance.photons > 0)) return 0;
  const double present = static_cast<double>(sums_.photons) / static_cast<double>(sums_.passes);
  if (variance.is_evenly_spaced) return present;
  if (!(variance.eye_paths > 0)) return std::numeric_limits<double>::infinity();
  const Costs costs = CostsSoFar();
  return present *
         std::sqrt(variance.photons * costs.eye_paths / (variance.eye_paths * costs.photons));
}

std::uint64_t NextPhotons(std::uint64_t present, std::uint64_t most, double best) {
  std::uint64_t next = present;
  // Between a number and twice as many lies the one from which twice as many are better.
  while (2 * next <= most && best >= std::numbers::sqrt2 * static_cast<double>(next))
    next *= 2;
  return next;
}

}  // namespace lucerna
