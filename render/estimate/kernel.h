// How much does a photon count at a distance from the hitpoint?
//
// A kernel is K(x) = norm · shape(|x|²/r²) / r², with integral 1 over the disc of radius r. The
// worker applies the shape, in [0, 1]; the coordinator the norm and 1/r².
#pragma once

#include <cmath>
#include <numbers>

#include "render/frequency/bandwidth.h"
#include "render/scene/render_settings.h"

namespace lucerna {

// `t2` = |x|²/r², in [0, 1].
template <KernelKind kKind>
[[nodiscard]] inline float KernelShape(float t2) {
  switch (kKind) {
    case KernelKind::kConstant:
      return 1;
    case KernelKind::kEpanechnikov:
      return 1 - t2;
    case KernelKind::kBiweight:
      return (1 - t2) * (1 - t2);
    case KernelKind::kGaussian:  // of standard deviation r/3, cut at r
      return std::exp(-4.5F * t2);
  }
  return 0;
}

struct Kernel {
  KernelKind kind = KernelKind::kEpanechnikov;

  [[nodiscard]] float Shape(float t2) const {
    switch (kind) {
      case KernelKind::kConstant:
        return KernelShape<KernelKind::kConstant>(t2);
      case KernelKind::kEpanechnikov:
        return KernelShape<KernelKind::kEpanechnikov>(t2);
      case KernelKind::kBiweight:
        return KernelShape<KernelKind::kBiweight>(t2);
      case KernelKind::kGaussian:
        return KernelShape<KernelKind::kGaussian>(t2);
    }
    return 0;
  }
  [[nodiscard]] double Norm() const {
    switch (kind) {
      case KernelKind::kConstant:
        return 1 / std::numbers::pi;
      case KernelKind::kEpanechnikov:
        return 2 / std::numbers::pi;
      case KernelKind::kBiweight:
        return 3 / std::numbers::pi;
      case KernelKind::kGaussian:
        return 4.5 / (std::numbers::pi * (1 - std::exp(-4.5)));
    }
    return 0;
  }
  [[nodiscard]] const KernelMoments& Moments() const {
    switch (kind) {
      case KernelKind::kConstant:
        return kConstantMoments;
      case KernelKind::kEpanechnikov:
        return kEpanechnikovMoments;
      case KernelKind::kBiweight:
        return kBiweightMoments;
      case KernelKind::kGaussian:
        return kGaussianMoments;
    }
    return kConstantMoments;
  }
};

}  // namespace lucerna
