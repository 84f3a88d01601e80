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

void ImageSums::Add(const SliceSums& slice) {
  LUCERNA_CHECK(slice.passes.first == whole_.passes && slice.pixels() == whole_.pixels.size());
  tail_.clear();
  for (std::size_t pixel = 0; pixel < whole_.pixels.size(); ++pixel) {
    AddTo(whole_.pixels[pixel], whole_.passes, slice, pixel);
    AddTo(whole_.features[pixel], slice, pixel);
  }
  whole_.passes = slice.passes.last;
  whole_.eye_rays += slice.eye_rays;
  whole_.tally += slice.tally;
}

void ImageSums::Restore(Whole whole) {
  LUCERNA_CHECK(whole.pixels.size() == pixels() && whole.features.size() == pixels());
  whole_ = std::move(whole);
  tail_.clear();
}

void ImageSums::SetTail(Slices tail) {
  std::uint64_t next = whole_.passes;
  for (const auto& slice : tail) {
    LUCERNA_CHECK(slice->passes.first == next && slice->pixels() == whole_.pixels.size());
    next = slice->passes.last;
  }
  tail_ = std::move(tail);
}

std::uint64_t ImageSums::eye_rays() const {
  std::uint64_t rays = whole_.eye_rays;
  for (const auto& slice : tail_)
    rays += slice->eye_rays;
  return rays;
}

BatchTally ImageSums::tally() const {
  BatchTally tally = whole_.tally;
  for (const auto& slice : tail_)
    tally += slice->tally;
  return tally;
}

ImageSums::Pixel ImageSums::At(std::size_t pixel) const {
  Pixel sum = whole_.pixels[pixel];
  std::uint64_t passes = whole_.passes;
  for (const auto& slice : tail_) {
    AddTo(sum, passes, *slice, pixel);
    passes = slice->passes.last;
  }
  return sum;
}

ImageSums::Features ImageSums::FeaturesAt(std::size_t pixel) const {
  Features sum = whole_.features[pixel];
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
