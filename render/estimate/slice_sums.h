// What did a slice of passes bring to every pixel?
//
// Sums over the passes of a slice (estimate/rounds.h), one row a pixel of the crop window, as
// columns of floats. A worker that traces whole passes adds them up and sends one of these; the
// coordinator adds slices to slices. Sums are taken in a fixed tree, each node the rounded sum of
// its two halves, so that the bits do not depend on who adds up what.
//
// When a pass becomes a slice, and at every node, sums are rounded to so many significant bits that
// the error is far below the noise of the passes that they sum, a third of the bytes on the wire:
// direct light, which may have no noise, to 16; light by photons to as many as the number of its
// photons deserves, with dither, so that it is right in the mean (PhotonRounding); statistics to 8.
//
// Invariants
//   S1  Every column that is kept has pixels() rows, all finite, of SignificantBits at most.
//   S2  `passes` is a slice (IsSlice).
//   S3  Of a single pass, columns that FollowsFromRadiance names are not kept: they are computed
//       when they are read.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "render/base/parallel.h"
#include "render/base/status.h"
#include "render/estimate/accumulation.h"
#include "render/estimate/emission_report.h"
#include "render/estimate/rounds.h"
#include "render/math/color_space.h"
#include "render/math/packed_floats.h"
#include "render/math/rgb.h"
#include "render/math/rng.h"

namespace lucerna {

// The columns that every slice has. Radiance in the working space.
enum SliceColumn : std::size_t {
  kPhotonRadiance,                           // 3: by photons
  kDirectRadiance = kPhotonRadiance + 3,     // 3: without photons
  kHalfDifference = kDirectRadiance + 3,     // 3: of even passes less that of odd ones
  kSquaredDeviations = kHalfDifference + 3,  // of passes' luminances from their mean
  kDirectDifference,                         // luminance: of kHalfDifference without photons
  kLargestLuminance,                         // of a pass
  kEvenBias,                                 // luminance by which kernels changed even passes
  kOddBias,                                  // and odd ones
  kPhotonCount,                              // photons found
  kBlur,                                     // RoundEvidence::blur, summed
  kSliceColumns,
};

// The columns of the first passes (kFeaturePasses), behind all others: sums over the passes whose
// eye path met a surface.
enum FeatureColumn : std::size_t {
  kAlbedo,                  // 3
  kNormal = kAlbedo + 3,    // 3
  kDistance = kNormal + 3,  // [scene units]
  kUnitRadius,              // EyePass::unit_radii
  kHits,                    // passes that met a surface
  kHitpoints,               // passes that have a hitpoint
  kPathVariance,            // of single eye paths: squared luminances (ComparesEyePaths)
  kFeatureColumns,
};
// What surfaces look like is known from so many passes.
inline constexpr std::uint64_t kFeaturePasses = 16;
[[nodiscard]] constexpr bool HasFeatures(const PassRange& slice) {
  return slice.first < kFeaturePasses;
}

// Of a single pass some columns follow from its radiance.
[[nodiscard]] constexpr bool FollowsFromRadiance(const PassRange& passes, std::size_t column) {
  return passes.size() == 1 && column >= kHalfDifference && column <= kLargestLuminance;
}

// In the last of so many passes half of the pixels may have two eye paths, and then the others,
// which say how much single ones vary.
inline constexpr std::uint64_t kEyePathsCompared = 8;
[[nodiscard]] constexpr bool ComparesEyePaths(std::uint64_t pass) {
  return kEyePathsCompared / 2 <= pass && pass < kEyePathsCompared;
}
inline constexpr int kComparisonsOfPixel = 2;

// What names one photon of a job.
struct PhotonKey {
  std::uint64_t pass = 0, index = 0;
  auto operator<=>(const PhotonKey&) const = default;
};

struct SliceSums {
  PassRange passes;
  // kSliceColumns, then `evidence` columns of the radius controller, then kFeatureColumns where
  // HasFeatures(passes). Each [pixels], or empty where FollowsFromRadiance.
  std::vector<PackedFloats> columns;
  std::size_t evidence = 0;
  BatchTally tally;
  std::uint64_t eye_rays = 0;
  // The first photons that were dropped, strictly increasing, at most kDroppedNamed.
  std::vector<PhotonKey> dropped_photons;
  // Of the photons that the guide asks to be reported those that were found, in order of passes and
  // indices.
  std::vector<EmissionReport> reports;

  [[nodiscard]] std::size_t pixels() const { return columns.empty() ? 0 : columns[0].size(); }
  [[nodiscard]] std::size_t first_feature() const { return kSliceColumns + evidence; }
  [[nodiscard]] float At(std::size_t column, std::size_t pixel) const {
    if (!FollowsFromRadiance(passes, column)) return columns[column][pixel];
    float value = 0;
    Read(column, pixel, std::span(&value, 1));
    return value;
  }
  // What the pixels from `begin` on have, as many as there are in `values`.
  void Read(std::size_t column, std::size_t begin, std::span<float> values) const;
  bool operator==(const SliceSums&) const = default;
};

// What the sender of a slice was asked for.
struct SliceShape {
  PassRange passes;
  std::size_t pixels = 0;
  std::size_t evidence = 0;
  std::uint64_t photons_per_pass = 0;
};
// How many columns a slice has.
[[nodiscard]] constexpr std::size_t ColumnsOf(const PassRange& passes, std::size_t evidence) {
  return kSliceColumns + evidence + (HasFeatures(passes) ? std::size_t{kFeatureColumns} : 0);
}
// Significant bits of a column's floats, at most. The difference of halves is a statistic as soon
// as there is one: of a single pass it is the radiance itself.
[[nodiscard]] constexpr unsigned int SignificantBits(std::uint64_t passes, std::size_t column,
                                                     std::size_t evidence) {
  const std::size_t first_statistic =
      passes == 1 ? std::size_t{kSquaredDeviations} : std::size_t{kHalfDifference};
  const bool is_radiance = passes == 1 && column == kDirectDifference;
  const bool is_statistic = column >= first_statistic && column < kSliceColumns + evidence &&
                            column != kPhotonCount && !is_radiance;
  return is_statistic ? 8 : 16;
}

// Pixels that are unpacked at a time, so that a few columns of theirs stay in the nearest cache.
inline constexpr std::size_t kPixelsUnpacked = 256;

// These are made for every pixel of every pass, in loops over vectors.

// The low bits of a float that are zero where it has so many significant ones.
[[nodiscard]] constexpr unsigned int DroppedBits(unsigned int significant_bits) {
  return 24 - significant_bits;
}
// `value` without its lowest bits, to nearest, ties to even. Requires one whose rounding is finite.
[[nodiscard]] constexpr float RoundedFloat(float value, unsigned int dropped_bits) {
  const auto bits = std::bit_cast<std::uint32_t>(value);
  const std::uint32_t mask = (std::uint32_t{1} << dropped_bits) - 1;
  // Half of the last bit kept, less one where that bit is even: ties go to even.
  const std::uint32_t half = (mask >> 1) + ((bits >> dropped_bits) & 1);
  return std::bit_cast<float>((bits + half) & ~mask);
}
// Rounding this up stays finite with any number of bits here.
inline constexpr double kLargestSum = 0x1.f8p127;
// `value` with so many significant bits, to nearest, ties to even; what no float holds becomes the
// largest.
[[nodiscard]] constexpr float Rounded(double value, unsigned int significant_bits) {
  return RoundedFloat(static_cast<float>(std::clamp(value, -kLargestSum, kLargestSum)),
                      DroppedBits(significant_bits));
}

// Significant bits of light by `count` photons: 8 for fewer than 32, half a bit more each time that
// they double, 16 at most. Then one rounding has less than a thousandth of the variance of light by
// as many photons that are independent of each other. Without photons there is no noise to hide in:
// 16. (The number comes from the exponent, of whatever float.)
[[nodiscard]] constexpr unsigned int PhotonBits(float count) {
  const std::uint32_t exponent = (std::bit_cast<std::uint32_t>(count) >> 23) & 0xFFU;
  if (exponent == 0) return 16;
  constexpr std::uint32_t kOfEight = 127 + 3;
  return 8 + std::min(8U, (std::max(exponent, kOfEight) - kOfEight) / 2);
}

// Rounds light by photons in a slice of these passes: down or up by chance, with the chance that
// keeps the mean. The numbers of chance belong to the slice and the pixel.
class PhotonRounding {
 public:
  explicit constexpr PhotonRounding(const PassRange& passes)
      : key_(CombineKeys(passes.first, passes.size())) {}

  // Requires values within kLargestSum, all columns of a pixel at once.
  [[nodiscard]] constexpr std::array<float, 3> operator()(std::size_t pixel, float count,
                                                          const std::array<float, 3>& rgb) const {
    const unsigned int bits = PhotonBits(count);
    const unsigned int dropped = DroppedBits(bits);
    if (bits == 16) {
      return {RoundedFloat(rgb[0], dropped), RoundedFloat(rgb[1], dropped),
              RoundedFloat(rgb[2], dropped)};
    }
    const std::uint32_t mask = (std::uint32_t{1} << dropped) - 1;
    // The same chance for all channels: grey stays grey, and what they have in common stays so.
    const std::uint32_t up =
        static_cast<std::uint32_t>(Mix64(key_ + pixel * 0x9E3779B97F4A7C15ULL)) & mask;
    std::array<float, 3> rounded{};
    for (std::size_t c = 0; c < 3; ++c)
      rounded[c] = std::bit_cast<float>((std::bit_cast<std::uint32_t>(rgb[c]) + up) & ~mask);
    return rounded;
  }

 private:
  std::uint64_t key_;
};

// All columns zero.
[[nodiscard]] SliceSums EmptySlice(const PassRange& passes, std::size_t pixels,
                                   std::size_t evidence);

// Makes `sum` the sum of itself and its sibling; in either order the same bits. By the threads of
// `team`, or by the caller's alone.
// Errors: INVALID_ARGUMENT when they are no siblings or differ in shape, OUT_OF_RANGE when a tally
// would not fit in 64 bits. Then nothing has changed.
[[nodiscard]] Status MergeSibling(SliceSums& sum, const SliceSums& sibling,
                                  ThreadTeam* team = nullptr);

// MergeSibling for a sibling whose columns come one after the other, so that few of them are there
// at a time. By the caller's thread.
class SiblingMerge {
 public:
  // `sibling` has no columns yet. Keeps a reference to `sum`, which has no meaning until Finish.
  SiblingMerge(SliceSums& sum, SliceSums sibling) : sum_(sum), sibling_(std::move(sibling)) {}

  // Errors: as MergeSibling, for siblings of `pixels` pixels and `columns` columns.
  [[nodiscard]] Status Begin(std::size_t pixels, std::size_t columns);
  // Each column that the sibling keeps, once, in any order.
  void Add(std::size_t column, PackedFloats values);
  void Finish();

  // With the columns of it that are still there: those of light and the number of photons.
  [[nodiscard]] const SliceSums& sibling() const { return sibling_; }

 private:
  SliceSums& sum_;
  SliceSums sibling_;
};

// Chan, Golub & LeVeque 1983, "Algorithms for Computing the Sample Variance": what the squared
// deviations of two groups together are more than their sum, of `n` and `m` values with these sums.
[[nodiscard]] constexpr double DeviationBetween(double n, double sum_n, double m, double sum_m) {
  const double difference = sum_n / n - sum_m / m;
  return difference * difference * n * m / (n + m);
}

// The working space's luminance of each channel.
inline constexpr std::array<double, 3> kLuminanceOfChannel = [] {
  constexpr std::array<double, 3> kRec709 = {0.2126, 0.7152, 0.0722};
  std::array<double, 3> weights{};
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t row = 0; row < 3; ++row)
      weights[c] += kRec709[row] * kRec709FromWorking[row][c];
  }
  return weights;
}();
// The luminance of radiance in the working space.
[[nodiscard]] constexpr double WorkingLuminance(double r, double g, double b) {
  return kLuminanceOfChannel[0] * r + kLuminanceOfChannel[1] * g + kLuminanceOfChannel[2] * b;
}

}  // namespace lucerna
