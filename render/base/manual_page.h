// A program's reference as a manual page, in the language of man(7).
#pragma once

#include <string>
#include <string_view>

namespace lucerna {

class ManualPage {
 public:
  // `summary` is what follows the name in a list of pages. Section 1, this release.
  ManualPage(std::string_view name, std::string_view summary);

  void Section(std::string_view title);
  void Subsection(std::string_view title);
  void Paragraph(std::string_view text);
  // Lines that are shown as they are.
  void Example(std::string_view lines);
  // A term, such as a flag with its value, and below it what it means.
  void Item(std::string_view term, std::string_view meaning);

  // The page so far, lines of at most 80 bytes where words allow it.
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  void BeginParagraph();
  void Wrapped(std::string_view text);

  std::string text_;
  bool begins_section_ = false;
};

// Text that man(7) shows as it is: no request, no escape, and hyphens that can be copied.
[[nodiscard]] std::string ManualText(std::string_view text);

// One Item for each flag of a command that `is_shown`. `App` is CLI::App: this floor does not know
// the library.
template <typename App, typename Predicate>
void AddFlagItems(ManualPage& page, const App& app, Predicate is_shown) {
  for (const auto* option : app.get_options()) {
    if (!is_shown(*option)) continue;
    std::string term = option->get_name(/*positional=*/false, /*all_options=*/true);
    for (std::size_t at = 0; (at = term.find(',', at)) != std::string::npos; at += 2)
      term.replace(at, 1, ", ");
    const bool takes_value = option->get_type_size() != 0 && option->nonpositional();
    if (takes_value && !option->get_type_name().empty()) term += " " + option->get_type_name();
    std::string meaning = option->get_description();
    if (!option->get_default_str().empty())
      meaning += " (default: " + option->get_default_str() + ")";
    if (!option->get_envname().empty()) meaning += "; environment: " + option->get_envname();
    page.Item(term, meaning);
  }
}

}  // namespace lucerna
