// What is a reference image made of, and how noisy is it?
//
// Two renders that are independent of each other, a and b, are averaged. Their difference tells the
// noise of the average without the right image: the expectation of (a - b)²/4 is its variance, also
// when one half had more passes than the other. It tells nothing of what both have in common, so
// the bias must be made small by the settings of the halves.
#pragma once

#include <array>
#include <cstdint>

#include "render/base/status.h"
#include "render/image/image.h"

namespace lucerna {

// Standard error of R, G, B in each pixel, from two values: right on average over many pixels, and
// no more than a hint in one.
inline constexpr std::array<const char*, 3> kNoiseLayer = {"noise.R", "noise.G", "noise.B"};

// The seeds of the halves of a reference with that seed. They are hashed, so that no half has the
// photons of another reference, nor of an image that is measured by it: those seeds are small.
[[nodiscard]] std::array<std::uint64_t, 2> SeedsOfHalves(std::uint64_t seed);

// The average, with the noise layer and in its metadata
//   lucerna.reference.rel_mse   the mean over pixels and channels of (a - b)²/4 / (value² +
//                               floor); the floor is that of render/estimate/relative_error.h
//   lucerna.reference.rel_mse_trimmed   the same without the kTrimmedShare of pixels in which it is
//                               largest
//   lucerna.reference.rmse      the root of the mean of (a - b)²/4
//   lucerna.reference.seeds, .passes, .photons   of both halves
//   lucerna.scene_digest, .settings, .numeric_profile   as the first half has them
// Errors: INVALID_ARGUMENT when the halves have other sizes or scenes, the same seed, no colour, or
// pixels that are not finite.
[[nodiscard]] StatusOr<Image> MakeReference(const Image& a, const Image& b);

// Whether `image` comes from MakeReference and still has its noise layer.
[[nodiscard]] bool TellsItsNoise(const Image& image);

}  // namespace lucerna
