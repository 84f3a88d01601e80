// Noise: smooth random numbers over space, the same in every process.
//
// Sources: Perlin 2002, "Improving Noise" (the lattice and its permutation); Pharr, Jakob &
// Humphreys 2016, "Physically Based Rendering", 3rd edition, section 10.6 (sums of octaves).
#pragma once

#include "render/math/vector.h"

namespace lucerna {

// In about [-1, 1], with mean 0 and features of size 1; 0 at whole numbers. Requires coordinates
// within 1e9.
[[nodiscard]] float NoiseAt(Vec3 p);

// The sum of `octaves` of noise, each about half as large as the one before, times `omega` in
// amplitude.
[[nodiscard]] float FbmAt(Vec3 p, float omega, int octaves);
// The same of absolute values, and of the mean absolute value of one octave more.
[[nodiscard]] float TurbulenceAt(Vec3 p, float omega, int octaves);

}  // namespace lucerna
