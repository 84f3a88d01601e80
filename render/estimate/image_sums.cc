#include "render/estimate/image_sums.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "render/base/status.h"

namespace lucerna {
namespace {

// By what sums of direct light become sums with the weight of the photons.
double DirectFactor(double passes, const PassWeights& weights) {
  return passes > 0 ? weights.all() / passes : 1;
}

// A difference of direct light, of which the luminance is known, has the colour of direct light. It
// is no more than all of it, also where pixel filters with negative weights leave next to nothing.
double ColoredDifference(double difference, double direct, double direct_luminance) {
  return direct_luminance > 0 ? std::clamp(difference / direct_luminance, -1.0, 1.0) * direct : 0;
}

// The squared deviations of two groups of passes together.
double TogetherDeviating(double one, double other, double weight, double luminance,
                         double slice_passes, double slice_luminance) {
  const double of_both = one + other;
  if (!(weight > 0)) return of_both;
  return of_both + DeviationBetween(weight, luminance, slice_passes, slice_luminance);
}

// Of both halves together, over the weight of the part.
double BiasSquare(float even, float odd, const PassRange& part) {
  const double both = static_cast<double>(even) + static_cast<double>(odd);
  return both * both / static_cast<double>(part.size());
}

// A float that grows by another, as columns of floats do.
void Grow(double& sum, float by) {
  sum = static_cast<double>(static_cast<float>(sum) + by);
}

}  // namespace

ImageSums::Columns::Columns(std::size_t pixels)
    : direct_difference(pixels),
      squared_deviations(pixels),
      bias_squares(pixels),
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
  whole_.weights += WeightsOf(slice.passes);
  whole_.eye_rays += slice.eye_rays;
  whole_.tally += slice.tally;
}

// By this thread, for the same reason as AddDeviations.
double ImageSums::WeighBy(std::uint64_t photons_per_pass) {
  LUCERNA_CHECK(photons_per_pass > 0);
  tail_.clear();
  const double factor =
      static_cast<double>(whole_.photons_per_pass) / static_cast<double>(photons_per_pass);
  whole_.photons_per_pass = photons_per_pass;
  if (whole_.passes == 0 || factor == 1) return 1;
  const auto scale = [](auto& column, auto by) {
    for (auto& sum : column)
      sum *= by;
  };
  for (std::size_t pixel = 0; pixel < pixels(); ++pixel) {
    const auto direct = [&](std::size_t c) { return whole_.columns.radiance[3 + c][pixel]; };
    const double luminance = WorkingLuminance(direct(0), direct(1), direct(2));
    const auto difference = static_cast<double>(whole_.columns.direct_difference[pixel]);
    for (std::size_t c = 0; c < 3; ++c) {
      float& of_both = whole_.columns.half_difference[c][pixel];
      of_both =
          static_cast<float>(factor * static_cast<double>(of_both) +
                             (1 - factor) * ColoredDifference(difference, direct(c), luminance));
    }
  }
  for (std::size_t c = 0; c < 3; ++c)
    scale(whole_.columns.radiance[c], factor);
  scale(whole_.columns.squared_deviations, factor);
  scale(whole_.columns.even_bias, static_cast<float>(factor));
  scale(whole_.columns.odd_bias, static_cast<float>(factor));
  scale(whole_.columns.bias_squares, factor);
  scale(whole_.columns.largest, static_cast<float>(std::sqrt(factor)));
  whole_.weights.even *= factor;
  whole_.weights.odd *= factor;
  whole_.weights.squares *= factor * factor;
  return factor;
}

PassWeights ImageSums::weights() const {
  PassWeights weights = whole_.weights;
  weights += WeightsOf({whole_.passes, passes()});
  return weights;
}

void ImageSums::AddDeviations(const SliceSums& slice) {
  const double weight = whole_.weights.all();
  const double of_direct = DirectFactor(static_cast<double>(whole_.passes), whole_.weights);
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
        return radiance[c][pixel] + of_direct * radiance[c + 3][pixel];
      };
      const auto of_slice = [&](std::size_t c) {
        return static_cast<double>(added[c][i]) + static_cast<double>(added[c + 3][i]);
      };
      deviations[pixel] =
          TogetherDeviating(deviations[pixel], static_cast<double>(slice_deviations[i]), weight,
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
  to_each(whole_.columns.direct_difference, kDirectDifference, add);
  to_each(whole_.columns.even_bias, kEvenBias, add);
  to_each(whole_.columns.odd_bias, kOddBias, add);
  std::array<float, kPixelsUnpacked> other;
  for (std::size_t first = begin; first < end; first += kPixelsUnpacked) {
    const std::size_t count = std::min(kPixelsUnpacked, end - first);
    slice.Read(kEvenBias, first, std::span(unpacked).first(count));
    slice.Read(kOddBias, first, std::span(other).first(count));
    for (std::size_t i = 0; i < count; ++i)
      whole_.columns.bias_squares[first + i] += BiasSquare(unpacked[i], other[i], slice.passes);
  }
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
  RawPixel raw;
  Pixel& sum = raw.sum;
  for (std::size_t c = 0; c < 3; ++c) {
    sum.photons[c] = whole_.columns.radiance[c][pixel];
    sum.direct[c] = whole_.columns.radiance[3 + c][pixel];
    sum.half_difference[c] = static_cast<double>(whole_.columns.half_difference[c][pixel]);
  }
  raw.direct_difference = static_cast<double>(whole_.columns.direct_difference[pixel]);
  sum.squared_deviations = whole_.columns.squared_deviations[pixel];
  sum.even_bias = static_cast<double>(whole_.columns.even_bias[pixel]);
  sum.odd_bias = static_cast<double>(whole_.columns.odd_bias[pixel]);
  sum.bias_squares = whole_.columns.bias_squares[pixel];
  sum.photon_count = static_cast<double>(whole_.columns.photon_count[pixel]);
  sum.largest = whole_.columns.largest[pixel];
  PassRange before = {0, whole_.passes};
  PassWeights weights = whole_.weights;
  for (const auto& slice : tail_) {
    AddTo(raw, before, weights, *slice, pixel);
    before.last = slice->passes.last;
    weights += WeightsOf(slice->passes);
  }
  Reweigh(raw, before.last, weights);
  return sum;
}

// What photons brought is a mean times a weight already; direct light and the difference of halves
// become such.
void ImageSums::Reweigh(RawPixel& raw, std::uint64_t passes, const PassWeights& weights) {
  const PassWeights counts = WeightsOf({0, passes});
  if (weights == counts || !(weights.even > 0 && weights.odd > 0)) return;
  Pixel& sum = raw.sum;
  const double weight = weights.all();
  const double luminance = WorkingLuminance(sum.direct);
  for (std::size_t c = 0; c < 3; ++c) {
    const auto difference_of_means = [](double of_all, double difference, const PassWeights& by) {
      return (of_all + difference) / (2 * by.even) - (of_all - difference) / (2 * by.odd);
    };
    const double of_direct = ColoredDifference(raw.direct_difference, sum.direct[c], luminance);
    const double of_photons = sum.half_difference[c] - of_direct;
    const double difference = difference_of_means(sum.photons[c], of_photons, weights) +
                              difference_of_means(sum.direct[c], of_direct, counts);
    sum.direct[c] *= weight / counts.all();
    // Such that difference_of_means of the whole radiance is that difference again.
    const double without = difference_of_means(sum.photons[c] + sum.direct[c], 0, weights);
    sum.half_difference[c] = 2 * (difference - without) * weights.even * weights.odd / weight;
  }
}

RgbSum ImageSums::RadianceAt(std::size_t pixel) const {
  const double of_direct = DirectFactor(static_cast<double>(passes()), weights());
  RgbSum radiance{};
  for (std::size_t c = 0; c < 3; ++c) {
    double photons = whole_.columns.radiance[c][pixel];
    double direct = whole_.columns.radiance[3 + c][pixel];
    for (const auto& slice : tail_) {
      photons += static_cast<double>(slice->At(kPhotonRadiance + c, pixel));
      direct += static_cast<double>(slice->At(kDirectRadiance + c, pixel));
    }
    radiance[c] = photons + of_direct * direct;
  }
  return radiance;
}

ImageSums::Features ImageSums::FeaturesAt(std::size_t pixel) const {
  Features sum = whole_.features[pixel];
  for (const auto& slice : tail_)
    AddTo(sum, *slice, pixel);
  return sum;
}

void ImageSums::AddTo(RawPixel& raw, const PassRange& before, const PassWeights& weights,
                      const SliceSums& slice, std::size_t pixel) {
  const auto at = [&](std::size_t column) { return slice.At(column, pixel); };
  Pixel& sum = raw.sum;
  const double of_direct = DirectFactor(static_cast<double>(before.size()), weights);
  RgbSum radiance_before{};
  RgbSum alone{};
  for (std::size_t c = 0; c < 3; ++c) {
    radiance_before[c] = sum.photons[c] + of_direct * sum.direct[c];
    const auto photons = static_cast<double>(at(kPhotonRadiance + c));
    const auto direct = static_cast<double>(at(kDirectRadiance + c));
    alone[c] = photons + direct;
    sum.photons[c] += photons;
    sum.direct[c] += direct;
    Grow(sum.half_difference[c], at(kHalfDifference + c));
  }
  Grow(raw.direct_difference, at(kDirectDifference));
  sum.squared_deviations =
      TogetherDeviating(sum.squared_deviations, static_cast<double>(at(kSquaredDeviations)),
                        weights.all(), WorkingLuminance(radiance_before),
                        static_cast<double>(slice.passes.size()), WorkingLuminance(alone));
  sum.largest = std::max(sum.largest, at(kLargestLuminance));
  Grow(sum.even_bias, at(kEvenBias));
  Grow(sum.odd_bias, at(kOddBias));
  sum.bias_squares += BiasSquare(at(kEvenBias), at(kOddBias), slice.passes);
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
