#include "render/wire/color_columns.h"

#include <algorithm>
#include <array>
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

// Some pixels, with the kBefore pixels before them in front.
constexpr std::size_t kPixels = 512;
struct Window {
  std::array<float, kBefore + kPixels> base, channel;
  std::array<float, kPixels> counts;
};

// Calls body(pixel, its code that is predicted from what lies before, its number in the channel),
// which reads the number or sets it. Before and after that of a run of pixels, begin and end are
// called with the first of them and their numbers.
template <typename Begin, typename Body, typename End>
void ForEachPixel(const ColorColumn& with, const Begin& begin, const Body& body, const End& end) {
  const std::size_t size = with.base.size();
  const unsigned int dropped = 32 - 8 * with.base.bytes();
  Window window = {};
  for (std::size_t first = 0; first < size; first += kPixels) {
    const std::size_t count = std::min(kPixels, size - first);
    with.base.Read(first, std::span(window.base).subspan(kBefore, count));
    if (with.counts != nullptr) with.counts->Read(first, std::span(window.counts).first(count));
    const std::span channel = std::span(window.channel).subspan(kBefore, count);
    begin(first, channel);
    const auto work = [&](std::size_t i, std::uint32_t bits) {
      // With as few bits as what is predicted, so that the difference has no others.
      const unsigned int rounded =
          with.counts == nullptr ? dropped
                                 : std::max(dropped, DroppedBits(PhotonBits(window.counts[i])));
      const std::uint32_t half = rounded == 0 ? 0 : std::uint32_t{1} << (rounded - 1);
      body(first + i, ((bits + half) >> rounded) << (rounded - dropped), channel[i]);
    };
    const std::size_t without = first == 0 ? std::min(kBefore, count) : 0;
    for (std::size_t i = 0; i < without; ++i)
      work(i, std::bit_cast<std::uint32_t>(window.base[kBefore + i]));
    for (std::size_t i = without; i < count; ++i)
      work(i, Predicted(window.base[kBefore + i], window.base[i], window.channel[i]));
    end(first, channel);
    std::copy_n(window.base.end() - kBefore, kBefore, window.base.begin());
    std::copy_n(window.channel.end() - kBefore, kBefore, window.channel.begin());
  }
}

}  // namespace

void CodesOfChannel(const ColorColumn& with, const PackedFloats& channel,
                    std::span<std::uint32_t> codes) {
  LUCERNA_CHECK(with.base.size() == channel.size() && codes.size() == channel.size() &&
                with.base.bytes() == channel.bytes());
  const unsigned int dropped = 32 - 8 * channel.bytes();
  ForEachPixel(
      with, [&](std::size_t first, std::span<float> floats) { channel.Read(first, floats); },
      [&](std::size_t pixel, std::uint32_t predicted, float value) {
        const std::uint32_t code = std::bit_cast<std::uint32_t>(value) >> dropped;
        codes[pixel] = ZigZag(static_cast<std::int32_t>(code - predicted));
      },
      [](std::size_t, std::span<float>) {});
}

bool ChannelFromCodes(const ColorColumn& with, std::span<const std::uint32_t> codes,
                      PackedFloats& channel) {
  LUCERNA_CHECK(with.base.size() == channel.size() && codes.size() == channel.size() &&
                with.base.bytes() == channel.bytes());
  const unsigned int dropped = 32 - 8 * channel.bytes();
  constexpr std::uint32_t kExponent = 0x7F800000;  // all ones: infinite or not a number
  std::uint32_t all = 0;
  std::uint32_t largest_exponent = 0;
  ForEachPixel(
      with, [](std::size_t, std::span<float>) {},
      [&](std::size_t pixel, std::uint32_t predicted, float& value) {
        const std::uint32_t code = predicted + static_cast<std::uint32_t>(UnZigZag(codes[pixel]));
        const std::uint32_t bits = code << dropped;
        all |= code;
        largest_exponent = std::max(largest_exponent, bits & kExponent);
        value = std::bit_cast<float>(bits);
      },
      [&](std::size_t first, std::span<float> floats) { channel.Write(first, floats); });
  const bool is_too_wide = (all >> (32 - dropped)) != 0;
  return !is_too_wide && largest_exponent != kExponent;
}

}  // namespace lucerna
