// Errors, warnings and notes about the files of a scene, each with its location.
//
// A reader goes on after an error, so that its user sees all errors at once. Equal warnings and
// notes are kept once, with the first location and a count.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace lucerna {

struct Diagnostic {
  // An error: the scene is not rendered. A warning: something is approximated or ignored, and the
  // image may differ for it. A note: something is read and has no effect here.
  enum class Severity : std::uint8_t { kError, kWarning, kNote };

  Severity severity = Severity::kError;
  std::string file;  // logical path
  int line = 0;      // from 1; 0: the file as a whole
  int column = 0;    // from 1
  std::string message;

  // "scene.pbrt:12:1: error: what is wrong, and what to do".
  [[nodiscard]] std::string ToString() const;
};

// A location in a text. `file` is from Diagnostics::NameOfFile, or outlives the diagnostics.
struct SourceLocation {
  const std::string* file = nullptr;
  int line = 0;    // from 1; 0: the file as a whole
  int column = 0;  // from 1, in bytes
};

// `text` in quotes, fit to be shown: at most 40 bytes of it, unprintable ones as '?'.
[[nodiscard]] std::string Quoted(std::string_view text);

// The entry of `known` that a person who wrote `text` most likely meant; empty when none is near.
[[nodiscard]] std::string_view ClosestOf(std::string_view text,
                                         const std::vector<std::string_view>& known);

class Diagnostics {
 public:
  static constexpr std::size_t kMaxOfEach = 100;  // errors, warnings, notes

  explicit Diagnostics(std::size_t max_of_each = kMaxOfEach) : max_of_each_(max_of_each) {}

  // The name of a file, for locations in it; as long-lived as the diagnostics.
  [[nodiscard]] const std::string* NameOfFile(const std::string& file) {
    return &*file_names_.insert(file).first;
  }

  void Error(const SourceLocation& location, std::string message);
  void Warning(const SourceLocation& location, std::string message);
  void Note(const SourceLocation& location, std::string message);

  // Drops everything else: once the text turns out to be in another language, what was said about
  // it until then only distracts.
  void OnlyError(const SourceLocation& location, std::string message);

  [[nodiscard]] bool has_error() const { return !of_severity_[0].kept.empty(); }

  // True when one more of this kind would only be counted.
  [[nodiscard]] bool IsFull(Diagnostic::Severity severity) const {
    return of_severity_[static_cast<std::size_t>(severity)].kept.size() == max_of_each_;
  }

  // How many have come of a kind, with those that were not kept; equal warnings and notes count
  // once.
  [[nodiscard]] std::size_t CountOf(Diagnostic::Severity severity) const {
    const OfSeverity& of = of_severity_[static_cast<std::size_t>(severity)];
    return of.kept.size() + of.dropped;
  }

  // Errors first, then warnings, then notes, each in the order of the text. Where more than
  // max_of_each came, the last one kept says how many more there were.
  [[nodiscard]] std::vector<Diagnostic> Take();

 private:
  struct Kept {
    Diagnostic diagnostic;
    std::size_t more_places = 0;
  };
  struct OfSeverity {
    std::vector<Kept> kept;
    std::map<std::string, std::size_t> index_of_message;  // warnings and notes
    std::size_t dropped = 0;
  };

  void Add(Diagnostic::Severity severity, const SourceLocation& location, std::string message);

  const std::size_t max_of_each_;
  OfSeverity of_severity_[3];
  std::set<std::string> file_names_;
};

}  // namespace lucerna
