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

// The factor m for rounds that follow from the whole passes, at most 1, of the least sum of
//
//   V / m² + B m⁴
//
// over the pixels, where V is the squared noise of light by photons and B the squared bias, both
// relative (estimate/relative_error.h), at radii without a factor, and m is no larger than the
// pixel's own evidence allows (RadiusController::Scaled). For all pixels alike that is
// (V / 2B)^(1/6). One deviation is taken from the sum of B, that of sums over tiles. 1 where the
// controller scales no radii, or not yet, and where light covers too few tiles to know what chance
// does. `sample` is SampleNoise(sums), `width` that of the image.
[[nodiscard]] double RadiusScale(const ImageSums& sums, const PixelRadii& radii,
                                 const NoiseSample& sample, std::size_t width);

}  // namespace lucerna
