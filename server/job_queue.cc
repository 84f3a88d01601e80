#include "server/job_queue.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "render/base/status.h"

namespace lucerna {

void JobQueue::Push(std::uint64_t serial, Claim claim) {
  waiting_[serial] = std::move(claim);
}

void JobQueue::SetPriority(std::uint64_t serial, int priority) {
  if (const auto waits = waiting_.find(serial); waits != waiting_.end()) {
    waits->second.priority = priority;
  }
  if (const auto turn = turns_.find(serial); turn != turns_.end()) {
    turn->second.claim.priority = priority;
  }
}

std::size_t JobQueue::PlacesOf(const std::string& owner) const {
  return static_cast<std::size_t>(std::ranges::count_if(turns_, [&](const auto& item) {
    return item.second.has_place && item.second.claim.owner == owner;
  }));
}

std::size_t JobQueue::places_taken() const {
  return static_cast<std::size_t>(
      std::ranges::count_if(turns_, [](const auto& item) { return item.second.has_place; }));
}

std::optional<std::uint64_t> JobQueue::First() const {
  std::optional<std::uint64_t> first;
  std::tuple<int, std::size_t, std::uint64_t> rank_of_first;
  for (const auto& [serial, claim] : waiting_) {
    if (turns_.contains(serial)) continue;
    const std::tuple rank(-claim.priority, PlacesOf(claim.owner), claim.number);
    if (first && rank >= rank_of_first) continue;
    first = serial;
    rank_of_first = rank;
  }
  return first;
}

std::optional<std::uint64_t> JobQueue::Next() const {
  return places_taken() < max_at_once_ ? First() : std::nullopt;
}

void JobQueue::Begin(std::uint64_t serial) {
  const auto waits = waiting_.find(serial);
  LUCERNA_CHECK(waits != waiting_.end() && !turns_.contains(serial));
  turns_[serial].claim = std::move(waits->second);
  waiting_.erase(waits);
}

void JobQueue::End(std::uint64_t serial) {
  LUCERNA_CHECK(turns_.erase(serial) == 1);
}

void JobQueue::SetHasPlace(std::uint64_t serial, bool has_place) {
  const auto turn = turns_.find(serial);
  if (turn != turns_.end()) turn->second.has_place = has_place;
}

std::optional<std::uint64_t> JobQueue::TakeYielding() {
  const std::size_t taken = places_taken();
  if (taken < max_at_once_) return std::nullopt;
  auto last = turns_.end();
  std::tuple<int, std::size_t, std::uint64_t> rank_of_last;
  for (auto turn = turns_.begin(); turn != turns_.end(); ++turn) {
    const Claim& claim = turn->second.claim;
    if (!turn->second.has_place) continue;
    const std::tuple rank(-claim.priority, PlacesOf(claim.owner), claim.number);
    if (last != turns_.end() && rank <= rank_of_last) continue;
    last = turn;
    rank_of_last = rank;
  }
  if (taken == max_at_once_) {
    const std::optional<std::uint64_t> first = First();
    if (!first) return std::nullopt;
    const Claim& waits = waiting_.at(*first);
    const Claim& runs = last->second.claim;
    const bool shall_yield =
        runs.priority < waits.priority ||
        (runs.priority == waits.priority && PlacesOf(runs.owner) >= PlacesOf(waits.owner) + 2);
    if (!shall_yield) return std::nullopt;
  }
  last->second.has_place = false;
  return last->first;
}

}  // namespace lucerna
