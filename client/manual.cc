#include "client/manual.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include "client/render_flags.h"
#include "render/base/manual_page.h"
#include "render/base/text.h"

namespace lucerna {
namespace {

constexpr std::array<std::pair<std::string_view, std::string_view>, 8> kEnvironment = {{
    {"LUCERNA_SERVER", "the coordinator, where --server is not given"},
    {"LUCERNA_TOKEN", "your token, where --token-file is not given"},
    {"LUCERNA_TLS_CA, LUCERNA_TLS_CERT, LUCERNA_TLS_KEY",
     "PEM files, where --tls-ca, --tls-cert and --tls-key are not given"},
    {"COLORTERM, TERM", "whether the terminal can show the image so far"},
    {"NO_COLOR", "if it is set, no image is shown on the terminal"},
    {"LC_ALL, LC_CTYPE, LANG", "whether text may have other characters than ASCII"},
    {"XDG_CONFIG_HOME, HOME", "where lucerna.toml is"},
    {"TMPDIR", "where an image goes whose own file cannot be written"},
}};

constexpr std::array<std::pair<std::string_view, std::string_view>, 5> kExits = {{
    {"0", "done"},
    {"1", "failed"},
    {"2", "the command line is wrong"},
    {"3", "the coordinator does not answer"},
    {"130", "interrupted"},
}};

const Setting* SettingOf(const CLI::Option& option) {
  const auto settings = AllSettings();
  const auto found = std::ranges::find_if(settings, [&](const Setting& setting) {
    return option.check_lname(FlagOf(setting).substr(2));
  });
  return found == settings.end() ? nullptr : &*found;
}

std::vector<const CLI::App*> CommandsOf(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App*) { return true; });
}

// "render SCENE... [FLAGS]".
std::string Usage(const CLI::App& command) {
  std::string usage = command.get_name();
  bool has_flags = false;
  for (const CLI::Option* option : command.get_options()) {
    if (option->nonpositional()) {
      has_flags = true;
    } else {
      usage += Concat(" ", option->get_name(/*positional=*/true),
                      option->get_items_expected_max() > 1 ? "..." : "");
    }
  }
  return usage + (has_flags ? " [FLAGS]" : "");
}

void AddCommand(ManualPage& page, const CLI::App& command, std::string_view parent) {
  page.Subsection(Concat(parent, Usage(command)));
  page.Paragraph(command.get_description());
  bool decides = false;
  bool stops = false;
  AddFlagItems(page, command, [&](const CLI::Option& option) {
    const Setting* const setting = SettingOf(option);
    if (setting != nullptr) {
      (setting->role == SettingRole::kStopsJob ? stops : decides) = true;
      return false;
    }
    return !option.check_lname("help");
  });
  if (decides || stops) {
    page.Paragraph(Concat("Also the settings below that ", decides ? "decide the image" : "",
                          decides && stops ? " and that " : "", stops ? "stop the job" : "", "."));
  }
  for (const CLI::App* below : CommandsOf(command))
    AddCommand(page, *below, Concat(parent, command.get_name(), " "));
}

void AddSettings(ManualPage& page, SettingRole role) {
  for (const Setting& setting : AllSettings()) {
    if (setting.role != role) continue;
    const std::string placeholder = ValuePlaceholder(setting);
    std::string meaning(setting.meaning);
    if (!setting.unit.empty()) meaning += Concat(" [", setting.unit, "]");
    if (!placeholder.empty()) {
      meaning += Concat("; ", RangeText(setting), " (default: ", DefaultText(setting), ")");
    } else if (!setting.default_text.empty()) {
      meaning += Concat(" (default: ", DefaultText(setting), ")");
    }
    page.Item(Concat(FlagOf(setting), placeholder.empty() ? "" : " ", placeholder), meaning);
  }
}

}  // namespace

std::string ManualOf(const CLI::App& app) {
  ManualPage page("lucerna", "distributed progressive photon mapping");
  page.Section("SYNOPSIS");
  page.Paragraph("lucerna SCENE... [FLAGS]");
  page.Paragraph("lucerna COMMAND [FLAGS]");
  page.Section("DESCRIPTION");
  page.Paragraph(app.get_description());
  page.Paragraph(
      "A scene alone is rendered on this machine, to its name with .exr. Other commands send jobs "
      "to a coordinator, follow them and fetch their images, or look at scenes and images.");
  page.Section("OPTIONS");
  AddFlagItems(page, app, [](const CLI::Option&) { return true; });
  page.Section("COMMANDS");
  for (const CLI::App* command : CommandsOf(app))
    AddCommand(page, *command, "");
  page.Section("SETTINGS");
  page.Paragraph("Those that decide the image:");
  AddSettings(page, SettingRole::kDecidesPixels);
  page.Paragraph("Those that stop the job:");
  AddSettings(page, SettingRole::kStopsJob);
  page.Paragraph(
      "Counts may end with k, M, G or T (--photons 10M), times with ms, s, m or h (--time 5m).");
  page.Section("ENVIRONMENT");
  for (const auto& [name, meaning] : kEnvironment)
    page.Item(name, meaning);
  page.Section("FILES");
  page.Item("~/.config/lucerna.toml",
            "Flags, with a section for each command, as [render] and size = \"640x480\". Those of "
            "the command line come first.");
  page.Section("EXIT STATUS");
  for (const auto& [code, meaning] : kExits)
    page.Item(code, meaning);
  page.Section("EXAMPLES");
  page.Example(
      "lucerna scene.pbrt --time 5m\n"
      "lucerna submit scene.pbrt --server farm:7400 --error 2%\n"
      "lucerna watch JOB; lucerna fetch JOB -o out.exr\n"
      "lucerna png out.exr noise.png --layer noise");
  page.Section("SEE ALSO");
  page.Paragraph("lucerna-server(1), lucerna-worker(1); /usr/share/doc/lucerna/manual.md");
  return page.text();
}

}  // namespace lucerna
