#include "render/estimate/statistics.h"

#include "render/base/status.h"

namespace lucerna {

PixelStatistics::PixelStatistics(std::size_t pixels, float initial_radius,
                                 std::size_t memory_per_pixel)
    : radius_(pixels, PixelRadius{initial_radius, 0}),
      radiance_sum_(pixels),
      photon_count_(pixels),
      last_radius_(pixels),
      last_unit_radius_(pixels),
      memory_per_pixel_(memory_per_pixel),
      memory_(pixels * memory_per_pixel) {}

RadiusColumn PixelStatistics::Radii(const HitpointRows& rows) const {
  RadiusColumn radii(rows.pixels.size());
  for (std::size_t row = 0; row < radii.size(); ++row) {
    radii[row] = radius_[rows.pixels[row]].radius * rows.unit_radii[row];
  }
  return radii;
}

void PixelStatistics::AddPhotons(const HitpointRows& rows, const RadiusColumn& radii,
                                 const PassSums& sums, const FluxScale& scale, const Kernel& kernel,
                                 std::int64_t photons_per_pass,
                                 const RadiusController& controller) {
  LUCERNA_CHECK(rows.pixels.size() == sums.size() && radii.size() == sums.size());
  const auto pass = static_cast<std::uint64_t>(passes_);
  std::vector<std::int64_t> columns(sums.evidence().size());
  const double per_photon = kernel.Norm() / static_cast<double>(photons_per_pass);
  for (std::size_t row = 0; row < radii.size(); ++row) {
    const std::uint32_t pixel = rows.pixels[row];
    const auto radius = static_cast<double>(radii[row]);
    const double to_density = per_photon / (radius * radius);
    RgbSum& sum = radiance_sum_[pixel];
    for (int channel = 0; channel < 3; ++channel) {
      const auto c = static_cast<std::size_t>(channel);
      const double flux = static_cast<double>(sums.flux(channel)[row]) *
                          static_cast<double>(scale.watts_per_quantum[channel]);
      sum[c] += static_cast<double>(rows.weights[row][channel]) * flux * to_density;
    }
    photon_count_[pixel] += sums.counts()[row];
    last_radius_[pixel] = radii[row];
    last_unit_radius_[pixel] = rows.unit_radii[row];
    for (std::size_t column = 0; column < columns.size(); ++column) {
      columns[column] = sums.evidence()[column][row];
    }
    radius_[pixel] = controller.Next(
        radius_[pixel],
        {static_cast<double>(sums.counts()[row]), radii[row] / rows.unit_radii[row], columns}, pass,
        std::span<double>(memory_).subspan(pixel * memory_per_pixel_, memory_per_pixel_));
  }
  ++passes_;
}

}  // namespace lucerna
