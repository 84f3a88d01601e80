// Splits a pbrt text into tokens.
//
// Words, quoted strings and brackets; `#` begins a comment that lasts to the end of the line.
// Every token has its location.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "render/formats/diagnostic.h"

namespace lucerna {

struct Token {
  enum class Kind : std::uint8_t { kEnd, kWord, kString, kOpen, kClose };

  Kind kind = Kind::kEnd;
  SourceLocation location;
  // A word as it stands, a string without quotes and with its escapes resolved. Valid until the
  // token after the next is read.
  std::string_view text;
};

class Tokenizer {
 public:
  // `file`, `text` and `diagnostics` outlive the tokenizer, and so does that of the text that
  // includes this one (may be null).
  Tokenizer(const std::string* file, std::string_view text, Diagnostics& diagnostics,
            Tokenizer* including = nullptr)
      : file_(file), text_(text), diagnostics_(diagnostics), including_(including) {}

  // The next token; kEnd again and again after the last one. A string that its line does not
  // close is an error, and ends with the line.
  Token Next();
  // What Next will return.
  const Token& Peek();
  [[nodiscard]] Tokenizer* including() { return including_; }

 private:
  Token Scan();
  std::string_view ScanString(const SourceLocation& location);
  [[nodiscard]] SourceLocation Here() const {
    return {file_, line_, static_cast<int>(position_ - line_start_) + 1};
  }

  const std::string* file_;
  std::string_view text_;
  Diagnostics& diagnostics_;
  Tokenizer* const including_;
  std::size_t position_ = 0;
  std::size_t line_start_ = 0;
  int line_ = 1;
  Token peeked_;
  bool has_peeked_ = false;
  // Strings with escapes do not stand in the text; two, because one may be returned while the
  // next one is being peeked at.
  std::string unescaped_[2];
  int next_unescaped_ = 0;
};

}  // namespace lucerna
