#include "tests/support/local_render.h"

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <utility>

#include "render/estimate/evidence.h"
#include "render/formats/read_scene.h"
#include "render/scene/scene_files.h"

namespace lucerna {
namespace {

[[noreturn]] void Die(const Status& status) {
  std::fprintf(stderr, "%s\n", std::string(status.message()).c_str());
  std::abort();
}

template <typename T>
T OrDie(StatusOr<T> value) {
  if (!value.ok()) Die(value.status());
  return std::move(value).value();
}

}  // namespace

LocalRender::LocalRender(const Scene& scene, const RenderSettings& settings, int threads)
    : settings_(settings),
      needs_(NeedsOf(scene, settings)),
      estimator_(OrDie(JobEstimator::Create(scene, settings, needs_, threads))),
      tracer_(std::make_unique<BatchTracer>(scene, threads)) {
  next_ = estimator_->TraceEyePaths(0);
  next_radii_ = estimator_->Radii(next_);
}

void LocalRender::AddPass(int batches) {
  const EyePass pass = std::move(next_);
  const RadiusColumn radii = std::move(next_radii_);
  next_ = estimator_->TraceEyePaths(pass_ + 1);
  next_radii_ = estimator_->Radii(next_);
  PassSums sums(pass.block.size(), EvidenceColumns(EvidenceOf(settings_.radius_controller, pass_)));
  const std::atomic<bool> stop = false;
  const auto photons = static_cast<std::uint64_t>(settings_.photons_per_pass);
  for (int batch = 0; batch < batches; ++batch) {
    const auto b = static_cast<std::uint64_t>(batch);
    const auto n = static_cast<std::uint64_t>(batches);
    const Accumulation accumulation = OrDie(tracer_->Run(
        settings_, needs_, pass_, photons * b / n, photons * (b + 1) / n, pass.block, radii, stop));
    if (const Status added = sums.Add(accumulation); !added.ok()) Die(added);
  }
  estimator_->Apply(pass, radii, sums);
  tally_ += sums.tally();
  ++pass_;
}

Image RenderLocally(const Scene& scene, const RenderSettings& settings, int passes, int threads) {
  LocalRender render(scene, settings, threads);
  for (int pass = 0; pass < passes; ++pass)
    render.AddPass();
  return render.MakeImage();
}

Scene LoadScene(const std::string& path) {
  const std::string full =
      path.starts_with('/') ? path : std::string(LUCERNA_SOURCE_DIR) + "/tests/scenes/" + path;
  const std::size_t slash = full.rfind('/');
  DirectoryFiles files(full.substr(0, slash));
  ParsedScene parsed = ReadScene(files, full.substr(slash + 1));
  if (!parsed.ok()) Die(parsed.ToStatus());
  return std::move(parsed.scene);
}

RenderSettings SettingsFor(const Scene& scene, const RenderOverrides& overrides) {
  return OrDie(ResolveSettings(overrides, scene));
}

}  // namespace lucerna
