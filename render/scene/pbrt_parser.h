// What does this pbrt-v4 text describe?
//
// Reads the main file and everything it includes, and returns a Scene together with everything
// there is to say about the text: all errors of the parse at once, warnings where something is
// approximated, notes where something is read and has no effect here. A scene with an error is
// never rendered. Defaults and units are pbrt-v4's.
#pragma once

#include <string>
#include <vector>

#include "render/base/status.h"
#include "render/scene/diagnostic.h"
#include "render/scene/scene.h"
#include "render/scene/scene_files.h"

namespace lucerna {

struct ParsedScene {
  Scene scene;  // meaningful only when ok()
  std::vector<Diagnostic> diagnostics;

  [[nodiscard]] bool ok() const;
  // OK, or INVALID_ARGUMENT whose message is every error, one to a line.
  [[nodiscard]] Status ToStatus() const;
};

// Never fails otherwise than by diagnostics. Work and memory are bounded by the limits whatever
// the bytes are. At most 100 errors are kept; the last then says how many more there were.
[[nodiscard]] ParsedScene ParsePbrt(SceneFiles& files, const std::string& main_path,
                                    const SceneLimits& limits = {});

}  // namespace lucerna
