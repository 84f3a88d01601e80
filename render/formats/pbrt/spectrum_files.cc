#include "render/formats/pbrt/spectrum_files.h"

#include <charconv>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>

#include "render/base/text.h"

namespace lucerna {
namespace {

// Numbers in between white space; what follows a # is a comment. Errors: INVALID_ARGUMENT with the
// line of what is no number.
StatusOr<std::vector<double>> ParseNumbers(std::string_view text) {
  std::vector<double> numbers;
  int line = 1;
  std::size_t i = 0;
  const auto is_space = [](char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; };
  while (i < text.size()) {
    if (text[i] == '#') {
      while (i < text.size() && text[i] != '\n' && text[i] != '\r')
        ++i;
    } else if (is_space(text[i])) {
      const bool is_cr = text[i] == '\r' && (i + 1 == text.size() || text[i + 1] != '\n');
      if (text[i] == '\n' || is_cr) ++line;
      ++i;
    } else {
      std::size_t end = i;
      while (end < text.size() && !is_space(text[end]) && text[end] != '#')
        ++end;
      double number = 0;
      const auto [stop, error] = std::from_chars(&text[i], text.data() + end, number);
      if (error != std::errc() || stop != text.data() + end || !(std::abs(number) <= 3.4e38)) {
        return absl::InvalidArgumentError(
            Concat("line ", line, " has something else than numbers"));
      }
      numbers.push_back(number);
      i = end;
    }
  }
  return numbers;
}

}  // namespace

void ReadSpectrumFiles(AssetReader& assets, std::vector<Parameter>& parameters,
                       Diagnostics& diagnostics) {
  for (Parameter& parameter : parameters) {
    if (parameter.type != "spectrum" || parameter.strings.size() != 1) continue;
    const std::string& file = parameter.strings[0];
    // Names of curves have no dots.
    if (file.find('.') == std::string::npos) continue;
    StatusOr<std::vector<double>> numbers = [&]() -> StatusOr<std::vector<double>> {
      LUCERNA_ASSIGN_OR_RETURN(const std::string text, assets.ReadBytes(file));
      return ParseNumbers(text);
    }();
    if (!numbers.ok()) {
      diagnostics.Error(
          parameter.location,
          Concat("the spectrum ", Quoted(file), " cannot be read: ", numbers.status().message()));
      // One curve that no reader objects to: the error is reported once.
      numbers = std::vector<double>{500, 0.5};
    }
    parameter.strings.clear();
    parameter.numbers = *std::move(numbers);
  }
}

}  // namespace lucerna
