// Scattering by hair, written anew: in double, in angles, with the standard library's Bessel
// function, and without anything of render/transport.
//
// Sources: d'Eon et al. 2011, "An Energy-Conserving Hair Reflectance Model"; Chiang et al. 2016, "A
// Practical and Controllable Hair and Fur Model for Production Path Tracing".
#pragma once

#include <array>

#include "render/math/double3.h"

namespace lucerna {

struct ReferenceFibre {
  double eta = 1.55, beta_m = 0.3, beta_n = 0.3;
  double tilt_rad = 0;
  std::array<double, 3> absorption{};
};

// The share of the light from `wi` that goes to `wo`, the cosine included [sr⁻¹]: eye paths
// multiply radiance by it. The fibre lies along x, and the normal of the tube is z.
[[nodiscard]] std::array<double, 3> ReferenceHairShare(const ReferenceFibre& fibre, Double3 wo,
                                                       Double3 wi);

}  // namespace lucerna
