// How are words put together and taken apart?
//
// Debian's Abseil has a string_view of its own that std::string_view does not turn into; where
// views meet absl/strings, they go through here.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

namespace lucerna {

[[nodiscard]] inline absl::string_view ToAbsl(std::string_view text) {
  return {text.data(), text.size()};
}

namespace text_internal {
inline absl::string_view Piece(std::string_view text) {
  return ToAbsl(text);
}
inline absl::string_view Piece(const std::string& text) {
  return text;
}
inline absl::string_view Piece(const char* text) {
  return text;
}
template <typename Number>
absl::AlphaNum Piece(Number number) {
  return absl::AlphaNum(number);
}
}  // namespace text_internal

// The pieces, texts and numbers, one after the other.
template <typename... Pieces>
[[nodiscard]] std::string Concat(const Pieces&... pieces) {
  return absl::StrCat(text_internal::Piece(pieces)...);
}

// The words of `text`, which spaces and tabs separate. They point into `text`.
[[nodiscard]] std::vector<std::string_view> WordsOf(std::string_view text);

// "a, b and c".
template <typename Texts>
[[nodiscard]] std::string Listed(const Texts& texts, std::string_view last_separator = " and ") {
  std::string list;
  std::size_t i = 0;
  for (const auto& text : texts) {
    if (i > 0) list += i + 1 == texts.size() ? last_separator : ", ";
    list += text;
    ++i;
  }
  return list;
}

}  // namespace lucerna
