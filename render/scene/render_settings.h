// How is the scene to be rendered?
//
// What the user gives (RenderOverrides), else what the scene file says, else a documented
// default, becomes one RenderSettings: complete, checked, and together with the scene's digest
// all that the image depends on. Unit, range, default and meaning of each setting: its row in
// setting_table.cc.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "render/base/status.h"
#include "render/math/kernel.h"
#include "render/scene/radius_controllers.h"
#include "render/scene/scene.h"

namespace lucerna {

[[nodiscard]] std::string_view NameOf(RadiusControllerKind kind);
[[nodiscard]] std::string_view NameOf(KernelKind kind);
// All, in documentation order.
[[nodiscard]] std::vector<std::string_view> RadiusControllerNames();
[[nodiscard]] std::vector<std::string_view> KernelNames();
// Errors: INVALID_ARGUMENT that lists all names.
[[nodiscard]] StatusOr<RadiusControllerKind> ParseRadiusController(std::string_view name);
[[nodiscard]] StatusOr<KernelKind> ParseKernel(std::string_view name);

// With automatic radii the first radius is this many widths of a pixel at the hitpoint. At one
// photon per pixel and pass it holds about as many photons as a radius chosen by hand for a scene
// would.
inline constexpr float kInitialFootprints = 3;

// One field for each setting of a job. The struct exists twice, so that a setting is declared
// once: with the values themselves (RenderSettings) and with optional values (RenderOverrides).
template <template <typename> class Field>
struct SettingFields {
  Field<int> width{}, height{};  // [pixels]

  // Stop criteria. The job ends when the first of them is met. 0: none.
  Field<std::int64_t> passes{};
  Field<double> time_s{};
  Field<double> error{};  // relative error: the root of relMSE
  Field<std::uint64_t> photons{};

  Field<std::int64_t> photons_per_pass{};
  // Later passes may have more photons (estimate/photon_steps.h).
  Field<bool> adaptive_photons{};
  // Photons are drawn in proportion to power alone, not by what earlier ones found
  // (transport/photon_guide.h).
  Field<bool> unguided{};
  // Paths carry three wavelengths of each pass in place of three colours.
  Field<bool> spectral{};
  Field<std::uint64_t> seed{};
  Field<RadiusControllerKind> radius_controller{};
  Field<double> alpha{};
  Field<KernelKind> kernel{};
  // In scene units; 0: automatic, which is `initial_footprints` widths of a pixel at the hitpoint.
  // The latter has no effect beside a radius in scene units, and is not sent with one.
  Field<double> initial_radius{};
  Field<double> initial_footprints{};
  Field<int> max_depth{};
  Field<double> bias{};
  Field<double> frequency_share{};
  Field<bool> use_everything{};
  // The image has the channel A.
  Field<bool> coverage{};
  // The finished image has the layer `denoised`.
  Field<bool> denoise{};

  bool operator==(const SettingFields&) const = default;
};

template <typename T>
using SettingValue = T;

// A part of an image, [x0, x1) × [y0, y1) [pixels].
struct CropWindow {
  int x0 = 0, x1 = 0, y0 = 0, y1 = 0;
  bool operator==(const CropWindow&) const = default;
};

// What a user gives for one job; absent: the scene file's value, else the default. Width and
// height are given both or not at all; the scene's crop window is scaled along.
struct RenderOverrides : SettingFields<std::optional> {
  std::optional<CropWindow> crop;
  bool operator==(const RenderOverrides&) const = default;
};

struct RenderSettings : SettingFields<SettingValue> {
  // All defaults; those that depend on the scene are 0.
  RenderSettings();

  int crop_x0 = 0, crop_y0 = 0, crop_x1 = 0, crop_y1 = 0;

  [[nodiscard]] int crop_width() const { return crop_x1 - crop_x0; }
  [[nodiscard]] int crop_height() const { return crop_y1 - crop_y0; }
  bool operator==(const RenderSettings&) const = default;
};

// Replaces the stop criteria of `settings` by those of `until`; those that it does not give become
// none. 0 passes beside another criterion are none too.
// Errors: INVALID_ARGUMENT without any, or for a value out of its range.
[[nodiscard]] Status SetStopCriteria(const RenderOverrides& until, RenderSettings& settings);

// Adds to `overrides` what the scene file gives, and the defaults. When the user gives another stop
// criterion but no passes, there is no limit of passes.
// Errors: INVALID_ARGUMENT for a value out of its range, with the setting's name (NameInMessage)
// and its range.
[[nodiscard]] StatusOr<RenderSettings> ResolveSettings(const RenderOverrides& overrides,
                                                       const Scene& scene);

}  // namespace lucerna
