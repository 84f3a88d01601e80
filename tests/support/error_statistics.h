// Sums over made-up passes, as the error estimate wants them.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "render/estimate/error_estimate.h"

namespace lucerna {

// What is kept of all passes, per pixel.
class ErrorStatistics {
 public:
  explicit ErrorStatistics(std::size_t pixels);

  // Takes in pass number `pass`: per pixel its radiance and the
  // luminance of radiance by which its kernel is estimated to have changed it.
  void AddPass(std::uint64_t pass, std::span<const RgbSum> radiance, std::span<const double> bias);

  [[nodiscard]] std::int64_t passes() const { return passes_; }
  // Sums over the even passes [pixels].
  [[nodiscard]] const std::vector<RgbSum>& even_sum() const { return even_sum_; }
  // Sums over all passes of the squared luminance [pixels].
  [[nodiscard]] const std::vector<double>& square_sum() const { return square_sum_; }
  // The largest luminance of a pass [pixels].
  [[nodiscard]] const std::vector<float>& largest() const { return largest_; }
  // Sums over even and odd passes of the bias [pixels].
  [[nodiscard]] const std::vector<double>& even_bias() const { return bias_sum_[0]; }
  [[nodiscard]] const std::vector<double>& odd_bias() const { return bias_sum_[1]; }

 private:
  std::int64_t passes_ = 0;
  std::vector<RgbSum> even_sum_;
  std::vector<double> square_sum_;
  std::vector<float> largest_;
  std::array<std::vector<double>, 2> bias_sum_;
};

}  // namespace lucerna
