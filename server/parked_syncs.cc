#include "server/parked_syncs.h"

#include <utility>

namespace lucerna {

std::uint64_t ParkedSyncs::Park(Call call) {
  const MutexLock lock(mutex_);
  if (is_closed_) return 0;
  parked_.emplace(next_ticket_, Parked{.call = std::move(call)});
  return next_ticket_++;
}

std::optional<ParkedSyncs::Call> ParkedSyncs::Break(std::uint64_t ticket) {
  const MutexLock lock(mutex_);
  const auto found = parked_.find(ticket);
  if (found == parked_.end()) return std::nullopt;
  if (found->second.is_being_tried) {
    found->second.is_broken = true;
    return std::nullopt;
  }
  Call broken = std::move(found->second.call);
  parked_.erase(found);
  return broken;
}

void ParkedSyncs::AnswerReady(SteadyTime now, const TryAnswer& try_answer,
                              const std::function<void(const Call&)>& on_broken) {
  std::vector<std::uint64_t> tickets;
  {
    const MutexLock lock(mutex_);
    for (const auto& [ticket, parked] : parked_)
      tickets.push_back(ticket);
  }
  for (const std::uint64_t ticket : tickets) {
    std::string worker;
    Scheduler::Report report;
    {
      const MutexLock lock(mutex_);
      const auto found = parked_.find(ticket);
      if (found == parked_.end() || found->second.is_being_tried) continue;
      found->second.is_being_tried = true;
      worker = found->second.call.worker;
      report = found->second.call.report;
    }
    std::optional<StatusOr<SyncAnswer>> ready = try_answer(worker, report);
    std::optional<Parked> ended;
    {
      const MutexLock lock(mutex_);
      const auto found = parked_.find(ticket);
      // Close has handed it out.
      if (found == parked_.end()) continue;
      found->second.is_being_tried = false;
      if (ready || found->second.is_broken || found->second.call.until <= now) {
        ended = std::move(found->second);
        parked_.erase(found);
      }
    }
    if (!ended) continue;
    if (ended->is_broken) {
      on_broken(ended->call);
    } else {
      ended->call.answer(ready ? *std::move(ready) : SyncAnswer{});
    }
  }
}

std::vector<ParkedSyncs::Call> ParkedSyncs::Close() {
  const MutexLock lock(mutex_);
  is_closed_ = true;
  std::vector<Call> calls;
  for (auto& [ticket, parked] : parked_)
    calls.push_back(std::move(parked.call));
  parked_.clear();
  return calls;
}

}  // namespace lucerna
