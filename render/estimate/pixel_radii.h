// How large is the radius of every pixel, round after round?
//
// Applies a radius controller to what each round brought. Radii are in unit radii
// (EyePass::unit_radii), so that a pixel's hitpoints at different distances share one.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "render/base/parallel.h"
#include "render/estimate/hitpoint_block.h"
#include "render/estimate/radius_controller.h"
#include "render/estimate/slice_sums.h"

namespace lucerna {

class PixelRadii {
 public:
  // Keeps a reference to `controller`.
  PixelRadii(std::size_t pixels, float initial_radius, const RadiusController& controller);
  // Goes on from there. Requires numbers of one shape, that of `controller`.
  struct Numbers;
  PixelRadii(Numbers numbers, const RadiusController& controller);

  // What the whole image says of the radii of its pixels, as RoundEvidence has it.
  struct OfImage {
    double noise_share = 1, scale = 1;
  };
  // A round whose hitpoints gathered with `radii` [pixels].
  struct Round {
    const SliceSums& sums;
    const RadiusColumn& radii;
    std::uint64_t photons_per_pass = 1;
  };
  void Step(const Round& round, const OfImage& image, ThreadTeam& team);

  // The radii after the rounds so far [pixels].
  [[nodiscard]] RadiusColumn Current() const;
  // The radius controller's own numbers for a pixel.
  [[nodiscard]] std::span<const double> memory(std::size_t pixel) const {
    return std::span<const double>(numbers_.memory)
        .subspan(pixel * memory_per_pixel_, memory_per_pixel_);
  }

  // RadiusController::Scaled of a pixel.
  [[nodiscard]] std::optional<ScaledRadius> ScaledAt(std::size_t pixel,
                                                     const PassesTaken& taken) const {
    return controller_.Scaled(memory(pixel), taken);
  }

  // All that is kept of the rounds taken in: for checkpoints.
  struct Numbers {
    std::vector<PixelRadius> radius;
    std::vector<double> memory;  // [pixels × MemoryPerPixel]
  };
  [[nodiscard]] const Numbers& numbers() const { return numbers_; }

 private:
  const RadiusController& controller_;
  std::size_t memory_per_pixel_;
  Numbers numbers_;
};

}  // namespace lucerna
