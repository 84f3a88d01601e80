// What would the image be without most of its noise, and how far off is that?
//
// Even and odd passes are two independent images. Each is filtered by itself, by non-local means of
// several strengths (film/non_local_means.h), on light divided by the albedo. From the strongest on
// towards the image itself, each weaker filter's difference D from what is there so far is added in
// the share g = ⟨D (T - y)⟩ / ⟨D²⟩ that makes the squared error least: y is what is there so far
// and T the truth, for which the other half stands, whose noise is independent of what this half's
// filter has made. Means ⟨⟩ are relative and over some 30 pixels. So detail that both halves show
// comes back, wherever it is, and noise does not; with more photons the result becomes the image.
// Source of weights by other halves: Rousselle, Manzi & Zwicker 2013, "Robust Denoising using
// Feature and Color Information"; of shares of least error: Wiener 1949, with the product of halves
// in place of a model of the signal.
//
// The other half says how wrong a filtered half is: (F₀ - B₁)² is its squared error and the noise
// of B₁ together. What the filter blurs is therefore in the estimate, not in a model. What both
// halves share is not: blur by kernels, which the estimate of the image has, and what is noise in
// the features, which are of the first passes of both. The interval is wider for that, the more the
// larger a part of all passes these are.
#pragma once

#include <cstddef>
#include <vector>

#include "render/base/parallel.h"
#include "render/estimate/error_estimate.h"
#include "render/film/non_local_means.h"

namespace lucerna {

// An image of two passes or more, as columns [height × width]; Rec. 709 in the image's exposure.
struct NoisyImage {
  int width = 0, height = 0;
  ImageHalves halves;        // means of the even passes and of the odd ones
  double even_share = 0.5;   // of all that the image's means weigh
  std::vector<float> noise;  // standard deviation of the luminance of the mean of both
  SurfaceFeatures features;
  double feature_share = 0;  // of the passes, that the features are of
};

struct DenoisedImage {
  ColorColumns pixels;
  // Mean squared relative errors over those of the image's noise, of the pixels that
  // ErrorEstimate::relative is of, as far as noise tells which these are.
  double noise_left = 1;  // what is left of noise
  // Squared bias that was added; by chance below 0 where there is little.
  double blur = 0;
  double deviation = 0;  // standard deviation of the sum
  double all_left = 1;   // the sum, of all pixels
  // As NoisyImage has it.
  double feature_share = 0;
};

// `image` is used up. The result does not depend on the number of threads. Requires finite values,
// but for distances.
[[nodiscard]] DenoisedImage Denoise(NoisyImage image, ThreadTeam& team);

// Of a denoised image.
struct DenoisedError {
  SquaredError relative;
  double untrimmed = 0;
};
// From the estimate for the image that was denoised.
[[nodiscard]] DenoisedError ErrorOfDenoised(const DenoisedImage& denoised,
                                            const ErrorEstimate& of_image);

}  // namespace lucerna
