#include "client/render_flags.h"

#include <charconv>
#include <cmath>
#include <string_view>
#include <tuple>

#include <CLI/CLI.hpp>

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

void AddImageFlags(CLI::App& command, RenderFlags& flags) {
  command.add_option("--size", flags.size, "width and height in pixels, like 640x480");
  command.add_option("--photons-per-pass", flags.photons_per_pass, "photons of one pass");
  command.add_option("--seed", flags.seed, "another seed, other noise");
  command.add_option("--radius-controller", flags.radius_controller,
                     "ppm, pppm, appm, cppm, frequency, frequency-consistent or frequency-mse");
  command.add_option("--alpha", flags.alpha, "share of new photons kept, between 0 and 1");
  command.add_option("--kernel", flags.kernel, "constant, epanechnikov, biweight or gaussian");
  command.add_option("--bias", flags.bias, "frequency controllers: bias a pixel may have, like 2%");
  command.add_option("--frequency-share", flags.frequency_share,
                     "frequency controllers: share of frequency photons, like 10%");
  command.add_option("--initial-radius", flags.initial_radius,
                     "in scene units, in pixel widths like 1.5px, or auto (3px)");
  command.add_option("--max-depth", flags.max_depth, "scattering events of a path");
  command.add_flag("--use-everything", flags.use_everything,
                   "leave nothing out that the scene does not need, for comparison");
}

void AddStopFlags(CLI::App& command, RenderFlags& flags) {
  command.add_option("--passes", flags.passes, "stop after so many passes");
  command.add_option("--time", flags.time_s, "stop after so many seconds");
  command.add_option("--error", flags.error,
                     "stop when the relative error is at most this, like 2%");
  command.add_option("--photons", flags.photons, "stop after so many photons in all");
}

StatusOr<RenderFlags> WithImageFlags(RenderFlags flags, const std::string& words) {
  CLI::App app;
  app.set_help_flag();
  AddImageFlags(app, flags);
  try {
    app.parse(words);
  } catch (const CLI::ParseError& error) {
    return Misuse(absl::StrCat("\"", words, "\": ", error.what()));
  }
  return flags;
}

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
  if (flags.initial_radius == "auto") {
    overrides.initial_radius = 0;
  } else if (flags.initial_radius) {
    std::string_view text = *flags.initial_radius;
    const bool is_footprints = text.ends_with("px");
    if (is_footprints) text.remove_suffix(2);
    const auto radius = ToNumber<double>(text);
    if (!radius || !std::isfinite(*radius) || *radius <= 0) {
      return Misuse(absl::StrCat("--initial-radius ", *flags.initial_radius,
                                 ": give a radius above 0 in scene units, or in widths of a pixel "
                                 "like 1.5px, or auto"));
    }
    overrides.initial_radius = is_footprints ? 0 : *radius;
    if (is_footprints) overrides.initial_footprints = radius;
  }
  for (const auto& [flag, given, wanted] :
       {std::tuple{"--bias", &flags.bias, &overrides.bias},
        std::tuple{"--frequency-share", &flags.frequency_share, &overrides.frequency_share},
        std::tuple{"--error", &flags.error, &overrides.error}}) {
    if (!*given) continue;
    std::string_view text = **given;
    const bool is_percent = text.ends_with('%');
    if (is_percent) text.remove_suffix(1);
    const auto number = ToNumber<double>(text);
    if (!number) {
      return Misuse(absl::StrCat(flag, " ", **given, ": give a share, like 2% or 0.02"));
    }
    // "3" is hardly ever meant as 300 %.
    if (!is_percent && *number > 1) {
      return Misuse(absl::StrCat(flag, " ", **given, " is ", *number * 100, " %: write ", **given,
                                 "% for ", **given, " percent, or ", *number * 100,
                                 "% if that is meant"));
    }
    *wanted = is_percent ? *number / 100 : *number;
  }
  overrides.passes = flags.passes;
  overrides.photons_per_pass = flags.photons_per_pass;
  overrides.time_s = flags.time_s;
  overrides.photons = flags.photons;
  overrides.seed = flags.seed;
  overrides.alpha = flags.alpha;
  overrides.max_depth = flags.max_depth;
  if (flags.use_everything) overrides.use_everything = true;
  return overrides;
}

}  // namespace lucerna
