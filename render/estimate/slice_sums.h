// What did a slice of passes bring to every pixel?
//
// Sums over the passes of a slice (estimate/rounds.h), one row a pixel of the crop window, as
// columns of floats. A worker that traces whole passes adds them up and sends one of these; the
// coordinator adds slices to slices. Sums are taken in a fixed tree, each node the rounded sum of
// its two halves, so that the bits do not depend on who adds up what.
//
// Sums of radiance are rounded to 16 significant bits and all others to 8, to nearest, when a pass
// becomes a slice and at every node: far below the noise of the passes that
// they sum, and half the bytes on the wire.
//
// Invariants
//   S1  Every column that is present has pixels() rows, all finite, in its column's precision.
//   S2  `passes` is a slice (IsSlice).
//   S3  Of a single pass, columns that FollowsFromRadiance names are as SetWhatFollowsFromRadiance
//       sets them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "render/base/status.h"
#include "render/estimate/accumulation.h"
#include "render/estimate/rounds.h"
#include "render/math/rgb.h"

namespace lucerna {

// Significant bits of a column's floats.
enum class Precision : std::uint8_t { kRadiance = 16, kStatistic = 8 };

// The columns that every slice has. Radiance in the working space.
enum SliceColumn : std::size_t {
  kPhotonRadiance,                           // 3: by photons
  kDirectRadiance = kPhotonRadiance + 3,     // 3: without photons
  kHalfDifference = kDirectRadiance + 3,     // 3: of even passes less that of odd ones
  kSquaredDeviations = kHalfDifference + 3,  // of passes' luminances from their mean
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
  kFeatureColumns,
};
// What surfaces look like is known from so many passes.
inline constexpr std::uint64_t kFeaturePasses = 16;
[[nodiscard]] constexpr bool HasFeatures(const PassRange& slice) {
  return slice.first < kFeaturePasses;
}

// What names one photon of a job.
struct PhotonKey {
  std::uint64_t pass = 0, index = 0;
  auto operator<=>(const PhotonKey&) const = default;
};

struct SliceSums {
  PassRange passes;
  // kSliceColumns, then `evidence` columns of the radius controller, then kFeatureColumns where
  // HasFeatures(passes). Each [pixels].
  std::vector<std::vector<float>> columns;
  std::size_t evidence = 0;
  BatchTally tally;
  std::uint64_t eye_rays = 0;
  // The first photons that were dropped, strictly increasing, at most kDroppedNamed.
  std::vector<PhotonKey> dropped_photons;

  [[nodiscard]] std::size_t pixels() const { return columns.empty() ? 0 : columns[0].size(); }
  [[nodiscard]] std::size_t first_feature() const { return kSliceColumns + evidence; }
  [[nodiscard]] float At(std::size_t column, std::size_t pixel) const {
    return columns[column][pixel];
  }
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
[[nodiscard]] Precision PrecisionOf(std::size_t column, std::size_t evidence);

// `value` in this precision, to nearest, ties to even; what no float holds becomes the largest.
[[nodiscard]] float Rounded(double value, Precision precision);

// All columns zero.
[[nodiscard]] SliceSums EmptySlice(const PassRange& passes, std::size_t pixels,
                                   std::size_t evidence);

// Of a single pass some columns follow from its radiance: they are computed and never sent.
[[nodiscard]] constexpr bool FollowsFromRadiance(const PassRange& passes, std::size_t column) {
  return passes.size() == 1 && column >= kHalfDifference && column <= kLargestLuminance;
}
// Sets these columns. Requires slice.passes.size() == 1.
void SetWhatFollowsFromRadiance(SliceSums& slice);

// Makes `sum` the sum of itself and its sibling; in either order the same bits.
// Errors: INVALID_ARGUMENT when they are no siblings or differ in shape, OUT_OF_RANGE when a tally
// would not fit in 64 bits. Then nothing has changed.
[[nodiscard]] Status MergeSibling(SliceSums& sum, const SliceSums& sibling);

// Chan, Golub & LeVeque 1983, "Algorithms for Computing the Sample Variance": what the squared
// deviations of two groups together are more than their sum, of `n` and `m` values with these sums.
[[nodiscard]] double DeviationBetween(double n, double sum_n, double m, double sum_m);

// The luminance of radiance in the working space.
[[nodiscard]] double WorkingLuminance(double r, double g, double b);

}  // namespace lucerna
