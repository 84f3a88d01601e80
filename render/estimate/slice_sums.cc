#include "render/estimate/slice_sums.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "render/math/color_space.h"

namespace lucerna {
namespace {

using Floats = std::array<float, kPixelsUnpacked>;

// The radiance of some pixels, by photons and without.
class Radiance {
 public:
  Radiance(const SliceSums& sums, std::size_t begin, std::size_t count) {
    for (std::size_t c = 0; c < columns_.size(); ++c)
      sums.columns[kPhotonRadiance + c].Read(begin, std::span(columns_[c]).first(count));
  }
  [[nodiscard]] double channel(std::size_t c, std::size_t i) const {
    return static_cast<double>(columns_[c][i]) + static_cast<double>(columns_[c + 3][i]);
  }
  [[nodiscard]] double luminance(std::size_t i) const {
    return WorkingLuminance(channel(0, i), channel(1, i), channel(2, i));
  }
  [[nodiscard]] double direct_luminance(std::size_t i) const {
    const auto direct = [&](std::size_t c) { return static_cast<double>(columns_[c + 3][i]); };
    return WorkingLuminance(direct(0), direct(1), direct(2));
  }
  [[nodiscard]] float by_photons(std::size_t c, std::size_t i) const { return columns_[c][i]; }

 private:
  static_assert(kDirectRadiance == kPhotonRadiance + 3);
  std::array<Floats, 6> columns_;
};

// Calls work(begin, count) for all pixels of [begin, end), a few at a time.
template <typename Work>
void ForEachFew(std::size_t begin, std::size_t end, const Work& work) {
  for (std::size_t first = begin; first < end; first += kPixelsUnpacked)
    work(first, std::min(kPixelsUnpacked, end - first));
}

float HeldSum(float one, float other) {
  constexpr auto kLargest = static_cast<float>(kLargestSum);
  return std::clamp(one + other, -kLargest, kLargest);
}

PassRange Together(const SliceSums& sum, const SliceSums& sibling) {
  return {std::min(sum.passes.first, sibling.passes.first),
          std::max(sum.passes.last, sibling.passes.last)};
}

// Columns up to here are of light, and are added together. All others are sums on their own.
constexpr std::size_t kLightColumns = kEvenBias;
static_assert(kPhotonRadiance < kLightColumns && kDirectRadiance < kLightColumns &&
              kHalfDifference < kSquaredDeviations && kSquaredDeviations < kLargestLuminance &&
              kLargestLuminance < kLightColumns && kLightColumns < kPhotonCount);

// Adds a few rows of a column that is none of light. `bits` are those of the sum.
void AddFew(PackedFloats& sum, const PackedFloats& theirs, unsigned int bits, std::size_t begin,
            std::size_t count) {
  Floats mine;
  Floats other;
  const std::span values = std::span(mine).first(count);
  sum.Read(begin, values);
  theirs.Read(begin, std::span(other).first(count));
  const unsigned int dropped = DroppedBits(bits);
  for (std::size_t i = 0; i < count; ++i)
    values[i] = RoundedFloat(HeldSum(values[i], other[i]), dropped);
  sum.Write(begin, values);
}

// Adds a few rows of a sibling's columns of light, after the number of its photons. `sum` has room
// for those of both together.
void AddLight(SliceSums& sum, const SliceSums& sibling, const PassRange& together,
              std::size_t begin, std::size_t count) {
  const auto half = static_cast<double>(sum.passes.size());
  // All that follows from the radiance before that is added up.
  const Radiance radiance(sum, begin, count);
  const Radiance their_radiance(sibling, begin, count);
  std::array<Floats, kLightColumns - kHalfDifference> ours;
  for (std::size_t column = kHalfDifference; column < kLightColumns; ++column)
    sum.Read(column, begin, std::span(ours[column - kHalfDifference]).first(count));
  Floats mine;
  Floats theirs;
  for (std::size_t column = kDirectRadiance; column < kLightColumns; ++column) {
    const unsigned int bits = SignificantBits(together.size(), column, sum.evidence);
    const std::span their_values = std::span(theirs).first(count);
    sibling.Read(column, begin, their_values);
    const bool is_read = column >= kHalfDifference;
    const std::span values =
        std::span(is_read ? ours[column - kHalfDifference] : mine).first(count);
    if (!is_read) sum.columns[column].Read(begin, values);
    if (column == kSquaredDeviations) {
      for (std::size_t i = 0; i < count; ++i) {
        values[i] = Rounded(
            static_cast<double>(values[i]) + static_cast<double>(their_values[i]) +
                DeviationBetween(half, radiance.luminance(i), half, their_radiance.luminance(i)),
            bits);
      }
    } else if (column == kLargestLuminance) {
      for (std::size_t i = 0; i < count; ++i)
        values[i] = std::max(values[i], their_values[i]);
    } else {
      const unsigned int dropped = DroppedBits(bits);
      for (std::size_t i = 0; i < count; ++i)
        values[i] = RoundedFloat(HeldSum(values[i], their_values[i]), dropped);
    }
    sum.columns[column].Write(begin, values);
  }
  static_assert(kPhotonRadiance == 0 && kDirectRadiance == 3);
  const PhotonRounding rounded(together);
  const std::span counts = std::span(mine).first(count);
  sum.columns[kPhotonCount].Read(begin, counts);
  for (std::size_t i = 0; i < count; ++i) {
    std::array<float, 3> rgb{};
    for (std::size_t c = 0; c < 3; ++c)
      rgb[c] = HeldSum(radiance.by_photons(c, i), their_radiance.by_photons(c, i));
    rgb = rounded(begin + i, counts[i], rgb);
    for (std::size_t c = 0; c < 3; ++c)
      sum.columns[c].Set(begin + i, rgb[c]);
  }
}

Status CheckSibling(const SliceSums& sum, const SliceSums& sibling, std::size_t pixels,
                    std::size_t columns) {
  if (sibling.passes != SiblingOf(sum.passes) || columns != sum.columns.size() ||
      pixels != sum.pixels() || sibling.evidence != sum.evidence) {
    return absl::InvalidArgumentError("two slices do not make a larger one");
  }
  if (!sum.tally.Fits(sibling.tally)) {
    return absl::OutOfRangeError("the tally of a slice would not fit in 64 bits");
  }
  return absl::OkStatus();
}

// The columns that both together have and `sum` alone does not.
void MakeColumns(SliceSums& sum, const PassRange& together) {
  for (std::size_t column = 0; column < sum.columns.size(); ++column) {
    if (!FollowsFromRadiance(sum.passes, column)) continue;
    sum.columns[column] =
        PackedFloats(sum.pixels(), SignificantBits(together.size(), column, sum.evidence));
  }
}

// What is no column.
void AddRest(SliceSums& sum, const SliceSums& sibling) {
  const bool is_first = sum.passes.first < sibling.passes.first;
  sum.reports.insert(is_first ? sum.reports.end() : sum.reports.begin(), sibling.reports.begin(),
                     sibling.reports.end());
  if (sum.reports.size() > kMostReports) sum.reports.resize(kMostReports);
  sum.tally += sibling.tally;
  sum.eye_rays += sibling.eye_rays;
  sum.passes = Together(sum, sibling);
  std::vector<PhotonKey>& dropped = sum.dropped_photons;
  dropped.insert(dropped.end(), sibling.dropped_photons.begin(), sibling.dropped_photons.end());
  std::ranges::sort(dropped);
  if (dropped.size() > kDroppedNamed) dropped.resize(kDroppedNamed);
}

}  // namespace

SliceSums EmptySlice(const PassRange& passes, std::size_t pixels, std::size_t evidence) {
  SliceSums sums;
  sums.passes = passes;
  sums.evidence = evidence;
  sums.columns.resize(ColumnsOf(passes, evidence));
  for (std::size_t column = 0; column < sums.columns.size(); ++column) {
    if (FollowsFromRadiance(passes, column)) continue;
    sums.columns[column] = PackedFloats(pixels, SignificantBits(passes.size(), column, evidence));
  }
  return sums;
}

void SliceSums::Read(std::size_t column, std::size_t begin, std::span<float> values) const {
  if (!FollowsFromRadiance(passes, column)) {
    columns[column].Read(begin, values);
    return;
  }
  if (column == kSquaredDeviations) {
    std::ranges::fill(values, 0.0F);
    return;
  }
  const unsigned int bits = SignificantBits(1, column, evidence);
  const double half = passes.first % 2 == 0 ? 1 : -1;
  ForEachFew(begin, begin + values.size(), [&](std::size_t first, std::size_t count) {
    const Radiance radiance(*this, first, count);
    float* const here = values.data() + (first - begin);
    if (column == kLargestLuminance) {
      for (std::size_t i = 0; i < count; ++i)
        here[i] = Rounded(std::max(0.0, radiance.luminance(i)), bits);
    } else if (column == kDirectDifference) {
      for (std::size_t i = 0; i < count; ++i)
        here[i] = Rounded(half * radiance.direct_luminance(i), bits);
    } else {
      for (std::size_t i = 0; i < count; ++i)
        here[i] = Rounded(half * radiance.channel(column - kHalfDifference, i), bits);
    }
  });
}

Status MergeSibling(SliceSums& sum, const SliceSums& sibling, ThreadTeam* team) {
  LUCERNA_RETURN_IF_ERROR(CheckSibling(sum, sibling, sibling.pixels(), sibling.columns.size()));
  const PassRange together = Together(sum, sibling);
  MakeColumns(sum, together);
  const auto add = [&](std::size_t begin, std::size_t end) {
    ForEachFew(begin, end, [&](std::size_t first, std::size_t count) {
      for (std::size_t column = kLightColumns; column < sum.columns.size(); ++column) {
        AddFew(sum.columns[column], sibling.columns[column],
               SignificantBits(together.size(), column, sum.evidence), first, count);
      }
      AddLight(sum, sibling, together, first, count);
    });
  };
  constexpr std::size_t kPixelsAtOnce = 4096;
  if (team != nullptr) {
    team->For(sum.pixels(), kPixelsAtOnce, add);
  } else {
    add(0, sum.pixels());
  }
  AddRest(sum, sibling);
  return absl::OkStatus();
}

Status SiblingMerge::Begin(std::size_t pixels, std::size_t columns) {
  LUCERNA_RETURN_IF_ERROR(CheckSibling(sum_, sibling_, pixels, columns));
  sibling_.columns.resize(columns);
  return absl::OkStatus();
}

void SiblingMerge::Add(std::size_t column, PackedFloats values) {
  const unsigned int bits = SignificantBits(Together(sum_, sibling_).size(), column, sum_.evidence);
  if (column >= kLightColumns) {
    ForEachFew(0, sum_.pixels(), [&](std::size_t first, std::size_t count) {
      AddFew(sum_.columns[column], values, bits, first, count);
    });
  }
  if (column < kLightColumns || column == kPhotonCount)
    sibling_.columns[column] = std::move(values);
}

void SiblingMerge::Finish() {
  const PassRange together = Together(sum_, sibling_);
  sibling_.columns[kPhotonCount] = PackedFloats();
  MakeColumns(sum_, together);
  ForEachFew(0, sum_.pixels(), [&](std::size_t first, std::size_t count) {
    AddLight(sum_, sibling_, together, first, count);
  });
  AddRest(sum_, sibling_);
}

}  // namespace lucerna
