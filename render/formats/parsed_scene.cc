#include "render/formats/parsed_scene.h"

#include <algorithm>
#include <string>

#include "absl/strings/str_join.h"

namespace lucerna {

bool ParsedScene::ok() const {
  return std::none_of(diagnostics.begin(), diagnostics.end(), [](const Diagnostic& diagnostic) {
    return diagnostic.severity == Diagnostic::Severity::kError;
  });
}

Status ParsedScene::ToStatus() const {
  std::vector<std::string> errors;
  for (const Diagnostic& diagnostic : diagnostics) {
    if (diagnostic.severity == Diagnostic::Severity::kError)
      errors.push_back(diagnostic.ToString());
  }
  if (errors.empty()) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrJoin(errors, "\n"));
}

}  // namespace lucerna
