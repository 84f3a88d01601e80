// Which columns do accumulations carry for a radius controller, besides photons and flux?
//
// Sums over the photons in a hitpoint's disc, as exact integers like everything else in an
// accumulation. Lengths are relative to the hitpoint's radius, so the numbers have no unit and stay
// in range at every scale.
#pragma once

#include <cstddef>
#include <cstdint>

#include "render/scene/render_settings.h"

namespace lucerna {

enum class Evidence : std::uint8_t { kNone, kSectors, kFrequency };

[[nodiscard]] constexpr Evidence EvidenceOf(RadiusControllerKind kind) {
  if (UsesFrequency(kind)) return Evidence::kFrequency;
  return kind == RadiusControllerKind::kCppm ? Evidence::kSectors : Evidence::kNone;
}

// kSectors: photons in each of twelve cells of equal area: two rings of six sectors.
inline constexpr std::size_t kSectors = 12;

// kFrequency, over the frequency photons: how many, and sums of w, w², w·x and w·x², where w is the
// photon's luminance flux relative to the scene's power and x the spatial spectral trace
// (1/length²) times the squared radius.
enum FrequencyColumn : std::size_t {
  kFrequencyCount,
  kFrequencyWeight,
  kFrequencyWeight2,
  kFrequencyTrace,
  kFrequencyTrace2,
  kFrequencyColumns,
};
// The last four are counted in units of 2^-16.
inline constexpr double kFrequencyUnit = 0x1p-16;
// Larger values of x ask for radii below a hundredth of the present one; they are held here.
inline constexpr float kLargestTrace = 4096;

[[nodiscard]] constexpr std::size_t EvidenceColumns(Evidence evidence) {
  switch (evidence) {
    case Evidence::kNone:
      return 0;
    case Evidence::kSectors:
      return kSectors;
    case Evidence::kFrequency:
      return kFrequencyColumns;
  }
  return 0;
}

}  // namespace lucerna
