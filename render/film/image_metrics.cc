#include "render/film/image_metrics.h"

#include <algorithm>
#include <string>
#include <vector>

#include "render/estimate/error_estimate.h"
#include "render/estimate/relative_error.h"
#include "render/film/reference.h"

namespace lucerna {
namespace {

// One channel cut or averaged to the size of the comparison.
using Plane = std::vector<double>;

struct Size {
  int width = 0, height = 0;
  bool operator==(const Size&) const = default;
};

std::string ToText(Size size) {
  return absl::StrCat(size.width, "x", size.height);
}

// How one row or column of the smaller grid is made of those of the larger one.
struct Share {
  std::size_t source = 0;
  double weight = 0;  // sums to 1
};

std::vector<std::vector<Share>> BoxShares(int from, int to) {
  std::vector<std::vector<Share>> shares(static_cast<std::size_t>(to));
  const double step = static_cast<double>(from) / to;
  for (int i = 0; i < to; ++i) {
    const double begin = i * step;
    const double end = (i + 1) * step;
    for (int j = static_cast<int>(begin); j < from && j < end; ++j) {
      const double covered = std::min<double>(end, j + 1) - std::max<double>(begin, j);
      if (covered > 0) {
        shares[static_cast<std::size_t>(i)].push_back(
            {static_cast<std::size_t>(j), covered / step});
      }
    }
  }
  return shares;
}

// The part of `channel` that the comparison needs, clipped, at `size`.
Plane FitPlane(const ImageChannel& channel, Size from, Size to, const MetricsOptions& options) {
  const auto width = static_cast<std::size_t>(from.width);
  const auto clipped = [&](std::size_t x, std::size_t y) {
    // What is not finite stays so and is reported; clipping would hide it.
    const double value = channel.pixels[y * width + x];
    return std::isfinite(value) ? std::min(value, options.clip) : value;
  };
  Plane plane;
  plane.reserve(static_cast<std::size_t>(to.width) * static_cast<std::size_t>(to.height));
  if (options.fit != MetricsOptions::Fit::kScale || from == to) {
    for (std::size_t y = 0; y < static_cast<std::size_t>(to.height); ++y) {
      for (std::size_t x = 0; x < static_cast<std::size_t>(to.width); ++x) {
        plane.push_back(clipped(x, y));
      }
    }
    return plane;
  }
  const auto columns = BoxShares(from.width, to.width);
  const auto rows = BoxShares(from.height, to.height);
  for (const auto& row : rows) {
    for (const auto& column : columns) {
      double sum = 0;
      for (const Share y : row) {
        for (const Share x : column)
          sum += y.weight * x.weight * clipped(x.source, y.source);
      }
      plane.push_back(sum);
    }
  }
  return plane;
}

using ColourNames = std::array<const char*, 3>;
constexpr ColourNames kColour = {"R", "G", "B"};

StatusOr<std::array<Plane, 3>> FitColour(const Image& image, const ColourNames& names,
                                         const std::string& who, Size size,
                                         const MetricsOptions& options) {
  std::array<Plane, 3> planes;
  for (std::size_t channel = 0; channel < 3; ++channel) {
    const ImageChannel* found = image.Find(names[channel]);
    if (found == nullptr) {
      return absl::InvalidArgumentError(
          absl::StrCat("the ", who, " has no channel ", names[channel]));
    }
    planes[channel] = FitPlane(*found, {image.width, image.height}, size, options);
  }
  return planes;
}

// Which pixels count; empty: all of them.
StatusOr<Plane> FitMask(const Image& mask, Size size, const MetricsOptions& options) {
  const Size mask_size = {mask.width, mask.height};
  const bool fits = options.fit == MetricsOptions::Fit::kExact
                        ? mask_size == size
                        : mask.width >= size.width && mask.height >= size.height;
  if (!fits) {
    return absl::InvalidArgumentError(absl::StrCat("the mask is ", ToText(mask_size), " and the ",
                                                   "comparison ", ToText(size),
                                                   "; give a mask of that size"));
  }
  const ImageChannel* channel = mask.Find("R");
  if (channel == nullptr) channel = mask.Find("Y");
  if (channel == nullptr && !mask.channels.empty()) channel = &mask.channels.front();
  if (channel == nullptr) return absl::InvalidArgumentError("the mask has no channel");
  return FitPlane(*channel, mask_size, size, options);
}

// What is masked may be other than finite: it does not count as light.
double FloorOf(const std::array<Plane, 3>& planes) {
  std::vector<double> luminances(planes[0].size());
  for (std::size_t i = 0; i < luminances.size(); ++i) {
    const double luminance = LuminanceOf({planes[0][i], planes[1][i], planes[2][i]});
    luminances[i] = std::isfinite(luminance) ? luminance : 0;
  }
  return RelativeErrorFloor(luminances);
}

double Ratio(double a, double b) {
  return a == b ? 1 : a / b;
}

}  // namespace

StatusOr<ImageMetrics> Compare(const Image& image, const Image& reference,
                               const MetricsOptions& options) {
  const Size image_size = {image.width, image.height};
  const Size reference_size = {reference.width, reference.height};
  if (options.fit == MetricsOptions::Fit::kExact && image_size != reference_size) {
    return absl::InvalidArgumentError(
        absl::StrCat("the images differ in size: ", ToText(image_size), " and ",
                     ToText(reference_size), "; crop or scale them to compare"));
  }
  if (!(options.trim_share >= 0 && options.trim_share < 1)) {
    return absl::InvalidArgumentError("the share of pixels to trim is at least 0 and below 1");
  }
  const Size size = {std::min(image.width, reference.width),
                     std::min(image.height, reference.height)};
  LUCERNA_ASSIGN_OR_RETURN(const auto a, FitColour(image, kColour, "image", size, options));
  LUCERNA_ASSIGN_OR_RETURN(const auto b, FitColour(reference, kColour, "reference", size, options));
  std::optional<std::array<Plane, 3>> noise;
  const bool is_scaled = options.fit == MetricsOptions::Fit::kScale && reference_size != size;
  if (TellsItsNoise(reference) && !is_scaled && options.clip == HUGE_VAL) {
    LUCERNA_ASSIGN_OR_RETURN(noise, FitColour(reference, kNoiseLayer, "reference", size, options));
  }
  Plane mask;
  if (options.mask != nullptr) {
    LUCERNA_ASSIGN_OR_RETURN(mask, FitMask(*options.mask, size, options));
  }

  const std::size_t count = a[0].size();
  for (std::size_t i = 0; i < count; ++i) {
    if (!mask.empty() && mask[i] == 0) continue;
    for (std::size_t channel = 0; channel < 3; ++channel) {
      if (std::isfinite(a[channel][i]) && std::isfinite(b[channel][i])) continue;
      return absl::InvalidArgumentError(
          absl::StrCat("the ", std::isfinite(a[channel][i]) ? "reference" : "image",
                       " is not finite at pixel (", i % static_cast<std::size_t>(size.width), ", ",
                       i / static_cast<std::size_t>(size.width), ")"));
    }
  }
  const double floor = options.floor ? *options.floor : FloorOf(b);

  struct Compared {
    double relative_error = 0;  // summed over channels
    double relative_noise = 0;  // of the reference
    std::size_t pixel = 0;
  };
  std::vector<Compared> compared;
  compared.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    if (!mask.empty() && mask[i] == 0) continue;
    double relative_error = 0;
    double relative_noise = 0;
    for (std::size_t channel = 0; channel < 3; ++channel) {
      const double va = a[channel][i];
      const double vb = b[channel][i];
      relative_error += RelativeSquare((va - vb) * (va - vb), vb, floor);
      if (!noise) continue;
      const double deviation = (*noise)[channel][i];
      relative_noise += RelativeSquare(deviation * deviation, vb, floor);
    }
    compared.push_back({relative_error, relative_noise, i});
  }

  const std::size_t kept = KeptPixels(compared.size(), options.trim_share);
  if (kept == 0) return absl::InvalidArgumentError("there is no pixel left to compare");
  // Ties go by place, so that the same images always give the same figures.
  std::ranges::sort(compared, [](const Compared& left, const Compared& right) {
    return left.relative_error != right.relative_error ? left.relative_error < right.relative_error
                                                       : left.pixel < right.pixel;
  });
  // Of the so many pixels with the least error.
  const auto mean_of = [&](double Compared::*of, std::size_t pixels) {
    double sum = 0;
    for (std::size_t i = 0; i < pixels; ++i)
      sum += compared[i].*of;
    return sum / (3 * static_cast<double>(pixels));
  };
  ImageMetrics metrics;
  const std::size_t kept_trimmed = options.trim_share > 0 ? kept : KeptPixels(compared.size());
  metrics.rel_mse = mean_of(&Compared::relative_error, kept);
  metrics.rel_mse_trimmed = mean_of(&Compared::relative_error, kept_trimmed);
  metrics.rel_mse_untrimmed = mean_of(&Compared::relative_error, compared.size());
  if (noise) {
    metrics.reference_rel_mse = mean_of(&Compared::relative_noise, kept);
    metrics.reference_rel_mse_trimmed = mean_of(&Compared::relative_noise, kept_trimmed);
    metrics.reference_rel_mse_untrimmed = mean_of(&Compared::relative_noise, compared.size());
  }
  compared.resize(kept);
  metrics.pixels = kept;
  metrics.floor = floor;
  std::array<double, 3> sum_a{};
  std::array<double, 3> sum_b{};
  double squares = 0;
  double noise_squares = 0;
  for (const Compared& one : compared) {
    for (std::size_t channel = 0; channel < 3; ++channel) {
      const double va = a[channel][one.pixel];
      const double vb = b[channel][one.pixel];
      squares += (va - vb) * (va - vb);
      if (noise) {
        const double deviation = (*noise)[channel][one.pixel];
        noise_squares += deviation * deviation;
      }
      sum_a[channel] += va;
      sum_b[channel] += vb;
    }
  }
  const double samples = 3 * static_cast<double>(kept);
  metrics.rmse = std::sqrt(squares / samples);
  if (noise) {
    metrics.reference_mse = noise_squares / samples;
    if (!std::isfinite(*metrics.reference_mse)) {
      return absl::InvalidArgumentError("the noise layer of the reference is not finite");
    }
  }
  metrics.mean_a = (sum_a[0] + sum_a[1] + sum_a[2]) / samples;
  metrics.mean_b = (sum_b[0] + sum_b[1] + sum_b[2]) / samples;
  metrics.mean_ratio = Ratio(metrics.mean_a, metrics.mean_b);
  for (std::size_t channel = 0; channel < 3; ++channel) {
    metrics.channel_mean_ratio[channel] = Ratio(sum_a[channel], sum_b[channel]);
  }
  return metrics;
}

}  // namespace lucerna
