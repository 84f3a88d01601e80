#include "server/pass_merger.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace lucerna {
namespace {

// A photon that a message names must be replayable.
Status CheckDropped(WorkRange range, const Accumulation& accumulation) {
  const std::vector<std::uint64_t>& named = accumulation.dropped_photons;
  std::uint64_t least = range.first;
  for (const std::uint64_t index : named) {
    if (index < least || index >= range.last) {
      return absl::InvalidArgumentError(absl::StrCat("a batch of photons ", range.first, " to ",
                                                     range.last, " names dropped photon ", index,
                                                     " out of order or out of range"));
    }
    least = index + 1;
  }
  const std::uint64_t all = accumulation.tally.dropped;
  if (all > range.size() || named.size() != std::min<std::uint64_t>(all, kDroppedNamed)) {
    return absl::InvalidArgumentError(absl::StrCat("a batch of ", range.size(), " photons dropped ",
                                                   all, " and names ", named.size(), " of them"));
  }
  return absl::OkStatus();
}

}  // namespace

void PassMerger::Open(const PassKey& key, std::size_t hitpoints, std::uint64_t photons,
                      std::size_t evidence_columns) {
  LUCERNA_CHECK(photons > 0);
  auto pass = std::make_shared<OpenPass>(hitpoints, photons, evidence_columns);
  const MutexLock lock(mutex_);
  LUCERNA_CHECK(passes_.emplace(key, std::move(pass)).second);
}

std::shared_ptr<PassMerger::OpenPass> PassMerger::Find(const PassKey& key) const {
  const MutexLock lock(mutex_);
  const auto found = passes_.find(key);
  return found == passes_.end() ? nullptr : found->second;
}

std::optional<std::size_t> PassMerger::Hitpoints(const PassKey& key) const {
  const std::shared_ptr<OpenPass> pass = Find(key);
  if (pass == nullptr) return std::nullopt;
  return pass->hitpoints;
}

StatusOr<MergeOutcome> PassMerger::Merge(const PassKey& key, WorkRange range,
                                         const Accumulation& accumulation) {
  const std::shared_ptr<OpenPass> pass = Find(key);
  if (pass == nullptr) return MergeOutcome::kSuperseded;
  if (range.first >= range.last || range.last > pass->photons) {
    return absl::InvalidArgumentError(absl::StrCat("photons ", range.first, " to ", range.last,
                                                   " are not a range of a pass of ",
                                                   pass->photons));
  }
  if (accumulation.tally.photons != range.size()) {
    return absl::InvalidArgumentError(absl::StrCat(
        "a batch of ", range.size(), " photons has a tally of ", accumulation.tally.photons));
  }
  LUCERNA_RETURN_IF_ERROR(CheckDropped(range, accumulation));
  const MutexLock lock(pass->mutex);
  const auto next = pass->merged.lower_bound(range.first);
  if (next != pass->merged.end() && next->first == range.first && next->second == range.last) {
    return MergeOutcome::kDuplicate;
  }
  const bool meets_next = next != pass->merged.end() && next->first < range.last;
  const bool meets_previous = next != pass->merged.begin() && std::prev(next)->second > range.first;
  if (meets_next || meets_previous) {
    return absl::InvalidArgumentError(
        absl::StrCat("photons ", range.first, " to ", range.last, " were never lent as one batch"));
  }
  LUCERNA_RETURN_IF_ERROR(pass->sums.Add(accumulation));
  pass->merged.emplace(range.first, range.last);
  pass->photons_merged += range.size();
  return MergeOutcome::kAccepted;
}

bool PassMerger::IsComplete(const PassKey& key) const {
  const std::shared_ptr<OpenPass> pass = Find(key);
  if (pass == nullptr) return false;
  const MutexLock lock(pass->mutex);
  return pass->photons_merged == pass->photons;
}

PassSums PassMerger::Take(const PassKey& key) {
  std::shared_ptr<OpenPass> pass;
  {
    const MutexLock lock(mutex_);
    const auto found = passes_.find(key);
    LUCERNA_CHECK(found != passes_.end());
    pass = std::move(found->second);
    passes_.erase(found);
  }
  // A duplicate may still hold the pass; it changes nothing, but it reads.
  const MutexLock lock(pass->mutex);
  LUCERNA_CHECK(pass->photons_merged == pass->photons);
  return std::move(pass->sums);
}

void PassMerger::Drop(const PassKey& key) {
  const MutexLock lock(mutex_);
  passes_.erase(key);
}

}  // namespace lucerna
