// All radius controllers, and the evidence that each uses.
#pragma once

#include <cstdint>

namespace lucerna {

// Columns of an accumulation that a radius controller uses (estimate/evidence.h).
enum class Evidence : std::uint8_t { kNone, kSectors, kCurvature, kFrequency };

// One row for each radius controller, in documentation order:
//   ROW(Name, name in settings, its evidence: an enumerator of Evidence)
// A row declares RadiusControllerKind::kName and MakeName (estimate/radius_controller.h). The
// controller's own file, render/estimate/controllers/, defines MakeName.
#define LUCERNA_RADIUS_CONTROLLERS(ROW)                        \
  ROW(Ppm, "ppm", kNone)                                       \
  ROW(Pppm, "pppm", kNone)                                     \
  ROW(Appm, "appm", kCurvature)                                \
  ROW(Cppm, "cppm", kSectors)                                  \
  ROW(Frequency, "frequency", kFrequency)                      \
  ROW(FrequencyConsistent, "frequency-consistent", kFrequency) \
  ROW(FrequencyMse, "frequency-mse", kFrequency)               \
  ROW(Nearest, "nearest", kNone)                               \
  ROW(Fixed, "fixed", kNone)

enum class RadiusControllerKind : std::uint8_t {
#define LUCERNA_ENUMERATOR(Name, name, evidence) k##Name,
  LUCERNA_RADIUS_CONTROLLERS(LUCERNA_ENUMERATOR)
#undef LUCERNA_ENUMERATOR
};

[[nodiscard]] constexpr Evidence EvidenceOf(RadiusControllerKind kind) {
  switch (kind) {
#define LUCERNA_CASE(Name, name, evidence) \
  case RadiusControllerKind::k##Name:      \
    return Evidence::evidence;
    LUCERNA_RADIUS_CONTROLLERS(LUCERNA_CASE)
#undef LUCERNA_CASE
  }
  return Evidence::kNone;
}

// Whether the job traces frequency photons.
[[nodiscard]] constexpr bool UsesFrequency(RadiusControllerKind kind) {
  return EvidenceOf(kind) == Evidence::kFrequency;
}

}  // namespace lucerna
