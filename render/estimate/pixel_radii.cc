#include "render/estimate/pixel_radii.h"

#include <array>

#include "render/base/status.h"
#include "render/estimate/evidence.h"

namespace lucerna {

PixelRadii::PixelRadii(std::size_t pixels, float initial_radius, const RadiusController& controller)
    : controller_(controller),
      radius_(pixels, PixelRadius{static_cast<double>(initial_radius), 0}),
      memory_per_pixel_(controller.MemoryPerPixel()),
      memory_(pixels * memory_per_pixel_) {}

void PixelRadii::Step(const SliceSums& round, const RadiusColumn& used, ThreadTeam& team) {
  LUCERNA_CHECK(round.pixels() == radius_.size() && used.size() == radius_.size() &&
                round.evidence <= kMostControllerColumns);
  constexpr std::size_t kPixelsAtOnce = 1024;
  team.For(radius_.size(), kPixelsAtOnce, [&](std::size_t begin, std::size_t end) {
    std::array<double, kMostControllerColumns> columns{};
    for (std::size_t pixel = begin; pixel < end; ++pixel) {
      for (std::size_t column = 0; column < round.evidence; ++column)
        columns[column] = static_cast<double>(round.At(kSliceColumns + column, pixel));
      radius_[pixel] = controller_.Next(
          radius_[pixel],
          {.photons = static_cast<double>(round.At(kPhotonCount, pixel)),
           .radius = static_cast<double>(used[pixel]),
           .columns = std::span<const double>(columns).first(round.evidence),
           .blur = static_cast<double>(round.At(kBlur, pixel))},
          round.passes,
          std::span<double>(memory_).subspan(pixel * memory_per_pixel_, memory_per_pixel_));
    }
  });
}

RadiusColumn PixelRadii::Current() const {
  RadiusColumn radii(radius_.size());
  for (std::size_t pixel = 0; pixel < radii.size(); ++pixel)
    radii[pixel] = static_cast<float>(radius_[pixel].radius);
  return radii;
}

}  // namespace lucerna
