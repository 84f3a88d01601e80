#include "render/scene/render_settings.h"

#include <algorithm>
#include <array>
#include <tuple>
#include <utility>

#include "render/base/text.h"
#include "render/scene/setting_table.h"

namespace lucerna {
namespace {

// In the unit that the scene is rendered in: the square of a radius is a float.
constexpr double kMinRadius = 1e-18;
constexpr double kMaxRadius = 1e18;
// An image of 16384 x 16384 fits. Whether it fits into a coordinator's memory too is checked by
// the coordinator (server/memory_need.h).
constexpr std::int64_t kMaxPixels = std::int64_t{1} << 28;

constexpr std::array kControllers = {
#define LUCERNA_NAME(Name, name, evidence) \
  std::pair<std::string_view, RadiusControllerKind>(name, RadiusControllerKind::k##Name),
    LUCERNA_RADIUS_CONTROLLERS(LUCERNA_NAME)
#undef LUCERNA_NAME
};
constexpr std::array kKernels = std::apply(
    [](auto... kernels) { return std::array{std::pair(kernels.kName, kernels.kKind)...}; },
    Kernels());

template <typename Names>
StatusOr<typename Names::value_type::second_type> ParseName(const Names& names,
                                                            std::string_view what,
                                                            std::string_view given) {
  std::string all;
  for (const auto& [name, kind] : names) {
    if (name == given) return kind;
    all += Concat(all.empty() ? "" : ", ", name);
  }
  return absl::InvalidArgumentError(Concat("unknown ", what, " \"", given, "\"; known are ", all));
}

template <typename Names, typename Kind>
std::string_view NameIn(const Names& names, Kind wanted) {
  for (const auto& [name, kind] : names) {
    if (kind == wanted) return name;
  }
  LUCERNA_CHECK(false && "a kind without a name");
  return {};
}

template <typename Names>
std::vector<std::string_view> AllNames(const Names& names) {
  std::vector<std::string_view> all;
  for (const auto& [name, kind] : names)
    all.push_back(name);
  return all;
}

// Pixel `x` of `old_size` in an image of `new_size`. Rounded up as pbrt rounds a crop window, so
// that windows which meet still do.
int ScalePixel(int x, int old_size, int new_size) {
  const std::int64_t scaled = std::int64_t{x} * new_size;
  return static_cast<int>((scaled + old_size - 1) / old_size);
}

// The scene's crop window, at the size of the image.
void ScaleCrop(const FilmSettings& film, RenderSettings& settings) {
  settings.crop_x0 = ScalePixel(film.crop_x0, film.width, settings.width);
  settings.crop_y0 = ScalePixel(film.crop_y0, film.height, settings.height);
  // A crop window of a small image can vanish between two pixels; it keeps one then.
  settings.crop_x0 = std::min(settings.crop_x0, settings.width - 1);
  settings.crop_y0 = std::min(settings.crop_y0, settings.height - 1);
  settings.crop_x1 =
      std::max(ScalePixel(film.crop_x1, film.width, settings.width), settings.crop_x0 + 1);
  settings.crop_y1 =
      std::max(ScalePixel(film.crop_y1, film.height, settings.height), settings.crop_y0 + 1);
}

}  // namespace

std::string_view NameOf(RadiusControllerKind kind) {
  return NameIn(kControllers, kind);
}
std::string_view NameOf(KernelKind kind) {
  return NameIn(kKernels, kind);
}

std::vector<std::string_view> RadiusControllerNames() {
  return AllNames(kControllers);
}

std::vector<std::string_view> KernelNames() {
  return AllNames(kKernels);
}

StatusOr<RadiusControllerKind> ParseRadiusController(std::string_view name) {
  return ParseName(kControllers, "radius controller", name);
}

StatusOr<KernelKind> ParseKernel(std::string_view name) {
  return ParseName(kKernels, "kernel", name);
}

Status SetStopCriteria(const RenderOverrides& until, RenderSettings& settings) {
  std::vector<std::string> all;
  int given = 0;
  for (const Setting& setting : AllSettings()) {
    if (setting.role != SettingRole::kStopsJob) continue;
    all.push_back(NameInMessage(setting));
    given += IsGiven(setting, until) ? 1 : 0;
  }
  if (given == 0) {
    return absl::InvalidArgumentError(
        Concat("no stop criterion is given: give ", Listed(all, " or ")));
  }
  RenderOverrides limits = until;
  if (limits.passes == 0 && given > 1) limits.passes.reset();
  RenderSettings changed = settings;
  changed.passes = 0;
  changed.time_s = 0;
  changed.error = 0;
  changed.photons = 0;
  for (const Setting& setting : AllSettings()) {
    if (setting.role != SettingRole::kStopsJob || !IsGiven(setting, limits)) continue;
    ResolveSetting(setting, limits, nullptr, changed);
    LUCERNA_RETURN_IF_ERROR(CheckSetting(setting, changed));
  }
  settings = changed;
  return absl::OkStatus();
}

StatusOr<RenderSettings> ResolveSettings(const RenderOverrides& overrides, const Scene& scene) {
  const FilmSettings& film = scene.film;
  const Setting& size = *FindSetting("size");
  const Setting& radius = *FindSetting("initial_radius");
  RenderSettings settings;
  bool has_end = false;
  for (const Setting& setting : AllSettings()) {
    if (setting.role == SettingRole::kStopsJob) has_end |= IsGiven(setting, overrides);
    ResolveSetting(setting, overrides, &scene, settings);
  }
  if (overrides.width.has_value() != overrides.height.has_value()) {
    return absl::InvalidArgumentError(
        Concat(NameInMessage(size), " needs both a width and a height, as in 640x480"));
  }
  LUCERNA_RETURN_IF_ERROR(CheckSetting(size, settings));
  if (overrides.crop) {
    LUCERNA_RETURN_IF_ERROR(CheckSetting(*FindSetting("crop"), settings));
  } else {
    ScaleCrop(film, settings);
  }

  RenderOverrides until = overrides;
  if (!has_end) until.passes = settings.passes;
  LUCERNA_RETURN_IF_ERROR(SetStopCriteria(until, settings));

  const std::int64_t pixels =
      std::int64_t{settings.crop_width()} * std::int64_t{settings.crop_height()};
  if (pixels > kMaxPixels) {
    return absl::InvalidArgumentError(
        Concat(NameInMessage(size), ": ", settings.crop_width(), "x", settings.crop_height(),
               " are ", pixels, " pixels, more than the ", kMaxPixels,
               " of one job; render it in parts, with the film's cropwindow"));
  }
  const bool is_given = overrides.photons_per_pass || scene.integrator.photons_per_pass;
  if (!is_given) settings.photons_per_pass = pixels;
  if (!overrides.adaptive_photons) settings.adaptive_photons = !is_given;
  for (const Setting& setting : AllSettings()) {
    if (setting.role == SettingRole::kDecidesPixels) {
      LUCERNA_RETURN_IF_ERROR(CheckSetting(setting, settings));
    }
  }
  if (settings.initial_radius != 0 && !(settings.initial_radius >= kMinRadius * scene.unit &&
                                        settings.initial_radius <= kMaxRadius * scene.unit)) {
    return absl::InvalidArgumentError(
        Concat(NameInMessage(radius), " must be auto or a length from ", kMinRadius * scene.unit,
               " to ", kMaxRadius * scene.unit, ", not ", settings.initial_radius));
  }
  return settings;
}

}  // namespace lucerna
