#include "render/base/text.h"

#include <cstddef>

namespace lucerna {

std::vector<std::string_view> WordsOf(std::string_view text) {
  constexpr std::string_view kSpaces = " \t";
  std::vector<std::string_view> words;
  while (true) {
    const std::size_t start = text.find_first_not_of(kSpaces);
    if (start == std::string_view::npos) return words;
    text.remove_prefix(start);
    words.push_back(text.substr(0, text.find_first_of(kSpaces)));
    text.remove_prefix(words.back().size());
  }
}

}  // namespace lucerna
