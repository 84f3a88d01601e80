// How far is one image from another?
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>

#include "render/base/status.h"
#include "render/image/image.h"

namespace lucerna {

struct MetricsOptions {
  enum class Fit { kExact, kCrop, kScale };

  // kExact: sizes must agree. kCrop: the common top-left part. kScale: both are box-averaged to
  // the smaller width and height.
  Fit fit = Fit::kExact;
  double clip = HUGE_VAL;  // every channel of both images is clipped to this first
  double trim_share = 0;   // share of the pixels with the largest relative error left out
  // Floor of relMSE; absent: that of the reference (render/estimate/relative_error.h), clipped and
  // scaled as it is compared, of all pixels whatever the mask.
  std::optional<double> floor = std::nullopt;
  // Pixels whose R (or Y, or first channel) is 0 in it are left out. As large as the comparison;
  // a larger one is cropped or averaged as the images are.
  const Image* mask = nullptr;
};

struct ImageMetrics {
  std::uint64_t pixels = 0;  // compared
  double rmse = 0;           // sqrt of the mean over pixels and channels of (a - b)²
  double rel_mse = 0;        // mean over pixels and channels of (a - b)² / (b² + floor)
  // The same without the trim_share of pixels in which it is largest, kTrimmedShare where none is
  // asked for, and of all pixels.
  double rel_mse_trimmed = 0, rel_mse_untrimmed = 0;
  double floor = 0;               // of rel_mse
  double mean_a = 0, mean_b = 0;  // over pixels and channels
  double mean_ratio = 0;          // mean_a / mean_b
  std::array<double, 3> channel_mean_ratio{};
  // The part of rel_mse, and of the square of rmse, that is noise of the reference itself; where
  // the reference tells its noise (film/reference.h), and neither clipping nor scaling changed it.
  std::optional<double> reference_rel_mse, reference_mse;
  // The parts of rel_mse_trimmed and rel_mse_untrimmed; 0 where the others are absent.
  double reference_rel_mse_trimmed = 0, reference_rel_mse_untrimmed = 0;
};

// Compares R, G, B of `image` with those of `reference`.
// Errors: INVALID_ARGUMENT for missing channels, sizes that do not fit, or non-finite pixels.
[[nodiscard]] StatusOr<ImageMetrics> Compare(const Image& image, const Image& reference,
                                             const MetricsOptions& options = {});

}  // namespace lucerna
