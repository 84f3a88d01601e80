// How the coordinator measures a bake: the rounds of render/bake/bake_rounds.h, each as a run of
// the job, whose turn lasts from the first to the last.
#include <algorithm>
#include <cmath>
#include <utility>

#include <spdlog/spdlog.h>

#include "render/base/fail_point.h"
#include "render/image/exr_file.h"
#include "render/scene/setting_table.h"
#include "server/coordinator.h"
#include "server/job_image.h"
#include "server/memory_need.h"

namespace lucerna {
namespace {

// Of the memory that a job may have; the rest is for its scene and its rounds.
constexpr std::uint64_t kShareOfMesh = 4;

// The error of the first round after the survey, whose points are spread evenly over the surfaces;
// 0: none.
double EstimateOf(const BakeRecord& bake) {
  const BakeRoundRecord* const round = EvenRoundOf(bake);
  if (round == nullptr || !round->error || round->error->nothing_found) return 0;
  const SquaredError& squared = round->error->estimate.relative;
  return std::sqrt(std::max(squared.noise + squared.bias, 0.0));
}

RenderResult LaterTurn() {
  RenderResult later;
  later.gave_up_turn = true;
  return later;
}

}  // namespace

Status Coordinator::CheckBegins(const CheckedJob& job) {
  return BakeRounds::Check(job.scene, *job.submission.bake, options_.max_job_bytes / kShareOfMesh);
}

StatusOr<RenderResult> Coordinator::MeasureBake(JobTable::Turn& turn) {
  while (!turn.bake || turn.runner || turn.bake->rounds.round()) {
    const std::shared_ptr<RunningJob> runner = std::exchange(turn.runner, nullptr);
    if (!runner) {
      LUCERNA_ASSIGN_OR_RETURN(const std::optional<MemoryClaim> for_reading, WaitForReading(turn));
      if (!for_reading) return LaterTurn();
      if (!turn.bake) {
        LUCERNA_ASSIGN_OR_RETURN(turn.bake, ReadBake(turn));
        jobs_.SetBakeWork(turn.job_id, turn.bake);
        continue;
      }
      LUCERNA_RETURN_IF_ERROR(BeginRound(turn));
    }
    StatusOr<RenderResult> result = runner ? runner->Resume() : BeginRun(turn);
    if (!result.ok() || result->gave_up_turn) return result;
    LUCERNA_RETURN_IF_ERROR(EndRound(turn, *std::move(result)));
  }
  // After a restart with nothing left to measure it has not run.
  jobs_.OnRunning(turn.job_id, Now());
  RenderResult end;
  const std::optional<Job> job = jobs_.Find(turn.job_id);
  if (!job) return absl::CancelledError("the job has ended");
  // The later rounds go by the passes of this one.
  if (const BakeRoundRecord* const round = EvenRoundOf(*job->bake)) end.reason = round->reason;
  if (jobs_.IsFinishing(turn.job_id)) end.reason = StopReason::kUser;
  return end;
}

StatusOr<std::shared_ptr<BakeWork>> Coordinator::ReadBake(const JobTable::Turn& turn) {
  const std::optional<Job> job = jobs_.Find(turn.job_id);
  if (!job) return absl::CancelledError("the job has ended");
  LUCERNA_ASSIGN_OR_RETURN(const JobIntake::ReadResult read, intake_.ReadScene(job->manifest, [&] {
    return jobs_.CheckStillNeeded(turn.job_id);
  }));
  const auto begin = [&]() -> StatusOr<std::shared_ptr<BakeWork>> {
    LUCERNA_ASSIGN_OR_RETURN(
        BakeRounds rounds, BakeRounds::Begin(read.scene, job->bake->settings, job->bake->overrides,
                                             options_.max_job_bytes / kShareOfMesh));
    return std::make_shared<BakeWork>(std::move(rounds));
  };
  LUCERNA_ASSIGN_OR_RETURN(std::shared_ptr<BakeWork> work, begin());
  // After a restart.
  std::size_t taken = 0;
  const auto take_in = [&](const BakeRoundRecord& round) -> Status {
    if (!state_ || !round.image || !work->rounds.round()) {
      return absl::DataLossError("what it measured is not on the disk");
    }
    const std::string sensors = SensorsFile(job->manifest.main_path, work->rounds.round()->set);
    if (Sha256(sensors) != round.sensors.digest) {
      return absl::DataLossError("its points are others than this build would measure");
    }
    LUCERNA_ASSIGN_OR_RETURN(const std::string image, state_->blobs().Get(*round.image));
    LUCERNA_ASSIGN_OR_RETURN(const Image decoded, DecodeExr(image));
    const auto profile = decoded.metadata.find(kProfileName);
    if (profile == decoded.metadata.end() || profile->second != options_.numeric_profile) {
      return absl::DataLossError("it was measured by another build, whose bits may differ");
    }
    if (job->bake->is_stopped && &round == &job->bake->rounds.back()) work->rounds.StopRefining();
    return work->rounds.TakeIn(decoded, round.passes);
  };
  for (const BakeRoundRecord& round : job->bake->rounds) {
    if (!round.has_ended) break;
    if (const Status status = take_in(round); !status.ok()) {
      const std::string what = absl::StrCat(round.name, " cannot be used (",
                                            std::string(status.message()), "): it begins anew");
      spdlog::warn("job {}: {}", turn.job_id, what);
      jobs_.AddEvent(turn.job_id, what, Now());
      jobs_.ForgetRounds(turn.job_id, Now());
      return begin();
    }
    ++taken;
  }
  if (taken > 0) {
    const std::string what =
        absl::StrCat("goes on after ", job->bake->rounds[taken - 1].name, " of its bake");
    spdlog::info("job {} {}", turn.job_id, what);
    jobs_.AddEvent(turn.job_id, what, Now());
  }
  return work;
}

Status Coordinator::BeginRound(JobTable::Turn& turn) {
  const std::optional<Job> job = jobs_.Find(turn.job_id);
  if (!job) return absl::CancelledError("the job has ended");
  BakeWork& work = *turn.bake;
  const BakeRound& round = *work.rounds.round();
  auto sensors =
      std::make_shared<const std::string>(SensorsFile(job->manifest.main_path, round.set));
  BakeRoundRecord record;
  record.name = round.name;
  record.points = round.set.sensors.size();
  record.sensors = {Sha256(*sensors), sensors->size()};
  // The pins of the round before go once these are there.
  PinnedBlobs pinned;
  LUCERNA_ASSIGN_OR_RETURN(BlobPin pin,
                           blobs_.PutPinned(record.sensors.digest, *sensors, AfterLastPin::kDrop));
  pinned.push_back(std::move(pin));
  Submission submission;
  submission.manifest = job->manifest;
  submission.manifest.entries[kSensorsPath] = record.sensors;
  submission.manifest.main_path = kSensorsPath;
  submission.overrides = round.overrides;
  LUCERNA_ASSIGN_OR_RETURN(CheckedJob checked, intake_.Check(submission, [&] {
    return jobs_.CheckStillNeeded(turn.job_id);
  }));
  LUCERNA_RETURN_IF_ERROR(CheckDiskNeed(checked));
  for (BlobPin& file : checked.pinned)
    pinned.push_back(std::move(file));
  work.pinned = std::move(pinned);
  LUCERNA_RETURN_IF_ERROR(
      KeepForJob(turn.job_id, {std::move(sensors)}, [&](const std::vector<Digest>& /*digests*/) {
        return jobs_.BeginRound(turn.job_id, std::move(record), checked, Now());
      }));
  const std::optional<Job> begun = jobs_.Find(turn.job_id);
  if (!begun) return absl::CancelledError("the job has ended");
  turn.run_id = RunIdOf(*begun);
  turn.manifest = std::move(submission.manifest);
  turn.settings = std::move(checked.settings);
  turn.needs = std::move(checked.needs);
  turn.scene_memory = HeldOfScene(checked.scene_memory);
  turn.scene = std::move(checked.scene);
  turn.warns = round.name == kEvenRoundName;
  RemoveUnneeded();
  if (FindTrace(turn.job_id)) scheduler_.SetTraced(turn.run_id, true);
  spdlog::info("job {}: {} at {} points", turn.job_id, round.name, round.set.sensors.size());
  return absl::OkStatus();
}

Status Coordinator::EndRound(JobTable::Turn& turn, RenderResult result) {
  const std::optional<JobTable::ImageSource> source = jobs_.DescribeRun(turn.job_id, Now());
  if (!source) return absl::CancelledError("the job has ended");
  scheduler_.SetTraced(turn.run_id, false);
  const std::int64_t passes = result.passes;
  const StopReason reason = result.reason;
  LUCERNA_ASSIGN_OR_RETURN(const Blob image, Encode(*source, std::move(result)));
  // As it will be read after a restart.
  LUCERNA_ASSIGN_OR_RETURN(const Image decoded, DecodeExr(*image));
  LUCERNA_RETURN_IF_ERROR(KeepForJob(turn.job_id, {image}, [&](const std::vector<Digest>& digests) {
    return jobs_.EndRound(turn.job_id,
                          digests.empty() ? std::nullopt : std::optional(digests.front()), passes,
                          reason, Now());
  }));
  FailPoint("bake.round_ended");
  if (jobs_.IsFinishing(turn.job_id)) turn.bake->rounds.StopRefining();
  return turn.bake->rounds.TakeIn(decoded, passes);
}

void Coordinator::ConcludeBake(const JobTable::Turn& turn, StopReason reason) {
  const std::optional<JobTable::ImageSource> source = jobs_.DescribeRun(turn.job_id, Now());
  if (!source) return;
  const Job& job = source->job;
  StatusOr<BakeResult> result =
      turn.bake->rounds.Finish(job.manifest.main_path, EstimateOf(*job.bake),
                               {{"lucerna.scene_digest", job.scene_digest.Hex()},
                                {"lucerna.settings", SettingsText(job.settings)}});
  Status failure = result.status();
  if (result.ok()) {
    const Blob file = std::make_shared<const std::string>(std::move(result->file));
    std::vector<Blob> files = {file};
    Blob uv_mesh;
    if (!result->uv_mesh.empty()) {
      uv_mesh = std::make_shared<const std::string>(std::move(result->uv_mesh));
      files.push_back(uv_mesh);
    }
    const Blob held_file = Claimed(file);
    const Blob held_mesh = uv_mesh ? Claimed(uv_mesh) : nullptr;
    failure = KeepForJob(turn.job_id, files, [&](const std::vector<Digest>& digests) {
      jobs_.SetBakeResult(turn.job_id, *result, held_mesh,
                          digests.size() > 1 ? std::optional(digests[1]) : std::nullopt);
      return jobs_.Succeed(turn.job_id, reason, held_file, Now(),
                           digests.empty() ? std::nullopt : std::optional(digests.front()));
    });
    if (failure.ok()) {
      spdlog::info("job {} succeeded after {} rounds of its bake and {:.1f} s", turn.job_id,
                   job.bake->rounds.size(), Seconds(source->running));
      FailPoint("job.ended");
      RemoveUnneeded();
      return;
    }
  }
  ConcludeFailed(turn.job_id, failure);
}

}  // namespace lucerna
