#include "render/estimate/pixel_radii.h"

#include <array>
#include <utility>

#include "render/base/status.h"
#include "render/estimate/evidence.h"

namespace lucerna {

PixelRadii::PixelRadii(std::size_t pixels, float initial_radius, const RadiusController& controller)
    : controller_(controller),
      memory_per_pixel_(controller.MemoryPerPixel()),
      numbers_{std::vector<PixelRadius>(pixels, {static_cast<double>(initial_radius), 0}),
               std::vector<double>(pixels * memory_per_pixel_)} {}

PixelRadii::PixelRadii(Numbers numbers, const RadiusController& controller)
    : controller_(controller),
      memory_per_pixel_(controller.MemoryPerPixel()),
      numbers_(std::move(numbers)) {
  LUCERNA_CHECK(numbers_.memory.size() == numbers_.radius.size() * memory_per_pixel_);
}

void PixelRadii::Step(const Round& of_round, const OfImage& image, ThreadTeam& team) {
  const auto& [round, used, photons_per_pass] = of_round;
  LUCERNA_CHECK(round.pixels() == numbers_.radius.size() && used.size() == numbers_.radius.size() &&
                round.evidence <= kMostControllerColumns);
  const std::uint64_t rounds = RoundsUntil(round.passes.last);
  constexpr std::size_t kPixelsAtOnce = 1024;
  team.For(numbers_.radius.size(), kPixelsAtOnce, [&](std::size_t begin, std::size_t end) {
    std::array<double, kMostControllerColumns> columns{};
    for (std::size_t pixel = begin; pixel < end; ++pixel) {
      for (std::size_t column = 0; column < round.evidence; ++column)
        columns[column] = static_cast<double>(round.At(kSliceColumns + column, pixel));
      numbers_.radius[pixel] = controller_.Next(
          numbers_.radius[pixel],
          {.photons = static_cast<double>(round.At(kPhotonCount, pixel)),
           .radius = static_cast<double>(used[pixel]),
           .columns = std::span<const double>(columns).first(round.evidence),
           .blur = static_cast<double>(round.At(kBlur, pixel)),
           .rounds = rounds,
           .noise_share = image.noise_share,
           .scale = image.scale,
           .even_bias = static_cast<double>(round.At(kEvenBias, pixel)),
           .odd_bias = static_cast<double>(round.At(kOddBias, pixel)),
           .photons_per_pass = static_cast<double>(photons_per_pass)},
          round.passes,
          std::span<double>(numbers_.memory).subspan(pixel * memory_per_pixel_, memory_per_pixel_));
    }
  });
}

RadiusColumn PixelRadii::Current() const {
  RadiusColumn radii(numbers_.radius.size());
  for (std::size_t pixel = 0; pixel < radii.size(); ++pixel)
    radii[pixel] = static_cast<float>(numbers_.radius[pixel].radius);
  return radii;
}

}  // namespace lucerna
