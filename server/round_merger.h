// What have workers brought of the rounds that are open?
//
// Puts slices together (estimate/slice_tree.h), every pass once. A slice may come late, twice or
// from a worker that lost its lease: the first to come counts, and the order cannot be seen in the
// sums.
//
// Threads: any. Merging into one round does not wait for another.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>

#include "render/base/mutex.h"
#include "render/base/status.h"
#include "render/estimate/image_sums.h"
#include "render/estimate/slice_sums.h"
#include "render/estimate/slice_tree.h"
#include "server/batch.h"

namespace lucerna {

class RoundMerger {
 public:
  // Begins a round of the job; `key.pass` is its first pass. `shape` is that of its slices, for
  // all passes of the round. Requires that the round is not open.
  void Open(const PassKey& key, const SliceShape& shape);

  // The shape of slices of the round; absent when it is not open.
  [[nodiscard]] std::optional<SliceShape> ShapeOf(const PassKey& key) const;

  // Whether a slice of these passes has been merged; false when the round is not open.
  [[nodiscard]] bool Has(const PassKey& key, const PassRange& passes) const;
  // kSuperseded when the round is not open (any more). A slice that must wait for its sibling does
  // so as `packed` (SliceTree::Add).
  // Errors: INVALID_ARGUMENT when the slice was never lent, OUT_OF_RANGE when counters would not
  // fit.
  [[nodiscard]] StatusOr<MergeOutcome> Merge(const PassKey& key, SliceSums slice,
                                             std::unique_ptr<const PackedSlice> packed = nullptr);

  // One past the last pass that has come without a gap; absent when the round is not open.
  [[nodiscard]] std::optional<std::uint64_t> PrefixEnd(const PassKey& key) const;
  // The slices up to there, in order.
  [[nodiscard]] ImageSums::Slices Prefix(const PassKey& key) const;
  // Ends a round, and hands over its sums. Requires that it is whole.
  [[nodiscard]] std::shared_ptr<const SliceSums> Take(const PassKey& key);
  // Ends a round and forgets its sums, if it is open.
  void Drop(const PassKey& key);

 private:
  struct OpenRound {
    explicit OpenRound(const SliceShape& s) : shape(s), tree(s.passes) {}

    const SliceShape shape;
    mutable Mutex mutex;
    SliceTree tree LUCERNA_GUARDED_BY(mutex);
  };
  [[nodiscard]] std::shared_ptr<OpenRound> Find(const PassKey& key) const;

  mutable Mutex mutex_;
  std::map<PassKey, std::shared_ptr<OpenRound>> rounds_ LUCERNA_GUARDED_BY(mutex_);
};

}  // namespace lucerna
