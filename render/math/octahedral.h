// A unit direction in 32 bits: 2 × 16 bit octahedral coordinates. The largest error is about
// 5e-5 rad. Source: Cigolle et al. 2014, "Survey of Efficient Representations for Independent
// Unit Vectors".
#pragma once

#include <cmath>
#include <cstdint>

#include "render/math/vector.h"

namespace lucerna {

inline std::uint32_t EncodeOctahedral(Vec3 v) {
  const float inverse = 1.0F / (std::abs(v.x) + std::abs(v.y) + std::abs(v.z));
  float a = v.x * inverse;
  float b = v.y * inverse;
  if (v.z < 0) {
    const float folded_a = (1 - std::abs(b)) * std::copysign(1.0F, a);
    b = (1 - std::abs(a)) * std::copysign(1.0F, b);
    a = folded_a;
  }
  const auto quantize = [](float c) {
    return static_cast<std::uint32_t>(static_cast<std::int32_t>(std::lrint(c * 32767.0F)) + 32767);
  };
  return quantize(a) << 16 | quantize(b);
}

inline Vec3 DecodeOctahedral(std::uint32_t code) {
  const auto expand = [](std::uint32_t half) {
    return (static_cast<float>(half) - 32767.0F) * (1.0F / 32767.0F);
  };
  const float a = expand(code >> 16);
  const float b = expand(code & 0xFFFFU);
  Vec3 v = {a, b, 1 - std::abs(a) - std::abs(b)};
  const float fold = std::max(-v.z, 0.0F);
  v.x -= std::copysign(fold, v.x);
  v.y -= std::copysign(fold, v.y);
  return Normalize(v);
}

}  // namespace lucerna
