// How many eye paths does each pixel have in a pass, and how many photons has the pass?
//
// One path, until some passes have shown where eye paths bring the noise: at edges, in textures,
// through smooth and rough surfaces, in half shadows. From then on such pixels have several in
// every pass, all with the photons of the pass, and are the means of them. What is right in the
// mean stays so, since the numbers follow from passes before.
//
// How much eye paths vary is seen where two of one pixel and pass are compared: they have the same
// photons. With variances v_i of one path and the same cost c for each, n pixels have the least
// variance for the time when the numbers of paths k_i are in proportion to sqrt(v_i) (Neyman 1934,
// "On the Two Different Aspects of the Representative Method"). Here none is below 1. So the scale
// of that proportion is searched, and the number of photons with it, for the least product of
//
//   variance  V_photons + Σ v_i / (n k_i) + B     and     time  C_photons + c Σ k_i / n,
//
// where B is squared bias, which neither more paths nor more photons make less.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "render/estimate/hitpoint_block.h"
#include "render/estimate/image_sums.h"
#include "render/estimate/photon_steps.h"

namespace lucerna {

// What later passes are made of.
struct Samples {
  std::uint64_t photons_per_pass = 0;
  std::shared_ptr<const EyePathCounts> eye_paths;  // nullptr: one for each pixel
};

// After kEyePathsCompared passes, all that `variance` has seen and those that compare eye paths
// among them: the number of photons, from `present` by powers of two up to `most`, and the numbers
// of eye paths. `width` is that of the image, `kernel_noise` as PassVariance has it.
[[nodiscard]] Samples ChooseSamples(const PassVariance& variance, const ImageSums& sums,
                                    double kernel_noise, std::uint64_t present, std::uint64_t most,
                                    std::size_t width);

// The numbers of a pass that compares eye paths: two for every other pixel, like the fields of a
// chessboard, and for the others after two passes. Requires ComparesEyePaths(pass).
[[nodiscard]] EyePathCounts ComparedEyePaths(std::size_t pixels, std::size_t width,
                                             std::uint64_t pass);

}  // namespace lucerna
