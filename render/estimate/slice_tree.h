// Which slices of a round have come, and what are they together?
//
// Slices are put together to larger ones as soon as both halves are there. Each pass counts once: a
// slice that comes again changes nothing, and one that overlaps another without being equal to it
// was never lent.
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

class SliceTree {
 public:
  explicit SliceTree(const PassRange& round) : round_(round) {}

  enum class Outcome : std::uint8_t { kAccepted, kDuplicate };
  // Whether a slice of these passes is new; kDuplicate also when a longer one has brought them.
  // Errors: INVALID_ARGUMENT when it is no slice of the round or overlaps a shorter one.
  [[nodiscard]] StatusOr<Outcome> Check(const PassRange& passes) const;
  // Adds a slice that Check called new, of the shape of the others.
  // Errors: OUT_OF_RANGE when counters would not fit. Then nothing has changed, nor when it throws
  // std::bad_alloc.
  [[nodiscard]] Status Add(SliceSums slice);

  // Passes from the beginning of the round on without a gap.
  [[nodiscard]] std::uint64_t PrefixEnd() const;
  [[nodiscard]] bool IsWhole() const { return PrefixEnd() == round_.last; }
  // The slices of that prefix, in order.
  [[nodiscard]] std::vector<std::shared_ptr<const SliceSums>> Prefix() const;
  // The whole round. Requires IsWhole().
  [[nodiscard]] std::shared_ptr<const SliceSums> Whole() const;

 private:
  using Slices = std::map<std::uint64_t, std::shared_ptr<SliceSums>>;  // by first pass

  // The sibling of a slice, if it is there.
  Slices::iterator FindSibling(const PassRange& passes);

  PassRange round_;
  std::set<PassRange> added_;
  Slices slices_;
};

}  // namespace lucerna
