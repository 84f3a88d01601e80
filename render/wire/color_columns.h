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

namespace lucerna {

// `channel` is predicted from `base`; floats with `dropped` low bits that are zero, or, where
// `counts` are given, what PhotonBits has of them at least. All of one size.
struct ColorColumn {
  std::span<const float> base;
  std::span<const float> counts;
  unsigned int dropped = 0;
};

// The numbers to be sent in place of `channel`, as many.
void CodesOfChannel(const ColorColumn& with, std::span<const float> channel,
                    std::span<std::uint32_t> codes);
// `channel` from what CodesOfChannel made of it. False when the codes are of something else: a
// number of more bits, or one that is not finite.
[[nodiscard]] bool ChannelFromCodes(const ColorColumn& with, std::span<const std::uint32_t> codes,
                                    std::span<float> channel);

}  // namespace lucerna
