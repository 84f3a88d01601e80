// How does an accumulation travel?
//
// Which hitpoints: differences as varints, or a bitmap of the block, whichever is smaller. How
// many photons: byte planes. Flux: what is left after a guess. A hitpoint that caught n photons
// has about n times the batch's mean flux in green, and in red and blue about green times the
// batch's colour; guess and remainder are integers modulo 2^64, so every value comes back to the
// last bit, however bad the guess.
//
// Decoding checks everything: rows are below the block's size and strictly increasing, counts are
// >= 1, every plane unpacks to exactly its rows, and no byte is left over.
#pragma once

#include <string>
#include <string_view>

#include "render/base/status.h"
#include "render/estimate/accumulation.h"

namespace lucerna {

// Requires an accumulation that keeps its promises for a block of `hitpoints` rows.
[[nodiscard]] std::string EncodeAccumulation(const Accumulation& accumulation,
                                             std::size_t hitpoints);

// Errors: INVALID_ARGUMENT when `bytes` is not an accumulation for a block of `hitpoints` rows.
[[nodiscard]] StatusOr<Accumulation> DecodeAccumulation(std::string_view bytes,
                                                        std::size_t hitpoints);

}  // namespace lucerna
