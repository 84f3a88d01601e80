#include "tests/support/error_statistics.h"

#include <algorithm>

#include "render/base/status.h"

namespace lucerna {

ErrorStatistics::ErrorStatistics(std::size_t pixels)
    : even_sum_(pixels), square_sum_(pixels), largest_(pixels) {
  for (std::vector<double>& sum : bias_sum_)
    sum.resize(pixels);
}

void ErrorStatistics::AddPass(std::uint64_t pass, std::span<const RgbSum> radiance,
                              std::span<const double> bias) {
  LUCERNA_CHECK(radiance.size() == even_sum_.size() && bias.size() == even_sum_.size());
  const bool is_even = pass % 2 == 0;
  std::vector<double>& bias_sum = bias_sum_[is_even ? 0 : 1];
  for (std::size_t pixel = 0; pixel < radiance.size(); ++pixel) {
    const double luminance = LuminanceOf(radiance[pixel]);
    square_sum_[pixel] += luminance * luminance;
    largest_[pixel] = std::max(largest_[pixel], static_cast<float>(luminance));
    bias_sum[pixel] += bias[pixel];
    if (!is_even) continue;
    for (std::size_t c = 0; c < 3; ++c) {
      even_sum_[pixel][c] += radiance[pixel][c];
    }
  }
  ++passes_;
}

}  // namespace lucerna
