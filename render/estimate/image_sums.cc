#include "render/estimate/image_sums.h"

#include <algorithm>
#include <utility>

#include "render/base/status.h"

namespace lucerna {
namespace {

double LuminanceOfSum(const ImageSums::Pixel& sum) {
  const RgbSum radiance = sum.radiance();
  return WorkingLuminance(radiance[0], radiance[1], radiance[2]);
}

}  // namespace

void ImageSums::Add(const SliceSums& slice, ThreadTeam& team) {
  LUCERNA_CHECK(slice.passes.first == passes_ && slice.pixels() == pixels_.size());
  tail_.clear();
  constexpr std::size_t kPixelsAtOnce = 4096;
  team.For(pixels_.size(), kPixelsAtOnce, [&](std::size_t begin, std::size_t end) {
    for (std::size_t pixel = begin; pixel < end; ++pixel) {
      AddTo(pixels_[pixel], passes_, slice, pixel);
      AddTo(features_[pixel], slice, pixel);
    }
  });
  passes_ = slice.passes.last;
  eye_rays_ += slice.eye_rays;
  tally_ += slice.tally;
}

void ImageSums::SetTail(Slices tail) {
  std::uint64_t next = passes_;
  for (const auto& slice : tail) {
    LUCERNA_CHECK(slice->passes.first == next && slice->pixels() == pixels_.size());
    next = slice->passes.last;
  }
  tail_ = std::move(tail);
}

std::uint64_t ImageSums::eye_rays() const {
  std::uint64_t rays = eye_rays_;
  for (const auto& slice : tail_)
    rays += slice->eye_rays;
  return rays;
}

BatchTally ImageSums::tally() const {
  BatchTally tally = tally_;
  for (const auto& slice : tail_)
    tally += slice->tally;
  return tally;
}

ImageSums::Pixel ImageSums::At(std::size_t pixel) const {
  Pixel sum = pixels_[pixel];
  std::uint64_t passes = passes_;
  for (const auto& slice : tail_) {
    AddTo(sum, passes, *slice, pixel);
    passes = slice->passes.last;
  }
  return sum;
}

ImageSums::Features ImageSums::FeaturesAt(std::size_t pixel) const {
  Features sum = features_[pixel];
  for (const auto& slice : tail_)
    AddTo(sum, *slice, pixel);
  return sum;
}

void ImageSums::AddTo(Pixel& sum, std::uint64_t passes, const SliceSums& slice, std::size_t pixel) {
  const auto at = [&](std::size_t column) {
    return static_cast<double>(slice.columns[column][pixel]);
  };
  const double before = LuminanceOfSum(sum);
  double added = 0;
  {
    Pixel alone;
    for (std::size_t c = 0; c < 3; ++c) {
      alone.photons[c] = at(kPhotonRadiance + c);
      alone.direct[c] = at(kDirectRadiance + c);
      sum.photons[c] += alone.photons[c];
      sum.direct[c] += alone.direct[c];
      sum.half_difference[c] += at(kHalfDifference + c);
    }
    added = LuminanceOfSum(alone);
  }
  sum.squared_deviations += at(kSquaredDeviations);
  if (passes > 0) {
    sum.squared_deviations += DeviationBetween(static_cast<double>(passes), before,
                                               static_cast<double>(slice.passes.size()), added);
  }
  sum.largest = std::max(sum.largest, slice.columns[kLargestLuminance][pixel]);
  sum.even_bias += at(kEvenBias);
  sum.odd_bias += at(kOddBias);
  sum.photon_count += at(kPhotonCount);
}

void ImageSums::AddTo(Features& sum, const SliceSums& slice, std::size_t pixel) {
  if (!HasFeatures(slice.passes)) return;
  const std::size_t first = slice.first_feature();
  const auto at = [&](std::size_t column) { return slice.columns[first + column][pixel]; };
  sum.albedo += Rgb{at(kAlbedo), at(kAlbedo + 1), at(kAlbedo + 2)};
  sum.normal = sum.normal + Vec3{at(kNormal), at(kNormal + 1), at(kNormal + 2)};
  sum.distance += at(kDistance);
  sum.unit_radius += at(kUnitRadius);
  sum.hits += at(kHits);
  sum.hitpoints += at(kHitpoints);
}

}  // namespace lucerna
