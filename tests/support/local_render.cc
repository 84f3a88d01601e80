#include "tests/support/local_render.h"

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <utility>

#include "render/estimate/evidence.h"
#include "render/formats/read_scene.h"
#include "render/scene/scene_files.h"
#include "render/wire/bytes.h"

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
      tracer_(std::make_unique<BatchTracer>(scene, threads)) {}

void LocalRender::AddPass(int batches) {
  const PassRange round = RoundOf(pass_);
  if (pass_ == round.first) {
    plan_ = estimator_->PlanFor(round);
    round_.emplace(round);
    if (!plan_) Die(absl::InternalError("no plan for the next round"));
  }
  const std::atomic<bool> stop = false;
  SliceSums slice;
  if (batches == 0 && pass_ > 0) {
    slice = OrDie(tracer_->RunSlice(settings_, needs_, {pass_, pass_ + 1}, *plan_, stop));
  } else {
    EyePass eye = estimator_->TraceEyePaths(pass_, plan_->eye_paths.get()).value();
    const RadiusColumn radii = HitpointRadii(eye, *plan_);
    PassSums sums(eye.block.size(),
                  EvidenceColumns(EvidenceOf(settings_.radius_controller, pass_)));
    const std::uint64_t photons = plan_->photons_per_pass;
    const auto n = static_cast<std::uint64_t>(std::max(batches, 1));
    for (std::uint64_t b = 0; b < n; ++b) {
      const Accumulation accumulation =
          OrDie(tracer_->Run(settings_, needs_, pass_, photons * b / n, photons * (b + 1) / n,
                             eye.block, radii, stop, photons, plan_->guide.get()));
      if (const Status added = sums.Add(accumulation); !added.ok()) Die(added);
    }
    slice = estimator_->SliceOf(std::move(eye), *plan_, std::move(sums));
  }
  tally_ += slice.tally;
  if (const Status added = round_->Add(std::move(slice)); !added.ok()) Die(added);
  ++pass_;
  if (round_->IsWhole()) {
    estimator_->AddRound(round_->Whole(), *plan_);
  } else {
    estimator_->SetTail(round_->Prefix(), *plan_);
  }
}

std::string LocalRender::Save() const {
  ByteWriter writer;
  estimator_->Save(writer);
  return writer.Take();
}

Status LocalRender::Restore(std::string_view bytes) {
  ByteReader reader(bytes);
  LUCERNA_RETURN_IF_ERROR(estimator_->Restore(reader));
  pass_ = estimator_->whole_passes();
  return absl::OkStatus();
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
