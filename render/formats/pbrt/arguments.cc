#include "render/formats/pbrt/arguments.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <utility>

#include "absl/strings/numbers.h"

#include "render/base/text.h"
#include "render/formats/pbrt/directives.h"

namespace lucerna {
namespace {

std::optional<double> ParseNumber(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (end != text.data() + text.size()) return std::nullopt;
  // Out of range is too large or too small; absl's slower reader says which.
  if (error == std::errc::result_out_of_range && !absl::SimpleAtod(ToAbsl(text), &value)) {
    return std::nullopt;
  }
  if (error != std::errc() && error != std::errc::result_out_of_range) return std::nullopt;
  return value;
}

bool IsNumeric(std::string_view type) {
  return type != "bool" && type != "string" && type != "texture";
}

}  // namespace

std::string Arguments::SubjectOf(std::string_view type) const {
  return made_ != nullptr ? made_->subject : Concat(directive_, " ", Quoted(type));
}

bool Arguments::HasString() {
  if (made_ != nullptr) return strings_read_ < made_->strings.size();
  return tokens_->Peek().kind == Token::Kind::kString;
}

bool Arguments::ReadNumbers(std::span<double> numbers) {
  if (made_ != nullptr) {
    if (made_->numbers.size() != numbers.size()) return false;
    std::ranges::copy(made_->numbers, numbers.begin());
    return true;
  }
  const bool has_brackets = tokens_->Peek().kind == Token::Kind::kOpen;
  if (has_brackets) tokens_->Next();
  for (double& number : numbers) {
    const Token& token = tokens_->Peek();
    const std::optional<double> value =
        token.kind == Token::Kind::kWord ? ParseNumber(token.text) : std::nullopt;
    if (!value.has_value() || !std::isfinite(*value)) {
      diagnostics_.Error(token.location, Concat(directive_, " takes ", numbers.size(),
                                                " finite numbers, not ", Quoted(token.text)));
      return false;
    }
    number = *value;
    tokens_->Next();
  }
  if (!has_brackets) return true;
  const Token& token = tokens_->Peek();
  if (token.kind == Token::Kind::kClose) {
    tokens_->Next();
    return true;
  }
  diagnostics_.Error(token.location, Concat(directive_, " takes ", numbers.size(),
                                            " numbers; expected ], not ", Quoted(token.text)));
  return false;
}

bool Arguments::ReadString(std::string_view what, std::string& out) {
  if (made_ != nullptr) {
    if (!HasString()) return false;
    out = made_->strings[strings_read_++];
    return true;
  }
  const Token& token = tokens_->Peek();
  if (token.kind != Token::Kind::kString) {
    diagnostics_.Error(token.location,
                       Concat(directive_, " takes ", what, " in quotes, not ", Quoted(token.text)));
    return false;
  }
  out = std::string(token.text);
  tokens_->Next();
  return true;
}

bool Arguments::ReadParameters(std::vector<Parameter>& parameters) {
  if (made_ != nullptr) {
    parameters = std::move(made_->parameters);
    return true;
  }
  while (true) {
    const Token::Kind next = tokens_->Peek().kind;
    if (next == Token::Kind::kEnd && tokens_->including() != nullptr) {
      tokens_ = tokens_->including();
    } else if (next != Token::Kind::kString) {
      return true;
    } else if (!ReadParameter(parameters)) {
      return false;
    }
  }
}

bool Arguments::ReadParameter(std::vector<Parameter>& parameters) {
  const Token declaration = tokens_->Next();
  const std::vector<std::string_view> words = WordsOf(declaration.text);
  if (words.size() != 2) {
    diagnostics_.Error(declaration.location, Concat("expected a parameter as \"type name\", not ",
                                                    Quoted(declaration.text)));
    return false;
  }
  Parameter parameter;
  parameter.location = declaration.location;
  parameter.type = std::string(words[0]);
  parameter.name = std::string(words[1]);
  const std::vector<std::string_view>& types = KnownParameterTypes();
  const bool is_known_type = std::find(types.begin(), types.end(), parameter.type) != types.end();
  if (!is_known_type) {
    diagnostics_.Error(parameter.location, Concat("unknown parameter type ", Quoted(parameter.type),
                                                  "; there are ", Listed(types)));
  }
  if (tokens_->Peek().kind != Token::Kind::kOpen) {
    if (!ReadValue(parameter, is_known_type)) return false;
  } else {
    const SourceLocation open = tokens_->Next().location;
    while (tokens_->Peek().kind != Token::Kind::kClose) {
      const Token& token = tokens_->Peek();
      const bool is_next_directive = token.kind == Token::Kind::kWord && IsDirective(token.text);
      if (token.kind == Token::Kind::kEnd || token.kind == Token::Kind::kOpen ||
          is_next_directive) {
        diagnostics_.Error(open,
                           Concat("the values of ", Quoted(parameter.name), " have no closing ]"));
        return false;
      }
      if (!ReadValue(parameter, is_known_type)) return false;
    }
    tokens_->Next();
  }
  if (is_known_type) parameters.push_back(std::move(parameter));
  return true;
}

bool Arguments::ReadValue(Parameter& parameter, bool is_known_type) {
  const Token token = tokens_->Peek();
  const auto unexpected = [&](std::string_view wanted) {
    diagnostics_.Error(token.location, Concat(Quoted(parameter.name), " of ", directive_, " takes ",
                                              wanted, ", not ", Quoted(token.text)));
    // A wrong word among values is one mistake; what follows it may still be right.
    const bool is_value = token.kind == Token::Kind::kWord || token.kind == Token::Kind::kString;
    if (!is_value || IsDirective(token.text)) return false;
    tokens_->Next();
    parameter.is_unreadable = true;
    return true;
  };
  if (!is_known_type) {
    if (token.kind != Token::Kind::kWord && token.kind != Token::Kind::kString) return false;
    tokens_->Next();
    return true;
  }
  const bool takes_string =
      parameter.type == "string" || parameter.type == "texture" || parameter.type == "spectrum";
  if (token.kind == Token::Kind::kString && takes_string) {
    parameter.strings.emplace_back(token.text);
  } else if (parameter.type == "bool") {
    // pbrt-v4 still reads the quoted form of older files.
    const bool is_word = token.kind == Token::Kind::kWord || token.kind == Token::Kind::kString;
    if (!is_word || (token.text != "true" && token.text != "false")) {
      return unexpected("true or false");
    }
    parameter.bools.push_back(token.text == "true");
  } else if (IsNumeric(parameter.type)) {
    const std::optional<double> value =
        token.kind == Token::Kind::kWord ? ParseNumber(token.text) : std::nullopt;
    if (!value.has_value()) return unexpected(takes_string ? "numbers or a name" : "numbers");
    if (!(std::abs(*value) <= 3.4e38)) return unexpected("finite numbers below 3.4e38");
    if (parameter.type == "integer" &&
        (*value != std::floor(*value) || std::abs(*value) > 2147483648.0)) {
      return unexpected("whole numbers of 32 bits");
    }
    parameter.numbers.push_back(*value);
  } else {
    return unexpected("text in quotes");
  }
  tokens_->Next();
  return true;
}

bool Arguments::ReadTyped(std::string& type, std::vector<Parameter>& parameters) {
  return ReadString("a type", type) && ReadParameters(parameters);
}

void Arguments::Error(std::string message) {
  diagnostics_.Error(location_, std::move(message));
}

}  // namespace lucerna
