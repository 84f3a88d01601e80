#include "server/round_merger.h"

#include <utility>

namespace lucerna {

void RoundMerger::Open(const PassKey& key, const SliceShape& shape) {
  auto round = std::make_shared<OpenRound>(shape);
  const MutexLock lock(mutex_);
  LUCERNA_CHECK(rounds_.emplace(key, std::move(round)).second);
}

std::shared_ptr<RoundMerger::OpenRound> RoundMerger::Find(const PassKey& key) const {
  const MutexLock lock(mutex_);
  const auto found = rounds_.find(key);
  return found == rounds_.end() ? nullptr : found->second;
}

std::optional<SliceShape> RoundMerger::ShapeOf(const PassKey& key) const {
  const std::shared_ptr<OpenRound> round = Find(key);
  if (round == nullptr) return std::nullopt;
  return round->shape;
}

StatusOr<MergeOutcome> RoundMerger::Merge(const PassKey& key, SliceSums slice,
                                          std::unique_ptr<const PackedSlice> packed) {
  const std::shared_ptr<OpenRound> round = Find(key);
  if (round == nullptr) return MergeOutcome::kSuperseded;
  const MutexLock lock(round->mutex);
  LUCERNA_ASSIGN_OR_RETURN(const SliceTree::Outcome outcome, round->tree.Check(slice.passes));
  if (outcome == SliceTree::Outcome::kDuplicate) return MergeOutcome::kDuplicate;
  LUCERNA_RETURN_IF_ERROR(round->tree.Add(std::move(slice), std::move(packed)));
  return MergeOutcome::kAccepted;
}

bool RoundMerger::Has(const PassKey& key, const PassRange& passes) const {
  const std::shared_ptr<OpenRound> round = Find(key);
  if (round == nullptr) return false;
  const MutexLock lock(round->mutex);
  const StatusOr<SliceTree::Outcome> outcome = round->tree.Check(passes);
  return outcome.ok() && *outcome == SliceTree::Outcome::kDuplicate;
}

std::optional<std::uint64_t> RoundMerger::PrefixEnd(const PassKey& key) const {
  const std::shared_ptr<OpenRound> round = Find(key);
  if (round == nullptr) return std::nullopt;
  const MutexLock lock(round->mutex);
  return round->tree.PrefixEnd();
}

ImageSums::Slices RoundMerger::Prefix(const PassKey& key) const {
  const std::shared_ptr<OpenRound> round = Find(key);
  if (round == nullptr) return {};
  const MutexLock lock(round->mutex);
  return round->tree.Prefix();
}

std::shared_ptr<const SliceSums> RoundMerger::Take(const PassKey& key) {
  std::shared_ptr<OpenRound> round;
  {
    const MutexLock lock(mutex_);
    const auto found = rounds_.find(key);
    LUCERNA_CHECK(found != rounds_.end());
    round = std::move(found->second);
    rounds_.erase(found);
  }
  const MutexLock lock(round->mutex);
  return round->tree.Whole();
}

void RoundMerger::Drop(const PassKey& key) {
  const MutexLock lock(mutex_);
  rounds_.erase(key);
}

}  // namespace lucerna
