// What have the batches of the open passes brought so far?
//
// Sums each pass's accumulations, every photon range once. A batch may come late, twice or from a
// worker that lost its lease: the first to come counts, and because sums are exact integers the
// order cannot be seen in them.
//
// Ranges are lent whole and never cut again, so two ranges of one pass are equal or apart; a
// batch that overlaps a merged one without being equal to it was never lent and is refused.
//
// Threads: any. Merging into one pass does not wait for another.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>

#include "render/base/mutex.h"
#include "render/base/status.h"
#include "render/estimate/accumulation.h"
#include "server/batch.h"

namespace lucerna {

class PassMerger {
 public:
  // Requires that the pass is not open, and photons > 0.
  void Open(const PassKey& key, std::size_t hitpoints, std::uint64_t photons,
            std::size_t evidence_columns = 0);

  // The rows of the pass's hitpoint block; absent when it is not open.
  [[nodiscard]] std::optional<std::size_t> Hitpoints(const PassKey& key) const;

  // kSuperseded when the pass is not open (any more).
  // Errors: INVALID_ARGUMENT when the range was never lent or the accumulation breaks its
  // promises, OUT_OF_RANGE when a sum would not fit. Then nothing has changed.
  [[nodiscard]] StatusOr<MergeOutcome> Merge(const PassKey& key, WorkRange range,
                                             const Accumulation& accumulation);

  // Whether every photon of the pass has been merged; false when it is not open.
  [[nodiscard]] bool IsComplete(const PassKey& key) const;

  // Ends a complete pass and hands over its sums.
  [[nodiscard]] PassSums Take(const PassKey& key);
  // Ends a pass and forgets its sums, if it is open.
  void Drop(const PassKey& key);

 private:
  struct OpenPass {
    OpenPass(std::size_t hitpoint_count, std::uint64_t photon_count, std::size_t evidence_columns)
        : hitpoints(hitpoint_count),
          photons(photon_count),
          sums(hitpoint_count, evidence_columns) {}

    const std::size_t hitpoints;
    const std::uint64_t photons;
    mutable Mutex mutex;
    PassSums sums LUCERNA_GUARDED_BY(mutex);
    std::map<std::uint64_t, std::uint64_t> merged LUCERNA_GUARDED_BY(mutex);  // first -> last
    std::uint64_t photons_merged LUCERNA_GUARDED_BY(mutex) = 0;
  };

  [[nodiscard]] std::shared_ptr<OpenPass> Find(const PassKey& key) const;

  mutable Mutex mutex_;
  std::map<PassKey, std::shared_ptr<OpenPass>> passes_ LUCERNA_GUARDED_BY(mutex_);
};

}  // namespace lucerna
