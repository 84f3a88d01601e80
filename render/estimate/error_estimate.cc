#include "render/estimate/error_estimate.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "render/base/status.h"
#include "render/estimate/relative_error.h"

namespace lucerna {
namespace {

// What the models of noise may be off by, in the logarithm of the squared error: a seventh of the
// error. Most of it is light so rare that the halves have hardly seen it.
constexpr double kModelError = 0.3;
// What squared bias is at least and at most, of what is estimated. It is too large where values
// without blur are guessed from few photons, too small where lines thinner than the inner kernel
// are. Chosen, with kModelError, on half A of tests/tools/make_study_scenes.py and on scenes of the
// project.
constexpr double kLeastBias = 0.35;
constexpr double kMostBias = 2.5;

// The most by which an estimate is assumed to be too large, as a share of its square.
constexpr double kLeastShare = 0.01;
// How much noise of the estimated bias weighs against the bias in the share of it that is believed
// of single pixels. Chosen on half A of tests/tools/make_study_scenes.py.
constexpr double kNoiseWeight = 0.02;

// The widest smoothing that is tried reaches over so many times the area over which noise is alike.
constexpr double kWidest = 3;
// How much less than narrower ones a wider smoothing may say, in deviations of theirs.
constexpr double kUnsure = 0.5;

// Neighbours whose differences correlate less count as independent.
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

// The mean bias of a pixel in even passes and in odd ones [luminance].
struct HalfBiases {
  float even = 0, odd = 0;
};

// The share of the estimated bias that is taken off single pixels to guess their values without
// blur: near 1 unless the estimate is mostly noise.
double BelievedShare(const std::vector<HalfBiases>& biases, const std::vector<double>& luminances,
                     double floor) {
  double bias = 0;
  double noise = 0;
  for (std::size_t i = 0; i < luminances.size(); ++i) {
    const auto even = static_cast<double>(biases[i].even);
    const auto odd = static_cast<double>(biases[i].odd);
    const double weight = 1 / (luminances[i] * luminances[i] + floor);
    bias += even * odd * weight;
    noise += 0.25 * (even - odd) * (even - odd) * weight;
  }
  bias = std::max(bias, 0.0);
  return noise > 0 ? bias / (bias + kNoiseWeight * noise) : 1;
}

// The estimates of one pixel, means over channels.
struct PixelError {
  float relative_noise = 0, relative_bias = 0;
  float noise = 0, bias = 0;
  // By how much the relative bias might be larger, or smaller, for another value without blur.
  float more_bias = 0, less_bias = 0;

  // By which pixels are left out: whatever is large by chance, be it above or below 0.
  [[nodiscard]] float Size() const { return relative_noise + std::abs(relative_bias); }
};

// `values` with triangular weights of `reach` pixels to either side, along rows and along columns;
// edges repeat.
std::vector<float> Smoothed(int width, int height, int reach, const std::vector<float>& values) {
  std::vector<float> smooth = values;
  std::vector<double> line;
  // A triangle is a box over a box: one looks back, the other ahead.
  const auto box = [&](std::size_t start, std::size_t step, int length, int back, int ahead) {
    line.resize(static_cast<std::size_t>(length));
    for (std::size_t i = 0; i < line.size(); ++i)
      line[i] = static_cast<double>(smooth[start + i * step]);
    const auto at = [&](int i) {
      return line[static_cast<std::size_t>(std::clamp(i, 0, length - 1))];
    };
    double sum = 0;
    for (int i = -back; i <= ahead; ++i)
      sum += at(i);
    for (int i = 0; i < length; ++i) {
      smooth[start + static_cast<std::size_t>(i) * step] =
          static_cast<float>(sum / (back + ahead + 1));
      sum += at(i + ahead + 1) - at(i - back);
    }
  };
  const auto w = static_cast<std::size_t>(width);
  for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y) {
    box(y * w, 1, width, reach - 1, 0);
    box(y * w, 1, width, 0, reach - 1);
  }
  for (std::size_t x = 0; x < w; ++x) {
    box(x, w, height, reach - 1, 0);
    box(x, w, height, 0, reach - 1);
  }
  return smooth;
}

// The least of `values` within `reach` pixels along rows and columns.
std::vector<float> LeastAround(int width, int height, int reach, const std::vector<float>& values) {
  std::vector<float> least = values;
  std::vector<float> line;
  const auto along = [&](std::size_t start, std::size_t step, int length) {
    line.resize(static_cast<std::size_t>(length));
    for (std::size_t i = 0; i < line.size(); ++i)
      line[i] = least[start + i * step];
    for (int i = 0; i < length; ++i) {
      least[start + static_cast<std::size_t>(i) * step] = *std::min_element(
          line.begin() + std::max(0, i - reach), line.begin() + std::min(length, i + reach + 1));
    }
  };
  const auto w = static_cast<std::size_t>(width);
  for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y)
    along(y * w, 1, width);
  for (std::size_t x = 0; x < w; ++x)
    along(x, w, height);
  return least;
}

// What a kernel at most blurs over, in pixels: the default first radius.
constexpr int kKernelReach = 3;

// The least luminance that a pixel can plausibly have without the blur.
std::vector<float> LeastLuminance(int width, int height, std::vector<float> luminance) {
  return LeastAround(width, height, kKernelReach, Smoothed(width, height, 2, luminance));
}

// What the kernel changed in each pixel, as the two halves have it.
struct BiasHalves {
  std::vector<float> even, odd;

  explicit BiasHalves(std::size_t pixels) : even(pixels), odd(pixels) {}

  // Squared bias, without the halves' noise: the product of one half with the other, smoothed.
  [[nodiscard]] std::vector<float> Squares(int width, int height, int reach) const {
    const std::vector<float> smooth_even = Smoothed(width, height, reach, even);
    std::vector<float> squares = Smoothed(width, height, reach, odd);
    for (std::size_t i = 0; i < squares.size(); ++i)
      squares[i] = 0.5F * (even[i] * squares[i] + smooth_even[i] * odd[i]);
    return squares;
  }
};

// Over how many pixels products of one field's chance and the other's are alike: the sum, over all
// distances, of the products of the two fields' correlations, taken as that along rows times that
// along columns.
double CorrelatedArea(int width, int height, const std::vector<float>& one,
                      const std::vector<float>& other) {
  const auto w = static_cast<std::size_t>(width);
  const auto h = static_cast<std::size_t>(height);
  const std::size_t stride = 1 + one.size() / kCorrelationSample;
  double area = 1;
  for (const bool is_row : {true, false}) {
    const std::size_t length = is_row ? w : h;
    const std::size_t lines = is_row ? h : w;
    const std::size_t step = is_row ? 1 : w;
    const std::size_t next_line = is_row ? w : 1;
    const auto product = [&](const std::vector<float>& field, std::size_t lag) {
      double sum = 0;
      for (std::size_t line = 0; line < lines; line += stride) {
        const float* at = field.data() + line * next_line;
        for (std::size_t i = 0; i + lag < length; ++i)
          sum += static_cast<double>(at[i * step]) * static_cast<double>(at[(i + lag) * step]);
      }
      return sum;
    };
    const double variance = product(one, 0);
    const double other_variance = product(other, 0);
    if (!(variance > 0 && other_variance > 0)) return 1;
    double sum = 1;
    for (std::size_t lag = 1; lag <= length / 4; ++lag) {
      const double correlation = product(one, lag) / variance;
      if (correlation < kLeastCorrelation) break;
      sum +=
          2 * correlation * (&one == &other ? correlation : product(other, lag) / other_variance);
    }
    area *= sum;
  }
  return area;
}

// The squared correlation of two fields, pixel by pixel.
double SquaredCorrelation(const std::vector<float>& one, const std::vector<float>& other) {
  double both = 0, ones = 0, others = 0;
  for (std::size_t i = 0; i < one.size(); ++i) {
    const auto a = static_cast<double>(one[i]);
    const auto b = static_cast<double>(other[i]);
    both += a * b;
    ones += a * a;
    others += b * b;
  }
  return ones > 0 && others > 0 ? both * both / (ones * others) : 1;
}

// By what the chance in sums over pixels is known.
struct Spread {
  double noise_area = 1, bias_area = 1;  // pixels that are alike
  double z = 0;                          // deviations at either end of an interval
};

// What smoothing over `reach` pixels makes of the squared bias of all pixels.
struct SmoothedBias {
  std::vector<float> relative, absolute;
  double area = 1;  // pixels whose chance is alike
  // Sums, and the deviation of the relative one.
  double relative_sum = 0, absolute_sum = 0, deviation = 0;
};

// The biases of pixels: absolute, and relative to what the even passes and what the odd ones say. A
// product of both halves' biases is free of noise only if its weight knows one of them alone.
struct PixelBiases {
  BiasHalves absolute, to_even, to_odd;

  explicit PixelBiases(std::size_t pixels) : absolute(pixels), to_even(pixels), to_odd(pixels) {}

  [[nodiscard]] SmoothedBias Smooth(int width, int height, int reach) const {
    SmoothedBias smooth;
    smooth.absolute = absolute.Squares(width, height, reach);
    smooth.relative = to_even.Squares(width, height, reach);
    const std::vector<float> relative_to_odd = to_odd.Squares(width, height, reach);
    std::vector<float> differences(relative_to_odd.size());
    double square_sum = 0;
    for (std::size_t i = 0; i < differences.size(); ++i) {
      differences[i] = to_even.even[i] - to_even.odd[i];
      smooth.relative[i] = 0.5F * (smooth.relative[i] + relative_to_odd[i]);
      const auto square = static_cast<double>(smooth.relative[i]);
      smooth.relative_sum += square;
      smooth.absolute_sum += static_cast<double>(smooth.absolute[i]);
      square_sum += square * square;
    }
    // The mean of the two ways to smooth one product varies as one of them does, but its square is
    // less by the second factor.
    const std::vector<float> smoothed = Smoothed(width, height, reach, differences);
    smooth.area = CorrelatedArea(width, height, differences, smoothed) * 2 /
                  (1 + SquaredCorrelation(differences, smoothed));
    smooth.deviation = std::sqrt(smooth.area * square_sum);
    return smooth;
  }
};

// Squared bias as the widest smoothing has it that says hardly less than the narrower ones.
struct ChosenBias {
  SmoothedBias bias;
  // How much more narrower ones said, in sums.
  double relative_lost = 0, absolute_lost = 0;
};

ChosenBias Choose(int width, int height, const PixelBiases& biases, double noise_area) {
  ChosenBias chosen{.bias = biases.Smooth(width, height, 1)};
  double most_relative = chosen.bias.relative_sum;
  double most_absolute = chosen.bias.absolute_sum;
  double least = most_relative - kUnsure * chosen.bias.deviation;
  for (int reach = 2; reach * reach <= 1 + kWidest * noise_area; reach *= 2) {
    SmoothedBias wider = biases.Smooth(width, height, reach);
    if (wider.relative_sum < least) break;
    most_relative = std::max(most_relative, wider.relative_sum);
    most_absolute = std::max(most_absolute, wider.absolute_sum);
    least = std::max(least, wider.relative_sum - kUnsure * wider.deviation);
    chosen.bias = std::move(wider);
  }
  chosen.relative_lost = most_relative - chosen.bias.relative_sum;
  chosen.absolute_lost = most_absolute - chosen.bias.absolute_sum;
  return chosen;
}

// Whether `pixels` are summed as relative errors or as absolute ones.
enum class Scale : std::uint8_t { kRelative, kAbsolute };

SquaredError Summarize(const std::vector<PixelError>& pixels, Scale scale, double lost,
                       const Spread& spread) {
  const bool is_relative = scale == Scale::kRelative;
  const auto noise_of = is_relative ? &PixelError::relative_noise : &PixelError::noise;
  const auto bias_of = is_relative ? &PixelError::relative_bias : &PixelError::bias;
  double more = 0;
  double less = 0;
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
    if (!is_relative) continue;
    more += static_cast<double>(pixel.more_bias);
    less += static_cast<double>(pixel.less_bias);
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
  const double chance = spread.z * std::sqrt(variance) / count / total;
  // Chance and what bias may be off by know nothing of each other.
  const double least_bias = kLeastBias * std::max(0.0, error.bias - std::max(less, 0.0) / count);
  const double most_bias = kMostBias * error.bias + std::max(more, 0.0) / count;
  const double below = std::log(total / std::max(error.noise + least_bias, kLeastShare * total));
  const double above = std::log((error.noise + most_bias) / total);
  error.low = total * std::exp(-std::hypot(chance, below) - kModelError);
  error.high = (total + lost / count) * std::exp(std::hypot(chance, above) + kModelError);
  return error;
}

}  // namespace

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
  const double z = TwoSidedNormalQuantile((1 - kConfidence) * SpentAt(look));

  const std::size_t count = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  std::array<std::vector<float>, 3> means;
  for (std::vector<float>& channel : means)
    channel.resize(count);
  std::vector<double> luminances(count);
  std::vector<HalfBiases> half_biases(count);
  for (std::size_t i = 0; i < count; ++i) {
    const PixelSums sums = sums_at(i);
    for (std::size_t c = 0; c < 3; ++c)
      means[c][i] = static_cast<float>(sums.all[c] / passes);
    luminances[i] = LuminanceOf(sums.all) / passes;
    half_biases[i] = {static_cast<float>(sums.even_bias / even_passes),
                      static_cast<float>(sums.odd_bias / odd_passes)};
  }
  const std::array<MeanAround, 3> around = {MeanAround(width, height, std::move(means[0])),
                                            MeanAround(width, height, std::move(means[1])),
                                            MeanAround(width, height, std::move(means[2]))};
  const std::vector<float> least_luminance =
      LeastLuminance(width, height, std::vector<float>(luminances.begin(), luminances.end()));
  const double floor = RelativeErrorFloor(luminances);
  if (floor == 0) {
    const SquaredError unknown = {.noise = HUGE_VAL, .bias = 0, .low = 0, .high = HUGE_VAL};
    return {.relative = unknown, .absolute = {}, .untrimmed = HUGE_VAL};
  }

  const double believed = BelievedShare(half_biases, luminances, floor);
  std::vector<PixelError> pixels(count);
  std::vector<float> differences(count);
  PixelBiases biases(count);
  double halves = 0;
  double independent = 0;
  std::size_t pixel = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x, ++pixel) {
      const PixelSums sums = sums_at(pixel);
      RgbSum difference{};
      double noise_sum = 0, relative_noise = 0, signed_noise = 0;
      double color_square = 0;
      RgbSum odd_sum{};
      for (std::size_t c = 0; c < 3; ++c) {
        const double even = sums.even[c] / even_passes;
        odd_sum[c] = sums.all[c] - sums.even[c];
        const double odd = odd_sum[c] / odd_passes;
        difference[c] = even - odd;
        const double own = sums.all[c] / passes;
        const double agreed = Middle(even, odd, around[c](x, y));
        const double least = std::min(own, agreed);
        // One over value² + floor. The agreed value is too large where rare light fell on the
        // dark, the least one too small where lights are seen in few samples.
        const double weight = 0.5 / (agreed * agreed + floor) + 0.5 / (least * least + floor);
        const double noise = difference[c] * difference[c] * to_noise;
        noise_sum += noise;
        relative_noise += noise * weight;
        signed_noise += difference[c] * std::sqrt(weight);
        color_square += sums.bias_color[c] * sums.bias_color[c];
      }
      pixels[pixel].noise = static_cast<float>(noise_sum / 3);
      pixels[pixel].relative_noise = static_cast<float>(relative_noise / 3);
      differences[pixel] = static_cast<float>(signed_noise);
      const double even_bias = sums.even_bias / even_passes;
      const double odd_bias = sums.odd_bias / odd_passes;
      // One over value² + floor as a half has it without `share` of the bias, times the squared
      // colour of the bias.
      const double mean = luminances[pixel];
      const auto color_over_value = [&](double half, double bias, double share) {
        const double unblurred =
            std::max({static_cast<double>(least_luminance[pixel]), half - share * bias, 0.0});
        const double of_mean = mean > 0 ? unblurred / mean : 0;
        double sum = 0;
        for (std::size_t c = 0; c < 3; ++c) {
          const double value = of_mean * sums.all[c] / passes;
          sum += sums.bias_color[c] * sums.bias_color[c] / (value * value + floor);
        }
        return sum / 3;
      };
      const double even = LuminanceOf(sums.even) / even_passes;
      const double odd = LuminanceOf(odd_sum) / odd_passes;
      const double square_to_even = color_over_value(even, even_bias, believed);
      const double square_to_odd = color_over_value(odd, odd_bias, believed);
      const double of_even = std::sqrt(square_to_even);
      const double of_odd = std::sqrt(square_to_odd);
      const auto product = [&](double to_even, double to_odd) {
        return 0.5 * even_bias * odd_bias * (to_even + to_odd);
      };
      const double relative_product = product(square_to_even, square_to_odd);
      pixels[pixel].more_bias = static_cast<float>(
          product(color_over_value(even, even_bias, 1), color_over_value(odd, odd_bias, 1)) -
          relative_product);
      pixels[pixel].less_bias =
          static_cast<float>(relative_product - product(color_over_value(even, even_bias, 0),
                                                        color_over_value(odd, odd_bias, 0)));
      const double of_color = std::sqrt(color_square / 3);
      biases.absolute.even[pixel] = static_cast<float>(even_bias * of_color);
      biases.absolute.odd[pixel] = static_cast<float>(odd_bias * of_color);
      biases.to_even.even[pixel] = static_cast<float>(even_bias * of_even);
      biases.to_even.odd[pixel] = static_cast<float>(odd_bias * of_even);
      biases.to_odd.even[pixel] = static_cast<float>(even_bias * of_odd);
      biases.to_odd.odd[pixel] = static_cast<float>(odd_bias * of_odd);
      const double luminance = LuminanceOf(difference);
      halves += luminance * luminance * to_noise;
      independent += std::max(0.0, sums.square / passes - mean * mean) / (passes - 1);
    }
  }
  Spread spread{.noise_area = CorrelatedArea(width, height, differences, differences), .z = z};
  const ChosenBias chosen = Choose(width, height, biases, spread.noise_area);
  spread.bias_area = chosen.bias.area;
  for (std::size_t i = 0; i < count; ++i) {
    pixels[i].bias = chosen.bias.absolute[i];
    pixels[i].relative_bias = chosen.bias.relative[i];
  }
  double untrimmed = 0;
  for (const PixelError& one : pixels)
    untrimmed += static_cast<double>(one.relative_noise) + static_cast<double>(one.relative_bias);
  const std::size_t kept = KeptPixels(count);
  std::ranges::nth_element(pixels, pixels.begin() + static_cast<std::ptrdiff_t>(kept) - 1, {},
                           &PixelError::Size);
  pixels.resize(kept);
  const SquaredError relative = Summarize(pixels, Scale::kRelative, chosen.relative_lost, spread);
  return {.relative = relative,
          .absolute = Summarize(pixels, Scale::kAbsolute, chosen.absolute_lost, spread),
          // Products of the halves' biases may be below 0 in the pixels left out; errors are not.
          .untrimmed = std::max(untrimmed / static_cast<double>(count), relative.total()),
          .left_out_pixels = static_cast<std::int64_t>(count - kept),
          .noise_factor = independent > 0 ? halves / independent : 1,
          .noise_area = spread.noise_area};
}

}  // namespace lucerna
