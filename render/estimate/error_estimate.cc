#include "render/estimate/error_estimate.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "render/base/status.h"
#include "render/estimate/relative_error.h"

namespace lucerna {
namespace {

// What the models of noise may be off by, in the logarithm of the squared error: a tenth of the
// error. Most of it is light so rare that the halves have hardly seen it.
constexpr double kModelError = 0.2;
// What squared bias is at least and at most, of what is estimated. It is too small where a step is
// blurred and the dark side is not known to be so dark, too large where lines thinner than the
// kernel are. On the project's scenes it is 0.5 to 1.4 times the truth wherever it matters.
constexpr double kLeastBias = 0.5;
constexpr double kMostBias = 2.5;

// The widest smoothing that is tried reaches over so many times the area over which noise is alike.
constexpr double kWidest = 3;
// How much less than narrower ones a wider smoothing may say, in deviations of theirs.
constexpr double kUnsure = 0.5;

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

// Which folds' biases are multiplied: one even, one odd. The weight of their product, one over the
// squared value, comes from the other two, so that it shares no noise with it.
struct FoldPair {
  std::size_t even, odd;

  [[nodiscard]] std::size_t other_even() const { return 2 - even; }
  [[nodiscard]] std::size_t other_odd() const { return 4 - odd; }
};
constexpr std::array<FoldPair, 4> kFoldPairs = {{{0, 1}, {0, 3}, {2, 1}, {2, 3}}};

// The biases of pixels: absolute, and relative. All products of fold pairs together are the product
// of the two halves.
struct PixelBiases {
  BiasHalves absolute;
  std::array<BiasHalves, kFoldPairs.size()> relative;

  explicit PixelBiases(std::size_t pixels)
      : absolute(pixels),
        relative{BiasHalves(pixels), BiasHalves(pixels), BiasHalves(pixels), BiasHalves(pixels)} {}

  [[nodiscard]] SmoothedBias Smooth(int width, int height, int reach) const {
    SmoothedBias smooth;
    smooth.absolute = absolute.Squares(width, height, reach);
    smooth.relative.resize(smooth.absolute.size());
    std::vector<float> differences(smooth.absolute.size());
    for (const BiasHalves& pair : relative) {
      const std::vector<float> squares = pair.Squares(width, height, reach);
      for (std::size_t i = 0; i < squares.size(); ++i) {
        smooth.relative[i] += squares[i];
        differences[i] += pair.even[i] - pair.odd[i];
      }
    }
    double square_sum = 0;
    for (std::size_t i = 0; i < differences.size(); ++i) {
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

// The luminance without what the kernel is estimated to have added, from the folds that a fold pair
// leaves. What is taken away is the estimate times the share of its square that is no noise in the
// pixels around (Wiener's filter).
class UnblurredLuminance {
 public:
  UnblurredLuminance(int width, int height, std::int64_t passes, const PixelSumsAt& sums_at) {
    const std::size_t count = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    for (std::size_t p = 0; p < kFoldPairs.size(); ++p) {
      const std::size_t e = FoldOrSibling(kFoldPairs[p].other_even(), passes);
      const std::size_t o = FoldOrSibling(kFoldPairs[p].other_odd(), passes);
      const double even_passes = PassesOf(e, passes);
      const double odd_passes = PassesOf(o, passes);
      std::vector<float> products(count);
      std::vector<float> noise(count);
      std::vector<float> bias(count);
      values_[p].resize(count);
      for (std::size_t i = 0; i < count; ++i) {
        const PixelSums sums = sums_at(i);
        const double even = sums.bias[e] / even_passes;
        const double odd = sums.bias[o] / odd_passes;
        products[i] = static_cast<float>(even * odd);
        noise[i] = static_cast<float>(0.25 * (even - odd) * (even - odd));
        bias[i] = static_cast<float>(0.5 * (even + odd));
        values_[p][i] = static_cast<float>(
            0.5 * (sums.luminance[e] / even_passes + sums.luminance[o] / odd_passes));
      }
      products = Smoothed(width, height, kReach, products);
      noise = Smoothed(width, height, kReach, noise);
      for (std::size_t i = 0; i < count; ++i) {
        if (!(products[i] > 0)) continue;
        const float share = products[i] / (products[i] + noise[i]);
        values_[p][i] = std::max(0.0F, values_[p][i] - share * bias[i]);
      }
    }
  }

  [[nodiscard]] double operator()(std::size_t pair, std::size_t pixel) const {
    return static_cast<double>(values_[pair][pixel]);
  }

 private:
  static constexpr int kReach = 2;

  static double PassesOf(std::size_t fold, std::int64_t passes) {
    return static_cast<double>((passes + static_cast<std::int64_t>(kFolds - 1 - fold)) /
                               static_cast<std::int64_t>(kFolds));
  }
  // Before there are kFolds passes, the last folds have none.
  static std::size_t FoldOrSibling(std::size_t fold, std::int64_t passes) {
    return static_cast<std::int64_t>(fold) < passes ? fold : fold - 2;
  }

  std::array<std::vector<float>, kFoldPairs.size()> values_;
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

SquaredError Summarize(const std::vector<PixelError>& pixels, float PixelError::*noise_of,
                       float PixelError::*bias_of, double lost, const Spread& spread) {
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
  const double chance = spread.z * std::sqrt(variance) / count / total;
  // Chance and what bias may be off by know nothing of each other.
  const double below = std::log(total / (error.noise + kLeastBias * error.bias));
  const double above = std::log((error.noise + kMostBias * error.bias) / total);
  error.low = total * std::exp(-std::hypot(chance, below) - kModelError);
  error.high = (total + lost / count) * std::exp(std::hypot(chance, above) + kModelError);
  return error;
}

}  // namespace

ErrorStatistics::ErrorStatistics(std::size_t pixels)
    : even_sum_(pixels), square_sum_(pixels), luminance_sums_(pixels), bias_sums_(pixels) {}

void ErrorStatistics::AddPass(std::uint64_t pass, std::span<const RgbSum> radiance,
                              std::span<const double> bias) {
  LUCERNA_CHECK(radiance.size() == even_sum_.size() && bias.size() == even_sum_.size());
  const bool is_even = pass % 2 == 0;
  const std::size_t fold = pass % kFolds;
  for (std::size_t pixel = 0; pixel < radiance.size(); ++pixel) {
    const double luminance = LuminanceOf(radiance[pixel]);
    square_sum_[pixel] += luminance * luminance;
    luminance_sums_[pixel][fold] += luminance;
    bias_sums_[pixel][fold] += bias[pixel];
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
  const double z = TwoSidedNormalQuantile((1 - kConfidence) * SpentAt(look));

  const std::size_t count = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  const auto mean_around = [&](std::size_t channel) {
    std::vector<float> means(count);
    for (std::size_t i = 0; i < count; ++i)
      means[i] = static_cast<float>(sums_at(i).all[channel] / passes);
    return MeanAround(width, height, std::move(means));
  };
  const std::array<MeanAround, 3> around = {mean_around(0), mean_around(1), mean_around(2)};
  std::vector<double> luminances(count);
  for (std::size_t i = 0; i < count; ++i)
    luminances[i] = LuminanceOf(sums_at(i).all) / passes;
  const double floor = RelativeErrorFloor(luminances);
  if (floor == 0) {
    const SquaredError unknown = {.noise = HUGE_VAL, .bias = 0, .low = 0, .high = HUGE_VAL};
    return {.relative = unknown, .absolute = {}, .noise_factor = 1};
  }

  std::vector<PixelError> pixels(count);
  std::vector<float> differences(count);
  PixelBiases biases(count);
  const UnblurredLuminance unblurred(width, height, pass_count, sums_at);
  double halves = 0;
  double independent = 0;
  std::size_t pixel = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x, ++pixel) {
      const PixelSums sums = sums_at(pixel);
      RgbSum difference{};
      double noise_sum = 0, relative_noise = 0, signed_noise = 0;
      double color_square = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        const double even = sums.even[c] / even_passes;
        const double odd = (sums.all[c] - sums.even[c]) / odd_passes;
        difference[c] = even - odd;
        const double own = sums.all[c] / passes;
        const double agreed = Middle(even, odd, around[c](x, y));
        const double least = std::min(own, agreed);
        // One over value² + floor. The agreed value is too large where rare light fell on the
        // dark, the least one too small where lamps are seen in few samples.
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
      const double of_color = std::sqrt(color_square / 3);
      biases.absolute.even[pixel] =
          static_cast<float>((sums.bias[0] + sums.bias[2]) / even_passes * of_color);
      biases.absolute.odd[pixel] =
          static_cast<float>((sums.bias[1] + sums.bias[3]) / odd_passes * of_color);
      const double mean = LuminanceOf(sums.all) / passes;
      for (std::size_t p = 0; p < kFoldPairs.size(); ++p) {
        const FoldPair pair = kFoldPairs[p];
        const double share = mean > 0 ? unblurred(p, pixel) / mean : 0;
        double color_over_value = 0;
        for (std::size_t c = 0; c < 3; ++c) {
          const double value = share * sums.all[c] / passes;
          color_over_value += sums.bias_color[c] * sums.bias_color[c] / (value * value + floor);
        }
        const double of_pair = std::sqrt(color_over_value / 3);
        biases.relative[p].even[pixel] =
            static_cast<float>(sums.bias[pair.even] / even_passes * of_pair);
        biases.relative[p].odd[pixel] =
            static_cast<float>(sums.bias[pair.odd] / odd_passes * of_pair);
      }
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
  const std::size_t kept =
      count - static_cast<std::size_t>(kTrimmedShare * static_cast<double>(count));
  std::ranges::nth_element(pixels, pixels.begin() + static_cast<std::ptrdiff_t>(kept) - 1, {},
                           &PixelError::Size);
  pixels.resize(kept);
  return {.relative = Summarize(pixels, &PixelError::relative_noise, &PixelError::relative_bias,
                                chosen.relative_lost, spread),
          .absolute = Summarize(pixels, &PixelError::noise, &PixelError::bias, chosen.absolute_lost,
                                spread),
          .noise_factor = independent > 0 ? halves / independent : 1};
}

}  // namespace lucerna
