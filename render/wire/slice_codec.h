// How does a slice travel?
//
// A short head (magic with the version, passes, pixels, counters) and the columns as byte planes of
// the bits that they have (estimate/slice_sums.h): the lowest of 8 bits of noise, the others of
// exponents, which compress. Red and blue travel beside green (wire/color_columns.h). The same
// slice gives the same bytes.
//
// Decoding checks everything: shape against what the caller expects before anything is allocated,
// that numbers are finite, that dropped photons belong to the slice, and that no byte is left over.
#pragma once

#include <string>
#include <string_view>
#include <utility>

#include "render/base/parallel.h"
#include "render/base/status.h"
#include "render/estimate/slice_sums.h"
#include "render/estimate/slice_tree.h"

namespace lucerna {

// By the threads of `team`, or by the caller's alone.
[[nodiscard]] std::string EncodeSlice(const SliceSums& slice, ThreadTeam* team = nullptr);

// Errors: INVALID_ARGUMENT when `bytes` is not a slice of this shape.
[[nodiscard]] StatusOr<SliceSums> DecodeSlice(std::string_view bytes, const SliceShape& shape);

// A slice as its bytes. It is added to its sibling column by column.
class EncodedSlice final : public PackedSlice {
 public:
  // Requires bytes that DecodeSlice reads with this shape.
  EncodedSlice(std::string bytes, const SliceShape& shape)
      : bytes_(std::move(bytes)), shape_(shape) {}
  [[nodiscard]] SliceSums Unpacked() const override;
  [[nodiscard]] Status AddTo(SliceSums& sum) const override;

 private:
  const std::string bytes_;
  const SliceShape shape_;
};

}  // namespace lucerna
