// How do the three channels of a radiance travel?
//
// Light of one color on a surface of one color has the same ratio of red to green in all its
// pixels, however noisy it is. So red and blue are sent as what they are more or less than green
// times the ratio of a pixel before. Nothing is lost, and there is little to send.
//
// The prediction is made in floats and must have the same bits for encoder and decoder. Denormal
// numbers are left out of it: some threads round them to zero, and some do not.
#pragma once

#include <cstdint>
#include <span>

#include "render/math/packed_floats.h"

namespace lucerna {

// What a channel is predicted from: `base`, whose floats have as many bytes. Where `counts` are
// given, the channel has no more significant bits than PhotonBits says. All of one size.
struct ColorColumn {
  const PackedFloats& base;
  const PackedFloats* counts = nullptr;
};

// The numbers to be sent in place of `channel`, as many.
void CodesOfChannel(const ColorColumn& with, const PackedFloats& channel,
                    std::span<std::uint32_t> codes);
// `channel` from what CodesOfChannel made of it. False when the codes are of something else: a
// number of more bits, or one that is not finite.
[[nodiscard]] bool ChannelFromCodes(const ColorColumn& with, std::span<const std::uint32_t> codes,
                                    PackedFloats& channel);

}  // namespace lucerna
