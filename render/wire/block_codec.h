// How do the hitpoints of a pass travel?
//
// A block is a short head (magic with the version, row counts) and its columns as byte planes,
// every value as the difference to the row before: neighbouring pixels see neighbouring surface.
// Radii are bytes of their own, because they become known later and change with every pass. The
// same value gives the same bytes, so equal blocks have equal digests.
//
// Decoding checks everything: counts against what the caller allows before anything is
// allocated, that numbers are finite, that rows are in order, and that no byte is left over.
#pragma once

#include <string>
#include <string_view>

#include "render/base/parallel.h"
#include "render/base/status.h"
#include "render/estimate/hitpoint_block.h"

namespace lucerna {

[[nodiscard]] std::string EncodeHitpointBlock(const HitpointBlock& block,
                                              ThreadTeam* team = nullptr);

// Errors: INVALID_ARGUMENT when `bytes` is not a block of at most `max_hitpoints` rows that keeps
// the block's invariants. (Whether materials exist is for those to check who have the scene.)
[[nodiscard]] StatusOr<HitpointBlock> DecodeHitpointBlock(std::string_view bytes,
                                                          std::size_t max_hitpoints);

[[nodiscard]] std::string EncodeRadii(const RadiusColumn& radii, ThreadTeam* team = nullptr);

// Errors: INVALID_ARGUMENT when `bytes` are not `hitpoints` radii, each finite and > 0.
[[nodiscard]] StatusOr<RadiusColumn> DecodeRadii(std::string_view bytes, std::size_t hitpoints);

[[nodiscard]] std::string EncodeEyePathCounts(const EyePathCounts& counts);

// Errors: INVALID_ARGUMENT when `bytes` are not `pixels` numbers from 1 to kMostEyePaths.
[[nodiscard]] StatusOr<EyePathCounts> DecodeEyePathCounts(std::string_view bytes,
                                                          std::size_t pixels);

}  // namespace lucerna
