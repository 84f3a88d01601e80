// How is the scene to be rendered?
//
// What the user gives (RenderOverrides), else what the scene file says, else a documented
// default, becomes one RenderSettings: complete, checked, and together with the scene's digest
// all that the image depends on.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "render/base/status.h"
#include "render/scene/scene.h"

namespace lucerna {

enum class RadiusControllerKind : std::uint8_t {
  kPpm,
  kPppm,
  kAppm,
  kCppm,
  kFrequency,
  kFrequencyConsistent,
  kFrequencyMse,
};
enum class KernelKind : std::uint8_t { kConstant, kEpanechnikov, kBiweight, kGaussian };

// Whether the job traces frequency photons.
[[nodiscard]] constexpr bool UsesFrequency(RadiusControllerKind kind) {
  return kind == RadiusControllerKind::kFrequency ||
         kind == RadiusControllerKind::kFrequencyConsistent ||
         kind == RadiusControllerKind::kFrequencyMse;
}

[[nodiscard]] std::string_view NameOf(RadiusControllerKind kind);
[[nodiscard]] std::string_view NameOf(KernelKind kind);
// Of all there are, in the order in which they are told.
[[nodiscard]] std::vector<std::string_view> RadiusControllerNames();
// Errors: INVALID_ARGUMENT that lists the names there are.
[[nodiscard]] StatusOr<RadiusControllerKind> ParseRadiusController(std::string_view name);
[[nodiscard]] StatusOr<KernelKind> ParseKernel(std::string_view name);

// With automatic radii the first radius is this many widths of a pixel at the hitpoint. At one
// photon per pixel and pass it holds about as many photons as a radius chosen by hand for a scene
// would.
inline constexpr float kInitialFootprints = 3;

// What a user may say about one job; absent means "as the scene file has it, else the default".
struct RenderOverrides {
  std::optional<int> width, height;  // both or neither; the crop window is scaled along
  std::optional<std::int64_t> passes;
  std::optional<std::int64_t> photons_per_pass;
  std::optional<double> time_s;
  std::optional<double> error;
  std::optional<std::uint64_t> photons;
  std::optional<std::uint64_t> seed;
  std::optional<RadiusControllerKind> radius_controller;
  std::optional<double> alpha;
  std::optional<KernelKind> kernel;
  std::optional<double> bias;
  std::optional<double> frequency_share;
  // A radius in scene units, or 0 for "auto".
  std::optional<double> initial_radius;
  // What "auto" is, in widths of a pixel at the hitpoint.
  std::optional<double> initial_footprints;
  std::optional<int> max_depth;
  std::optional<bool> use_everything;
};

struct RenderSettings {
  int width = 0, height = 0;  // [pixels]
  int crop_x0 = 0, crop_y0 = 0, crop_x1 = 0, crop_y1 = 0;
  std::int64_t passes = 16;  // stop after so many; 0: no limit
  double time_s = 0;         // stop after so long; 0: no limit
  // Stop when the relative error (the root of relMSE) is known to be at most this; 0: no target.
  double error = 0;
  std::uint64_t photons = 0;  // stop after so many in all, at the end of a pass; 0: no limit
  std::int64_t photons_per_pass = 0;
  std::uint64_t seed = 0;
  RadiusControllerKind radius_controller = RadiusControllerKind::kAppm;
  double alpha = 2.0 / 3;  // share of new photons kept by ppm and pppm, in (0, 1)
  KernelKind kernel = KernelKind::kEpanechnikov;
  // Frequency controllers only: the relative bias that a pixel may have, and the share of photons
  // that carry a spectrum.
  double bias = 0.02;
  double frequency_share = 0.05;
  double initial_radius = 0;  // scene units; 0: auto, from each pixel's footprint
  double initial_footprints = kInitialFootprints;  // the automatic radius, in footprints
  int max_depth = 5;  // scattering events of an eye path, and of a photon path
  // Leave nothing out that the scene does not need (see needs.h): for comparison.
  bool use_everything = false;

  [[nodiscard]] int crop_width() const { return crop_x1 - crop_x0; }
  [[nodiscard]] int crop_height() const { return crop_y1 - crop_y0; }
  bool operator==(const RenderSettings&) const = default;
};

// Fills in what `overrides` leaves open. When the user gives a time, an error or a number of
// photons and no passes, passes is 0. Errors: INVALID_ARGUMENT for a value out of its range, naming
// the flag and the range. Replaces the stop criteria of `settings` by those of `until`: those it
// leaves open are none. Errors: INVALID_ARGUMENT without any, or for a value out of its range.
[[nodiscard]] Status SetStopCriteria(const RenderOverrides& until, RenderSettings& settings);

[[nodiscard]] StatusOr<RenderSettings> ResolveSettings(const RenderOverrides& overrides,
                                                       const Scene& scene);

}  // namespace lucerna
