#include "render/estimate/statistics.h"

#include <algorithm>

#include "render/base/status.h"
#include "render/estimate/evidence.h"

namespace lucerna {
namespace {

// The square of a radius is a float.
constexpr double kSmallestRadius = 1e-18;
constexpr double kLargestRadius = 1e18;

}  // namespace

PixelStatistics::PixelStatistics(std::size_t pixels, float initial_radius,
                                 std::size_t memory_per_pixel)
    : radius_(pixels, PixelRadius{static_cast<double>(initial_radius), 0}),
      radius_before_(pixels, static_cast<double>(initial_radius)),
      radiance_sum_(pixels),
      photon_count_(pixels),
      last_radius_(pixels),
      last_unit_radius_(pixels),
      memory_per_pixel_(memory_per_pixel),
      memory_(pixels * memory_per_pixel) {}

RadiusColumn PixelStatistics::Radii(const HitpointRows& rows, std::uint64_t pass) const {
  const auto passes = static_cast<std::uint64_t>(passes_);
  LUCERNA_CHECK(passes <= pass && pass <= passes + 1);
  RadiusColumn radii(rows.pixels.size());
  for (std::size_t row = 0; row < radii.size(); ++row) {
    const std::uint32_t pixel = rows.pixels[row];
    const double radius = pass == passes ? radius_before_[pixel] : radius_[pixel].radius;
    radii[row] = static_cast<float>(std::clamp(radius * static_cast<double>(rows.unit_radii[row]),
                                               kSmallestRadius, kLargestRadius));
  }
  return radii;
}

void PixelStatistics::AddPhotons(const HitpointRows& rows, const RadiusColumn& radii,
                                 const PassSums& sums, const FluxScale& scale, const Kernel& kernel,
                                 std::int64_t photons_per_pass, const RadiusController& controller,
                                 std::span<RgbSum> radiance, std::span<double> bias) {
  LUCERNA_CHECK(rows.first + rows.pixels.size() <= sums.size() && radii.size() == sums.size() &&
                sums.evidence().size() >= kCommonColumns);
  const auto pass = static_cast<std::uint64_t>(passes_);
  for (std::size_t pixel = 0; pixel < radius_.size(); ++pixel)
    radius_before_[pixel] = radius_[pixel].radius;
  std::vector<std::int64_t> columns(sums.evidence().size());
  const double luminance_per_quantum = static_cast<double>(Luminance(scale.watts_per_quantum));
  constexpr double kToBias = 1 / (1 - static_cast<double>(kInnerShare * kInnerShare));
  const double per_photon = kernel.Norm() / static_cast<double>(photons_per_pass);
  for (std::size_t row = 0; row < rows.pixels.size(); ++row) {
    const std::size_t block_row = rows.first + row;
    const std::uint32_t pixel = rows.pixels[row];
    const auto radius = static_cast<double>(radii[block_row]);
    const double to_density = per_photon / (radius * radius);
    RgbSum& sum = radiance_sum_[pixel];
    for (int channel = 0; channel < 3; ++channel) {
      const auto c = static_cast<std::size_t>(channel);
      const double flux = static_cast<double>(sums.flux(channel)[block_row]) *
                          static_cast<double>(scale.watts_per_quantum[channel]);
      const double value = static_cast<double>(rows.weights[row][channel]) * flux * to_density;
      sum[c] += value;
      radiance[pixel][c] += value;
    }
    photon_count_[pixel] += sums.counts()[block_row];
    last_radius_[pixel] = radii[block_row];
    last_unit_radius_[pixel] = rows.unit_radii[row];
    for (std::size_t column = 0; column < columns.size(); ++column) {
      columns[column] = sums.evidence()[column][block_row];
    }
    const double blur = static_cast<double>(columns[kBlurColumn]) * kToBias;
    bias[pixel] += blur * luminance_per_quantum * to_density *
                   static_cast<double>(Luminance(rows.weights[row]));
    const double in_unit_radii = radius / static_cast<double>(rows.unit_radii[row]);
    radius_[pixel] = controller.Next(
        radius_[pixel],
        {.photons = static_cast<double>(sums.counts()[block_row]),
         .radius = in_unit_radii,
         .columns = std::span<const std::int64_t>(columns).subspan(kCommonColumns),
         .blur = blur * kernel.Norm() / ((1 << kFluxBits) * in_unit_radii * in_unit_radii)},
        pass, std::span<double>(memory_).subspan(pixel * memory_per_pixel_, memory_per_pixel_));
  }
  ++passes_;
}

}  // namespace lucerna
