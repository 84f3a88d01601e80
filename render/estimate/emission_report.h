// Which photon was found, and by which hitpoint?
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "render/math/vector.h"
#include "render/transport/photon_guide.h"

namespace lucerna {

// A photon that a hitpoint found, of those that its guide asks to be reported.
struct EmissionReport {
  // The numbers of its emission, times 2^16.
  std::array<std::uint16_t, kEmissionDimensions> numbers{};
  std::uint32_t pixel = 0;  // of the crop window, that found it first: that of the lowest row
  bool operator==(const EmissionReport&) const = default;
};

// The same within one pass.
struct FoundPhoton {
  std::uint64_t index = 0;
  std::array<std::uint16_t, kEmissionDimensions> numbers{};
  std::uint32_t row = 0;  // the first of the hitpoint block that found it
  bool operator==(const FoundPhoton&) const = default;
};

// Where a photon first lands and goes on.
struct FirstScattering {
  Vec3 position;      // [scene units]
  Vec3 direction;     // in which it goes on
  float density = 0;  // of the BSDF [1/sr]; 0: the surface is not diffuse, or there is none
  bool operator==(const FirstScattering&) const = default;
};

// An emission that a pilot path led to (tracing/pilot_paths.h).
struct PilotReport {
  PrimaryNumbers numbers{};
  std::uint32_t pixel = 0;  // of the crop window
  // What the path says the light of this emission adds to the pixel, luminance: the sum over the
  // reports of a pixel, over its paths, estimates what photons bring to it.
  double brought = 0;
  FirstScattering scattering;
};
struct PilotReports {
  std::vector<PilotReport> reports;
  std::uint64_t paths = 0;  // that began at random pixels
};

// No pass or slice has more. What guides ask for is far below; where more photons are found than
// was foreseen, those of later passes and indices are left out.
inline constexpr std::size_t kMostReports = 1 << 17;

[[nodiscard]] inline PrimaryNumbers NumbersOf(
    const std::array<std::uint16_t, kEmissionDimensions>& in_steps) {
  PrimaryNumbers numbers;
  for (std::size_t d = 0; d < kEmissionDimensions; ++d)
    numbers[d] = (static_cast<double>(in_steps[d]) + 0.5) * 0x1p-16;
  return numbers;
}

// The numbers of an emission in the steps of a report.
[[nodiscard]] inline std::array<std::uint16_t, kEmissionDimensions> InSteps(
    const PrimaryNumbers& numbers) {
  std::array<std::uint16_t, kEmissionDimensions> in_steps{};
  for (std::size_t d = 0; d < kEmissionDimensions; ++d)
    in_steps[d] = static_cast<std::uint16_t>(numbers[d] * 0x1p16);
  return in_steps;
}

}  // namespace lucerna
