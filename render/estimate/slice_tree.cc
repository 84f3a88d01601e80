#include "render/estimate/slice_tree.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace lucerna {

StatusOr<SliceTree::Outcome> SliceTree::Check(const PassRange& passes) const {
  if (!IsSlice(passes) || passes.first < round_.first || passes.last > round_.last) {
    return absl::InvalidArgumentError(absl::StrCat("passes ", passes.first, " to ", passes.last,
                                                   " are not a slice of the round from ",
                                                   round_.first, " to ", round_.last));
  }
  const auto next = added_.lower_bound({passes.first, 0});
  const auto covers = [&](const PassRange& added) {
    return added.first <= passes.first && passes.last <= added.last;
  };
  if ((next != added_.end() && covers(*next)) ||
      (next != added_.begin() && covers(*std::prev(next)))) {
    return Outcome::kDuplicate;
  }
  const bool meets_next = next != added_.end() && next->first < passes.last;
  const bool meets_previous = next != added_.begin() && std::prev(next)->last > passes.first;
  if (meets_next || meets_previous) {
    return absl::InvalidArgumentError(absl::StrCat("passes ", passes.first, " to ", passes.last,
                                                   " were never lent as one slice"));
  }
  return Outcome::kAccepted;
}

SliceTree::Slices::iterator SliceTree::FindSibling(const PassRange& passes) {
  if (passes == round_) return slices_.end();
  const PassRange sibling = SiblingOf(passes);
  const auto found = slices_.find(sibling.first);
  return found != slices_.end() && found->second.passes == sibling ? found : slices_.end();
}

Status SliceTree::Add(SliceSums slice, std::unique_ptr<const PackedSlice> packed) {
  // Before anything is changed: do the counters of all that will be put together fit?
  BatchTally tally = slice.tally;
  PassRange passes = slice.passes;
  for (auto found = FindSibling(passes); found != slices_.end(); found = FindSibling(passes)) {
    if (!tally.Fits(found->second.tally)) {
      return absl::OutOfRangeError("the counters of a round would not fit in 64 bits");
    }
    tally += found->second.tally;
    passes = {std::min(passes.first, found->second.passes.first),
              std::max(passes.last, found->second.passes.last)};
  }
  // All that may run out of memory comes before the first change.
  std::set<PassRange> added = {slice.passes};
  const bool waits = passes == slice.passes && passes != round_;
  if (!waits) packed = nullptr;
  Part part = {.passes = passes, .tally = std::move(tally), .slice = nullptr, .packed = nullptr};
  std::vector<Slices::iterator> merged;
  if (packed != nullptr) {
    part.packed = std::move(packed);
  } else {
    const auto sum = std::make_shared<SliceSums>(std::move(slice));
    for (auto found = FindSibling(sum->passes); found != slices_.end();
         found = FindSibling(sum->passes)) {
      const Part& sibling = found->second;
      LUCERNA_RETURN_IF_ERROR(sibling.packed != nullptr ? sibling.packed->AddTo(*sum)
                                                        : MergeSibling(*sum, *sibling.slice));
      merged.push_back(found);
    }
    part.slice = sum;
  }
  Slices larger;
  larger.emplace(passes.first, std::move(part));
  for (const Slices::iterator& of_sum : merged)
    slices_.erase(of_sum);
  added_.merge(added);
  slices_.merge(larger);
  return absl::OkStatus();
}

std::shared_ptr<const SliceSums> SliceTree::Part::Unpacked() const {
  return packed == nullptr ? slice : std::make_shared<const SliceSums>(packed->Unpacked());
}

std::uint64_t SliceTree::PrefixEnd() const {
  std::uint64_t end = round_.first;
  for (auto found = slices_.find(end); found != slices_.end(); found = slices_.find(end))
    end = found->second.passes.last;
  return end;
}

std::vector<std::shared_ptr<const SliceSums>> SliceTree::Prefix() const {
  std::vector<std::shared_ptr<const SliceSums>> prefix;
  std::uint64_t end = round_.first;
  for (auto found = slices_.find(end); found != slices_.end(); found = slices_.find(end)) {
    prefix.push_back(found->second.Unpacked());
    end = found->second.passes.last;
  }
  return prefix;
}

std::shared_ptr<const SliceSums> SliceTree::Whole() const {
  LUCERNA_CHECK(IsWhole());
  return slices_.at(round_.first).Unpacked();
}

}  // namespace lucerna
