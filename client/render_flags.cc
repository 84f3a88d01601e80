#include "client/render_flags.h"

#include <algorithm>
#include <cstdint>
#include <string_view>

#include "absl/strings/str_replace.h"
#include <CLI/CLI.hpp>

#include "client/exit_code.h"
#include "render/base/text.h"

namespace lucerna {
namespace {

bool IsBool(const Setting& setting) {
  return std::holds_alternative<SettingField<bool>>(setting.type);
}

// A share above 1 without a percent sign: "3" is hardly ever meant as 300 %.
Status CheckPercentSign(const Setting& setting, const std::string& text,
                        const RenderOverrides& overrides) {
  const auto* field = std::get_if<SettingField<double>>(&setting.type);
  if (!setting.is_share || field == nullptr || text.ends_with('%')) return absl::OkStatus();
  const double value = (overrides.*field->given).value_or(0);
  if (!(value > 1)) return absl::OkStatus();
  return absl::InvalidArgumentError(Concat(NameInMessage(setting), " is ", 100 * value,
                                           " % when it is ", text, ": write ", text, "% for ", text,
                                           " percent, or ", 100 * value, "% if that is meant"));
}

void ParseFlag(const Setting& setting, const std::string& text, RenderOverrides& overrides) {
  Status status = ParseSetting(setting, text, overrides);
  if (status.ok()) status = CheckPercentSign(setting, text, overrides);
  if (!status.ok()) throw CLI::ValidationError(WithFlagNames(std::string(status.message())));
}

void AddFlag(CLI::App& command, const Setting& setting, RenderOverrides& overrides,
             const std::string& help) {
  if (IsBool(setting)) {
    // --flag=false counts as one less than none.
    command.add_flag_function(
        FlagOf(setting),
        [&](std::int64_t count) { ParseFlag(setting, count > 0 ? "true" : "false", overrides); },
        help);
    return;
  }
  command
      .add_option_function<std::string>(
          FlagOf(setting), [&](const std::string& text) { ParseFlag(setting, text, overrides); },
          help)
      ->type_name(ValuePlaceholder(setting));
}

std::string HelpOf(const Setting& setting, const std::string& fallback) {
  std::string help(setting.meaning);
  if (!setting.unit.empty()) help += Concat(" [", setting.unit, "]");
  if (!IsBool(setting)) help += Concat("; ", RangeText(setting));
  return IsBool(setting) ? help : Concat(help, " (default: ", fallback, ")");
}

// A cell of a Markdown table.
std::string Cell(std::string_view text) {
  return absl::StrReplaceAll(ToAbsl(text), {{"|", "\\|"}});
}

}  // namespace

std::string FlagOf(const Setting& setting) {
  std::string name(setting.name);
  const std::string unit = Concat("_", setting.unit);
  if (!setting.unit.empty() && name.ends_with(unit)) name.resize(name.size() - unit.size());
  std::ranges::replace(name, '_', '-');
  return "--" + name;
}

std::string WithFlagNames(std::string message) {
  for (const Setting& setting : AllSettings())
    absl::StrReplaceAll({{NameInMessage(setting), FlagOf(setting)}}, &message);
  return message;
}

void AddSettingFlags(CLI::App& command, SettingRole role, RenderOverrides& overrides) {
  for (const Setting& setting : AllSettings()) {
    if (setting.role == role) {
      AddFlag(command, setting, overrides, HelpOf(setting, DefaultText(setting)));
    }
  }
}

void AddSettingFlag(CLI::App& command, std::string_view name, RenderOverrides& overrides,
                    const std::string& help) {
  const Setting* setting = FindSetting(name);
  LUCERNA_CHECK(setting != nullptr);
  AddFlag(command, *setting, overrides, help);
}

void ShowDefault(CLI::App& command, std::string_view name, const std::string& fallback) {
  const Setting* setting = FindSetting(name);
  LUCERNA_CHECK(setting != nullptr);
  command.get_option(FlagOf(*setting))->description(HelpOf(*setting, fallback));
}

StatusOr<RenderOverrides> WithImageFlags(RenderOverrides overrides, const std::string& words) {
  CLI::App app;
  app.set_help_flag();
  AddSettingFlags(app, SettingRole::kDecidesPixels, overrides);
  try {
    app.parse(words);
  } catch (const CLI::ParseError& error) {
    return Failure(ExitCode::kUsage, absl::StrCat("\"", words, "\": ", error.what()));
  }
  return overrides;
}

std::string SettingsTable() {
  std::string table =
      "| flag | meaning | unit | range | default |\n"
      "|---|---|---|---|---|\n";
  for (const Setting& setting : AllSettings()) {
    const std::string placeholder = ValuePlaceholder(setting);
    table += Concat(
        "| `", FlagOf(setting), placeholder.empty() ? "" : " ", Cell(placeholder), "` | ",
        Cell(setting.meaning), " | ", Cell(setting.unit), " | ",
        IsBool(setting) ? "" : Cell(RangeText(setting)), " | ",
        IsBool(setting) && setting.default_text.empty() ? "not set" : Cell(DefaultText(setting)),
        " |\n");
  }
  return table;
}

}  // namespace lucerna
