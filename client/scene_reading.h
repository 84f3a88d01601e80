// What is the scene on the user's disk, and what is wrong with it?
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "render/formats/read_scene.h"
#include "render/formats/view/view_reader.h"
#include "render/scene/render_settings.h"
#include "render/scene/scene_files.h"

namespace lucerna {

// Where a scene lies.
struct ScenePath {
  std::string folder;  // "." when the path names none
  std::string main;    // the main file's name in it
};

[[nodiscard]] ScenePath SplitScenePath(const std::string& path);

// A scene on this machine, the folders outside its own from which it may read, and what takes the
// place of its camera and sky.
struct SceneSource {
  std::string path;
  std::vector<std::string> allowed_folders = {};
  SceneView view = {};  // `environment` is a path from the current folder
};

[[nodiscard]] DirectoryFiles FilesOf(const SceneSource& source);
// The logical path of the main file: with a view, that of a file that FilesOf adds.
[[nodiscard]] std::string MainFileOf(const SceneSource& source);

// Errors: Failure(kUsage) when `path` is empty or ends as only a folder's does.
[[nodiscard]] Status CheckNamesFile(const std::string& path);

// Parses the scene here, so that its errors come before anything is started or sent, and writes
// every error and warning to stderr (warnings not when `quiet`). Also checks the flags against the
// scene. Returns its manifest.
// Errors: INVALID_ARGUMENT when the scene has errors, Failure(kUsage) for a flag out of range.
[[nodiscard]] StatusOr<SceneManifest> ReadScene(const SceneSource& source,
                                                const RenderOverrides& overrides, bool quiet);

// The same for several jobs of one scene, which is read once.
struct SceneOfJobs {
  SceneManifest manifest;
  std::vector<RenderSettings> settings;  // as many as there are overrides
};
// The scene itself goes to `scene`, unless that is null.
[[nodiscard]] StatusOr<SceneOfJobs> ReadSceneOfJobs(const SceneSource& source,
                                                    std::span<const RenderOverrides> overrides,
                                                    bool quiet, Scene* scene = nullptr);

}  // namespace lucerna
