// By what factor should the radii of the whole image be smaller, where no pixel shows enough by
// itself?
//
// Blur of light that bends everywhere, as under waves, is far above the noise of an image long
// before it is more than chance in any one of its pixels. Its square over the image is known much
// better: the product of what even and odd passes show has, in the mean, no noise. So radii that a
// pixel's own evidence does not hold are scaled by the factor that leaves the least squared
// relative error over the image, as the halves of the image have it.
#pragma once

#include "render/estimate/image_sums.h"
#include "render/estimate/photon_noise.h"
#include "render/estimate/pixel_radii.h"

namespace lucerna {

// The factor m for rounds that follow from the whole passes, at most 1, that leaves the least error
// when there are twice as many passes: the least sum of
//
//   V / m² + B (p² + m²)²
//
// over the pixels, where V is the squared noise of light by photons and B the squared bias, both
// relative (estimate/relative_error.h) and at radii without a factor, p the factor that the passes
// so far had (ScaledRadius::blurred), and m is no larger than the pixel's own evidence allows
// (ScaledRadius::most). For pixels that all had p = m that is (V / 4B)^(1/6). A pixel that its own
// evidence holds counts with B times the factor that it is held at: mostly it lies at an edge, of
// which wide discs see more than there is within narrow ones. Two deviations are taken from the
// sums of B. 1 where the controller scales no radii, or not yet, and where light covers too few
// tiles to know what chance does. `sample` is SampleNoise(sums), `width` that of the image.
[[nodiscard]] double RadiusScale(const ImageSums& sums, const PixelRadii& radii,
                                 const NoiseSample& sample, std::size_t width);

}  // namespace lucerna
