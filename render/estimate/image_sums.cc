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

// The squared deviations of two groups of passes together.
double TogetherDeviating(double one, double other, double passes, double luminance,
                         double slice_passes, double slice_luminance) {
  const double of_both = one + other;
  if (!(passes > 0)) return of_both;
  return of_both + DeviationBetween(passes, luminance, slice_passes, slice_luminance);
}

// A float that grows by another, as columns of floats do.
void Grow(double& sum, float by) {
  sum = static_cast<double>(static_cast<float>(sum) + by);
}

}  // namespace

ImageSums::Columns::Columns(std::size_t pixels)
    : squared_deviations(pixels),
      even_bias(pixels),
      odd_bias(pixels),
      photon_count(pixels),
      largest(pixels) {
  for (std::vector<double>& column : radiance)
    column.resize(pixels);
  for (std::vector<float>& column : half_difference)
    column.resize(pixels);
}

void ImageSums::Add(const SliceSums& slice, ThreadTeam& team) {
  LUCERNA_CHECK(slice.passes.first == whole_.passes && slice.pixels() == pixels());
  tail_.clear();
  // Of the radiance before, and by this thread: those of a team take floats that are not normal for
  // zero, and the squares of faint light are such.
  AddDeviations(slice);
  constexpr std::size_t kPixelsAtOnce = 4096;
  team.For(pixels(), kPixelsAtOnce, [&](std::size_t begin, std::size_t end) {
    AddPixels(slice, begin, end);
    if (!HasFeatures(slice.passes)) return;
    for (std::size_t pixel = begin; pixel < end; ++pixel)
      AddTo(whole_.features[pixel], slice, pixel);
  });
  whole_.passes = slice.passes.last;
  whole_.eye_rays += slice.eye_rays;
  whole_.tally += slice.tally;
}

void ImageSums::AddDeviations(const SliceSums& slice) {
  const auto passes = static_cast<double>(whole_.passes);
  const auto slice_passes = static_cast<double>(slice.passes.size());
  std::array<const double*, 6> radiance{};
  std::array<std::array<float, kPixelsUnpacked>, 6> added;
  static_assert(kDirectRadiance == kPhotonRadiance + 3);
  for (std::size_t c = 0; c < 6; ++c)
    radiance[c] = whole_.columns.radiance[c].data();
  double* const deviations = whole_.columns.squared_deviations.data();
  std::array<float, kPixelsUnpacked> slice_deviations;
  for (std::size_t first = 0; first < pixels(); first += kPixelsUnpacked) {
    const std::size_t count = std::min(kPixelsUnpacked, pixels() - first);
    for (std::size_t c = 0; c < 6; ++c)
      slice.Read(kPhotonRadiance + c, first, std::span(added[c]).first(count));
    slice.Read(kSquaredDeviations, first, std::span(slice_deviations).first(count));
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t pixel = first + i;
      const auto before = [&](std::size_t c) {
        return radiance[c][pixel] + radiance[c + 3][pixel];
      };
      const auto of_slice = [&](std::size_t c) {
        return static_cast<double>(added[c][i]) + static_cast<double>(added[c + 3][i]);
      };
      deviations[pixel] =
          TogetherDeviating(deviations[pixel], static_cast<double>(slice_deviations[i]), passes,
                            WorkingLuminance(before(0), before(1), before(2)), slice_passes,
                            WorkingLuminance(of_slice(0), of_slice(1), of_slice(2)));
    }
  }
}

// Column by column, as vectors. AddTo does the same to one pixel, with the same bits.
void ImageSums::AddPixels(const SliceSums& slice, std::size_t begin, std::size_t end) {
  std::array<float, kPixelsUnpacked> unpacked;
  // Calls add(sum, number of the slice) for each pixel.
  const auto to_each = [&](auto& sums, std::size_t column, const auto& add) {
    for (std::size_t first = begin; first < end; first += kPixelsUnpacked) {
      const std::size_t count = std::min(kPixelsUnpacked, end - first);
      slice.Read(column, first, std::span(unpacked).first(count));
      auto* const sum = sums.data() + first;
      for (std::size_t i = 0; i < count; ++i)
        add(sum[i], unpacked[i]);
    }
  };
  const auto add = [](auto& sum, float number) { sum += number; };
  for (std::size_t c = 0; c < 6; ++c) {
    to_each(whole_.columns.radiance[c], kPhotonRadiance + c,
            [](double& sum, float number) { sum += static_cast<double>(number); });
  }
  for (std::size_t c = 0; c < 3; ++c)
    to_each(whole_.columns.half_difference[c], kHalfDifference + c, add);
  to_each(whole_.columns.even_bias, kEvenBias, add);
  to_each(whole_.columns.odd_bias, kOddBias, add);
  to_each(whole_.columns.photon_count, kPhotonCount, add);
  to_each(whole_.columns.largest, kLargestLuminance,
          [](float& most, float number) { most = std::max(most, number); });
}

ImageSums::ImageSums(Whole whole) : whole_(std::move(whole)) {
  LUCERNA_CHECK(whole_.columns.pixels() == pixels());
}

void ImageSums::SetTail(Slices tail) {
  std::uint64_t next = whole_.passes;
  for (const auto& slice : tail) {
    LUCERNA_CHECK(slice->passes.first == next && slice->pixels() == pixels());
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
  Pixel sum;
  for (std::size_t c = 0; c < 3; ++c) {
    sum.photons[c] = whole_.columns.radiance[c][pixel];
    sum.direct[c] = whole_.columns.radiance[3 + c][pixel];
    sum.half_difference[c] = static_cast<double>(whole_.columns.half_difference[c][pixel]);
  }
  sum.squared_deviations = whole_.columns.squared_deviations[pixel];
  sum.even_bias = static_cast<double>(whole_.columns.even_bias[pixel]);
  sum.odd_bias = static_cast<double>(whole_.columns.odd_bias[pixel]);
  sum.photon_count = static_cast<double>(whole_.columns.photon_count[pixel]);
  sum.largest = whole_.columns.largest[pixel];
  std::uint64_t passes = whole_.passes;
  for (const auto& slice : tail_) {
    AddTo(sum, passes, *slice, pixel);
    passes = slice->passes.last;
  }
  return sum;
}

RgbSum ImageSums::RadianceAt(std::size_t pixel) const {
  RgbSum radiance{};
  for (std::size_t c = 0; c < 3; ++c) {
    double photons = whole_.columns.radiance[c][pixel];
    double direct = whole_.columns.radiance[3 + c][pixel];
    for (const auto& slice : tail_) {
      photons += static_cast<double>(slice->At(kPhotonRadiance + c, pixel));
      direct += static_cast<double>(slice->At(kDirectRadiance + c, pixel));
    }
    radiance[c] = photons + direct;
  }
  return radiance;
}

ImageSums::Features ImageSums::FeaturesAt(std::size_t pixel) const {
  Features sum = whole_.features[pixel];
  for (const auto& slice : tail_)
    AddTo(sum, *slice, pixel);
  return sum;
}

void ImageSums::AddTo(Pixel& sum, std::uint64_t passes, const SliceSums& slice, std::size_t pixel) {
  const auto at = [&](std::size_t column) { return slice.At(column, pixel); };
  const double before = LuminanceOfSum(sum);
  Pixel alone;
  for (std::size_t c = 0; c < 3; ++c) {
    alone.photons[c] = static_cast<double>(at(kPhotonRadiance + c));
    alone.direct[c] = static_cast<double>(at(kDirectRadiance + c));
    sum.photons[c] += alone.photons[c];
    sum.direct[c] += alone.direct[c];
    Grow(sum.half_difference[c], at(kHalfDifference + c));
  }
  sum.squared_deviations =
      TogetherDeviating(sum.squared_deviations, static_cast<double>(at(kSquaredDeviations)),
                        static_cast<double>(passes), before,
                        static_cast<double>(slice.passes.size()), LuminanceOfSum(alone));
  sum.largest = std::max(sum.largest, at(kLargestLuminance));
  Grow(sum.even_bias, at(kEvenBias));
  Grow(sum.odd_bias, at(kOddBias));
  Grow(sum.photon_count, at(kPhotonCount));
}

void ImageSums::AddTo(Features& sum, const SliceSums& slice, std::size_t pixel) {
  if (!HasFeatures(slice.passes)) return;
  const std::size_t first = slice.first_feature();
  const auto at = [&](std::size_t column) { return slice.At(first + column, pixel); };
  sum.albedo += Rgb{at(kAlbedo), at(kAlbedo + 1), at(kAlbedo + 2)};
  sum.normal = sum.normal + Vec3{at(kNormal), at(kNormal + 1), at(kNormal + 2)};
  sum.distance += at(kDistance);
  sum.unit_radius += at(kUnitRadius);
  // Whatever a worker sent.
  const auto passes = [&](std::size_t column) {
    return std::clamp(at(column), 0.0F, static_cast<float>(kFeaturePasses));
  };
  sum.hits = static_cast<std::uint16_t>(static_cast<float>(sum.hits) + passes(kHits));
  sum.hitpoints =
      static_cast<std::uint16_t>(static_cast<float>(sum.hitpoints) + passes(kHitpoints));
}

}  // namespace lucerna
