// The command line of a service: help, version, manual page, and flags that are wrong.
#pragma once

#include <optional>
#include <span>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>

#include "render/base/console.h"
#include "render/base/manual_page.h"

namespace lucerna {

struct ServiceManual {
  std::string_view program, summary, description, signals;
  std::span<const std::pair<std::string_view, std::string_view>> exit_codes;
  std::string_view example, see_also;
};

// `App` is CLI::App: this floor does not know the library.
template <typename App>
[[nodiscard]] std::string ManualOf(const App& app, const ServiceManual& texts) {
  ManualPage page(texts.program, texts.summary);
  page.Section("SYNOPSIS");
  page.Paragraph(std::string(texts.program) + " [FLAGS]");
  page.Section("DESCRIPTION");
  page.Paragraph(texts.description);
  page.Section("OPTIONS");
  AddFlagItems(page, app, [](const auto&) { return true; });
  page.Section("SIGNALS");
  page.Paragraph(texts.signals);
  page.Section("EXIT STATUS");
  for (const auto& [code, meaning] : texts.exit_codes)
    page.Item(code, meaning);
  page.Section("EXAMPLES");
  page.Example(texts.example);
  page.Section("SEE ALSO");
  page.Paragraph(std::string(texts.see_also) + "; /usr/share/doc/lucerna/manual.md");
  return page.text();
}

// Reads the flags. Returns the exit code where the program is done with that: `usage_error` for
// wrong flags, 0 after --help, --version, `help` and `help man`. `ParseError` is CLI::ParseError.
template <typename ParseError, typename App>
[[nodiscard]] std::optional<int> ParseServiceFlags(App& app, int argc, char** argv,
                                                   const ServiceManual& manual, int usage_error) {
  if (argc == 3 && std::string_view(argv[1]) == "help" && std::string_view(argv[2]) == "man") {
    PrintData(ManualOf(app, manual));
    return 0;
  }
  std::string help = "--help";
  if (argc == 2 && std::string_view(argv[1]) == "help") argv[1] = help.data();
  try {
    app.parse(argc, argv);
  } catch (const ParseError& error) {
    std::ostringstream result;
    std::ostringstream wrong;
    const bool is_done = app.exit(error, result, wrong) == 0;
    PrintText(result.str());
    PrintError(wrong.str());
    return is_done ? 0 : usage_error;
  }
  return std::nullopt;
}

}  // namespace lucerna
