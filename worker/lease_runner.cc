#include "worker/lease_runner.h"

#include <thread>

#include <spdlog/spdlog.h>

#include "render/wire/accumulation_codec.h"
#include "render/wire/messages.h"

namespace lucerna {
namespace {

constexpr int kCommitTries = 3;
constexpr std::chrono::milliseconds kBusyPause{200};

bool IsGone(const Status& status) {
  return absl::IsUnavailable(status) || absl::IsDeadlineExceeded(status) ||
         absl::IsCancelled(status) || absl::IsUnimplemented(status);
}

}  // namespace

Status LeaseRunner::Run() {
  std::thread fetch([this] { FetchStage(); });
  std::thread commit([this] { CommitStage(); });
  std::thread heartbeat([this] { Heartbeat(); });
  ComputeStage();
  fetch.join();
  commit.join();
  heartbeat.join();
  const MutexLock lock(mutex_);
  return why_stopped_;
}

void LeaseRunner::Stop(Status why) {
  {
    const MutexLock lock(mutex_);
    if (is_stopped_) return;
    is_stopped_ = true;
    why_stopped_ = std::move(why);
    for (const auto& [id, held] : held_)
      held->is_revoked = true;
  }
  fetched_.Close();
  computed_.Close();
  connection_.BreakOff();
}

bool LeaseRunner::StopIfGone(const Status& status) {
  if (!IsGone(status)) return false;
  Stop(status);
  return true;
}

v1::SyncRequest LeaseRunner::Report(bool wants_lease) {
  v1::SyncRequest request;
  request.set_worker_id(worker_id_);
  request.set_wants_lease(wants_lease);
  const MutexLock lock(mutex_);
  for (const auto& [id, held] : held_)
    request.add_held_lease_ids(id);
  for (auto& [id, reason] : std::exchange(failures_, {})) {
    v1::SyncRequest::Failure& failure = *request.add_failures();
    failure.set_lease_id(std::move(id));
    failure.set_reason(std::move(reason));
  }
  return request;
}

void LeaseRunner::Revoke(const v1::SyncResponse& response) {
  const MutexLock lock(mutex_);
  for (const std::string& id : response.revoked_lease_ids()) {
    const auto found = held_.find(id);
    if (found == held_.end()) continue;
    found->second->is_revoked = true;
    // Not spoken of again, or the coordinator would say the same again at once.
    held_.erase(found);
  }
}

void LeaseRunner::Release(const Held& held, const Status& status) {
  const MutexLock lock(mutex_);
  held_.erase(held.batch.lease_id);
  if (status.ok() || held.is_revoked) return;
  spdlog::warn("batch {}: {}", held.batch.lease_id, std::string(status.message()));
  failures_.emplace_back(held.batch.lease_id, std::string(status.message()));
}

void LeaseRunner::FetchStage() {
  while (fetched_.WaitForRoom()) {
    const StatusOr<v1::SyncResponse> response =
        connection_.Sync(Report(/*wants_lease=*/true), sync_every_);
    if (!response.ok()) {
      // Whatever it is: without an answer to this call there is no work. NOT_FOUND means that the
      // coordinator was started anew.
      Stop(response.status());
      return;
    }
    Revoke(*response);
    if (!response->has_lease()) continue;
    StatusOr<LentBatch> batch = ReadLease(response->lease());
    const auto held = std::make_shared<Held>();
    held->batch.lease_id = response->lease().lease_id();
    if (batch.ok()) held->batch = std::move(*batch);
    {
      const MutexLock lock(mutex_);
      if (is_stopped_) return;
      held_[held->batch.lease_id] = held;
    }
    if (!batch.ok()) {
      Release(*held, batch.status());
      continue;
    }
    StatusOr<Fetched> fetched = Fetch(held);
    if (!fetched.ok()) {
      if (StopIfGone(fetched.status())) return;
      // The pass ended while its lease was on the way.
      Release(*held, absl::IsNotFound(fetched.status()) ? absl::OkStatus() : fetched.status());
      continue;
    }
    if (!fetched_.Give(*std::move(fetched))) return;
  }
}

StatusOr<LeaseRunner::Fetched> LeaseRunner::Fetch(const std::shared_ptr<Held>& held) {
  const LentBatch& batch = held->batch;
  const std::size_t pixels = static_cast<std::size_t>(batch.settings.crop_width()) *
                             static_cast<std::size_t>(batch.settings.crop_height());
  const std::size_t per_pixel = batch.needs.Uses(Part::kCausticHitpoints) ? 2 : 1;
  Fetched fetched;
  fetched.held = held;
  LUCERNA_ASSIGN_OR_RETURN(fetched.tracer, cache_.TracerFor(batch.scene));
  LUCERNA_ASSIGN_OR_RETURN(fetched.block, cache_.BlockFor(batch.block, pixels * per_pixel));
  LUCERNA_ASSIGN_OR_RETURN(fetched.radii, cache_.RadiiFor(batch.radii, fetched.block->size()));
  return fetched;
}

void LeaseRunner::ComputeStage() {
  while (auto fetched = fetched_.Take()) {
    const LentBatch& batch = fetched->held->batch;
    const Duration cpu_before = ProcessCpuTime();
    StatusOr<Accumulation> accumulation = fetched->tracer->Run(
        batch.settings, batch.needs, batch.pass, batch.first_photon, batch.last_photon,
        *fetched->block, fetched->radii, fetched->held->is_revoked);
    if (!accumulation.ok()) {
      Release(*fetched->held, accumulation.status());
      continue;
    }
    Computed computed{fetched->held, *std::move(accumulation), fetched->block->size(),
                      ProcessCpuTime() - cpu_before};
    if (!computed_.Give(std::move(computed))) return;
  }
}

void LeaseRunner::CommitStage() {
  while (auto computed = computed_.Take()) {
    if (computed->held->is_revoked) continue;
    const StatusOr<v1::CommitOutcome> outcome = Commit(*computed);
    if (outcome.ok()) {
      Release(*computed->held, absl::OkStatus());
    } else if (StopIfGone(outcome.status())) {
      return;
    } else {
      Release(*computed->held, outcome.status());
    }
  }
}

StatusOr<v1::CommitOutcome> LeaseRunner::Commit(const Computed& computed) {
  const LentBatch& batch = computed.held->batch;
  const std::string bytes = EncodeAccumulation(computed.accumulation, computed.hitpoints);
  v1::CommitBatchRequest::Header header;
  header.set_worker_id(worker_id_);
  header.set_lease_id(batch.lease_id);
  header.set_job_id(batch.job_id);
  header.set_pass(batch.pass);
  header.set_first_photon(batch.first_photon);
  header.set_last_photon(batch.last_photon);
  *header.mutable_cpu() = ToProto(computed.cpu);
  StatusOr<v1::CommitOutcome> outcome = connection_.Commit(header, bytes);
  // Bytes that were damaged on the way are sent again.
  for (int i = 1; i < kCommitTries && absl::IsDataLoss(outcome.status()); ++i) {
    outcome = connection_.Commit(header, bytes);
  }
  // The coordinator has more commits than it can merge: this worker's batch is no failure. A lease
  // that is revoked, also by Stop, ends the waiting.
  while (absl::IsResourceExhausted(outcome.status()) && !computed.held->is_revoked) {
    std::this_thread::sleep_for(kBusyPause);
    outcome = connection_.Commit(header, bytes);
  }
  return outcome;
}

void LeaseRunner::Heartbeat() {
  while (true) {
    {
      const MutexLock lock(mutex_);
      if (is_stopped_) return;
    }
    const StatusOr<v1::SyncResponse> response =
        connection_.Sync(Report(/*wants_lease=*/false), sync_every_);
    if (!response.ok()) {
      Stop(response.status());
      return;
    }
    Revoke(*response);
  }
}

}  // namespace lucerna
