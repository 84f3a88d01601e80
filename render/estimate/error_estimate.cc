#include "render/estimate/error_estimate.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "render/base/status.h"

namespace lucerna {
namespace {

// Of relMSE, as in film/image_metrics.h.
constexpr double kEpsilon = 0.01;

// What the estimate's models may be off by, in the logarithm of the squared error: a seventh of the
// error. (Their worst on the project's scenes is a fifth, where the step of a hard shadow is
// blurred.)
constexpr double kModelError = 0.3;

// The share of a blurred edge's squared relative bias that smoothing loses while the kernel is a
// few pixels wide, and that is lost because the edge's dark side is not known to be so dark; and
// the area of correlation [pixels] from which on kernels are wide and less is lost. Measured.
constexpr double kSmoothedAway = 1.0 / 3;
constexpr double kWideKernel = 9;
// Over how many more pixels products are alike once smoothed: the weights (1 2 1)/4 both ways have
// squares that sum to 9/64, and the mean of the two ways to smooth one product varies by 13/128.
constexpr double kSmoothedArea = 18.0 / 13;

// Neighbours whose differences correlate less are strangers.
constexpr double kLeastCorrelation = 0.05;
// What the correlation of neighbours is found from, in pixels.
constexpr std::size_t kCorrelationSample = std::size_t{1} << 17;

double Middle(double a, double b, double c) {
  return std::max(std::min(a, b), std::min(std::max(a, b), c));
}

// The mean of the pixels within kReach, without the pixel itself; its own value where it is alone.
class MeanAround {
 public:
  MeanAround(int width, int height, std::vector<float> values)
      : width_(width), height_(height), values_(std::move(values)), rows_(values_.size()) {
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        float sum = 0;
        for (int i = std::max(0, x - kReach); i <= std::min(width - 1, x + kReach); ++i)
          sum += values_[At(i, y)];
        rows_[At(x, y)] = sum;
      }
    }
  }

  [[nodiscard]] double operator()(int x, int y) const {
    const int top = std::max(0, y - kReach);
    const int bottom = std::min(height_ - 1, y + kReach);
    const int across = std::min(width_ - 1, x + kReach) - std::max(0, x - kReach) + 1;
    const int count = across * (bottom - top + 1) - 1;
    const auto own = static_cast<double>(values_[At(x, y)]);
    if (count == 0) return own;
    double sum = -own;
    for (int j = top; j <= bottom; ++j)
      sum += static_cast<double>(rows_[At(x, j)]);
    return std::max(sum, 0.0) / count;
  }

 private:
  static constexpr int kReach = 3;

  [[nodiscard]] std::size_t At(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
           static_cast<std::size_t>(x);
  }

  int width_, height_;
  std::vector<float> values_;
  std::vector<float> rows_;  // sums over x
};

// The estimates of one pixel, means over channels.
struct PixelError {
  float relative_noise = 0, relative_bias = 0;
  float noise = 0, bias = 0;

  // By which pixels are left out: whatever is large by chance, be it above or below 0.
  [[nodiscard]] float Size() const { return relative_noise + std::abs(relative_bias); }
};

// `values` with the weights (1 2 1)/4 along rows and along columns; edges repeat.
std::vector<float> Smoothed(int width, int height, const std::vector<float>& values) {
  std::vector<float> rows(values.size());
  std::vector<float> smooth(values.size());
  const auto at = [&](int x, int y) {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(x);
  };
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      rows[at(x, y)] = 0.25F * (values[at(std::max(x - 1, 0), y)] + 2 * values[at(x, y)] +
                                values[at(std::min(x + 1, width - 1), y)]);
    }
  }
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      smooth[at(x, y)] = 0.25F * (rows[at(x, std::max(y - 1, 0))] + 2 * rows[at(x, y)] +
                                  rows[at(x, std::min(y + 1, height - 1))]);
    }
  }
  return smooth;
}

// What the kernel changed in each pixel, as the two halves have it.
struct BiasHalves {
  std::vector<float> even, odd;

  explicit BiasHalves(std::size_t pixels) : even(pixels), odd(pixels) {}

  // Squared bias, without the halves' noise.
  [[nodiscard]] std::vector<float> Squares(int width, int height, double factor) const {
    const std::vector<float> smooth_even = Smoothed(width, height, even);
    std::vector<float> squares = Smoothed(width, height, odd);
    for (std::size_t i = 0; i < squares.size(); ++i) {
      squares[i] =
          static_cast<float>(factor) * 0.5F * (even[i] * squares[i] + smooth_even[i] * odd[i]);
    }
    return squares;
  }
};

// Over how many pixels the signed `differences` are alike: the sum of their squared correlations
// over all distances, taken as the product of those along rows and along columns.
double CorrelatedArea(int width, int height, const std::vector<float>& differences) {
  const auto w = static_cast<std::size_t>(width);
  const auto h = static_cast<std::size_t>(height);
  const std::size_t stride = 1 + differences.size() / kCorrelationSample;
  double area = 1;
  for (const bool is_row : {true, false}) {
    const std::size_t length = is_row ? w : h;
    const std::size_t lines = is_row ? h : w;
    const std::size_t step = is_row ? 1 : w;
    const std::size_t next_line = is_row ? w : 1;
    const auto product = [&](std::size_t lag) {
      double sum = 0;
      for (std::size_t line = 0; line < lines; line += stride) {
        const float* at = differences.data() + line * next_line;
        for (std::size_t i = 0; i + lag < length; ++i)
          sum += static_cast<double>(at[i * step]) * static_cast<double>(at[(i + lag) * step]);
      }
      return sum;
    };
    const double variance = product(0);
    if (!(variance > 0)) return 1;
    double sum = 1;
    for (std::size_t lag = 1; lag <= length / 4; ++lag) {
      const double correlation = product(lag) / variance;
      if (correlation < kLeastCorrelation) break;
      sum += 2 * correlation * correlation;
    }
    area *= sum;
  }
  return area;
}

// Squares and products of single pixels, with what their chance is known by.
struct Spread {
  double noise_area = 1, bias_area = 1;  // pixels that are alike
  double z = 0;                          // deviations at either end of an interval
};

SquaredError Summarize(const std::vector<PixelError>& pixels, float PixelError::*noise_of,
                       float PixelError::*bias_of, const Spread& spread) {
  double noise = 0;
  double bias = 0;
  double of_noise = 0;  // fourth powers
  double of_bias = 0;
  double of_cross = 0;
  for (const PixelError& pixel : pixels) {
    const auto n = static_cast<double>(pixel.*noise_of);
    const auto b = static_cast<double>(pixel.*bias_of);
    noise += n;
    bias += b;
    of_noise += n * n;
    of_bias += b * b;
    of_cross += b * n;
  }
  const auto count = static_cast<double>(pixels.size());
  SquaredError error;
  error.noise = noise / count;
  // The product of two halves may fall below 0 where there is no bias to speak of.
  error.bias = std::max(bias / count, 0.0);
  const double total = error.total();
  if (!(total > 0)) return error;
  // E[D⁴] = 3 E[D²]², so 2/3 of the sum for the estimate and as much for the truth.
  const double variance = spread.noise_area * (4.0 / 3.0 * of_noise + 4 * std::max(of_cross, 0.0)) +
                          spread.bias_area * of_bias;
  const double log_width = spread.z * std::sqrt(variance) / count / total + kModelError;
  error.low = total * std::exp(-log_width);
  error.high = total * std::exp(log_width);
  return error;
}

}  // namespace

ErrorStatistics::ErrorStatistics(std::size_t pixels) : even_sum_(pixels), square_sum_(pixels) {
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
    bias_sum[pixel] += bias[pixel];
    if (!is_even) continue;
    for (std::size_t c = 0; c < 3; ++c) {
      even_sum_[pixel][c] += radiance[pixel][c];
    }
  }
  ++passes_;
}

double TwoSidedNormalQuantile(double probability) {
  double low = 0;
  double high = 40;
  for (int i = 0; i < 100; ++i) {
    const double middle = 0.5 * (low + high);
    (std::erfc(middle / std::numbers::sqrt2) > probability ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

ErrorEstimate EstimateError(int width, int height, std::int64_t pass_count, int look,
                            const PixelSumsAt& sums_at) {
  LUCERNA_CHECK(pass_count >= 2 && look >= 1);
  const auto passes = static_cast<double>(pass_count);
  const auto even_passes = static_cast<double>((pass_count + 1) / 2);
  const auto odd_passes = static_cast<double>(pass_count / 2);
  // From the squared difference of the halves' means to the squared noise of the whole mean.
  const double to_noise = even_passes * odd_passes / (passes * passes);
  const double spent = (1 - kConfidence) / (static_cast<double>(look) * (look + 1.0));
  const double z = TwoSidedNormalQuantile(spent);

  const std::size_t count = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  const auto mean_around = [&](std::size_t channel) {
    std::vector<float> means(count);
    for (std::size_t i = 0; i < count; ++i)
      means[i] = static_cast<float>(sums_at(i).all[channel] / passes);
    return MeanAround(width, height, std::move(means));
  };
  const std::array<MeanAround, 3> around = {mean_around(0), mean_around(1), mean_around(2)};

  std::vector<PixelError> pixels(count);
  std::vector<float> differences(count);
  BiasHalves relative_bias(count);
  BiasHalves bias(count);
  double halves = 0;
  double independent = 0;
  std::size_t pixel = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x, ++pixel) {
      const PixelSums sums = sums_at(pixel);
      RgbSum difference{};
      double noise_sum = 0, relative_noise = 0, signed_noise = 0;
      double color_square = 0, relative_color_square = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        const double even = sums.even[c] / even_passes;
        const double odd = (sums.all[c] - sums.even[c]) / odd_passes;
        difference[c] = even - odd;
        const double own = sums.all[c] / passes;
        const double agreed = Middle(even, odd, around[c](x, y));
        const double least = std::min(own, agreed);
        // One over value² + kEpsilon. The agreed value is too large where rare light fell on the
        // dark, the least one too small where lamps are seen in few samples.
        const double weight = 0.5 / (agreed * agreed + kEpsilon) + 0.5 / (least * least + kEpsilon);
        const double noise = difference[c] * difference[c] * to_noise;
        noise_sum += noise;
        relative_noise += noise * weight;
        signed_noise += difference[c] * std::sqrt(weight);
        const double square = sums.bias_color[c] * sums.bias_color[c];
        color_square += square;
        relative_color_square += square / (own * own + kEpsilon);
      }
      pixels[pixel].noise = static_cast<float>(noise_sum / 3);
      pixels[pixel].relative_noise = static_cast<float>(relative_noise / 3);
      differences[pixel] = static_cast<float>(signed_noise);
      const double even_bias = sums.even_bias / even_passes;
      const double odd_bias = sums.odd_bias / odd_passes;
      const double of_color = std::sqrt(color_square / 3);
      const double of_relative_color = std::sqrt(relative_color_square / 3);
      bias.even[pixel] = static_cast<float>(even_bias * of_color);
      bias.odd[pixel] = static_cast<float>(odd_bias * of_color);
      relative_bias.even[pixel] = static_cast<float>(even_bias * of_relative_color);
      relative_bias.odd[pixel] = static_cast<float>(odd_bias * of_relative_color);
      const double luminance = LuminanceOf(difference);
      halves += luminance * luminance * to_noise;
      const double mean = LuminanceOf(sums.all) / passes;
      independent += std::max(0.0, sums.square / passes - mean * mean) / (passes - 1);
    }
  }
  Spread spread{.noise_area = CorrelatedArea(width, height, differences), .z = z};
  const double lost = kSmoothedAway * std::min(1.0, kWideKernel / spread.noise_area);
  const std::vector<float> squares = bias.Squares(width, height, 1 / (1 - lost));
  const std::vector<float> relative_squares = relative_bias.Squares(width, height, 1 / (1 - lost));
  for (std::size_t i = 0; i < count; ++i) {
    pixels[i].bias = squares[i];
    pixels[i].relative_bias = relative_squares[i];
    differences[i] = relative_bias.even[i] - relative_bias.odd[i];
  }
  spread.bias_area = kSmoothedArea * CorrelatedArea(width, height, differences);
  const std::size_t kept =
      count - static_cast<std::size_t>(kTrimmedShare * static_cast<double>(count));
  std::ranges::nth_element(pixels, pixels.begin() + static_cast<std::ptrdiff_t>(kept) - 1, {},
                           &PixelError::Size);
  pixels.resize(kept);
  return {.relative =
              Summarize(pixels, &PixelError::relative_noise, &PixelError::relative_bias, spread),
          .absolute = Summarize(pixels, &PixelError::noise, &PixelError::bias, spread),
          .noise_factor = independent > 0 ? halves / independent : 1};
}

}  // namespace lucerna
