// Reads a scene, whatever its format.
//
// A scene's format is that of its main file, by the end of its name and, when that says nothing, by
// its first bytes. Each format has a reader that turns text into an UnfinishedScene; the rest is
// common to all of them (finish_scene.h).
#pragma once

#include <cstddef>
#include <string>

#include "render/formats/asset_reader.h"
#include "render/formats/diagnostic.h"
#include "render/formats/finish_scene.h"
#include "render/formats/parsed_scene.h"
#include "render/scene/scene_files.h"

namespace lucerna {

// What a format builds on: a whole scene on no other, the rest on files of the layers before.
enum class SceneLayer { kWhole, kView, kSensors };

// For formats that build on another file. Reads a main file, of a format of the layer `highest` or
// one before, by that format's reader; after an error in `diagnostics` the scene is not meaningful.
// `main_path` outlives the diagnostics.
[[nodiscard]] UnfinishedScene ReadUnfinishedScene(const std::string& main_path, SceneLayer highest,
                                                  AssetReader& assets, Diagnostics& diagnostics);

// Reads the main file and everything it includes. Never fails otherwise than by diagnostics. Work
// and memory are bounded by the limits whatever the bytes are. At most `max_of_each`
// errors, warnings and notes are kept; the last one then says how many more there were.
[[nodiscard]] ParsedScene ReadScene(SceneFiles& files, const std::string& main_path,
                                    const SceneLimits& limits = {},
                                    std::size_t max_of_each = Diagnostics::kMaxOfEach);

}  // namespace lucerna
