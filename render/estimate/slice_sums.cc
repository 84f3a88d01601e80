#include "render/estimate/slice_sums.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "render/math/color_space.h"

namespace lucerna {
namespace {

float RoundedFloat(float value, unsigned int dropped_bits) {
  const std::uint32_t bits = std::bit_cast<std::uint32_t>(value);
  const std::uint32_t mask = (std::uint32_t{1} << dropped_bits) - 1;
  // Half of the last bit kept, less one where that bit is even: ties go to even.
  const std::uint32_t half = (mask >> 1) + ((bits >> dropped_bits) & 1);
  return std::bit_cast<float>((bits + half) & ~mask);
}

unsigned int DroppedBits(Precision precision) {
  return 24U - static_cast<unsigned int>(precision);
}

// The working space's luminance of each channel.
constexpr std::array<double, 3> kLuminanceOfChannel = [] {
  constexpr std::array<double, 3> kRec709 = {0.2126, 0.7152, 0.0722};
  std::array<double, 3> weights{};
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t row = 0; row < 3; ++row)
      weights[c] += kRec709[row] * kRec709FromWorking[row][c];
  }
  return weights;
}();

double LuminanceSum(const SliceSums& sums, std::size_t pixel) {
  const auto channel = [&](std::size_t c) {
    return static_cast<double>(sums.At(kPhotonRadiance + c, pixel)) +
           static_cast<double>(sums.At(kDirectRadiance + c, pixel));
  };
  return WorkingLuminance(channel(0), channel(1), channel(2));
}

}  // namespace

Precision PrecisionOf(std::size_t column, std::size_t evidence) {
  const bool is_statistic =
      column >= kSquaredDeviations && column < kSliceColumns + evidence && column != kPhotonCount;
  return is_statistic ? Precision::kStatistic : Precision::kRadiance;
}

float Rounded(double value, Precision precision) {
  // The largest float of any precision here, so that rounding up stays finite.
  constexpr double kLargest = 0x1.fep127;
  const auto held = static_cast<float>(std::clamp(value, -kLargest, kLargest));
  return RoundedFloat(held, DroppedBits(precision));
}

SliceSums EmptySlice(const PassRange& passes, std::size_t pixels, std::size_t evidence) {
  SliceSums sums;
  sums.passes = passes;
  sums.evidence = evidence;
  sums.columns.assign(ColumnsOf(passes, evidence), std::vector<float>(pixels));
  return sums;
}

double WorkingLuminance(double r, double g, double b) {
  return kLuminanceOfChannel[0] * r + kLuminanceOfChannel[1] * g + kLuminanceOfChannel[2] * b;
}

double DeviationBetween(double n, double sum_n, double m, double sum_m) {
  const double difference = sum_n / n - sum_m / m;
  return difference * difference * n * m / (n + m);
}

void SetWhatFollowsFromRadiance(SliceSums& slice) {
  LUCERNA_CHECK(slice.passes.size() == 1);
  const std::size_t pixels = slice.pixels();
  const double half = slice.passes.first % 2 == 0 ? 1 : -1;
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
      const double radiance = static_cast<double>(slice.columns[kPhotonRadiance + c][pixel]) +
                              static_cast<double>(slice.columns[kDirectRadiance + c][pixel]);
      slice.columns[kHalfDifference + c][pixel] = Rounded(half * radiance, Precision::kRadiance);
    }
  }
  std::ranges::fill(slice.columns[kSquaredDeviations], 0.0F);
  for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
    slice.columns[kLargestLuminance][pixel] =
        Rounded(std::max(0.0, LuminanceSum(slice, pixel)), Precision::kStatistic);
  }
}

Status MergeSibling(SliceSums& sum, const SliceSums& sibling) {
  if (sibling.passes != SiblingOf(sum.passes) || sibling.columns.size() != sum.columns.size() ||
      sibling.pixels() != sum.pixels() || sibling.evidence != sum.evidence) {
    return absl::InvalidArgumentError("two slices do not make a larger one");
  }
  if (!sum.tally.Fits(sibling.tally)) {
    return absl::OutOfRangeError("the tally of a slice would not fit in 64 bits");
  }
  const std::size_t pixels = sum.pixels();
  const auto half = static_cast<double>(sum.passes.size());
  // Before the radiance is added up.
  std::vector<float>& deviations = sum.columns[kSquaredDeviations];
  for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
    const double one = LuminanceSum(sum, pixel);
    const double other = LuminanceSum(sibling, pixel);
    deviations[pixel] = Rounded(static_cast<double>(deviations[pixel]) +
                                    static_cast<double>(sibling.At(kSquaredDeviations, pixel)) +
                                    DeviationBetween(half, one, half, other),
                                Precision::kStatistic);
  }
  for (std::size_t column = 0; column < sum.columns.size(); ++column) {
    if (column == kSquaredDeviations) continue;
    float* const ours = sum.columns[column].data();
    const float* const theirs = sibling.columns[column].data();
    if (column == kLargestLuminance) {
      for (std::size_t pixel = 0; pixel < pixels; ++pixel)
        ours[pixel] = std::max(ours[pixel], theirs[pixel]);
      continue;
    }
    constexpr float kLargest = 0x1.fep127F;
    const unsigned int dropped = DroppedBits(PrecisionOf(column, sum.evidence));
    for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
      ours[pixel] =
          RoundedFloat(std::clamp(ours[pixel] + theirs[pixel], -kLargest, kLargest), dropped);
    }
  }
  sum.tally += sibling.tally;
  sum.eye_rays += sibling.eye_rays;
  sum.passes = {std::min(sum.passes.first, sibling.passes.first),
                std::max(sum.passes.last, sibling.passes.last)};
  std::vector<PhotonKey>& dropped = sum.dropped_photons;
  dropped.insert(dropped.end(), sibling.dropped_photons.begin(), sibling.dropped_photons.end());
  std::ranges::sort(dropped);
  if (dropped.size() > kDroppedNamed) dropped.resize(kDroppedNamed);
  return absl::OkStatus();
}

}  // namespace lucerna
