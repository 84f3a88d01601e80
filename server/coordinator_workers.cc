// What workers ask of the coordinator and what is asked about them: part of server/coordinator.h.
#include <algorithm>
#include <utility>

#include <spdlog/spdlog.h>

#include "render/base/escape.h"
#include "render/wire/accumulation_codec.h"
#include "render/wire/slice_codec.h"
#include "server/coordinator.h"

namespace lucerna {
namespace {

constexpr Duration kLongestSync = std::chrono::seconds(5);
constexpr std::size_t kMostIdentity = 128;

BatchClaim ClaimOf(const Delivery& delivery) {
  return {delivery.worker, {delivery.lease, delivery.pass, delivery.range, delivery.kind}};
}

// Absent when the result is needed.
std::optional<MergeOutcome> KnownOutcome(Scheduler::Standing standing) {
  switch (standing) {
    case Scheduler::Standing::kDuplicate:
      return MergeOutcome::kDuplicate;
    case Scheduler::Standing::kSuperseded:
      return MergeOutcome::kSuperseded;
    case Scheduler::Standing::kExpected:
      break;
  }
  return std::nullopt;
}

Status UnknownRecord(const std::string& id) {
  return absl::NotFoundError(absl::StrCat("there is no worker ", Escaped(id.substr(0, 64)),
                                          "; lucerna workers lists them"));
}

}  // namespace

StatusOr<std::string> Coordinator::Register(const std::string& name, int threads,
                                            const std::string& numeric_profile,
                                            const std::string& identity, const std::string& peer) {
  if (name.size() > 256 || identity.size() > kMostIdentity) {
    return absl::InvalidArgumentError("a worker's name or identity is too long");
  }
  if (numeric_profile != options_.numeric_profile) {
    return absl::FailedPreconditionError(absl::StrCat(
        "worker ", Escaped(name), " has the numeric profile \"",
        Escaped(numeric_profile.substr(0, 1024)), "\" and this coordinator \"",
        options_.numeric_profile, "\"; their bits would differ, run the same build on both"));
  }
  LUCERNA_ASSIGN_OR_RETURN(std::string id,
                           scheduler_.AddWorker(name, clock_.Steady(), identity, peer, threads));
  CountWorkers();
  spdlog::info("worker {} joined with {} threads", ShownWorker(id), threads);
  return id;
}

std::optional<StatusOr<SyncAnswer>> Coordinator::TryAnswer(const std::string& worker,
                                                           const Scheduler::Report& report) {
  if (!is_lending_) return std::nullopt;
  StatusOr<Scheduler::Answer> result = scheduler_.AnswerFor(worker, report, clock_.Steady());
  if (!result.ok()) return result.status();
  SyncAnswer answer;
  answer.revoked = std::move(result->revoked);
  // Without a loan the pass ended this moment, and its lease with it.
  if (result->lease) {
    answer.loan = jobs_.MakeLoan(*std::move(result->lease), scheduler_.LiveWorkers());
    if (!answer.loan) scheduler_.WaitAgain(worker);
  }
  if (!answer.loan && answer.revoked.empty()) return std::nullopt;
  return answer;
}

std::uint64_t Coordinator::Sync(const std::string& worker, Scheduler::Report report, Duration wait,
                                ParkedSyncs::Answer answer) {
  const SteadyTime now = clock_.Steady();
  if (const Status heard = scheduler_.TakeReport(worker, report, now); !heard.ok()) {
    answer(heard);
    return 0;
  }
  HandleLosses();
  // What came back with this report may be what others wait for.
  if (report.wants_lease || !report.failures.empty()) AnswerParked();
  report.failures.clear();
  if (auto ready = TryAnswer(worker, report)) {
    answer(*std::move(ready));
    return 0;
  }
  if (wait <= Duration::zero() || !is_lending_) {
    answer(SyncAnswer{});
    return 0;
  }
  const std::uint64_t ticket =
      parked_.Park({worker, std::move(report), now + std::min(wait, kLongestSync), answer});
  if (ticket == 0) {
    answer(absl::UnavailableError("the coordinator is shutting down"));
    return 0;
  }
  // What changed between the try and the wait was announced to nobody.
  parked_.AnswerWorkers(
      {worker}, now,
      [this](const std::string& id, const Scheduler::Report& r) { return TryAnswer(id, r); },
      [this](const ParkedSyncs::Call& broken) { EndBroken(broken); });
  return ticket;
}

void Coordinator::SyncBroke(std::uint64_t ticket) {
  const std::optional<ParkedSyncs::Call> broken = parked_.Break(ticket);
  if (!broken) return;
  EndBroken(*broken);
  AnswerParked();
}

void Coordinator::EndBroken(const ParkedSyncs::Call& broken) {
  scheduler_.LoseWorker(broken.worker);
  broken.answer(absl::CancelledError("the connection broke"));
  HandleLosses();
}

// Calls of workers whose leases have ended, then of those that can be lent something, as long as
// there is something to lend, then those whose time is over.
void Coordinator::AnswerParked() {
  const SteadyTime now = clock_.Steady();
  const ParkedSyncs::TryAnswer try_answer = [this](const std::string& worker,
                                                   const Scheduler::Report& report) {
    return TryAnswer(worker, report);
  };
  const ParkedSyncs::OnBroken on_broken = [this](const ParkedSyncs::Call& broken) {
    EndBroken(broken);
  };
  parked_.AnswerWorkers(scheduler_.TakeAffected(), now, try_answer, on_broken);
  while (const std::optional<std::string> worker = scheduler_.TakeWaiting(now))
    parked_.AnswerWorkers({*worker}, now, try_answer, on_broken);
  parked_.AnswerOverdue(now, try_answer, on_broken);
}

StatusOr<Blob> Coordinator::Fetch(const Digest& digest) {
  LUCERNA_ASSIGN_OR_RETURN(Blob blob, blobs_.Get(digest));
  jobs_.CountFetched(digest, blob->size());
  return blob;
}

std::optional<std::size_t> Coordinator::RowsOf(const Delivery& delivery) const {
  if (delivery.kind == WorkKind::kPhotons) return passes_.Hitpoints(delivery.pass);
  const std::optional<SliceShape> shape = rounds_.ShapeOf(delivery.pass);
  if (!shape) return std::nullopt;
  return shape->pixels;
}

StatusOr<std::optional<Coordinator::DecodedResult>> Coordinator::Decode(const Delivery& delivery,
                                                                        std::string bytes) const {
  DecodedResult decoded;
  if (delivery.kind == WorkKind::kPhotons) {
    const std::optional<std::size_t> hitpoints = passes_.Hitpoints(delivery.pass);
    if (!hitpoints) return std::optional<DecodedResult>();
    LUCERNA_ASSIGN_OR_RETURN(decoded.photons, DecodeAccumulation(bytes, *hitpoints));
    decoded.counts.tally = decoded.photons->tally;
    decoded.counts.rows = decoded.photons->size();
    for (const std::uint64_t index : decoded.photons->dropped_photons)
      decoded.counts.dropped_photons.push_back({delivery.pass.pass, index});
    return decoded;
  }
  std::optional<SliceShape> shape = rounds_.ShapeOf(delivery.pass);
  if (!shape) return std::optional<DecodedResult>();
  shape->passes = {delivery.range.first, delivery.range.last};
  LUCERNA_ASSIGN_OR_RETURN(decoded.slice, DecodeSlice(bytes, *shape));
  decoded.counts.tally = decoded.slice->tally;
  decoded.counts.rows = decoded.slice->pixels();
  decoded.counts.dropped_photons = decoded.slice->dropped_photons;
  // The columns of the first passes are the most; later on, to decode a slice twice would take
  // more than it is worth.
  if (HasFeatures(shape->passes))
    decoded.packed = std::make_unique<EncodedSlice>(std::move(bytes), *shape);
  return decoded;
}

StatusOr<MergeOutcome> Coordinator::Merge(const Delivery& delivery, DecodedResult decoded) {
  // Before the bytes are part of any sum: a checkpoint may be written at any moment.
  const std::optional<WorkerRecord> worker = scheduler_.RecordOf(delivery.worker);
  if (!worker) return MergeOutcome::kSuperseded;
  Delivery of_record = delivery;
  of_record.record = worker->id;
  jobs_.NoteContributor(delivery.pass.job_id, worker->id, worker->name);
  LUCERNA_ASSIGN_OR_RETURN(
      const MergeOutcome outcome,
      decoded.photons
          ? passes_.Merge(delivery.pass, delivery.range, *decoded.photons)
          : rounds_.Merge(delivery.pass, *std::move(decoded.slice), std::move(decoded.packed)));
  if (outcome == MergeOutcome::kSuperseded) return outcome;
  const SteadyTime now = clock_.Steady();
  // Also of a duplicate: nobody need trace it any more.
  scheduler_.Commit(delivery.pass, delivery.range, now);
  if (outcome == MergeOutcome::kDuplicate) return outcome;
  scheduler_.CountWork(delivery.worker, delivery.pass.job_id, delivery.kind, delivery.range.size(),
                       delivery.cpu);
  jobs_.CountMerged(of_record, decoded.counts, worker->name, now);
  const BatchTally& tally = decoded.counts.tally;
  results_.photons += tally.photons;
  if (tally.dropped > 0 || tally.excess > 0) {
    spdlog::warn(
        "job {}, pass {}: {} photons that were not finite and {} contributions that were too "
        "bright are left out",
        delivery.pass.job_id, delivery.pass.pass, tally.dropped, tally.excess);
  }
  return outcome;
}

StatusOr<std::optional<MergeOutcome>> Coordinator::OutcomeOf(const Delivery& delivery) const {
  LUCERNA_ASSIGN_OR_RETURN(const Scheduler::Standing standing,
                           scheduler_.StandingOf(ClaimOf(delivery)));
  if (const auto known = KnownOutcome(standing)) return known;
  // Its thread, which closes its passes, may be in the middle of a step.
  if (jobs_.HasEnded(delivery.pass.job_id)) return MergeOutcome::kSuperseded;
  return std::nullopt;
}

StatusOr<MergeOutcome> Coordinator::TakeIn(const Delivery& delivery, std::string bytes) {
  LUCERNA_ASSIGN_OR_RETURN(std::optional<DecodedResult> decoded,
                           Decode(delivery, std::move(bytes)));
  if (!decoded) return MergeOutcome::kSuperseded;
  LUCERNA_RETURN_IF_ERROR(jobs_.CheckEmission(delivery.pass.job_id, decoded->counts.tally));
  Scheduler::Taken taken;
  StatusOr<MergeOutcome> outcome = MergeOutcome::kAccepted;
  {
    // Whoever waits for all merges holds the gate, so that new ones do not keep it waiting.
    { const MutexLock gate(merge_gate_); }
    const std::shared_lock merging(merging_);
    LUCERNA_ASSIGN_OR_RETURN(
        taken, scheduler_.TakeResult(ClaimOf(delivery), delivery.digest, clock_.Steady()));
    if (const auto known = KnownOutcome(taken.standing)) return *known;
    jobs_.CountAudit(delivery.pass.job_id, taken.audit);
    if (!taken.is_held) outcome = Merge(delivery, *std::move(decoded));
  }
  if (taken.audit == AuditOutcome::kDisputed) {
    spdlog::warn("job {}: two workers returned different results of pass {}", delivery.pass.job_id,
                 delivery.range.first);
  }
  TakeOut(taken.wrong);
  if (taken.is_held) AnswerParked();
  return outcome;
}

StatusOr<MergeOutcome> Coordinator::Commit(const Delivery& delivery, std::string bytes) {
  LUCERNA_ASSIGN_OR_RETURN(const std::optional<MergeOutcome> known, OutcomeOf(delivery));
  if (known) return *known;
  const SteadyTime began_at = clock_.Steady();
  const std::size_t size_bytes = bytes.size();
  StatusOr<MergeOutcome> outcome = TakeIn(delivery, std::move(bytes));
  const SteadyTime ended_at = clock_.Steady();
  TraceEndedLeases();
  results_.taking_in.Count(ended_at - began_at);
  if (const auto trace = FindTrace(delivery.pass.job_id)) {
    trace->AddOwn({.row = "merge",
                   .what = absl::StrCat("result of ", ShownWorker(delivery.worker)),
                   .from = began_at,
                   .to = ended_at,
                   .details = {{"bytes", absl::StrCat(size_bytes)},
                               {"taken in", outcome.ok() ? "yes" : "refused"}}});
  }
  if (outcome.ok()) {
    ++results_.of_outcome[static_cast<std::size_t>(*outcome)];
  } else {
    Refuse(delivery, outcome.status());
  }
  return outcome;
}

void Coordinator::Refuse(const Delivery& delivery, const Status& why) {
  spdlog::warn("worker {}: a result of job {} is refused: {}", ShownWorker(delivery.worker),
               delivery.pass.job_id, std::string(why.message()));
  ++results_.refused;
  scheduler_.RefuseResult(ClaimOf(delivery), std::string(why.message()));
  HandleLosses();
  AnswerParked();
}

void Coordinator::SaveStandings() {
  const MutexLock lock(standings_mutex_);
  const std::vector<WorkerStanding> changed = scheduler_.TakeChangedStandings();
  if (!state_ || changed.empty()) return;
  const Status saved = state_->SaveWorkers(changed);
  if (saved.ok()) return;
  spdlog::warn("which workers are drained or in quarantine cannot be written yet: {}",
               Escaped(std::string(saved.message())));
  for (const WorkerStanding& standing : changed)
    scheduler_.NoteChangedStanding(standing.id);
}

void Coordinator::TakeOut(const std::vector<std::string>& records) {
  if (!records.empty()) SaveStandings();
  for (const std::string& record : records) {
    spdlog::error(
        "worker {} returned a wrong result: it is in quarantine, and its work is taken out",
        record);
    // The scheduler takes no result of it any more.
    WaitForMerges();
    jobs_.TakeOut(record, Now());
  }
}

void Coordinator::WaitForMerges() {
  const MutexLock gate(merge_gate_);
  const std::unique_lock alone(merging_);
}

void Coordinator::ShowDisputes() {
  const std::map<std::string, std::string> disputes = scheduler_.Disputes();
  for (const auto& [job_id, what] : disputes) {
    if (disputed_.insert(job_id).second) spdlog::warn("job {} {}", job_id, what);
    // Again at each tick: the job may have been paused when the dispute began.
    jobs_.SetCondition(job_id, PauseCause::kDispute, what, Now());
  }
  for (auto job_id = disputed_.begin(); job_id != disputed_.end();) {
    if (disputes.contains(*job_id)) {
      ++job_id;
      continue;
    }
    jobs_.SetCondition(*job_id, PauseCause::kDispute, "", Now());
    job_id = disputed_.erase(job_id);
  }
}

void Coordinator::Goodbye(const std::string& worker) {
  spdlog::info("worker {} left", ShownWorker(worker));
  scheduler_.RemoveWorker(worker);
  AnswerParked();
}

Status Coordinator::QuarantineWorker(const std::string& id, const std::string& reason) {
  if (!scheduler_.Quarantine(id, reason)) return UnknownRecord(id);
  SaveStandings();
  spdlog::info("worker {} is put in quarantine", id);
  AnswerParked();
  return absl::OkStatus();
}

Status Coordinator::DrainWorker(const std::string& id) {
  if (!scheduler_.Drain(id)) return UnknownRecord(id);
  SaveStandings();
  spdlog::info("worker {} is drained", id);
  AnswerParked();
  return absl::OkStatus();
}

Status Coordinator::ReleaseWorker(const std::string& id) {
  if (!scheduler_.Release(id)) return UnknownRecord(id);
  SaveStandings();
  spdlog::info("worker {} is released", id);
  AnswerParked();
  return absl::OkStatus();
}

std::string Coordinator::ShownWorker(const std::string& worker) const {
  const std::optional<WorkerRecord> record = scheduler_.RecordOf(worker);
  if (!record) return "that is not known";
  return absl::StrCat(record->id, " (", Escaped(record->name), ")");
}

void Coordinator::HandleLosses() {
  TraceEndedLeases();
  for (const Scheduler::Loss& loss : scheduler_.TakeLosses())
    spdlog::warn("worker {} ({}) {}", loss.record, Escaped(loss.name), loss.reason);
  for (const Scheduler::Poisoned& poisoned : scheduler_.TakePoisoned()) {
    const std::string reason =
        absl::StrCat("paused: ", poisoned.message, "; lucerna resume lends it again");
    if (!jobs_.Pause(poisoned.pass.job_id, PauseCause::kFailedBatch, reason, Now()).ok()) continue;
    UpdateClaim(poisoned.pass.job_id);
    spdlog::warn("job {} is {}", poisoned.pass.job_id, reason);
  }
}

}  // namespace lucerna
