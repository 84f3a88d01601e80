// What would a pixel be without the blur that its photons surely show?
//
// Beside the image goes an estimate of what the kernel changed (estimate/error_estimate.h). At
// edges of light it is far above its own noise, and taking it off leaves about the estimate of the
// inner kernel: averaged over a pixel at least as wide as its radius, a 17th to a 50th of the
// squared bias of a straight step. Elsewhere it is noise, with nine times the variance of the
// pixel. So of a bias that noise may be nothing is taken, of one that is surely there all, and
// between the two what is continuous (Gao & Bruce 1997, "WaveShrink with Firm Shrinkage"). All
// passes so far are corrected, the first with their wide discs too, while radii only mend what
// comes.
//
// What is taken follows from the same photons as the bias. The product of what is left of the
// halves' biases is therefore too small, by twice the variance of the bias times the difference
// between the derivative of what is taken and its share (Stein 1981, "Estimation of the Mean of a
// Multivariate Normal Distribution"): the biases of the result are larger by as much.
#pragma once

#include <cstddef>

#include "render/estimate/image_sums.h"
#include "render/estimate/radius_controller.h"

namespace lucerna {

class WithoutBlur {
 public:
  // Takes nothing where `controller` does not say so, nor where `media_scatter`: segments of eye
  // paths find few photons of great weight, which are not among a pixel's count, so that before a
  // bright one has come chance looks like blur, and light would be lost. noise_share: as
  // BlurNoiseShare has it, or 1. Keeps a reference to `sums`, which must not change.
  WithoutBlur(const ImageSums& sums, const RadiusController& controller, double noise_share,
              bool media_scatter = false);

  // sums.At(pixel), with blur taken off what photons brought, off the difference of the halves and
  // off both biases; squared deviations are those of passes that scatter like the result.
  [[nodiscard]] ImageSums::Pixel At(std::size_t pixel) const;

 private:
  const ImageSums& sums_;
  double weight_ = 0, passes_ = 0, parts_ = 0;
  double noise_share_ = 1;
  double least_ = 0;  // deviations of which nothing is taken; 0: nothing is taken of any
};

}  // namespace lucerna
