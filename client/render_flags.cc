#include "client/render_flags.h"

#include <charconv>
#include <cmath>
#include <string_view>
#include <tuple>

#include "client/exit_code.h"

namespace lucerna {
namespace {

// The whole of `text` as a number, or nothing.
template <typename Number>
std::optional<Number> ToNumber(std::string_view text) {
  Number value = 0;
  const char* end = text.data() + text.size();
  const auto [stopped, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc() || stopped != end) return std::nullopt;
  return value;
}

Status Misuse(const std::string& message) {
  return Failure(ExitCode::kUsage, message);
}

}  // namespace

StatusOr<RenderOverrides> ToOverrides(const RenderFlags& flags) {
  RenderOverrides overrides;
  if (flags.size) {
    const std::string_view size = *flags.size;
    const std::size_t cross = size.find('x');
    const auto width = ToNumber<int>(size.substr(0, cross));
    const auto height =
        cross == std::string_view::npos ? std::nullopt : ToNumber<int>(size.substr(cross + 1));
    if (!width || !height || *width <= 0 || *height <= 0) {
      return Misuse(
          absl::StrCat("--size ", *flags.size, ": give width and height in pixels, like 640x480"));
    }
    overrides.width = width;
    overrides.height = height;
  }
  if (flags.radius_controller) {
    const auto kind = ParseRadiusController(*flags.radius_controller);
    if (!kind.ok()) {
      return Misuse(absl::StrCat("--radius-controller: ", kind.status().message()));
    }
    overrides.radius_controller = *kind;
  }
  if (flags.kernel) {
    const auto kind = ParseKernel(*flags.kernel);
    if (!kind.ok()) return Misuse(absl::StrCat("--kernel: ", kind.status().message()));
    overrides.kernel = *kind;
  }
  if (flags.initial_radius) {
    const auto radius =
        *flags.initial_radius == "auto" ? 0.0 : ToNumber<double>(*flags.initial_radius);
    const bool is_zero = *flags.initial_radius != "auto" && radius == 0.0;
    if (!radius || is_zero || !std::isfinite(*radius) || *radius < 0) {
      return Misuse(absl::StrCat("--initial-radius ", *flags.initial_radius,
                                 ": give a radius above 0 in scene units, or auto"));
    }
    overrides.initial_radius = radius;
  }
  for (const auto& [flag, given, wanted] :
       {std::tuple{"--bias", &flags.bias, &overrides.bias},
        std::tuple{"--frequency-share", &flags.frequency_share, &overrides.frequency_share}}) {
    if (!*given) continue;
    std::string_view text = **given;
    const bool is_percent = text.ends_with('%');
    if (is_percent) text.remove_suffix(1);
    const auto number = ToNumber<double>(text);
    if (!number) {
      return Misuse(absl::StrCat(flag, " ", **given, ": give a share, like 2% or 0.02"));
    }
    *wanted = is_percent ? *number / 100 : *number;
  }
  overrides.passes = flags.passes;
  overrides.photons_per_pass = flags.photons_per_pass;
  overrides.time_s = flags.time_s;
  overrides.seed = flags.seed;
  overrides.alpha = flags.alpha;
  overrides.max_depth = flags.max_depth;
  return overrides;
}

}  // namespace lucerna
