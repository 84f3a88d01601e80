#include "render/base/manual_page.h"

#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_format.h"

#include "render/base/text.h"
#include "render/base/version.h"

namespace lucerna {
namespace {

constexpr std::size_t kMaxLineBytes = 78;

// The code point that begins at `text[at]`, and its length; the byte itself where the text is not
// UTF-8.
std::pair<char32_t, std::size_t> CodePointAt(std::string_view text, std::size_t at) {
  const auto first = static_cast<unsigned char>(text[at]);
  const std::size_t length = first < 0xC0 ? 1 : first < 0xE0 ? 2 : first < 0xF0 ? 3 : 4;
  if (length == 1 || at + length > text.size()) return {first, 1};
  char32_t point = first & (0x7FU >> length);
  for (std::size_t i = 1; i < length; ++i)
    point = (point << 6) | (static_cast<unsigned char>(text[at + i]) & 0x3FU);
  return {point, length};
}

}  // namespace

std::string ManualText(std::string_view text) {
  std::string shown;
  for (std::size_t at = 0; at < text.size();) {
    const auto [point, length] = CodePointAt(text, at);
    at += length;
    if (point == '\\') {
      shown += "\\e";
    } else if (point == '-') {
      shown += "\\-";
    } else if (point == '\'') {
      shown += "\\(aq";
    } else if (point == '`') {
      shown += "\\(ga";
    } else if (point >= 0x80) {
      shown += absl::StrFormat("\\[u%04X]", static_cast<unsigned>(point));
    } else {
      shown += static_cast<char>(point);
    }
  }
  // A line that begins so would be a request.
  return shown.starts_with('.') ? "\\&" + shown : shown;
}

ManualPage::ManualPage(std::string_view name, std::string_view summary) {
  const std::string version = Concat("Lucerna ", Version());
  text_ = Concat(".TH ", absl::AsciiStrToUpper(ToAbsl(name)), " 1 \"\" \"", version,
                 "\" \"User Commands\"\n");
  Section("NAME");
  text_ += Concat(ManualText(name), " \\- ", ManualText(summary), "\n");
}

void ManualPage::Section(std::string_view title) {
  text_ += Concat(".SH ", ManualText(title), "\n");
  begins_section_ = true;
}

void ManualPage::Subsection(std::string_view title) {
  text_ += Concat(".SS \"", ManualText(title), "\"\n");
  begins_section_ = true;
}

void ManualPage::BeginParagraph() {
  if (!begins_section_) text_ += ".PP\n";
  begins_section_ = false;
}

void ManualPage::Paragraph(std::string_view text) {
  BeginParagraph();
  Wrapped(text);
}

void ManualPage::Example(std::string_view lines) {
  BeginParagraph();
  text_ += ".EX\n";
  while (!lines.empty()) {
    const std::size_t end = lines.find('\n');
    text_ += Concat(ManualText(lines.substr(0, end)), "\n");
    lines = end == std::string_view::npos ? "" : lines.substr(end + 1);
  }
  text_ += ".EE\n";
}

void ManualPage::Item(std::string_view term, std::string_view meaning) {
  text_ += Concat(".TP\n.B ", ManualText(term), "\n");
  begins_section_ = false;
  Wrapped(meaning);
}

void ManualPage::Wrapped(std::string_view text) {
  std::string line;
  for (const std::string_view word : WordsOf(text)) {
    const std::string shown = ManualText(word);
    if (!line.empty() && line.size() + 1 + shown.size() > kMaxLineBytes) {
      text_ += line + "\n";
      line.clear();
    }
    line += Concat(line.empty() ? "" : " ", shown);
  }
  if (!line.empty()) text_ += line + "\n";
}

}  // namespace lucerna
