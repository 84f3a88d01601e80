// Renders of one scene that differ by their seeds alone: is the `noise` layer their deviation?
#pragma once

#include <vector>

#include "render/scene/scene.h"

namespace lucerna {

struct NoiseStudySize {
  int side = 64;  // pixels
  int renders = 16;
  int passes = 32;
};

// A tenth of the pixels, by their mean luminance over all renders.
struct NoiseDecile {
  double mean = 0;       // luminance
  double deviation = 0;  // root of the mean over pixels of the variance over renders
  double layer = 0;      // root of the mean over pixels and renders of the squared layer
  // Median over pixels of deviation over layer (root of its mean square over renders), of pixels
  // where both are above 0.
  double median_ratio = 0;

  [[nodiscard]] double Ratio() const { return deviation / layer; }
};

// Ten deciles, the darkest first. One photon a pixel and pass.
[[nodiscard]] std::vector<NoiseDecile> StudyNoise(const Scene& scene, const NoiseStudySize& size);

}  // namespace lucerna
