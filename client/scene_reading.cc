#include "client/scene_reading.h"

#include <algorithm>
#include <utility>

#include "client/exit_code.h"
#include "client/render_flags.h"
#include "render/base/console.h"
#include "render/base/escape.h"
#include "render/base/text.h"

namespace lucerna {
namespace {

// Settings may be common to several jobs, of which one uses them.
void WarnOfUnused(std::span<const RenderOverrides> overrides,
                  std::span<const RenderSettings> settings) {
  for (const Setting& setting : AllSettings()) {
    if (setting.is_used == nullptr) continue;
    const bool is_given = std::ranges::any_of(
        overrides, [&](const RenderOverrides& of_job) { return IsGiven(setting, of_job); });
    if (!is_given || std::ranges::any_of(settings, setting.is_used)) continue;
    PrintError(Concat("lucerna: warning: ", FlagOf(setting),
                      " has no effect with the other settings of this job (", setting.meaning,
                      ")\n"));
  }
}

}  // namespace

ScenePath SplitScenePath(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  if (slash == std::string::npos) return {".", path};
  return {slash == 0 ? "/" : path.substr(0, slash), path.substr(slash + 1)};
}

DirectoryFiles FilesOf(const SceneSource& source) {
  const ScenePath place = SplitScenePath(source.path);
  DirectoryFiles files(place.folder, {}, source.allowed_folders);
  if (source.view.IsEmpty()) return files;
  SceneView view = source.view;
  if (!view.environment.empty()) {
    // The path on this machine is not sent.
    const std::string name = Concat(".view/", SplitScenePath(view.environment).main);
    files.AddFromDisk(name, std::exchange(view.environment, name));
  }
  files.Add(MainFileOf(source), ViewFile(place.main, view));
  return files;
}

std::string MainFileOf(const SceneSource& source) {
  const std::string main = SplitScenePath(source.path).main;
  return source.view.IsEmpty() ? main : Concat(main, kViewExtension);
}

Status CheckNamesFile(const std::string& path) {
  if (!path.empty() && !path.ends_with('/')) return absl::OkStatus();
  return Failure(
      ExitCode::kUsage,
      absl::StrCat("\"", path,
                   "\" is not a scene file; name its .pbrt, .gltf, .glb, .xml or .view.json file"));
}

StatusOr<SceneManifest> ReadScene(const SceneSource& source, const RenderOverrides& overrides,
                                  bool quiet) {
  LUCERNA_ASSIGN_OR_RETURN(SceneOfJobs scene, ReadSceneOfJobs(source, {&overrides, 1}, quiet));
  return std::move(scene.manifest);
}

StatusOr<SceneOfJobs> ReadSceneOfJobs(const SceneSource& source,
                                      std::span<const RenderOverrides> overrides, bool quiet,
                                      Scene* scene) {
  const std::string& path = source.path;
  LUCERNA_RETURN_IF_ERROR(CheckNamesFile(path));
  const std::string main_file = MainFileOf(source);
  DirectoryFiles files = FilesOf(source);
  ParsedScene parsed = ReadScene(files, main_file);
  std::size_t errors = 0;
  for (const Diagnostic& diagnostic : parsed.diagnostics) {
    const bool is_error = diagnostic.severity == Diagnostic::Severity::kError;
    errors += is_error ? 1 : 0;
    if (!is_error && (quiet || diagnostic.severity == Diagnostic::Severity::kNote)) continue;
    PrintError(Escaped(diagnostic.ToString()) + "\n");
  }
  if (!parsed.ok()) {
    return absl::InvalidArgumentError(absl::StrCat(path, " has ", errors,
                                                   errors == 1 ? " error" : " errors",
                                                   "; correct the scene and try again"));
  }
  SceneOfJobs read;
  for (const RenderOverrides& of_job : overrides) {
    const auto settings = ResolveSettings(of_job, parsed.scene);
    if (!settings.ok()) {
      return Failure(ExitCode::kUsage, std::string(settings.status().message()));
    }
    read.settings.push_back(*settings);
  }
  if (!quiet) WarnOfUnused(overrides, read.settings);
  read.manifest = files.Manifest(main_file);
  if (scene != nullptr) *scene = std::move(parsed.scene);
  return read;
}

}  // namespace lucerna
