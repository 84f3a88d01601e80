#include <utility>

#include "client/selfcheck/selfcheck_case.h"
#include "render/base/digest.h"
#include "render/scene/scene_files.h"
#include "render/wire/messages.h"

namespace lucerna {
namespace {

constexpr char kMainFile[] = "selfcheck.pbrt";

StatusOr<SelfcheckRender> RenderWith(LocalRuns& runs, const std::string& scene_text,
                                     const RenderOverrides& overrides) {
  const Digest digest = Sha256(scene_text);
  const SceneManifest manifest = {.main_path = kMainFile,
                                  .entries = {{kMainFile, {digest, scene_text.size()}}}};
  ManifestFiles files(manifest, [&](const Digest&) { return scene_text; });
  const OutputOptions silent = {.quiet = true};
  SelfcheckRender render;
  LUCERNA_ASSIGN_OR_RETURN(render.job, runs.Run(files, {manifest, overrides}, silent));
  LUCERNA_ASSIGN_OR_RETURN(render.image, runs.ImageOf(render.job));
  render.warnings.assign(render.job.warnings().begin(), render.job.warnings().end());
  return render;
}

}  // namespace

StatusOr<std::unique_ptr<SelfcheckBench>> SelfcheckBench::Start(const std::string& program_folder) {
  LUCERNA_ASSIGN_OR_RETURN(auto runs, LocalRuns::Start({.program_folder = program_folder}));
  return std::unique_ptr<SelfcheckBench>(new SelfcheckBench(program_folder, std::move(runs)));
}

StatusOr<const SelfcheckRender*> SelfcheckBench::Render(const std::string& scene_text,
                                                        const RenderOverrides& overrides) {
  const std::string key =
      absl::StrCat(ToProto(overrides).SerializeAsString(), "\n", Sha256(scene_text).Hex());
  const auto known = known_.find(key);
  if (known != known_.end()) return known->second.get();
  LUCERNA_ASSIGN_OR_RETURN(SelfcheckRender render, RenderWith(*runs_, scene_text, overrides));
  return known_.emplace(key, std::make_unique<SelfcheckRender>(std::move(render)))
      .first->second.get();
}

StatusOr<SelfcheckRender> SelfcheckBench::RenderByWorkers(const std::string& scene_text,
                                                          const RenderOverrides& overrides,
                                                          int workers) {
  LUCERNA_ASSIGN_OR_RETURN(
      const auto runs,
      LocalRuns::Start({.program_folder = program_folder_, .workers = workers, .threads = 1}));
  return RenderWith(*runs, scene_text, overrides);
}

}  // namespace lucerna
