// A scene as a reader returns it: the value, and everything there is to say about its files.
//
// All errors at once, warnings where something is approximated, notes where something is read and
// has no effect here. A scene with an error is never rendered.
#pragma once

#include <vector>

#include "render/base/status.h"
#include "render/formats/diagnostic.h"
#include "render/scene/scene.h"

namespace lucerna {

struct ParsedScene {
  Scene scene;  // meaningful only when ok()
  std::vector<Diagnostic> diagnostics;

  [[nodiscard]] bool ok() const;
  // OK, or INVALID_ARGUMENT whose message is every error, one to a line.
  [[nodiscard]] Status ToStatus() const;
};

}  // namespace lucerna
