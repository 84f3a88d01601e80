#include "render/estimate/slice_sums.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "render/math/color_space.h"

namespace lucerna {
namespace {

// The luminances of the radiance of pixels.
class Luminances {
 public:
  explicit Luminances(const SliceSums& sums) {
    for (std::size_t c = 0; c < 6; ++c)
      columns_[c] = sums.columns[kPhotonRadiance + c].data();
  }
  double operator[](std::size_t pixel) const {
    const auto channel = [&](std::size_t c) {
      return static_cast<double>(columns_[c][pixel]) + static_cast<double>(columns_[c + 3][pixel]);
    };
    return WorkingLuminance(channel(0), channel(1), channel(2));
  }

 private:
  static_assert(kDirectRadiance == kPhotonRadiance + 3);
  std::array<const float*, 6> columns_{};
};

}  // namespace

SliceSums EmptySlice(const PassRange& passes, std::size_t pixels, std::size_t evidence) {
  SliceSums sums;
  sums.passes = passes;
  sums.evidence = evidence;
  sums.columns.assign(ColumnsOf(passes, evidence), std::vector<float>(pixels));
  return sums;
}

void SetWhatFollowsFromRadiance(SliceSums& slice) {
  LUCERNA_CHECK(slice.passes.size() == 1);
  const std::size_t pixels = slice.pixels();
  const double half = slice.passes.first % 2 == 0 ? 1 : -1;
  const auto bits = [&](std::size_t column) {
    return SignificantBits(slice.passes, column, slice.evidence);
  };
  for (std::size_t c = 0; c < 3; ++c) {
    const float* const photons = slice.columns[kPhotonRadiance + c].data();
    const float* const direct = slice.columns[kDirectRadiance + c].data();
    float* const half_difference = slice.columns[kHalfDifference + c].data();
    for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
      half_difference[pixel] =
          Rounded(half * (static_cast<double>(photons[pixel]) + static_cast<double>(direct[pixel])),
                  bits(kHalfDifference));
    }
  }
  std::ranges::fill(slice.columns[kSquaredDeviations], 0.0F);
  const Luminances luminances(slice);
  float* const largest = slice.columns[kLargestLuminance].data();
  for (std::size_t pixel = 0; pixel < pixels; ++pixel)
    largest[pixel] = Rounded(std::max(0.0, luminances[pixel]), bits(kLargestLuminance));
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
  const PassRange together = {std::min(sum.passes.first, sibling.passes.first),
                              std::max(sum.passes.last, sibling.passes.last)};
  const auto bits = [&](std::size_t column) {
    return SignificantBits(together, column, sum.evidence);
  };
  const auto half = static_cast<double>(sum.passes.size());
  // Before the radiance is added up.
  float* const deviations = sum.columns[kSquaredDeviations].data();
  const float* const their_deviations = sibling.columns[kSquaredDeviations].data();
  const Luminances luminances(sum);
  const Luminances their_luminances(sibling);
  for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
    deviations[pixel] = Rounded(
        static_cast<double>(deviations[pixel]) + static_cast<double>(their_deviations[pixel]) +
            DeviationBetween(half, luminances[pixel], half, their_luminances[pixel]),
        bits(kSquaredDeviations));
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
    constexpr auto kLargest = static_cast<float>(kLargestSum);
    const unsigned int dropped = DroppedBits(bits(column));
    for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
      ours[pixel] =
          RoundedFloat(std::clamp(ours[pixel] + theirs[pixel], -kLargest, kLargest), dropped);
    }
  }
  const bool is_first = sum.passes.first < sibling.passes.first;
  sum.reports.insert(is_first ? sum.reports.end() : sum.reports.begin(), sibling.reports.begin(),
                     sibling.reports.end());
  if (sum.reports.size() > kMostReports) sum.reports.resize(kMostReports);
  sum.tally += sibling.tally;
  sum.eye_rays += sibling.eye_rays;
  sum.passes = together;
  std::vector<PhotonKey>& dropped = sum.dropped_photons;
  dropped.insert(dropped.end(), sibling.dropped_photons.begin(), sibling.dropped_photons.end());
  std::ranges::sort(dropped);
  if (dropped.size() > kDroppedNamed) dropped.resize(kDroppedNamed);
  return absl::OkStatus();
}

}  // namespace lucerna
