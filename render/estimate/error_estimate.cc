#include "render/estimate/error_estimate.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <utility>

#include "render/base/memory.h"
#include "render/base/status.h"
#include "render/estimate/relative_error.h"

namespace lucerna {
namespace {

// What squared bias is at least and at most, of what is estimated. It is too large where values
// without blur are guessed from few photons, too small where lines thinner than the inner kernel
// are. Chosen, with kModelError (in the header), on half A of tests/tools/make_study_scenes.py and
// on scenes of the project.
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

// Rows, or columns, that one thread takes at once.
constexpr std::size_t kLinesAtOnce = 16;

// Calls body(row) for all rows.
template <typename Body>
void ForRows(ThreadTeam& team, int height, const Body& body) {
  team.For(static_cast<std::size_t>(height), kLinesAtOnce, [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row)
      body(row);
  });
}

// The sum of what body_of(first, last)(row) gives for all rows, in their order: the same bits
// whatever the number of threads, and of rows of one block.
template <std::size_t kSums, typename BodyOf>
std::array<double, kSums> SumOfBlocks(ThreadTeam& team, int height, const BodyOf& body_of) {
  std::vector<std::array<double, kSums>> rows(static_cast<std::size_t>(height));
  team.For(rows.size(), kLinesAtOnce, [&](std::size_t begin, std::size_t end) {
    const auto body = body_of(begin, end);
    for (std::size_t row = begin; row < end; ++row)
      rows[row] = body(row);
  });
  std::array<double, kSums> sums{};
  for (const std::array<double, kSums>& row : rows) {
    for (std::size_t i = 0; i < kSums; ++i)
      sums[i] += row[i];
  }
  return sums;
}

// The same of body(row).
template <std::size_t kSums, typename Body>
std::array<double, kSums> SumOfRows(ThreadTeam& team, int height, const Body& body) {
  return SumOfBlocks<kSums>(team, height,
                            [&](std::size_t, std::size_t) { return std::cref(body); });
}

double Middle(double a, double b, double c) {
  return std::max(std::min(a, b), std::min(std::max(a, b), c));
}

// The means of the channels over the pixels within kReach, without the pixel itself; its own value
// where it is alone. For the rows of one block; keeps a reference to the image.
class MeanAround {
 public:
  MeanAround(const ImageStatistics& image, int first_row, int last_row)
      : image_(image),
        width_(image.width),
        height_(image.height),
        first_(std::max(0, first_row - kReach)) {
    const int last = std::min(height_, last_row + kReach);
    for (std::size_t channel = 0; channel < 3; ++channel) {
      std::vector<float>& sums = sums_[channel];
      sums.reserve(static_cast<std::size_t>(last - first_) * static_cast<std::size_t>(width_));
      for (int y = first_; y < last; ++y) {
        for (int x = 0; x < width_; ++x) {
          float sum = 0;
          for (int i = std::max(0, x - kReach); i <= std::min(width_ - 1, x + kReach); ++i)
            sum += ValueAt(channel, i, y);
          sums.push_back(sum);
        }
      }
    }
  }

  // Requires a pixel of the block.
  [[nodiscard]] double operator()(std::size_t channel, int x, int y) const {
    const int top = std::max(0, y - kReach);
    const int bottom = std::min(height_ - 1, y + kReach);
    const int across = std::min(width_ - 1, x + kReach) - std::max(0, x - kReach) + 1;
    const int count = across * (bottom - top + 1) - 1;
    const auto own = static_cast<double>(ValueAt(channel, x, y));
    if (count == 0) return own;
    double sum = -own;
    for (int j = top; j <= bottom; ++j)
      sum += static_cast<double>(sums_[channel][At(x, j - first_)]);
    return std::max(sum, 0.0) / count;
  }

 private:
  static constexpr int kReach = 3;

  [[nodiscard]] std::size_t At(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
           static_cast<std::size_t>(x);
  }

  [[nodiscard]] float ValueAt(std::size_t channel, int x, int y) const {
    return static_cast<float>(static_cast<double>(image_.all[channel][At(x, y)]) /
                              image_.weights.all());
  }

  const ImageStatistics& image_;
  int width_, height_;
  int first_;                               // row
  std::array<std::vector<float>, 3> sums_;  // over x, of the rows from there on
};

double LuminanceOfMean(const ImageStatistics& image, std::size_t pixel) {
  return LuminanceOf({static_cast<double>(image.all[0][pixel]),
                      static_cast<double>(image.all[1][pixel]),
                      static_cast<double>(image.all[2][pixel])}) /
         image.weights.all();
}

// The share of the estimated bias that is taken off single pixels to guess their values without
// blur: near 1 unless the estimate is mostly noise.
double BelievedShare(const ImageStatistics& image, double floor, ThreadTeam& team) {
  const auto w = static_cast<std::size_t>(image.width);
  const auto sums = SumOfRows<2>(team, image.height, [&](std::size_t row) {
    std::array<double, 2> of_row{};
    for (std::size_t i = row * w; i < (row + 1) * w; ++i) {
      const auto mean = [](float sum, double weight) {
        return static_cast<double>(static_cast<float>(static_cast<double>(sum) / weight));
      };
      const double even = mean(image.even_bias[i], image.weights.even);
      const double odd = mean(image.odd_bias[i], image.weights.odd);
      const double luminance = LuminanceOfMean(image, i);
      const double weight = 1 / (luminance * luminance + floor);
      of_row[0] += even * odd * weight;
      of_row[1] += 0.25 * (even - odd) * (even - odd) * weight;
    }
    return of_row;
  });
  const double bias = std::max(sums[0], 0.0);
  const double noise = sums[1];
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

// Sums over a window that moves along a line: from `back` places before to `ahead` behind, ends
// repeated. Lines lie side by side, `lines` of them, and all move at once; the next place of a line
// is `in_step` further on, or `out_step`.
void MoveBox(const float* in, std::size_t in_step, float* out, std::size_t out_step,
             std::size_t lines, int length, int back, int ahead) {
  const auto at = [&](int place) {
    return in + static_cast<std::size_t>(std::clamp(place, 0, length - 1)) * in_step;
  };
  std::vector<double> sums(lines, 0);
  for (int place = -back; place <= ahead; ++place) {
    for (std::size_t line = 0; line < lines; ++line)
      sums[line] += static_cast<double>(at(place)[line]);
  }
  for (int place = 0; place < length; ++place) {
    float* const here = out + static_cast<std::size_t>(place) * out_step;
    const float* const comes = at(place + ahead + 1);
    const float* const goes = at(place - back);
    for (std::size_t line = 0; line < lines; ++line) {
      here[line] = static_cast<float>(sums[line] / (back + ahead + 1));
      sums[line] += static_cast<double>(comes[line]) - static_cast<double>(goes[line]);
    }
  }
}

// Calls body(first, lines) for runs of neighbouring columns.
template <typename Body>
void ForColumns(ThreadTeam& team, int width, const Body& body) {
  constexpr std::size_t kColumnsAtOnce = 64;
  team.For(static_cast<std::size_t>(width), kColumnsAtOnce,
           [&](std::size_t begin, std::size_t end) { body(begin, end - begin); });
}

// `values` with triangular weights of `reach` pixels to either side, along rows and along columns;
// edges repeat.
std::vector<float> Smoothed(int width, int height, int reach, const std::vector<float>& values,
                            ThreadTeam& team) {
  if (reach <= 1) return values;
  const auto w = static_cast<std::size_t>(width);
  std::vector<float> smooth(values.size());
  // A triangle is a box over a box: one looks back, the other ahead.
  team.For(static_cast<std::size_t>(height), kLinesAtOnce, [&](std::size_t begin, std::size_t end) {
    // As columns, so that the rows move at once.
    const std::size_t rows = end - begin;
    std::vector<float> block(rows * w);
    std::vector<float> back(block.size());
    for (std::size_t row = 0; row < rows; ++row) {
      for (std::size_t x = 0; x < w; ++x)
        block[x * rows + row] = values[(begin + row) * w + x];
    }
    MoveBox(block.data(), rows, back.data(), rows, rows, width, reach - 1, 0);
    MoveBox(back.data(), rows, block.data(), rows, rows, width, 0, reach - 1);
    for (std::size_t row = 0; row < rows; ++row) {
      for (std::size_t x = 0; x < w; ++x)
        smooth[(begin + row) * w + x] = block[x * rows + row];
    }
  });
  ForColumns(team, width, [&](std::size_t first, std::size_t lines) {
    const auto rows = static_cast<std::size_t>(height);
    std::vector<float> block(lines * rows);
    MoveBox(smooth.data() + first, w, block.data(), lines, lines, height, reach - 1, 0);
    MoveBox(block.data(), lines, smooth.data() + first, w, lines, height, 0, reach - 1);
  });
  return smooth;
}

// The least of `values` within `reach` pixels along rows and columns.
std::vector<float> LeastAround(int width, int height, int reach, const std::vector<float>& values,
                               ThreadTeam& team) {
  const auto w = static_cast<std::size_t>(width);
  std::vector<float> of_rows(values.size());
  std::vector<float> least(values.size());
  ForRows(team, height, [&](std::size_t row) {
    const float* const line = values.data() + row * w;
    for (int x = 0; x < width; ++x) {
      of_rows[row * w + static_cast<std::size_t>(x)] =
          *std::min_element(line + std::max(0, x - reach), line + std::min(width, x + reach + 1));
    }
  });
  ForRows(team, height, [&](std::size_t row) {
    const int y = static_cast<int>(row);
    float* const out = least.data() + row * w;
    std::copy_n(of_rows.data() + row * w, w, out);
    for (int near = std::max(0, y - reach); near <= std::min(height - 1, y + reach); ++near) {
      const float* const line = of_rows.data() + static_cast<std::size_t>(near) * w;
      for (std::size_t x = 0; x < w; ++x)
        out[x] = std::min(out[x], line[x]);
    }
  });
  return least;
}

// What a kernel at most blurs over, in pixels: the default first radius.
constexpr int kKernelReach = 3;

// The least luminance that a pixel can plausibly have without the blur.
std::vector<float> LeastLuminance(int width, int height, std::vector<float> luminance,
                                  ThreadTeam& team) {
  luminance = Smoothed(width, height, 2, luminance, team);
  return LeastAround(width, height, kKernelReach, luminance, team);
}

// What the kernel changed in each pixel, as the two halves have it.
struct BiasHalves {
  std::vector<float> even, odd;

  // Squared bias, without the halves' noise: the product of one half with the other, smoothed.
  [[nodiscard]] std::vector<float> Squares(int width, int height, int reach,
                                           ThreadTeam& team) const {
    const std::vector<float> smooth_even = Smoothed(width, height, reach, even, team);
    std::vector<float> squares = Smoothed(width, height, reach, odd, team);
    const auto w = static_cast<std::size_t>(width);
    ForRows(team, height, [&](std::size_t row) {
      for (std::size_t i = row * w; i < (row + 1) * w; ++i)
        squares[i] = 0.5F * (even[i] * squares[i] + smooth_even[i] * odd[i]);
    });
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
double SquaredCorrelation(int width, int height, const std::vector<float>& one,
                          const std::vector<float>& other, ThreadTeam& team) {
  const auto w = static_cast<std::size_t>(width);
  const auto [both, ones, others] = SumOfRows<3>(team, height, [&](std::size_t row) {
    std::array<double, 3> of_row{};
    for (std::size_t i = row * w; i < (row + 1) * w; ++i) {
      const auto a = static_cast<double>(one[i]);
      const auto b = static_cast<double>(other[i]);
      of_row[0] += a * b;
      of_row[1] += a * a;
      of_row[2] += b * b;
    }
    return of_row;
  });
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

  [[nodiscard]] SmoothedBias Smooth(int width, int height, int reach, ThreadTeam& team) const {
    const auto w = static_cast<std::size_t>(width);
    SmoothedBias smooth;
    smooth.absolute = absolute.Squares(width, height, reach, team);
    smooth.relative = to_even.Squares(width, height, reach, team);
    // First relative to the odd passes, then the difference of the halves.
    std::vector<float> differences = to_odd.Squares(width, height, reach, team);
    const auto sums = SumOfRows<3>(team, height, [&](std::size_t row) {
      std::array<double, 3> of_row{};
      for (std::size_t i = row * w; i < (row + 1) * w; ++i) {
        smooth.relative[i] = 0.5F * (smooth.relative[i] + differences[i]);
        differences[i] = to_even.even[i] - to_even.odd[i];
        const auto square = static_cast<double>(smooth.relative[i]);
        of_row[0] += square;
        of_row[1] += static_cast<double>(smooth.absolute[i]);
        of_row[2] += square * square;
      }
      return of_row;
    });
    smooth.relative_sum = sums[0];
    smooth.absolute_sum = sums[1];
    // The mean of the two ways to smooth one product varies as one of them does, but its square is
    // less by the second factor.
    const std::vector<float> smoothed = Smoothed(width, height, reach, differences, team);
    smooth.area = CorrelatedArea(width, height, differences, smoothed) * 2 /
                  (1 + SquaredCorrelation(width, height, differences, smoothed, team));
    smooth.deviation = std::sqrt(smooth.area * sums[2]);
    return smooth;
  }
};

// Squared bias as the widest smoothing has it that says hardly less than the narrower ones.
struct ChosenBias {
  SmoothedBias bias;
  // How much more narrower ones said, in sums.
  double relative_lost = 0, absolute_lost = 0;
};

// Uses the biases up.
ChosenBias Choose(int width, int height, PixelBiases biases, double noise_area, ThreadTeam& team) {
  ChosenBias chosen{.bias = biases.Smooth(width, height, 1, team)};
  double most_relative = chosen.bias.relative_sum;
  double most_absolute = chosen.bias.absolute_sum;
  double least = most_relative - kUnsure * chosen.bias.deviation;
  for (int reach = 2; reach * reach <= 1 + kWidest * noise_area; reach *= 2) {
    SmoothedBias wider = biases.Smooth(width, height, reach, team);
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

ImageStatistics::ImageStatistics(int image_width, int image_height, std::int64_t image_passes)
    : width(image_width),
      height(image_height),
      passes(image_passes),
      weights(WeightsOf({0, static_cast<std::uint64_t>(image_passes)})) {
  const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  for (std::size_t c = 0; c < 3; ++c) {
    all[c].resize(pixels);
    half_difference[c].resize(pixels);
    bias_color[c].resize(pixels);
  }
  squared_deviations.resize(pixels);
  even_bias.resize(pixels);
  odd_bias.resize(pixels);
}

PixelStatistics ImageStatistics::At(std::size_t pixel) const {
  return {.all = {all[0][pixel], all[1][pixel], all[2][pixel]},
          .half_difference = {half_difference[0][pixel], half_difference[1][pixel],
                              half_difference[2][pixel]},
          .squared_deviations = squared_deviations[pixel],
          .even_bias = even_bias[pixel],
          .odd_bias = odd_bias[pixel],
          .bias_color = {bias_color[0][pixel], bias_color[1][pixel], bias_color[2][pixel]}};
}

void ImageStatistics::Set(std::size_t pixel, const PixelStatistics& statistics) {
  for (std::size_t c = 0; c < 3; ++c) {
    all[c][pixel] = statistics.all[c];
    half_difference[c][pixel] = statistics.half_difference[c];
    bias_color[c][pixel] = statistics.bias_color[c];
  }
  squared_deviations[pixel] = statistics.squared_deviations;
  even_bias[pixel] = statistics.even_bias;
  odd_bias[pixel] = statistics.odd_bias;
}

ErrorEstimate EstimateError(ImageStatistics image, int look, ThreadTeam& team) {
  LUCERNA_CHECK(image.passes >= 2 && look >= 1);
  const int width = image.width;
  const int height = image.height;
  const auto passes = static_cast<double>(image.passes);
  const PassWeights& weights = image.weights;
  const double weight_of_all = weights.all();
  // From the squared difference of the halves' means to the squared noise of the whole mean.
  const double to_noise = weights.even * weights.odd / (weight_of_all * weight_of_all);
  const double z = TwoSidedNormalQuantile((1 - kConfidence) * SpentAt(look));

  const auto w = static_cast<std::size_t>(width);
  const std::size_t count = w * static_cast<std::size_t>(height);
  LUCERNA_CHECK(image.pixels() == count);
  const auto color_of = [](const std::array<float, 3>& sums) {
    return RgbSum{static_cast<double>(sums[0]), static_cast<double>(sums[1]),
                  static_cast<double>(sums[2])};
  };
  double floor = 0;
  {
    std::vector<double> luminances(count);
    ForRows(team, height, [&](std::size_t row) {
      for (std::size_t i = row * w; i < (row + 1) * w; ++i)
        luminances[i] = LuminanceOfMean(image, i);
    });
    floor = RelativeErrorFloor(luminances);
  }
  if (floor == 0) {
    const SquaredError unknown = {.noise = HUGE_VAL, .bias = 0, .low = 0, .high = HUGE_VAL};
    return {.relative = unknown, .absolute = {}, .untrimmed = HUGE_VAL};
  }
  std::vector<float> least_luminance(count);
  ForRows(team, height, [&](std::size_t row) {
    for (std::size_t i = row * w; i < (row + 1) * w; ++i)
      least_luminance[i] = static_cast<float>(LuminanceOfMean(image, i));
  });
  least_luminance = LeastLuminance(width, height, std::move(least_luminance), team);
  const double believed = BelievedShare(image, floor, team);
  // What a pixel's statistics give takes their place, but for `all`, which its neighbours need.
  std::vector<float>& relative_noises = image.half_difference[0];
  std::vector<float>& noises = image.half_difference[1];
  std::vector<float>& more_biases = image.half_difference[2];
  std::vector<float>& less_biases = image.bias_color[0];
  std::vector<float>& differences = image.squared_deviations;
  BiasHalves absolute = {.even = std::vector<float>(count), .odd = std::vector<float>(count)};
  std::vector<float>& even_to_even = image.bias_color[1];
  std::vector<float>& odd_to_even = image.bias_color[2];
  std::vector<float>& even_to_odd = image.even_bias;
  std::vector<float>& odd_to_odd = image.odd_bias;
  const auto do_row = [&](const MeanAround& around, std::size_t row) {
    double halves = 0;
    double independent = 0;
    for (std::size_t column = 0; column < w; ++column) {
      const std::size_t pixel = row * w + column;
      const int x = static_cast<int>(column);
      const int y = static_cast<int>(row);
      const PixelStatistics sums = image.At(pixel);
      const RgbSum all = color_of(sums.all);
      const RgbSum half_difference = color_of(sums.half_difference);
      const RgbSum bias_color = color_of(sums.bias_color);
      RgbSum even_sum{};
      RgbSum odd_sum{};
      RgbSum difference{};
      double noise_sum = 0, relative_noise = 0, signed_noise = 0;
      double color_square = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        even_sum[c] = 0.5 * (all[c] + half_difference[c]);
        odd_sum[c] = 0.5 * (all[c] - half_difference[c]);
        const double even = even_sum[c] / weights.even;
        const double odd = odd_sum[c] / weights.odd;
        difference[c] = even - odd;
        const double own = all[c] / weight_of_all;
        const double agreed = Middle(even, odd, around(c, x, y));
        const double least = std::min(own, agreed);
        // One over value² + floor. The agreed value is too large where rare light fell on the
        // dark, the least one too small where lights are seen in few samples.
        const double weight = 0.5 / (agreed * agreed + floor) + 0.5 / (least * least + floor);
        const double noise = difference[c] * difference[c] * to_noise;
        noise_sum += noise;
        relative_noise += noise * weight;
        signed_noise += difference[c] * std::sqrt(weight);
        color_square += bias_color[c] * bias_color[c];
      }
      noises[pixel] = static_cast<float>(noise_sum / 3);
      relative_noises[pixel] = static_cast<float>(relative_noise / 3);
      differences[pixel] = static_cast<float>(signed_noise);
      const double even_bias = static_cast<double>(sums.even_bias) / weights.even;
      const double odd_bias = static_cast<double>(sums.odd_bias) / weights.odd;
      // One over value² + floor as a half has it without `share` of the bias, times the squared
      // colour of the bias.
      const double mean = LuminanceOf(all) / weight_of_all;
      const auto color_over_value = [&](double half, double bias, double share) {
        const double unblurred =
            std::max({static_cast<double>(least_luminance[pixel]), half - share * bias, 0.0});
        const double of_mean = mean > 0 ? unblurred / mean : 0;
        double sum = 0;
        for (std::size_t c = 0; c < 3; ++c) {
          const double value = of_mean * all[c] / weight_of_all;
          sum += bias_color[c] * bias_color[c] / (value * value + floor);
        }
        return sum / 3;
      };
      const double even = LuminanceOf(even_sum) / weights.even;
      const double odd = LuminanceOf(odd_sum) / weights.odd;
      const double square_to_even = color_over_value(even, even_bias, believed);
      const double square_to_odd = color_over_value(odd, odd_bias, believed);
      const double of_even = std::sqrt(square_to_even);
      const double of_odd = std::sqrt(square_to_odd);
      const auto product = [&](double to_even, double to_odd) {
        return 0.5 * even_bias * odd_bias * (to_even + to_odd);
      };
      const double relative_product = product(square_to_even, square_to_odd);
      more_biases[pixel] = static_cast<float>(
          product(color_over_value(even, even_bias, 1), color_over_value(odd, odd_bias, 1)) -
          relative_product);
      less_biases[pixel] =
          static_cast<float>(relative_product - product(color_over_value(even, even_bias, 0),
                                                        color_over_value(odd, odd_bias, 0)));
      const double of_color = std::sqrt(color_square / 3);
      absolute.even[pixel] = static_cast<float>(even_bias * of_color);
      absolute.odd[pixel] = static_cast<float>(odd_bias * of_color);
      even_to_even[pixel] = static_cast<float>(even_bias * of_even);
      odd_to_even[pixel] = static_cast<float>(odd_bias * of_even);
      even_to_odd[pixel] = static_cast<float>(even_bias * of_odd);
      odd_to_odd[pixel] = static_cast<float>(odd_bias * of_odd);
      const double luminance = LuminanceOf(difference);
      halves += luminance * luminance * to_noise;
      independent += static_cast<double>(sums.squared_deviations) / (weight_of_all * (passes - 1));
    }
    return std::array<double, 2>{halves, independent};
  };
  const auto [halves,
              independent] = SumOfBlocks<2>(team, height, [&](std::size_t begin, std::size_t end) {
    return [&do_row, around = MeanAround(image, static_cast<int>(begin), static_cast<int>(end))](
               std::size_t row) { return do_row(around, row); };
  });
  // Before what smoothing takes.
  FreeMemoryOf(least_luminance);
  for (std::vector<float>& channel : image.all)
    FreeMemoryOf(channel);
  Spread spread{.noise_area = CorrelatedArea(width, height, differences, differences), .z = z};
  FreeMemoryOf(differences);
  const ChosenBias chosen =
      Choose(width, height,
             {.absolute = std::move(absolute),
              .to_even = {.even = std::move(even_to_even), .odd = std::move(odd_to_even)},
              .to_odd = {.even = std::move(even_to_odd), .odd = std::move(odd_to_odd)}},
             spread.noise_area, team);
  spread.bias_area = chosen.bias.area;
  std::vector<PixelError> pixels(count);
  for (std::size_t i = 0; i < count; ++i) {
    pixels[i] = {.relative_noise = relative_noises[i],
                 .relative_bias = chosen.bias.relative[i],
                 .noise = noises[i],
                 .bias = chosen.bias.absolute[i],
                 .more_bias = more_biases[i],
                 .less_bias = less_biases[i]};
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
