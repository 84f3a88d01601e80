// How fine is the detail of an environment map around one direction?
#pragma once

#include <vector>

#include "render/frequency/spectrum.h"
#include "render/math/vector.h"
#include "render/transport/environment_map.h"

namespace lucerna {

class SkyDetail final : public InfiniteSpectrum {
 public:
  // Keeps a reference to `sky`, and a blurred copy of its luminance.
  explicit SkyDetail(const EnvironmentMap& sky);

  [[nodiscard]] Spectrum Source(Vec3 direction, const SpectrumLimits& limits) const override;

 private:
  // Interpolated between the centres of the pixels.
  [[nodiscard]] double BlurredLuminance(Vec3 direction) const;

  const EnvironmentMap& sky_;
  int size_;
  double mean_ = 0;
  double texel_rad_;
  std::vector<float> blurred_;  // [size × size]
};

}  // namespace lucerna
