#include "render/scene/setting_table.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <span>
#include <type_traits>

#include "render/base/text.h"
#include "render/scene/saturated_colors.h"

namespace lucerna {
namespace {

constexpr std::int64_t kNoHighInt64 = std::numeric_limits<std::int64_t>::max();
constexpr std::uint64_t kNoHighUint64 = std::numeric_limits<std::uint64_t>::max();
// Text from outside is shown up to this length.
constexpr std::size_t kMaxShownText = 64;

bool TracesFrequency(const RenderSettings& settings) {
  return UsesFrequency(settings.radius_controller);
}

using Overrides = RenderOverrides;
using Settings = RenderSettings;

// In documentation order, which is also the order in SettingsText.
constexpr auto kSettings = std::to_array<Setting>({
    {.name = "size",
     .unit = "pixels",
     .meaning = "width and height of the image",
     .scene_default = "the scene's film",
     .type = SizeFields{.width = {.given = &Overrides::width,
                                  .value = &Settings::width,
                                  .low = 1,
                                  .high = 65536,
                                  .of_scene = [](const Scene& scene) -> std::optional<int> {
                                    return scene.film.width;
                                  }},
                        .height = {.given = &Overrides::height,
                                   .value = &Settings::height,
                                   .low = 1,
                                   .high = 65536,
                                   .of_scene = [](const Scene& scene) -> std::optional<int> {
                                     return scene.film.height;
                                   }}}},
    {.name = "crop",
     .unit = "pixels",
     .meaning = "render a part of the image alone: columns from and to, rows from and to, without "
                "the last",
     .scene_default = "the scene's film",
     .type = CropFields{}},
    {.name = "passes",
     .role = SettingRole::kStopsJob,
     .meaning = "stop after so many passes in all",
     .scene_default = "the scene's `pixelsamples`",
     .default_text = "16; no limit beside another stop criterion",
     .type = SettingField<std::int64_t>{.given = &Overrides::passes,
                                        .value = &Settings::passes,
                                        .fallback = 16,
                                        .low = 1,
                                        .high = kNoHighInt64,
                                        .of_scene =
                                            [](const Scene& scene) -> std::optional<std::int64_t> {
                                          return scene.integrator.pixel_samples;
                                        }}},
    {.name = "time_s",
     .role = SettingRole::kStopsJob,
     .unit = "s",
     .meaning = "stop after so long in all",
     .default_text = "no limit",
     .type = SettingField<double>{.given = &Overrides::time_s,
                                  .value = &Settings::time_s,
                                  .low = 0,
                                  .high = HUGE_VAL,
                                  .excludes_low = true}},
    {.name = "error",
     .role = SettingRole::kStopsJob,
     .is_share = true,
     .meaning = "stop when the 95 % upper bound of the relative error is at most this (the root of "
                "relMSE without the worst 0.1 % of pixels; light that may be missing included)",
     .default_text = "no limit",
     .type =
         SettingField<double>{
             .given = &Overrides::error, .value = &Settings::error, .low = 1e-6, .high = 10}},
    {.name = "photons",
     .role = SettingRole::kStopsJob,
     .meaning = "stop after so many photons in all, at the end of the pass that reaches them",
     .default_text = "no limit",
     .type = SettingField<std::uint64_t>{.given = &Overrides::photons,
                                         .value = &Settings::photons,
                                         .low = 1,
                                         .high = kNoHighUint64}},
    {.name = "photons_per_pass",
     .meaning = "photons of one pass",
     .scene_default = "the scene's `photonsperiteration`",
     .default_text = "one for each pixel",
     .type =
         SettingField<std::int64_t>{
             .given = &Overrides::photons_per_pass,
             .value = &Settings::photons_per_pass,
             .low = 1,
             .high = 1'000'000'000'000,
             .of_scene = [](const Scene& scene) { return scene.integrator.photons_per_pass; }}},
    {.name = "adaptive_photons",
     .meaning =
         "give later passes up to eight times as many photons, where that is best for the noise",
     .default_text = "set unless the photons of a pass are given",
     .type = SettingField<bool>{.given = &Overrides::adaptive_photons,
                                .value = &Settings::adaptive_photons}},
    {.name = "unguided",
     .meaning = "send photons in proportion to power alone, not more where earlier ones have come "
                "into view, and trace one eye path a pixel and pass, not more where they vary",
     .in_older_jobs = "true",
     .type = SettingField<bool>{.given = &Overrides::unguided, .value = &Settings::unguided}},
    {.name = "spectral",
     .meaning = "carry wavelengths in place of three colours; `--spectral=false` for three colours",
     .default_text = "set where a colour is saturated or smooth glass disperses",
     .in_older_jobs = "false",
     .type = SettingField<bool>{.given = &Overrides::spectral,
                                .value = &Settings::spectral,
                                .of_scene = [](const Scene& scene) -> std::optional<bool> {
                                  return HasSaturatedColors(scene);
                                }}},
    {.name = "seed",
     .meaning = "another seed gives other noise",
     .scene_default = "the scene's `seed`",
     .type =
         SettingField<std::uint64_t>{
             .given = &Overrides::seed,
             .value = &Settings::seed,
             .low = 0,
             .high = kNoHighUint64,
             .of_scene = [](const Scene& scene) -> std::optional<std::uint64_t> {
               if (!scene.integrator.seed) return std::nullopt;
               return static_cast<std::uint64_t>(*scene.integrator.seed);
             }}},
    {.name = "radius_controller",
     .meaning = "the rule by which radii change",
     .type = SettingField<RadiusControllerKind>{.given = &Overrides::radius_controller,
                                                .value = &Settings::radius_controller,
                                                .fallback = RadiusControllerKind::kAppm}},
    {.name = "alpha",
     .meaning = "ppm and pppm: share of new photons that a shrinking radius keeps",
     .default_text = "2/3",
     .type = SettingField<double>{.given = &Overrides::alpha,
                                  .value = &Settings::alpha,
                                  .fallback = 2.0 / 3,
                                  .low = 0,
                                  .high = 1,
                                  .excludes_low = true,
                                  .excludes_high = true}},
    {.name = "kernel",
     .meaning = "weight of a photon by its distance from the hitpoint",
     .type = SettingField<KernelKind>{.given = &Overrides::kernel,
                                      .value = &Settings::kernel,
                                      .fallback = KernelKind::kEpanechnikov}},
    {.name = "initial_radius",
     .meaning = "first radius, in scene units or in widths of a pixel at the hitpoint",
     .scene_default = "the scene's `radius`",
     .default_text = "`auto`: 3px",
     .type = RadiusFields{.scene_units = {.given = &Overrides::initial_radius,
                                          .value = &Settings::initial_radius,
                                          .low = 0,
                                          .high = HUGE_VAL,
                                          .excludes_low = true,
                                          .of_scene =
                                              [](const Scene& scene) {
                                                return scene.integrator.initial_radius;
                                              }},
                          // Above the highest the disc of one pixel is the image.
                          .footprints = {.given = &Overrides::initial_footprints,
                                         .value = &Settings::initial_footprints,
                                         .fallback = kInitialFootprints,
                                         .low = 1e-3,
                                         .high = 1e4}}},
    {.name = "max_depth",
     .meaning = "scattering events of an eye path, and of a photon path",
     .scene_default = "the scene's `maxdepth`",
     .type = SettingField<int>{.given = &Overrides::max_depth,
                               .value = &Settings::max_depth,
                               .fallback = 5,
                               .low = 1,
                               .high = 10'000,
                               .of_scene =
                                   [](const Scene& scene) { return scene.integrator.max_depth; }}},
    {.name = "bias",
     .is_share = true,
     .meaning = "frequency controllers: relative bias that a pixel may have",
     .is_used = TracesFrequency,
     .type = SettingField<double>{.given = &Overrides::bias,
                                  .value = &Settings::bias,
                                  .fallback = 0.02,
                                  .low = 1e-4,
                                  .high = 1}},
    {.name = "frequency_share",
     .is_share = true,
     .meaning = "frequency controllers: share of photons that carry a spectrum",
     .is_used = TracesFrequency,
     .type = SettingField<double>{.given = &Overrides::frequency_share,
                                  .value = &Settings::frequency_share,
                                  .fallback = 0.05,
                                  .low = 0,
                                  .high = 1,
                                  .excludes_low = true}},
    {.name = "use_everything",
     .meaning = "leave nothing out that the scene does not need, for comparison",
     .type = SettingField<bool>{.given = &Overrides::use_everything,
                                .value = &Settings::use_everything}},
    {.name = "coverage",
     .meaning = "write the channel A: which share of a pixel meets a surface",
     .in_older_jobs = "false",
     .type = SettingField<bool>{.given = &Overrides::coverage, .value = &Settings::coverage}},
    {.name = "denoise",
     .meaning = "write the layer `denoised` at the end: the image filtered, and how wrong that is",
     .in_older_jobs = "false",
     .type = SettingField<bool>{.given = &Overrides::denoise, .value = &Settings::denoise}},
});

template <typename... Functions>
struct Overloaded : Functions... {
  using Functions::operator()...;
};
// clang 14 does not deduce the arguments of aggregates.
template <typename... Functions>
Overloaded(Functions...) -> Overloaded<Functions...>;

Status Invalid(const Setting& setting, std::string_view text) {
  return absl::InvalidArgumentError(Concat(NameInMessage(setting), " ", text));
}

Status NotOfTheType(const Setting& setting, std::string_view wanted, std::string_view text) {
  return Invalid(setting,
                 Concat("must be ", wanted, ", not \"", text.substr(0, kMaxShownText), "\""));
}

// The shortest text that reads back as the same number.
template <typename Number>
std::string NumberText(Number value) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

// The whole of `text` as a finite number, or nothing.
template <typename Number>
std::optional<Number> ToNumber(std::string_view text) {
  Number value = 0;
  const char* end = text.data() + text.size();
  const auto [stopped, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc() || stopped != end) return std::nullopt;
  if constexpr (std::is_floating_point_v<Number>) {
    if (!std::isfinite(value)) return std::nullopt;
  }
  return value;
}

// Ends of numbers. Of times [s]:
struct NumberUnit {
  std::string_view ending;
  double factor;
};
constexpr std::array<NumberUnit, 4> kTimes = {{{"ms", 1e-3}, {"s", 1}, {"m", 60}, {"h", 3600}}};
// Of all others:
constexpr std::array<NumberUnit, 4> kMultiples = {
    {{"k", 1e3}, {"M", 1e6}, {"G", 1e9}, {"T", 1e12}}};

// A number with one of these ends; of whole numbers, only what is whole.
template <typename Number>
std::optional<Number> WithUnit(std::span<const NumberUnit> units, std::string_view text) {
  for (const NumberUnit& unit : units) {
    if (!text.ends_with(unit.ending)) continue;
    const auto number = ToNumber<double>(text.substr(0, text.size() - unit.ending.size()));
    if (!number) return std::nullopt;
    const double value = *number * unit.factor;
    if constexpr (!std::is_floating_point_v<Number>) {
      // Beyond 2^53 doubles skip whole numbers.
      const bool fits = value >= (std::is_unsigned_v<Number> ? 0.0 : -0x1p53) && value <= 0x1p53;
      if (!fits || value != std::floor(value)) return std::nullopt;
    }
    return static_cast<Number>(value);
  }
  return std::nullopt;
}

// Parsing, by type.

template <typename Number>
Status Parse(const Setting& setting, const SettingField<Number>& field, std::string_view text,
             RenderOverrides& overrides) {
  std::string_view digits = text;
  const bool is_percent = setting.is_share && digits.ends_with('%');
  if (is_percent) digits.remove_suffix(1);
  const bool is_time = setting.unit == "s";
  std::optional<Number> number = ToNumber<Number>(digits);
  if (!number) number = WithUnit<Number>(is_time ? kTimes : kMultiples, digits);
  if (!number) {
    return NotOfTheType(setting,
                        setting.is_share                   ? "a share, like 2% or 0.02"
                        : is_time                          ? "a time, like 90, 90s, 5m or 1.5h"
                        : std::is_floating_point_v<Number> ? "a number"
                        : std::is_unsigned_v<Number> ? "a whole number from 0, like 2000, 10k or 5M"
                                                     : "a whole number, like 2000, 10k or 5M",
                        text);
  }
  overrides.*field.given = is_percent ? *number / 100 : *number;
  return absl::OkStatus();
}

Status Parse(const Setting& setting, const SettingField<bool>& field, std::string_view text,
             RenderOverrides& overrides) {
  if (text != "true" && text != "false") return NotOfTheType(setting, "true or false", text);
  overrides.*field.given = text == "true";
  return absl::OkStatus();
}

template <typename Kind>
Status PutKind(const Setting& setting, const SettingField<Kind>& field, StatusOr<Kind> kind,
               RenderOverrides& overrides) {
  if (!kind.ok()) {
    return absl::InvalidArgumentError(
        Concat(NameInMessage(setting), ": ", std::string(kind.status().message())));
  }
  overrides.*field.given = *kind;
  return absl::OkStatus();
}

Status Parse(const Setting& setting, const SettingField<RadiusControllerKind>& field,
             std::string_view text, RenderOverrides& overrides) {
  return PutKind(setting, field, ParseRadiusController(text), overrides);
}

Status Parse(const Setting& setting, const SettingField<KernelKind>& field, std::string_view text,
             RenderOverrides& overrides) {
  return PutKind(setting, field, ParseKernel(text), overrides);
}

Status Parse(const Setting& setting, const SizeFields& fields, std::string_view text,
             RenderOverrides& overrides) {
  const std::size_t cross = text.find('x');
  const auto width = ToNumber<int>(text.substr(0, cross));
  const auto height =
      cross == std::string_view::npos ? std::nullopt : ToNumber<int>(text.substr(cross + 1));
  if (!width || !height || *width <= 0 || *height <= 0) {
    return NotOfTheType(setting, "a width and a height in pixels, like 640x480", text);
  }
  overrides.*fields.width.given = width;
  overrides.*fields.height.given = height;
  return absl::OkStatus();
}

Status Parse(const Setting& setting, const RadiusFields& fields, std::string_view text,
             RenderOverrides& overrides) {
  std::string_view digits = text;
  const bool is_footprints = digits.ends_with("px");
  if (is_footprints) digits.remove_suffix(2);
  const auto radius = ToNumber<double>(digits);
  const bool is_auto = text == "auto";
  if (!is_auto && (!radius || *radius <= 0)) {
    return NotOfTheType(setting,
                        "a radius above 0 in scene units, or in widths of a pixel like 1.5px, or "
                        "auto",
                        text);
  }
  overrides.*fields.scene_units.given = is_auto || is_footprints ? 0 : *radius;
  overrides.*fields.footprints.given = is_footprints ? radius : std::nullopt;
  return absl::OkStatus();
}

Status Parse(const Setting& setting, const CropFields& /*fields*/, std::string_view text,
             RenderOverrides& overrides) {
  std::array<int, 4> bounds{};
  std::string_view rest = text;
  bool is_good = true;
  for (std::size_t i = 0; i < bounds.size(); ++i) {
    const std::size_t comma = i + 1 < bounds.size() ? rest.find(',') : rest.size();
    const auto bound = ToNumber<int>(rest.substr(0, comma));
    is_good = is_good && comma != std::string_view::npos && bound.has_value();
    if (!is_good) break;
    bounds[i] = *bound;
    rest.remove_prefix(std::min(comma + 1, rest.size()));
  }
  if (!is_good) {
    return NotOfTheType(setting, "columns and rows in pixels, X0,X1,Y0,Y1, like 0,320,0,240", text);
  }
  overrides.crop = CropWindow{bounds[0], bounds[1], bounds[2], bounds[3]};
  return absl::OkStatus();
}

// Text of values, by type.

template <typename T>
std::string TextOf(T value) {
  if constexpr (std::is_same_v<T, bool>) {
    return value ? "true" : "false";
  } else if constexpr (std::is_enum_v<T>) {
    return std::string(NameOf(value));
  } else {
    return NumberText(value);
  }
}

std::string SizeText(int width, int height) {
  return Concat(width, "x", height);
}

std::string CropText(const CropWindow& crop) {
  return Concat(crop.x0, ",", crop.x1, ",", crop.y0, ",", crop.y1);
}

CropWindow CropOf(const RenderSettings& settings) {
  return {settings.crop_x0, settings.crop_x1, settings.crop_y0, settings.crop_y1};
}

// "auto" alone is the default.
std::string RadiusText(double scene_units, double footprints) {
  if (scene_units > 0) return NumberText(scene_units);
  if (footprints == kInitialFootprints) return "auto";
  return NumberText(footprints) + "px";
}

// Ranges, by type.

// The largest number of a type stands for none.
template <typename Number>
bool HasHigh(const SettingField<Number>& field) {
  return field.high < (std::is_floating_point_v<Number> ? std::numeric_limits<Number>::infinity()
                                                        : std::numeric_limits<Number>::max());
}

template <typename Number>
std::string ShownNumber(Number number, bool is_share) {
  return is_share ? Concat(100 * number, "%") : Concat(number);
}

template <typename Number>
std::string BoundsText(const SettingField<Number>& field, bool is_share,
                       std::string_view suffix = "") {
  const std::string low = ShownNumber(field.low, is_share) + std::string(suffix);
  const std::string high = ShownNumber(field.high, is_share) + std::string(suffix);
  const std::string_view least = field.excludes_low ? "above " : "at least ";
  if (!HasHigh(field)) return Concat(least, low);
  if (!field.excludes_low && !field.excludes_high) return Concat("from ", low, " to ", high);
  return Concat(least, low, " and ", field.excludes_high ? "below " : "at most ", high);
}

// Also false for NaN.
template <typename Number>
bool IsInRange(const SettingField<Number>& field, Number value) {
  return (field.excludes_low ? value > field.low : value >= field.low) &&
         (field.excludes_high ? value < field.high : value <= field.high) &&
         (!std::is_floating_point_v<Number> || std::isfinite(static_cast<double>(value)));
}

template <typename T>
constexpr bool kHasRange = std::is_arithmetic_v<T> && !std::is_same_v<T, bool>;

template <typename T>
void Resolve(const SettingField<T>& field, const RenderOverrides& overrides, const Scene* scene,
             RenderSettings& settings) {
  std::optional<T> value = overrides.*field.given;
  if (!value && scene != nullptr && field.of_scene != nullptr) value = field.of_scene(*scene);
  settings.*field.value = value.value_or(field.fallback);
}

}  // namespace

RenderSettings::RenderSettings() {
  for (const Setting& setting : kSettings)
    ResolveSetting(setting, {}, nullptr, *this);
}

std::span<const Setting> AllSettings() {
  return kSettings;
}

const Setting* FindSetting(std::string_view name) {
  const auto found = std::ranges::find(kSettings, name, &Setting::name);
  return found == kSettings.end() ? nullptr : &*found;
}

std::string NameInMessage(const Setting& setting) {
  return Concat("setting \"", setting.name, "\"");
}

Status ParseSetting(const Setting& setting, std::string_view text, RenderOverrides& overrides) {
  return std::visit([&](const auto& fields) { return Parse(setting, fields, text, overrides); },
                    setting.type);
}

std::optional<std::string> SettingText(const Setting& setting, const RenderOverrides& overrides) {
  if (!IsGiven(setting, overrides)) return std::nullopt;
  return std::visit(
      Overloaded{[&](const SizeFields& fields) {
                   // A missing side becomes one that ParseSetting refuses.
                   return SizeText((overrides.*fields.width.given).value_or(0),
                                   (overrides.*fields.height.given).value_or(0));
                 },
                 [&](const RadiusFields& fields) {
                   return RadiusText(
                       (overrides.*fields.scene_units.given).value_or(0),
                       (overrides.*fields.footprints.given).value_or(fields.footprints.fallback));
                 },
                 [&](const CropFields&) { return CropText(*overrides.crop); },
                 [&](const auto& field) { return TextOf(*(overrides.*field.given)); }},
      setting.type);
}

std::string SettingText(const Setting& setting, const RenderSettings& settings) {
  return std::visit(Overloaded{[&](const SizeFields& fields) {
                                 return SizeText(settings.*fields.width.value,
                                                 settings.*fields.height.value);
                               },
                               [&](const RadiusFields& fields) {
                                 return RadiusText(settings.*fields.scene_units.value,
                                                   settings.*fields.footprints.value);
                               },
                               [&](const CropFields&) { return CropText(CropOf(settings)); },
                               [&](const auto& field) { return TextOf(settings.*field.value); }},
                    setting.type);
}

bool IsGiven(const Setting& setting, const RenderOverrides& overrides) {
  return std::visit(
      Overloaded{[&](const SizeFields& fields) {
                   return (overrides.*fields.width.given).has_value() ||
                          (overrides.*fields.height.given).has_value();
                 },
                 [&](const RadiusFields& fields) {
                   return (overrides.*fields.scene_units.given).has_value() ||
                          (overrides.*fields.footprints.given).has_value();
                 },
                 [&](const CropFields&) { return overrides.crop.has_value(); },
                 [&](const auto& field) { return (overrides.*field.given).has_value(); }},
      setting.type);
}

void ResolveSetting(const Setting& setting, const RenderOverrides& overrides, const Scene* scene,
                    RenderSettings& settings) {
  std::visit(Overloaded{[&](const SizeFields& fields) {
                          Resolve(fields.width, overrides, scene, settings);
                          Resolve(fields.height, overrides, scene, settings);
                        },
                        [&](const RadiusFields& fields) {
                          Resolve(fields.scene_units, overrides, scene, settings);
                          Resolve(fields.footprints, overrides, scene, settings);
                        },
                        [&](const CropFields&) {
                          // The scene's is scaled to the size (ResolveSettings).
                          if (!overrides.crop) return;
                          settings.crop_x0 = overrides.crop->x0;
                          settings.crop_x1 = overrides.crop->x1;
                          settings.crop_y0 = overrides.crop->y0;
                          settings.crop_y1 = overrides.crop->y1;
                        },
                        [&](const auto& field) { Resolve(field, overrides, scene, settings); }},
             setting.type);
}

bool IsNoLimit(const Setting& setting, const RenderSettings& settings) {
  return setting.role == SettingRole::kStopsJob && SettingText(setting, settings) == "0";
}

Status CheckSetting(const Setting& setting, const RenderSettings& settings) {
  const auto out_of_range = [&](std::string_view shown) {
    return Invalid(setting, Concat("must be ", RangeText(setting), ", not ", shown));
  };
  return std::visit(
      Overloaded{[&](const SizeFields& fields) {
                   const int width = settings.*fields.width.value;
                   const int height = settings.*fields.height.value;
                   return IsInRange(fields.width, width) && IsInRange(fields.height, height)
                              ? absl::OkStatus()
                              : Invalid(setting,
                                        Concat("must have sides ", BoundsText(fields.width, false),
                                               ", not ", SizeText(width, height)));
                 },
                 [&](const RadiusFields& fields) {
                   const double scene_units = settings.*fields.scene_units.value;
                   const double footprints = settings.*fields.footprints.value;
                   if (!IsInRange(fields.footprints, footprints)) {
                     return out_of_range(Concat(footprints, "px"));
                   }
                   return scene_units == 0 || IsInRange(fields.scene_units, scene_units)
                              ? absl::OkStatus()
                              : out_of_range(Concat(scene_units));
                 },
                 [&](const CropFields&) {
                   const CropWindow crop = CropOf(settings);
                   const bool is_within = crop.x0 >= 0 && crop.x0 < crop.x1 &&
                                          crop.x1 <= settings.width && crop.y0 >= 0 &&
                                          crop.y0 < crop.y1 && crop.y1 <= settings.height;
                   return is_within
                              ? absl::OkStatus()
                              : Invalid(setting, Concat("must lie within the image of ",
                                                        SizeText(settings.width, settings.height),
                                                        " pixels, not be ", CropText(crop)));
                 },
                 [&]<typename T>(const SettingField<T>& field) {
                   if constexpr (kHasRange<T>) {
                     const T value = settings.*field.value;
                     if (!IsInRange(field, value)) {
                       return out_of_range(ShownNumber(value, setting.is_share));
                     }
                   }
                   return absl::OkStatus();
                 }},
      setting.type);
}

std::string RangeText(const Setting& setting) {
  return std::visit(Overloaded{[&](const SizeFields& fields) {
                                 return Concat("each side ", BoundsText(fields.width, false));
                               },
                               [&](const RadiusFields& fields) {
                                 return Concat(
                                     BoundsText(fields.scene_units, false), " in scene units, ",
                                     BoundsText(fields.footprints, false, "px"), ", or auto");
                               },
                               [](const CropFields&) { return std::string("within the image"); },
                               [&]<typename T>(const SettingField<T>& field) -> std::string {
                                 if constexpr (std::is_same_v<T, RadiusControllerKind>) {
                                   return Listed(RadiusControllerNames(), " or ");
                                 } else if constexpr (std::is_same_v<T, KernelKind>) {
                                   return Listed(KernelNames(), " or ");
                                 } else if constexpr (kHasRange<T>) {
                                   return BoundsText(field, setting.is_share);
                                 } else {
                                   return "true or false";
                                 }
                               }},
                    setting.type);
}

std::string DefaultText(const Setting& setting) {
  std::string text(setting.default_text);
  if (text.empty()) {
    text = std::visit(Overloaded{[&](const SizeFields&) { return std::string(); },
                                 [&](const RadiusFields&) { return std::string("auto"); },
                                 [](const CropFields&) { return std::string(); },
                                 [&]<typename T>(const SettingField<T>& field) {
                                   if constexpr (kHasRange<T>) {
                                     return ShownNumber(field.fallback, setting.is_share);
                                   } else {
                                     return TextOf(field.fallback);
                                   }
                                 }},
                      setting.type);
  }
  if (setting.scene_default.empty()) return text;
  return text.empty() ? std::string(setting.scene_default)
                      : Concat(setting.scene_default, ", else ", text);
}

std::string ValuePlaceholder(const Setting& setting) {
  return std::visit(Overloaded{[](const SizeFields&) { return std::string("WxH"); },
                               [](const RadiusFields&) { return std::string("R|Npx|auto"); },
                               [](const CropFields&) { return std::string("X0,X1,Y0,Y1"); },
                               [](const SettingField<bool>&) { return std::string(); },
                               [&](const SettingField<double>&) {
                                 return std::string(setting.is_share ? "P%" : "X");
                               },
                               []<typename T>(const SettingField<T>&) {
                                 return std::string(std::is_enum_v<T> ? "NAME" : "N");
                               }},
                    setting.type);
}

std::string SettingsText(const RenderSettings& settings) {
  std::string line;
  for (const Setting& setting : kSettings) {
    if (setting.role != SettingRole::kDecidesPixels) continue;
    if (setting.is_used != nullptr && !setting.is_used(settings)) continue;
    // Stands behind the size.
    if (std::holds_alternative<CropFields>(setting.type)) continue;
    std::string name(setting.name);
    std::ranges::replace(name, '_', '-');
    const std::string value = SettingText(setting, settings);
    const bool is_flag = std::holds_alternative<SettingField<bool>>(setting.type);
    if (is_flag && value == "false") continue;
    line += Concat(line.empty() ? "" : " ", name, is_flag ? "" : "=", is_flag ? "" : value);
    if (std::holds_alternative<SizeFields>(setting.type)) {
      line += Concat(" crop=", settings.crop_x0, ",", settings.crop_y0, ",", settings.crop_x1, ",",
                     settings.crop_y1);
    }
  }
  return line;
}

}  // namespace lucerna
