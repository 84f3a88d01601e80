// Standard deviation of each pixel.
//
// A pixel has two estimates of its squared noise. The variance over passes has many degrees of
// freedom but assumes independent passes, and passes are stratified: at edges and in direct light
// the true noise is a small part of it. A quarter of the squared difference of the means of even
// and odd passes, which are independent of each other, is unbiased but has one degree of freedom.
// Their ratio, averaged over similar pixels around, is the factor by which the variance over passes
// is multiplied.
//
// Every pixel counts alike in that average, however bright: a ratio is relative to the pixel's own
// variance, and as one outlier changes both estimates by the same amount, no ratio is far above the
// number of passes. Similar are pixels near each other with a variance of the same order: beside an
// edge, where the factor is near 1, the edge itself has a far larger variance and a far smaller
// factor. A pixel without similar ones has its own ratio, and so the difference of its own halves.
// So has, the more the brightest pass makes of its variance, a pixel with an outlier: its variance
// may be that of an edge elsewhere, but no stratification has spread what came once.
// The average is that of a bilateral grid (Chen, Paris & Durand 2007, "Real-time Edge-Aware Image
// Processing with the Bilateral Grid"), with the logarithm of the variance as the third axis.
#pragma once

#include <span>
#include <vector>

namespace lucerna {

// Estimates of the squared noise of a pixel's mean.
struct PixelNoise {
  double of_halves = 0;
  double of_passes = 0;
  double largest_share = 0;  // of the brightest pass in `of_passes`
};

// Standard deviations [pixels], row-major. `correlated_area` is the number of pixels whose noise is
// alike. Scaling all of `pixels` by a power of four scales the result exactly.
[[nodiscard]] std::vector<float> NoiseOfPixels(int width, int height, double correlated_area,
                                               std::span<const PixelNoise> pixels);

}  // namespace lucerna
