// Which slices of a round have come, and what are they together?
//
// Slices are put together to larger ones as soon as both halves are there. Each pass counts once: a
// slice that comes again changes nothing, and one that overlaps another without being equal to it
// was never lent. A slice that waits for its other half may do so packed.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <set>
#include <vector>

#include "render/base/status.h"
#include "render/estimate/rounds.h"
#include "render/estimate/slice_sums.h"

namespace lucerna {

// A slice in fewer bytes than its columns take.
class PackedSlice {
 public:
  virtual ~PackedSlice() = default;
  [[nodiscard]] virtual SliceSums Unpacked() const = 0;
  // MergeSibling with this slice. `sum` is of no use after an error.
  [[nodiscard]] virtual Status AddTo(SliceSums& sum) const = 0;
};

class SliceTree {
 public:
  explicit SliceTree(const PassRange& round) : round_(round) {}

  enum class Outcome : std::uint8_t { kAccepted, kDuplicate };
  // Whether a slice of these passes is new; kDuplicate also when a longer one has brought them.
  // Errors: INVALID_ARGUMENT when it is no slice of the round or overlaps a shorter one.
  [[nodiscard]] StatusOr<Outcome> Check(const PassRange& passes) const;
  // Adds a slice that Check called new, of the shape of the others. If it must wait, it waits as
  // `packed`, the same slice, or as it is where there is none.
  // Errors: OUT_OF_RANGE when counters would not fit. Then nothing has changed, nor when it throws
  // std::bad_alloc.
  [[nodiscard]] Status Add(SliceSums slice, std::unique_ptr<const PackedSlice> packed = nullptr);

  // Passes from the beginning of the round on without a gap.
  [[nodiscard]] std::uint64_t PrefixEnd() const;
  [[nodiscard]] bool IsWhole() const { return PrefixEnd() == round_.last; }
  // The slices of that prefix, in order.
  [[nodiscard]] std::vector<std::shared_ptr<const SliceSums>> Prefix() const;
  // The whole round. Requires IsWhole().
  [[nodiscard]] std::shared_ptr<const SliceSums> Whole() const;

 private:
  struct Part {
    PassRange passes;
    BatchTally tally;
    // One of them.
    std::shared_ptr<const SliceSums> slice;
    std::shared_ptr<const PackedSlice> packed;

    [[nodiscard]] std::shared_ptr<const SliceSums> Unpacked() const;
  };
  using Slices = std::map<std::uint64_t, Part>;  // by first pass

  // The sibling of a slice, if it is there.
  Slices::iterator FindSibling(const PassRange& passes);

  PassRange round_;
  std::set<PassRange> added_;
  Slices slices_;
};

}  // namespace lucerna
