// Reads the arguments of one directive: numbers, strings and parameters.
//
// They come from a text, or from a reader of another format that translates into directives.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "render/formats/diagnostic.h"
#include "render/formats/pbrt/parameter_list.h"
#include "render/formats/pbrt/tokenizer.h"

namespace lucerna {

// A directive that another format's reader has made.
struct MadeDirective {
  std::string_view name;
  SourceLocation location;
  std::string subject;  // what messages call the thing
  std::vector<std::string> strings;
  std::vector<double> numbers;
  std::vector<Parameter> parameters;
};

// Functions that return bool return false when the arguments break off at something unexpected,
// which is then reported; the text is to be skipped to the next directive.
class Arguments {
 public:
  // `directive`, `tokens` and `diagnostics` outlive the arguments.
  Arguments(std::string_view directive, SourceLocation location, Tokenizer& tokens,
            Diagnostics& diagnostics)
      : directive_(directive), location_(location), tokens_(&tokens), diagnostics_(diagnostics) {}
  // `made` and `diagnostics` outlive the arguments.
  Arguments(MadeDirective& made, Diagnostics& diagnostics)
      : directive_(made.name), location_(made.location), made_(&made), diagnostics_(diagnostics) {}

  [[nodiscard]] std::string_view directive() const { return directive_; }
  [[nodiscard]] const SourceLocation& location() const { return location_; }
  // What messages call the thing of this type or name that the directive makes.
  [[nodiscard]] std::string SubjectOf(std::string_view type) const;
  // Of a directive in a text.
  [[nodiscard]] Tokenizer& tokens() { return *tokens_; }
  // Whether a string comes next.
  [[nodiscard]] bool HasString();

  // As many numbers as the span has, with or without brackets.
  bool ReadNumbers(std::span<double> numbers);
  // A string, which messages call `what`.
  bool ReadString(std::string_view what, std::string& out);
  // All parameters there are. A list that reaches the end of an included file goes on after the
  // Include, as in pbrt-v4.
  bool ReadParameters(std::vector<Parameter>& parameters);
  // The type in quotes that follows the directive, then its parameters.
  bool ReadTyped(std::string& type, std::vector<Parameter>& parameters);

  // Reports an error of the directive.
  void Error(std::string message);

 private:
  bool ReadParameter(std::vector<Parameter>& parameters);
  bool ReadValue(Parameter& parameter, bool is_known_type);

  const std::string_view directive_;
  const SourceLocation location_;
  Tokenizer* tokens_ = nullptr;  // one of the two
  MadeDirective* const made_ = nullptr;
  std::size_t strings_read_ = 0;  // of `made_`
  Diagnostics& diagnostics_;
};

}  // namespace lucerna
