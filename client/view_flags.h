// Command-line flags of a scene's view: a camera and an environment from outside its file.
#pragma once

#include "render/formats/view/view_reader.h"

namespace CLI {
class App;
}  // namespace CLI

namespace lucerna {

// Parsing writes to `view`, which outlives the command, and refuses what is no number. Ranges are
// for the reader of the scene to check.
void AddCameraFlags(CLI::App& command, SceneView& view);
void AddEnvironmentFlags(CLI::App& command, SceneView& view);

}  // namespace lucerna
