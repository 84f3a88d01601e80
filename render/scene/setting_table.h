// Which settings does a job have, and what is known about each?
//
// One table with one row for each setting: name, type, unit, range, default, meaning. Flags,
// parsing, the wire, JSON, the text in an image's header, `lucerna help settings` and the
// manual's table are made from it.
//
// To add a setting: its field in render_settings.h, its row in setting_table.cc, the code that uses
// the value, and the manual's table (which a test compares with the rows).
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>

#include "render/base/status.h"
#include "render/scene/render_settings.h"

namespace lucerna {

// One value. The range counts for numbers only; a `high` that is the largest of its type is none.
template <typename T>
struct SettingField {
  std::optional<T> RenderOverrides::*given = nullptr;
  T RenderSettings::*value = nullptr;
  T fallback{};  // when neither the user nor the scene gives a value
  T low{}, high{};
  bool excludes_low = false, excludes_high = false;
  std::optional<T> (*of_scene)(const Scene& scene) = nullptr;
};

// Two values that are given as one: "640x480".
struct SizeFields {
  SettingField<int> width = {}, height = {};
};

// "0.1" in scene units, "3px" in widths of a pixel at the hitpoint, or "auto".
struct RadiusFields {
  SettingField<double> scene_units = {}, footprints = {};
};

// "0,320,0,240" in pixels of the whole image: x from and to, y from and to.
struct CropFields {};

using SettingType =
    std::variant<SettingField<int>, SettingField<std::int64_t>, SettingField<std::uint64_t>,
                 SettingField<double>, SettingField<bool>, SettingField<RadiusControllerKind>,
                 SettingField<KernelKind>, SizeFields, RadiusFields, CropFields>;

enum class SettingRole : std::uint8_t {
  kDecidesPixels,
  kStopsJob,  // decides only after which pass the job stops
};

struct Setting {
  std::string_view name = {};  // words joined by '_'; ends with the unit where that is a time
  SettingRole role = SettingRole::kDecidesPixels;
  std::string_view unit = {};
  bool is_share = false;  // also given in percent, shown in percent
  std::string_view meaning = {};
  std::string_view scene_default =
      {};  // what of the scene file comes before the default; empty: none
  std::string_view default_text = {};                         // empty: the field's fallback
  bool (*is_used)(const RenderSettings& settings) = nullptr;  // nullptr: always
  // For settings that came after jobs were first kept on the disk: the value, as text, with which
  // a job renders as it did before. Empty: every job on a disk has the setting.
  std::string_view in_older_jobs = {};
  SettingType type = {};
};

// All, in documentation order.
[[nodiscard]] std::span<const Setting> AllSettings();
// nullptr when there is none of that name.
[[nodiscard]] const Setting* FindSetting(std::string_view name);

// How messages name a setting: `setting "alpha"`. The client shows it as its flag.
[[nodiscard]] std::string NameInMessage(const Setting& setting);

// Reads a value as a user types it and as it crosses the wire. "2%" and "0.02" are the same share.
// Errors: INVALID_ARGUMENT for what is not of the type. The range is not checked.
[[nodiscard]] Status ParseSetting(const Setting& setting, std::string_view text,
                                  RenderOverrides& overrides);
// Text that ParseSetting reads back to the same bits; absent when the setting is not given.
[[nodiscard]] std::optional<std::string> SettingText(const Setting& setting,
                                                     const RenderOverrides& overrides);
[[nodiscard]] std::string SettingText(const Setting& setting, const RenderSettings& settings);

[[nodiscard]] bool IsGiven(const Setting& setting, const RenderOverrides& overrides);
// The value given in `overrides`, else the scene's, else the default. scene = nullptr: none.
void ResolveSetting(const Setting& setting, const RenderOverrides& overrides, const Scene* scene,
                    RenderSettings& settings);
// A stop criterion that is 0: there is no such limit.
[[nodiscard]] bool IsNoLimit(const Setting& setting, const RenderSettings& settings);
// Errors: INVALID_ARGUMENT when the value is out of its range.
[[nodiscard]] Status CheckSetting(const Setting& setting, const RenderSettings& settings);

// For documentation: "from 1 to 10000", "the scene's `maxdepth`, else 5", "N" or "WxH".
[[nodiscard]] std::string RangeText(const Setting& setting);
[[nodiscard]] std::string DefaultText(const Setting& setting);
[[nodiscard]] std::string ValuePlaceholder(const Setting& setting);

// All settings that decide the pixels, as one line that is the same whenever they are. Passes are
// not among them: how many were merged is known only at the end. The line is part of an image's
// digest, so that its form must stay as it is.
[[nodiscard]] std::string SettingsText(const RenderSettings& settings);

}  // namespace lucerna
