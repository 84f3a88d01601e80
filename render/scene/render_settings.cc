#include "render/scene/render_settings.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "render/base/text.h"

namespace lucerna {
namespace {

constexpr int kMaxSide = 65536;
// In the unit that the scene is rendered in: the square of a radius is a float.
constexpr double kLeastRadius = 1e-18;
constexpr double kMostRadius = 1e18;
// An image of 16384 x 16384 fits. Whether it fits into a coordinator's memory too is for that to
// say (server/memory_need.h).
constexpr std::int64_t kMaxPixels = std::int64_t{1} << 28;
constexpr std::int64_t kMaxPhotonsPerPass = 1'000'000'000'000;
constexpr int kMaxDepth = 10'000;
constexpr std::int64_t kDefaultPasses = 16;
constexpr int kDefaultDepth = 5;

constexpr std::array<std::pair<std::string_view, RadiusControllerKind>, 7> kControllers = {{
    {"ppm", RadiusControllerKind::kPpm},
    {"pppm", RadiusControllerKind::kPppm},
    {"appm", RadiusControllerKind::kAppm},
    {"cppm", RadiusControllerKind::kCppm},
    {"frequency", RadiusControllerKind::kFrequency},
    {"frequency-consistent", RadiusControllerKind::kFrequencyConsistent},
    {"frequency-mse", RadiusControllerKind::kFrequencyMse},
}};
constexpr std::array<std::pair<std::string_view, KernelKind>, 4> kKernels = {{
    {"constant", KernelKind::kConstant},
    {"epanechnikov", KernelKind::kEpanechnikov},
    {"biweight", KernelKind::kBiweight},
    {"gaussian", KernelKind::kGaussian},
}};

template <typename Names>
StatusOr<typename Names::value_type::second_type> ParseName(const Names& names,
                                                            std::string_view what,
                                                            std::string_view given) {
  std::string all;
  for (const auto& [name, kind] : names) {
    if (name == given) return kind;
    all += Concat(all.empty() ? "" : ", ", name);
  }
  return absl::InvalidArgumentError(Concat("unknown ", what, " \"", given, "\"; there are ", all));
}

template <typename Names, typename Kind>
std::string_view NameIn(const Names& names, Kind wanted) {
  for (const auto& [name, kind] : names) {
    if (kind == wanted) return name;
  }
  LUCERNA_CHECK(false && "a kind without a name");
  return {};
}

template <typename Number>
Status CheckRange(std::string_view flag, Number value, Number low, Number high) {
  if (value >= low && value <= high) return absl::OkStatus();
  return absl::InvalidArgumentError(
      Concat(flag, " must be from ", low, " to ", high, ", not ", value));
}

// Pixel `x` of `old_size` in an image of `new_size`. Rounded up as pbrt rounds a crop window, so
// that windows which meet still do.
int ScalePixel(int x, int old_size, int new_size) {
  const std::int64_t scaled = std::int64_t{x} * new_size;
  return static_cast<int>((scaled + old_size - 1) / old_size);
}

}  // namespace

std::string_view NameOf(RadiusControllerKind kind) {
  return NameIn(kControllers, kind);
}
std::string_view NameOf(KernelKind kind) {
  return NameIn(kKernels, kind);
}

std::vector<std::string_view> RadiusControllerNames() {
  std::vector<std::string_view> names;
  for (const auto& [name, kind] : kControllers)
    names.push_back(name);
  return names;
}

StatusOr<RadiusControllerKind> ParseRadiusController(std::string_view name) {
  return ParseName(kControllers, "radius controller", name);
}

StatusOr<KernelKind> ParseKernel(std::string_view name) {
  return ParseName(kKernels, "kernel", name);
}

Status SetStopCriteria(const RenderOverrides& until, RenderSettings& settings) {
  const bool has_other_end = until.time_s || until.error || until.photons;
  if (!has_other_end && !until.passes) {
    return absl::InvalidArgumentError(
        "say when to stop, with --passes, --photons, --time or --error");
  }
  if (until.time_s && (!(*until.time_s > 0) || !std::isfinite(*until.time_s))) {
    return absl::InvalidArgumentError(
        Concat("--time must be a number of seconds above 0, not ", *until.time_s));
  }
  if (until.error && !(*until.error >= 1e-6 && *until.error <= 10)) {
    return absl::InvalidArgumentError(
        Concat("--error must be from 0.0001% to 1000%, not ", 100 * *until.error, "%"));
  }
  if (until.photons && *until.photons == 0) {
    return absl::InvalidArgumentError("--photons must be at least 1");
  }
  if (until.passes && (*until.passes < 0 || (*until.passes == 0 && !has_other_end))) {
    return absl::InvalidArgumentError(
        Concat("--passes must be at least 1, or 0 together with --time, --error or --photons, not ",
               *until.passes));
  }
  settings.time_s = until.time_s.value_or(0);
  settings.error = until.error.value_or(0);
  settings.photons = until.photons.value_or(0);
  settings.passes = until.passes.value_or(0);
  return absl::OkStatus();
}

StatusOr<RenderSettings> ResolveSettings(const RenderOverrides& overrides, const Scene& scene) {
  const IntegratorSettings& asked = scene.integrator;
  const FilmSettings& film = scene.film;
  RenderSettings settings;

  if (overrides.width.has_value() != overrides.height.has_value()) {
    return absl::InvalidArgumentError("--size needs both a width and a height, as in 640x480");
  }
  settings.width = overrides.width.value_or(film.width);
  settings.height = overrides.height.value_or(film.height);
  LUCERNA_RETURN_IF_ERROR(CheckRange("--size: the width", settings.width, 1, kMaxSide));
  LUCERNA_RETURN_IF_ERROR(CheckRange("--size: the height", settings.height, 1, kMaxSide));
  settings.crop_x0 = ScalePixel(film.crop_x0, film.width, settings.width);
  settings.crop_y0 = ScalePixel(film.crop_y0, film.height, settings.height);
  // A crop window of a small image can vanish between two pixels; it keeps one then.
  settings.crop_x0 = std::min(settings.crop_x0, settings.width - 1);
  settings.crop_y0 = std::min(settings.crop_y0, settings.height - 1);
  settings.crop_x1 =
      std::max(ScalePixel(film.crop_x1, film.width, settings.width), settings.crop_x0 + 1);
  settings.crop_y1 =
      std::max(ScalePixel(film.crop_y1, film.height, settings.height), settings.crop_y0 + 1);

  RenderOverrides until = overrides;
  const bool has_end = overrides.passes || overrides.time_s || overrides.error || overrides.photons;
  if (!has_end) until.passes = asked.pixel_samples.value_or(kDefaultPasses);
  LUCERNA_RETURN_IF_ERROR(SetStopCriteria(until, settings));

  const std::int64_t pixels =
      std::int64_t{settings.crop_width()} * std::int64_t{settings.crop_height()};
  if (pixels > kMaxPixels) {
    return absl::InvalidArgumentError(
        Concat("--size: ", settings.crop_width(), "x", settings.crop_height(), " are ", pixels,
               " pixels, more than the ", kMaxPixels,
               " of one job; render it in parts, with the film's cropwindow"));
  }
  settings.photons_per_pass =
      overrides.photons_per_pass.value_or(asked.photons_per_pass.value_or(pixels));
  LUCERNA_RETURN_IF_ERROR(CheckRange("--photons-per-pass", settings.photons_per_pass,
                                     std::int64_t{1}, kMaxPhotonsPerPass));

  settings.seed = overrides.seed.value_or(static_cast<std::uint64_t>(asked.seed.value_or(0)));
  settings.radius_controller = overrides.radius_controller.value_or(settings.radius_controller);
  settings.kernel = overrides.kernel.value_or(settings.kernel);
  settings.alpha = overrides.alpha.value_or(settings.alpha);
  if (!(settings.alpha > 0 && settings.alpha < 1)) {
    return absl::InvalidArgumentError(
        Concat("--alpha must be above 0 and below 1, not ", settings.alpha));
  }
  settings.initial_radius = overrides.initial_radius.value_or(asked.initial_radius.value_or(0));
  settings.initial_footprints = overrides.initial_footprints.value_or(kInitialFootprints);
  // Above that the disc of one pixel is the image.
  if (!(settings.initial_footprints >= 1e-3 && settings.initial_footprints <= 1e4)) {
    return absl::InvalidArgumentError(
        Concat("--initial-radius must be from 0.001px to 10000px, not ",
               settings.initial_footprints, "px"));
  }
  settings.bias = overrides.bias.value_or(settings.bias);
  if (!(settings.bias >= 1e-4 && settings.bias <= 1)) {
    return absl::InvalidArgumentError(
        Concat("--bias must be from 0.01% to 100%, not ", 100 * settings.bias, "%"));
  }
  settings.frequency_share = overrides.frequency_share.value_or(settings.frequency_share);
  if (!(settings.frequency_share > 0 && settings.frequency_share <= 1)) {
    return absl::InvalidArgumentError(
        Concat("--frequency-share must be above 0% and at most 100%, not ",
               100 * settings.frequency_share, "%"));
  }
  if (settings.initial_radius != 0 &&
      !(settings.initial_radius >= kLeastRadius * scene.unit &&
        settings.initial_radius <= kMostRadius * scene.unit)) {
    return absl::InvalidArgumentError(
        Concat("--initial-radius must be auto or a length from ", kLeastRadius * scene.unit, " to ",
               kMostRadius * scene.unit, ", not ", settings.initial_radius));
  }
  settings.max_depth = overrides.max_depth.value_or(asked.max_depth.value_or(kDefaultDepth));
  LUCERNA_RETURN_IF_ERROR(CheckRange("--max-depth", settings.max_depth, 1, kMaxDepth));
  settings.use_everything = overrides.use_everything.value_or(false);
  return settings;
}

}  // namespace lucerna
