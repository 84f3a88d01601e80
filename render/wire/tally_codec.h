// How do the counters of a batch travel? As varints, in the order of their rows in
// estimate/accumulation.h.
#pragma once

#include "render/base/status.h"
#include "render/estimate/accumulation.h"
#include "render/wire/bytes.h"

namespace lucerna {

void WriteTally(ByteWriter& writer, const BatchTally& tally);
// Errors: INVALID_ARGUMENT for counters that contradict each other. What is truncated fails the
// reader.
[[nodiscard]] StatusOr<BatchTally> ReadTally(ByteReader& reader);

}  // namespace lucerna
