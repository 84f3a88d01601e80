#include "render/formats/diagnostic.h"

#include <algorithm>

#include "render/base/text.h"

namespace lucerna {
namespace {

std::string_view NameOf(Diagnostic::Severity severity) {
  switch (severity) {
    case Diagnostic::Severity::kError:
      return "error";
    case Diagnostic::Severity::kWarning:
      return "warning";
    case Diagnostic::Severity::kNote:
      break;
  }
  return "note";
}

// How many letters have to be inserted, removed or replaced to turn `a` into `b` (Levenshtein).
std::size_t EditDistance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j)
    row[j] = j;
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min(replaced, std::min(row[j], row[j + 1]) + 1);
    }
  }
  return row[b.size()];
}

}  // namespace

std::string Diagnostic::ToString() const {
  const std::string location = line > 0 ? Concat(file, ":", line, ":", column) : file;
  return Concat(location, ": ", NameOf(severity), ": ", message);
}

std::string Quoted(std::string_view text) {
  constexpr std::size_t kShown = 40;
  std::string shown = "\"";
  for (const char c : text.substr(0, kShown))
    shown += c >= ' ' && c <= '~' ? c : '?';
  shown += text.size() > kShown ? "...\"" : "\"";
  return shown;
}

std::string_view ClosestOf(std::string_view text, const std::vector<std::string_view>& known) {
  if (text.size() > 32) return {};
  std::string_view closest;
  std::size_t smallest = std::max<std::size_t>(1, (text.size() + 1) / 3) + 1;
  for (const std::string_view candidate : known) {
    // The distance is at least the difference of the lengths.
    const std::size_t shorter = std::min(text.size(), candidate.size());
    if (std::max(text.size(), candidate.size()) - shorter >= smallest) continue;
    const std::size_t distance = EditDistance(text, candidate);
    if (distance < smallest) {
      smallest = distance;
      closest = candidate;
    }
  }
  return closest;
}

void Diagnostics::Error(const SourceLocation& location, std::string message) {
  Add(Diagnostic::Severity::kError, location, std::move(message));
}

void Diagnostics::Warning(const SourceLocation& location, std::string message) {
  Add(Diagnostic::Severity::kWarning, location, std::move(message));
}

void Diagnostics::Note(const SourceLocation& location, std::string message) {
  Add(Diagnostic::Severity::kNote, location, std::move(message));
}

void Diagnostics::OnlyError(const SourceLocation& location, std::string message) {
  for (OfSeverity& of : of_severity_)
    of = OfSeverity();
  Error(location, std::move(message));
}

void Diagnostics::Add(Diagnostic::Severity severity, const SourceLocation& location,
                      std::string message) {
  OfSeverity& of = of_severity_[static_cast<std::size_t>(severity)];
  if (severity != Diagnostic::Severity::kError) {
    const auto known = of.index_of_message.find(message);
    if (known != of.index_of_message.end()) {
      ++of.kept[known->second].more_places;
      return;
    }
  }
  if (of.kept.size() == max_of_each_) {
    ++of.dropped;
    return;
  }
  if (severity != Diagnostic::Severity::kError) of.index_of_message[message] = of.kept.size();
  of.kept.push_back(
      {{severity, *location.file, location.line, location.column, std::move(message)}, 0});
}

std::vector<Diagnostic> Diagnostics::Take() {
  std::vector<Diagnostic> all;
  for (OfSeverity& of : of_severity_) {
    if (of.dropped > 0) {
      Diagnostic& last = of.kept.back().diagnostic;
      last.line = last.column = 0;
      last.message = Concat("and ", of.dropped + 1, " more ", NameOf(last.severity), "s");
      of.kept.back().more_places = 0;
    }
    for (Kept& kept : of.kept) {
      if (kept.more_places > 0) {
        kept.diagnostic.message += Concat(" (and at ", kept.more_places, " more place",
                                          kept.more_places == 1 ? ")" : "s)");
      }
      all.push_back(std::move(kept.diagnostic));
    }
    of = OfSeverity();
  }
  return all;
}

}  // namespace lucerna
