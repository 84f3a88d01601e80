#include "server/parked_syncs.h"

#include <utility>

namespace lucerna {

std::uint64_t ParkedSyncs::Park(Call call) {
  const MutexLock lock(mutex_);
  if (is_closed_) return 0;
  const std::uint64_t ticket = next_ticket_++;
  of_workers_[call.worker].insert(ticket);
  by_end_.emplace(call.until, ticket);
  parked_.emplace(ticket, Parked{.call = std::move(call)});
  return ticket;
}

ParkedSyncs::Parked ParkedSyncs::Remove(std::uint64_t ticket) {
  const auto found = parked_.find(ticket);
  Parked parked = std::move(found->second);
  parked_.erase(found);
  by_end_.erase({parked.call.until, ticket});
  const auto of_worker = of_workers_.find(parked.call.worker);
  of_worker->second.erase(ticket);
  if (of_worker->second.empty()) of_workers_.erase(of_worker);
  return parked;
}

std::optional<ParkedSyncs::Call> ParkedSyncs::Break(std::uint64_t ticket) {
  const MutexLock lock(mutex_);
  const auto found = parked_.find(ticket);
  if (found == parked_.end()) return std::nullopt;
  if (found->second.is_being_tried) {
    found->second.is_broken = true;
    return std::nullopt;
  }
  return Remove(ticket).call;
}

void ParkedSyncs::AnswerOne(std::uint64_t ticket, SteadyTime now, const TryAnswer& try_answer,
                            const OnBroken& on_broken) {
  std::string worker;
  Scheduler::Report report;
  {
    const MutexLock lock(mutex_);
    const auto found = parked_.find(ticket);
    if (found == parked_.end()) return;
    if (found->second.is_being_tried) {
      found->second.shall_be_tried_again = true;
      return;
    }
    found->second.is_being_tried = true;
    worker = found->second.call.worker;
    report = found->second.call.report;
  }
  while (true) {
    std::optional<StatusOr<SyncAnswer>> ready = try_answer(worker, report);
    std::optional<Parked> ended;
    {
      const MutexLock lock(mutex_);
      const auto found = parked_.find(ticket);
      // Close has handed it out.
      if (found == parked_.end()) return;
      Parked& parked = found->second;
      if (ready || parked.is_broken || parked.call.until <= now) {
        ended = Remove(ticket);
      } else if (!std::exchange(parked.shall_be_tried_again, false)) {
        parked.is_being_tried = false;
        return;
      }
    }
    if (!ended) continue;
    if (ended->is_broken) {
      on_broken(ended->call);
    } else {
      ended->call.answer(ready ? *std::move(ready) : SyncAnswer{});
    }
    return;
  }
}

void ParkedSyncs::AnswerAll(const std::vector<std::uint64_t>& tickets, SteadyTime now,
                            const TryAnswer& try_answer, const OnBroken& on_broken) {
  for (const std::uint64_t ticket : tickets)
    AnswerOne(ticket, now, try_answer, on_broken);
}

void ParkedSyncs::AnswerWorkers(const std::vector<std::string>& workers, SteadyTime now,
                                const TryAnswer& try_answer, const OnBroken& on_broken) {
  std::vector<std::uint64_t> tickets;
  {
    const MutexLock lock(mutex_);
    for (const std::string& worker : workers) {
      const auto found = of_workers_.find(worker);
      if (found == of_workers_.end()) continue;
      tickets.insert(tickets.end(), found->second.begin(), found->second.end());
    }
  }
  AnswerAll(tickets, now, try_answer, on_broken);
}

void ParkedSyncs::AnswerOverdue(SteadyTime now, const TryAnswer& try_answer,
                                const OnBroken& on_broken) {
  std::vector<std::uint64_t> tickets;
  {
    const MutexLock lock(mutex_);
    for (const auto& [until, ticket] : by_end_) {
      if (until > now) break;
      tickets.push_back(ticket);
    }
  }
  AnswerAll(tickets, now, try_answer, on_broken);
}

void ParkedSyncs::AnswerReady(SteadyTime now, const TryAnswer& try_answer,
                              const OnBroken& on_broken) {
  std::vector<std::uint64_t> tickets;
  {
    const MutexLock lock(mutex_);
    for (const auto& [ticket, parked] : parked_)
      tickets.push_back(ticket);
  }
  AnswerAll(tickets, now, try_answer, on_broken);
}

std::vector<ParkedSyncs::Call> ParkedSyncs::Close() {
  const MutexLock lock(mutex_);
  is_closed_ = true;
  std::vector<Call> calls;
  for (auto& [ticket, parked] : parked_)
    calls.push_back(std::move(parked.call));
  parked_.clear();
  of_workers_.clear();
  by_end_.clear();
  return calls;
}

}  // namespace lucerna
