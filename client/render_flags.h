// Command-line flags of a job's settings.
//
// Each row of the table of settings is a flag: `photons_per_pass` is --photons-per-pass, `time_s`
// is --time. What is not given is left to the scene file, then to the defaults.
#pragma once

#include <string>
#include <string_view>

#include "render/base/status.h"
#include "render/scene/render_settings.h"
#include "render/scene/setting_table.h"

namespace CLI {
class App;
}  // namespace CLI

namespace lucerna {

// "--photons-per-pass".
[[nodiscard]] std::string FlagOf(const Setting& setting);

// `message` with flags in place of the names of settings (NameInMessage).
[[nodiscard]] std::string WithFlagNames(std::string message);

// Gives `command` the flag of every setting with the role. Parsing writes to `overrides`, which
// outlives the command, and refuses what is not of the setting's type. Ranges are for
// ResolveSettings to check.
void AddSettingFlags(CLI::App& command, SettingRole role, RenderOverrides& overrides);
// One of them, with another help text.
void AddSettingFlag(CLI::App& command, std::string_view name, RenderOverrides& overrides,
                    const std::string& help);
// Shows `fallback` in the help of one of them, where a command has its own default.
void ShowDefault(CLI::App& command, std::string_view name, const std::string& fallback);

// `overrides` with the changes in `words`, like "--alpha 0.5 --kernel constant". Stop criteria are
// not accepted.
// Errors: Failure(kUsage) that names the flag.
[[nodiscard]] StatusOr<RenderOverrides> WithImageFlags(RenderOverrides overrides,
                                                       const std::string& words);

// All settings with their flags, units, ranges and defaults, as a Markdown table.
[[nodiscard]] std::string SettingsTable();

}  // namespace lucerna
