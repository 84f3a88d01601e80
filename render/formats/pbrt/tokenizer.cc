#include "render/formats/pbrt/tokenizer.h"

#include <utility>

#include "render/base/text.h"

namespace lucerna {
namespace {

bool IsSpace(char c) {
  return c == ' ' || c == '\t' || c == '\n' || c == '\r' || c == '\f' || c == '\v';
}

bool EndsWord(char c) {
  return IsSpace(c) || c == '"' || c == '[' || c == ']' || c == '#';
}

}  // namespace

Token Tokenizer::Next() {
  if (!has_peeked_) return Scan();
  has_peeked_ = false;
  return peeked_;
}

const Token& Tokenizer::Peek() {
  if (!has_peeked_) {
    peeked_ = Scan();
    has_peeked_ = true;
  }
  return peeked_;
}

Token Tokenizer::Scan() {
  while (position_ < text_.size()) {
    const char c = text_[position_];
    if (c == '#') {
      while (position_ < text_.size() && text_[position_] != '\n' && text_[position_] != '\r')
        ++position_;
    } else if (IsSpace(c)) {
      ++position_;
      // A lone CR ends a line, too.
      const bool is_cr = c == '\r' && (position_ == text_.size() || text_[position_] != '\n');
      if (c == '\n' || is_cr) {
        ++line_;
        line_start_ = position_;
      }
    } else {
      break;
    }
  }
  const SourceLocation location = Here();
  if (position_ == text_.size()) return {Token::Kind::kEnd, location, {}};
  const std::size_t start = position_;
  switch (text_[position_]) {
    case '[':
      ++position_;
      return {Token::Kind::kOpen, location, text_.substr(start, 1)};
    case ']':
      ++position_;
      return {Token::Kind::kClose, location, text_.substr(start, 1)};
    case '"':
      ++position_;
      return {Token::Kind::kString, location, ScanString(location)};
    default:
      while (position_ < text_.size() && !EndsWord(text_[position_]))
        ++position_;
      return {Token::Kind::kWord, location, text_.substr(start, position_ - start)};
  }
}

std::string_view Tokenizer::ScanString(const SourceLocation& location) {
  const std::size_t start = position_;
  bool has_escape = false;
  while (position_ < text_.size() && text_[position_] != '"' && text_[position_] != '\n') {
    if (text_[position_] == '\\') {
      has_escape = true;
      ++position_;
      if (position_ == text_.size() || text_[position_] == '\n') break;
    }
    ++position_;
  }
  const std::string_view raw = text_.substr(start, position_ - start);
  if (position_ < text_.size() && text_[position_] == '"') {
    ++position_;
  } else {
    diagnostics_.Error(location, "this string has no closing quote on its line");
  }
  if (!has_escape) return raw;

  std::string& out = unescaped_[next_unescaped_];
  next_unescaped_ = 1 - next_unescaped_;
  out.clear();
  for (std::size_t i = 0; i < raw.size(); ++i) {
    if (raw[i] != '\\' || i + 1 == raw.size()) {
      out += raw[i];
      continue;
    }
    switch (raw[++i]) {
      case 'b':
        out += '\b';
        break;
      case 'f':
        out += '\f';
        break;
      case 'n':
        out += '\n';
        break;
      case 'r':
        out += '\r';
        break;
      case 't':
        out += '\t';
        break;
      case '\\':
      case '\'':
      case '"':
        out += raw[i];
        break;
      default:
        diagnostics_.Error(location,
                           Concat("unknown escape ", Quoted(raw.substr(i - 1, 2)), " in a string"));
    }
  }
  return out;
}

}  // namespace lucerna
