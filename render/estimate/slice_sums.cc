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

// Adds the rows [begin, end) of a sibling.
void AddSibling(SliceSums& sum, const SliceSums& sibling, std::size_t begin, std::size_t end) {
  const auto bits = [&](std::size_t column) {
    return SignificantBits(2 * sum.passes.size(), column, sum.evidence);
  };
  const auto half = static_cast<double>(sum.passes.size());
  // Before the radiance is added up.
  float* const deviations = sum.columns[kSquaredDeviations].data();
  const float* const their_deviations = sibling.columns[kSquaredDeviations].data();
  const Luminances luminances(sum);
  const Luminances their_luminances(sibling);
  for (std::size_t pixel = begin; pixel < end; ++pixel) {
    deviations[pixel] = Rounded(
        static_cast<double>(deviations[pixel]) + static_cast<double>(their_deviations[pixel]) +
            DeviationBetween(half, luminances[pixel], half, their_luminances[pixel]),
        bits(kSquaredDeviations));
  }
  const auto add = [](float ours, float theirs) {
    constexpr auto kLargest = static_cast<float>(kLargestSum);
    return std::clamp(ours + theirs, -kLargest, kLargest);
  };
  for (std::size_t column = kDirectRadiance; column < sum.columns.size(); ++column) {
    if (column == kSquaredDeviations || column == kLargestLuminance) continue;
    float* const ours = sum.columns[column].data();
    const float* const theirs = sibling.columns[column].data();
    const unsigned int dropped = DroppedBits(bits(column));
    for (std::size_t pixel = begin; pixel < end; ++pixel)
      ours[pixel] = RoundedFloat(add(ours[pixel], theirs[pixel]), dropped);
  }
  // After their number.
  static_assert(kPhotonRadiance == 0 && kDirectRadiance == 3);
  const PhotonRounding rounded({std::min(sum.passes.first, sibling.passes.first),
                                std::max(sum.passes.last, sibling.passes.last)});
  const float* const counts = sum.columns[kPhotonCount].data();
  std::array<float*, 3> ours{};
  std::array<const float*, 3> theirs{};
  for (std::size_t c = 0; c < 3; ++c) {
    ours[c] = sum.columns[c].data();
    theirs[c] = sibling.columns[c].data();
  }
  for (std::size_t pixel = begin; pixel < end; ++pixel) {
    std::array<float, 3> rgb{};
    for (std::size_t c = 0; c < 3; ++c)
      rgb[c] = add(ours[c][pixel], theirs[c][pixel]);
    rgb = rounded(pixel, counts[pixel], rgb);
    for (std::size_t c = 0; c < 3; ++c)
      ours[c][pixel] = rgb[c];
  }
  float* const largest = sum.columns[kLargestLuminance].data();
  const float* const their_largest = sibling.columns[kLargestLuminance].data();
  for (std::size_t pixel = begin; pixel < end; ++pixel)
    largest[pixel] = std::max(largest[pixel], their_largest[pixel]);
}

}  // namespace

SliceSums EmptySlice(const PassRange& passes, std::size_t pixels, std::size_t evidence) {
  SliceSums sums;
  sums.passes = passes;
  sums.evidence = evidence;
  sums.columns.assign(ColumnsOf(passes, evidence), std::vector<float>(pixels));
  return sums;
}

void SetWhatFollowsFromRadiance(SliceSums& slice) {
  SetWhatFollowsFromRadiance(slice, 0, slice.pixels());
}

void SetWhatFollowsFromRadiance(SliceSums& slice, std::size_t begin, std::size_t end) {
  LUCERNA_CHECK(slice.passes.size() == 1 && end <= slice.pixels());
  const double half = slice.passes.first % 2 == 0 ? 1 : -1;
  const auto bits = [&](std::size_t column) { return SignificantBits(1, column, slice.evidence); };
  for (std::size_t c = 0; c < 3; ++c) {
    const float* const photons = slice.columns[kPhotonRadiance + c].data();
    const float* const direct = slice.columns[kDirectRadiance + c].data();
    float* const half_difference = slice.columns[kHalfDifference + c].data();
    for (std::size_t pixel = begin; pixel < end; ++pixel) {
      half_difference[pixel] =
          Rounded(half * (static_cast<double>(photons[pixel]) + static_cast<double>(direct[pixel])),
                  bits(kHalfDifference));
    }
  }
  float* const deviations = slice.columns[kSquaredDeviations].data();
  std::fill(deviations + begin, deviations + end, 0.0F);
  const Luminances luminances(slice);
  float* const largest = slice.columns[kLargestLuminance].data();
  for (std::size_t pixel = begin; pixel < end; ++pixel)
    largest[pixel] = Rounded(std::max(0.0, luminances[pixel]), bits(kLargestLuminance));
}

Status MergeSibling(SliceSums& sum, const SliceSums& sibling, ThreadTeam* team) {
  if (sibling.passes != SiblingOf(sum.passes) || sibling.columns.size() != sum.columns.size() ||
      sibling.pixels() != sum.pixels() || sibling.evidence != sum.evidence) {
    return absl::InvalidArgumentError("two slices do not make a larger one");
  }
  if (!sum.tally.Fits(sibling.tally)) {
    return absl::OutOfRangeError("the tally of a slice would not fit in 64 bits");
  }
  const PassRange together = {std::min(sum.passes.first, sibling.passes.first),
                              std::max(sum.passes.last, sibling.passes.last)};
  const auto add = [&](std::size_t begin, std::size_t end) {
    AddSibling(sum, sibling, begin, end);
  };
  constexpr std::size_t kPixelsAtOnce = 4096;
  if (team != nullptr) {
    team->For(sum.pixels(), kPixelsAtOnce, add);
  } else {
    add(0, sum.pixels());
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
