// Reads a scene, whatever its format.
//
// A scene's format is that of its main file, by the end of its name and, when that says nothing, by
// its first bytes. Each format has a reader that turns text into an UnfinishedScene; the rest is
// common to all of them (finish_scene.h).
#pragma once

#include <string>

#include "render/formats/parsed_scene.h"
#include "render/scene/scene_files.h"

namespace lucerna {

// Reads the main file and everything it includes. Never fails otherwise than by diagnostics. Work
// and memory are bounded by the limits whatever the bytes are. At most 100 errors are kept; the
// last then says how many more there were.
[[nodiscard]] ParsedScene ReadScene(SceneFiles& files, const std::string& main_path,
                                    const SceneLimits& limits = {});

}  // namespace lucerna
