// Any bytes as a hitpoint block, as radii, as an accumulation or as a slice: no crash, no hang, no
// memory without bound, and what decodes comes back from its own encoding.
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "render/wire/accumulation_codec.h"
#include "render/wire/block_codec.h"
#include "render/wire/slice_codec.h"

namespace lucerna {
namespace {

// What decodes may be merged with another slice, or is refused as a whole.
void DecodeAsSlice(std::string_view bytes, std::size_t pixels, bool has_features) {
  const SliceShape shape = {.passes = has_features ? PassRange{4, 5} : PassRange{16, 18},
                            .pixels = pixels,
                            .evidence = has_features ? std::size_t{0} : std::size_t{2},
                            .photons_per_pass = 100};
  auto slice = DecodeSlice(bytes, shape);
  if (!slice.ok()) return;
  const std::string again = EncodeSlice(*slice);
  const auto same = DecodeSlice(again, shape);
  LUCERNA_CHECK(same.ok() && EncodeSlice(*same) == again);
  if (has_features) return;
  const SliceSums sibling = EmptySlice(SiblingOf(shape.passes), pixels, shape.evidence);
  LUCERNA_CHECK(MergeSibling(*slice, sibling).ok());
}

// The first byte chooses the codec and the rows of the block that the bytes are decoded for.
void Decode(std::string_view bytes) {
  if (bytes.empty()) return;
  const auto choice = static_cast<std::uint8_t>(bytes.front());
  const std::size_t rows = std::size_t{choice} / 5 * 8;
  bytes.remove_prefix(1);
  if (choice % 5 == 0) {
    const auto block = DecodeHitpointBlock(bytes, rows);
    if (!block.ok()) return;
    LUCERNA_CHECK(block->size() <= rows);
    const std::string again = EncodeHitpointBlock(*block);
    const auto same = DecodeHitpointBlock(again, rows);
    LUCERNA_CHECK(same.ok() && EncodeHitpointBlock(*same) == again);
  } else if (choice % 5 == 1) {
    const auto radii = DecodeRadii(bytes, rows);
    if (!radii.ok()) return;
    LUCERNA_CHECK(DecodeRadii(EncodeRadii(*radii), rows).value() == *radii);
  } else if (choice % 5 > 2) {
    DecodeAsSlice(bytes, rows, choice % 5 == 3);
  } else {
    const auto accumulation = DecodeAccumulation(bytes, rows);
    if (!accumulation.ok()) return;
    const std::string again = EncodeAccumulation(*accumulation, rows);
    const auto same = DecodeAccumulation(again, rows);
    LUCERNA_CHECK(same.ok() && EncodeAccumulation(*same, rows) == again);
    // Checked before anything is added: an accumulation that is refused leaves no trace.
    PassSums sums(rows, accumulation->evidence.size());
    static_cast<void>(sums.Add(*accumulation));
  }
}

}  // namespace
}  // namespace lucerna

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  lucerna::Decode({reinterpret_cast<const char*>(bytes), size});
  return 0;
}
