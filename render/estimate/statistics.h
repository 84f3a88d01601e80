// What is known about every pixel after the passes so far?
//
// Per pixel: the shared radius and photon count, and sums over passes of radiance densities.
// Storing the density flux/r² of each pass, rather than flux that is rescaled with every change of
// radius, makes merging a plain sum and lets radii lag behind (the two are the same number in
// exact arithmetic).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "render/estimate/accumulation.h"
#include "render/estimate/error_estimate.h"
#include "render/estimate/hitpoint_block.h"
#include "render/estimate/radius_controller.h"
#include "render/math/fixed_point.h"
#include "render/math/kernel.h"
#include "render/math/rgb.h"

namespace lucerna {

// Hitpoints of one pass, neighbouring rows of its block, and what belongs to each of them.
struct HitpointRows {
  std::span<const std::uint32_t> pixels;  // row -> pixel; a pixel has at most one row
  std::span<const Rgb> weights;           // from gathered flux density to radiance
  std::span<const float> unit_radii;      // length of a radius of 1 [scene units]
  std::size_t first = 0;                  // row of the block that is the first here
};

class PixelStatistics {
 public:
  // `initial_radius` in unit radii; `memory_per_pixel` as the radius controller needs.
  PixelStatistics(std::size_t pixels, float initial_radius, std::size_t memory_per_pixel = 0);

  // The radius of each hitpoint of pass number `pass` [scene units], from the statistics of the
  // passes before the one before it. Requires passes() <= pass <= passes() + 1.
  [[nodiscard]] RadiusColumn Radii(const HitpointRows& rows, std::uint64_t pass) const;

  // Takes in the merged photons of a pass that were gathered with `radii`, both of all rows of the
  // block. Adds what they bring to `radiance` and `bias`, both [pixels], for ErrorStatistics.
  void AddPhotons(const HitpointRows& rows, const RadiusColumn& radii, const PassSums& sums,
                  const FluxScale& scale, const Kernel& kernel, std::int64_t photons_per_pass,
                  const RadiusController& controller, std::span<RgbSum> radiance,
                  std::span<double> bias);

  [[nodiscard]] std::int64_t passes() const { return passes_; }
  // Sum over passes of each pass's estimate of photon radiance [pixels].
  [[nodiscard]] const std::vector<RgbSum>& radiance_sum() const { return radiance_sum_; }
  // Photons gathered over all passes [pixels].
  [[nodiscard]] const std::vector<std::uint64_t>& photon_count() const { return photon_count_; }
  // The radius controller's own numbers for a pixel.
  [[nodiscard]] std::span<const double> memory(std::size_t pixel) const {
    return std::span<const double>(memory_).subspan(pixel * memory_per_pixel_, memory_per_pixel_);
  }
  // The unit radius of the pixel's last hitpoint [scene units]; 0 before the first.
  [[nodiscard]] const std::vector<float>& last_unit_radius() const { return last_unit_radius_; }
  // The radius that the pixel's last hitpoint used [scene units]; 0 before the first.
  [[nodiscard]] const std::vector<float>& last_radius() const { return last_radius_; }

 private:
  std::int64_t passes_ = 0;
  std::vector<PixelRadius> radius_;
  std::vector<double> radius_before_;  // the last pass was taken in
  std::vector<RgbSum> radiance_sum_;
  std::vector<std::uint64_t> photon_count_;
  std::vector<float> last_radius_;
  std::vector<float> last_unit_radius_;
  std::size_t memory_per_pixel_;
  std::vector<double> memory_;  // [pixels × memory_per_pixel]
};

}  // namespace lucerna
