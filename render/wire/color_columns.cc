#include "render/wire/color_columns.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "render/base/status.h"
#include "render/estimate/slice_sums.h"
#include "render/wire/bytes.h"

namespace lucerna {
namespace {

// The pixel whose ratio is taken lies so many before: as many are decoded at once, in a vector.
constexpr std::size_t kBefore = 8;

bool IsNormal(float value) {
  const float size = std::abs(value);
  return size >= std::numeric_limits<float>::min() && size <= std::numeric_limits<float>::max();
}

// The bits of the number that is to `base` as `before` is to `base_before`; of `base` where no such
// ratio can be had.
std::uint32_t Predicted(float base, float base_before, float before) {
  const float ratio = before / base_before;
  const float predicted = base * ratio;
  const bool has_ratio = IsNormal(base) && IsNormal(base_before);
  if (has_ratio && !IsNormal(before)) return 0;
  const bool is_usable = has_ratio && IsNormal(ratio) && IsNormal(predicted);
  return std::bit_cast<std::uint32_t>(is_usable ? predicted : base);
}

// Calls body(pixel, code that is predicted from what lies before).
template <typename Body>
void ForEachPixel(const ColorColumn& with, const float* channel, const Body& body) {
  const std::span<const float> base = with.base;
  for (std::size_t pixel = 0; pixel < base.size(); ++pixel) {
    const bool has_before = pixel >= kBefore;
    const std::size_t before = has_before ? pixel - kBefore : 0;
    const std::uint32_t bits = has_before ? Predicted(base[pixel], base[before], channel[before])
                                          : std::bit_cast<std::uint32_t>(base[pixel]);
    // With as few bits as what is predicted, so that the difference has no others.
    const unsigned int rounded =
        with.counts.empty() ? with.dropped
                            : std::max(with.dropped, DroppedBits(PhotonBits(with.counts[pixel])));
    const std::uint32_t half = rounded == 0 ? 0 : std::uint32_t{1} << (rounded - 1);
    body(pixel, ((bits + half) >> rounded) << (rounded - with.dropped));
  }
}

}  // namespace

void CodesOfChannel(const ColorColumn& with, std::span<const float> channel,
                    std::span<std::uint32_t> codes) {
  LUCERNA_CHECK(with.base.size() == channel.size() && codes.size() == channel.size());
  ForEachPixel(with, channel.data(), [&](std::size_t pixel, std::uint32_t predicted) {
    const std::uint32_t code = std::bit_cast<std::uint32_t>(channel[pixel]) >> with.dropped;
    codes[pixel] = ZigZag(static_cast<std::int32_t>(code - predicted));
  });
}

bool ChannelFromCodes(const ColorColumn& with, std::span<const std::uint32_t> codes,
                      std::span<float> channel) {
  LUCERNA_CHECK(with.base.size() == channel.size() && codes.size() == channel.size());
  constexpr std::uint32_t kExponent = 0x7F800000;  // all ones: infinite or not a number
  std::uint32_t all = 0;
  std::uint32_t largest_exponent = 0;
  ForEachPixel(with, channel.data(), [&](std::size_t pixel, std::uint32_t predicted) {
    const std::uint32_t code = predicted + static_cast<std::uint32_t>(UnZigZag(codes[pixel]));
    const std::uint32_t bits = code << with.dropped;
    all |= code;
    largest_exponent = std::max(largest_exponent, bits & kExponent);
    channel[pixel] = std::bit_cast<float>(bits);
  });
  const bool is_too_wide = with.dropped > 0 && (all >> (32 - with.dropped)) != 0;
  return !is_too_wide && largest_exponent != kExponent;
}

}  // namespace lucerna
