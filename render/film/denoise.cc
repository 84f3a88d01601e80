#include "render/film/denoise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <iterator>
#include <numeric>
#include <utility>

#include "render/estimate/relative_error.h"

namespace lucerna {
namespace {

// Fainter surfaces are not divided by their albedo.
constexpr float kFaintAlbedo = 0.02F;
// Strengths of filters, in decreasing order: of those by light alone, for what is seen through
// rough glass, whose features are noise, and of those by features too. The result of one stands for
// the value in relative errors.
constexpr std::array<float, 2> kLightStrengths = {2, 1};
constexpr std::array<float, 4> kFeatureStrengths = {2, 1.4F, 1, 0.7F};
constexpr std::size_t kSteadyStrength = 2;
// Means are those over a box, taken so many times: about a normal distribution with a standard
// deviation of kMeanReach pixels.
constexpr int kMeanReach = 16;
constexpr int kMeanTimes = 3;
// Cells whose sums are taken for independent.
constexpr int kErrorCells = 16;
constexpr std::size_t kPixelsAtATime = 4096;

double LuminanceAt(const ColorColumns& color, std::size_t pixel) {
  return LuminanceOf({static_cast<double>(color[0][pixel]), static_cast<double>(color[1][pixel]),
                      static_cast<double>(color[2][pixel])});
}

// Means of rows or columns of `values` over the pixels within kMeanReach, in place.
void MeanAlong(std::vector<float>& values, std::size_t count, std::size_t stride, std::size_t lines,
               std::size_t line_stride, ThreadTeam& team) {
  constexpr std::size_t kLinesAtOnce = 16;
  team.For(lines, kLinesAtOnce, [&](std::size_t begin, std::size_t end) {
    std::vector<double> sums(count + 1);
    for (std::size_t line = begin; line < end; ++line) {
      float* const first = values.data() + line * line_stride;
      for (std::size_t i = 0; i < count; ++i)
        sums[i + 1] = sums[i] + static_cast<double>(first[i * stride]);
      constexpr std::size_t kReach = kMeanReach;
      for (std::size_t i = 0; i < count; ++i) {
        const std::size_t from = i > kReach ? i - kReach : 0;
        const std::size_t to = std::min(count, i + kReach + 1);
        first[i * stride] =
            static_cast<float>((sums[to] - sums[from]) / static_cast<double>(to - from));
      }
    }
  });
}

void MeanAround(std::vector<float>& values, std::size_t width, std::size_t height,
                ThreadTeam& team) {
  for (int i = 0; i < kMeanTimes; ++i) {
    MeanAlong(values, width, 1, height, width, team);
    MeanAlong(values, height, width, width, 1, team);
  }
}

class Denoiser {
 public:
  Denoiser(NoisyImage image, ThreadTeam& team) : image_(std::move(image)), team_(team) {}

  DenoisedImage Run() {
    const std::vector<double> luminances = Luminances();
    floor_ = RelativeErrorFloor(luminances);
    DenoisedImage result;
    result.feature_share = image_.feature_share;
    if (!(floor_ > 0)) {
      result.pixels = Mean(image_.halves);
      return result;
    }
    // Squares of faint light are no floats, and of very bright light neither.
    const int exponent = std::ilogb(std::sqrt(floor_));
    Scale(-exponent);
    std::vector<ImageHalves> filtered =
        FilterHalves(image_.width, image_.height, image_.halves, Variance(/*is_divided=*/false),
                     nullptr, kLightStrengths, team_);
    std::vector<ImageHalves> by_features =
        FilterHalves(image_.width, image_.height, DivideByAlbedo(), Variance(/*is_divided=*/true),
                     &image_.features, kFeatureStrengths, team_);
    for (ImageHalves& both : by_features)
      MultiplyByAlbedo(both);
    steady_ = Mean(by_features[kSteadyStrength]);
    std::ranges::move(by_features, std::back_inserter(filtered));
    ImageHalves best = std::exchange(filtered.front(), {});
    for (std::size_t k = 1; k < filtered.size(); ++k)
      AddShare(std::exchange(filtered[k], {}), best);
    AddShare(image_.halves, best);
    result.pixels = Mean(best);
    FindErrors(best, result);
    for (std::vector<float>& channel : result.pixels)
      ForPixels([&](std::size_t pixel) { channel[pixel] = std::ldexp(channel[pixel], exponent); });
    return result;
  }

 private:
  [[nodiscard]] std::size_t pixels() const { return image_.noise.size(); }
  void ForPixels(const std::function<void(std::size_t pixel)>& body) {
    team_.For(pixels(), kPixelsAtATime, [&](std::size_t begin, std::size_t end) {
      for (std::size_t pixel = begin; pixel < end; ++pixel)
        body(pixel);
    });
  }
  [[nodiscard]] float MeanAt(const ImageHalves& halves, std::size_t c, std::size_t pixel) const {
    const auto share = static_cast<float>(image_.even_share);
    return share * halves[0][c][pixel] + (1 - share) * halves[1][c][pixel];
  }
  ColorColumns Mean(const ImageHalves& halves) {
    ColorColumns mean;
    for (std::size_t c = 0; c < 3; ++c) {
      mean[c].resize(pixels());
      ForPixels([&](std::size_t pixel) { mean[c][pixel] = MeanAt(halves, c, pixel); });
    }
    return mean;
  }

  // Multiplies all light by 2^exponent.
  void Scale(int exponent) {
    floor_ = std::ldexp(floor_, 2 * exponent);
    ForPixels([&](std::size_t pixel) {
      for (ColorColumns& half : image_.halves) {
        for (std::vector<float>& channel : half)
          channel[pixel] = std::ldexp(channel[pixel], exponent);
      }
      image_.noise[pixel] = std::ldexp(image_.noise[pixel], exponent);
    });
  }

  [[nodiscard]] double LuminanceOfMean(std::size_t pixel) const {
    return LuminanceOf({static_cast<double>(MeanAt(image_.halves, 0, pixel)),
                        static_cast<double>(MeanAt(image_.halves, 1, pixel)),
                        static_cast<double>(MeanAt(image_.halves, 2, pixel))});
  }
  std::vector<double> Luminances() {
    std::vector<double> luminances(pixels());
    ForPixels([&](std::size_t pixel) { luminances[pixel] = LuminanceOfMean(pixel); });
    return luminances;
  }

  [[nodiscard]] float AlbedoAt(std::size_t c, std::size_t pixel) const {
    const float albedo = image_.features.albedo[c][pixel];
    return albedo > kFaintAlbedo ? albedo : 1;
  }
  ImageHalves DivideByAlbedo() {
    ImageHalves divided = image_.halves;
    for (ColorColumns& half : divided) {
      for (std::size_t c = 0; c < 3; ++c)
        ForPixels([&](std::size_t pixel) { half[c][pixel] /= AlbedoAt(c, pixel); });
    }
    return divided;
  }
  void MultiplyByAlbedo(ImageHalves& both) {
    for (ColorColumns& half : both) {
      for (std::size_t c = 0; c < 3; ++c)
        ForPixels([&](std::size_t pixel) { half[c][pixel] *= AlbedoAt(c, pixel); });
    }
  }

  // Of a half, or of one divided by the albedo: noise has the colour of the pixel. Where there is
  // none, differences of a 30,000th of the floor's root are none.
  ColorColumns Variance(bool is_divided) {
    ColorColumns variance;
    for (std::vector<float>& channel : variance)
      channel.resize(pixels());
    ForPixels([&](std::size_t pixel) {
      const double deviation = static_cast<double>(image_.noise[pixel]);
      const double luminance = LuminanceOfMean(pixel);
      for (std::size_t c = 0; c < 3; ++c) {
        const double share =
            luminance > 0 ? static_cast<double>(MeanAt(image_.halves, c, pixel)) / luminance : 1;
        const double of_channel = deviation * share;
        const auto albedo = is_divided ? static_cast<double>(AlbedoAt(c, pixel)) : 1.0;
        // No infinite one, by which an infinite difference would be divided.
        variance[c][pixel] = static_cast<float>(
            std::min((2 * of_channel * of_channel + 1e-9 * floor_) / (albedo * albedo), 1e30));
      }
    });
    return variance;
  }

  // Adds to `best` what `weaker` has beyond it, in the share of least error.
  void AddShare(const ImageHalves& weaker, ImageHalves& best) {
    std::vector<float> products(pixels()), squares(pixels());
    const double even = image_.even_share, odd = 1 - even;
    ForPixels([&](std::size_t pixel) {
      double product = 0, square = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        const auto beyond = [&](std::size_t half) {
          return static_cast<double>(weaker[half][c][pixel]) -
                 static_cast<double>(best[half][c][pixel]);
        };
        const double of_even = beyond(0), of_odd = beyond(1);
        const auto so_far = static_cast<double>(MeanAt(best, c, pixel));
        product += even * of_even * (static_cast<double>(image_.halves[1][c][pixel]) - so_far) +
                   odd * of_odd * (static_cast<double>(image_.halves[0][c][pixel]) - so_far);
        const double of_mean = even * of_even + odd * of_odd;
        square += of_mean * of_mean;
      }
      const double value = LuminanceAt(steady_, pixel);
      const double relative = 1 / (value * value + floor_);
      products[pixel] = static_cast<float>(product * relative);
      squares[pixel] = static_cast<float>(square * relative);
    });
    const auto width = static_cast<std::size_t>(image_.width);
    const auto height = static_cast<std::size_t>(image_.height);
    MeanAround(products, width, height, team_);
    MeanAround(squares, width, height, team_);
    ForPixels([&](std::size_t pixel) {
      if (!(squares[pixel] > 0)) return;
      const float share = std::clamp(products[pixel] / squares[pixel], 0.0F, 1.0F);
      for (std::size_t half = 0; half < 2; ++half) {
        for (std::size_t c = 0; c < 3; ++c) {
          float& so_far = best[half][c][pixel];
          so_far += share * (weaker[half][c][pixel] - so_far);
        }
      }
    });
  }

  void FindErrors(const ImageHalves& best, DenoisedImage& result) {
    // Squared and relative, of three channels: of the image's noise, of what is left of it, and of
    // that and blur.
    struct Errors {
      double noise = 0, left = 0, total = 0;
    };
    std::vector<Errors> errors(pixels());
    std::vector<float> expected(pixels());
    const double even = image_.even_share, odd = 1 - even;
    ForPixels([&](std::size_t pixel) {
      for (std::size_t c = 0; c < 3; ++c) {
        const auto value = static_cast<double>(steady_[c][pixel]);
        const double relative = 1 / (value * value + floor_);
        const auto of = [&](const ImageHalves& halves, std::size_t half) {
          return static_cast<double>(halves[half][c][pixel]);
        };
        const auto squared = [](double x) { return x * x; };
        const double before = squared(of(image_.halves, 0) - of(image_.halves, 1));
        const double after = squared(of(best, 0) - of(best, 1));
        const double across = squared(of(best, 0) - of(image_.halves, 1)) +
                              squared(of(best, 1) - of(image_.halves, 0));
        errors[pixel].noise += even * odd * before * relative;
        errors[pixel].left += even * odd * after * relative;
        errors[pixel].total += (0.5 * (across - before) - (0.5 - even * odd) * after) * relative;
      }
      const double luminance = LuminanceAt(steady_, pixel);
      const auto deviation = static_cast<double>(image_.noise[pixel]);
      expected[pixel] =
          static_cast<float>(deviation * deviation / (luminance * luminance + floor_));
    });
    // The worst ones are left out.
    const std::size_t kept_pixels = KeptPixels(pixels());
    std::vector<std::size_t> order(pixels());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::nth_element(order, order.begin() + static_cast<std::ptrdiff_t>(kept_pixels) - 1,
                             [&](std::size_t a, std::size_t b) {
                               return expected[a] != expected[b] ? expected[a] < expected[b]
                                                                 : a < b;
                             });
    std::vector<bool> is_left_out(pixels());
    for (std::size_t i = kept_pixels; i < pixels(); ++i)
      is_left_out[order[i]] = true;
    Errors all;
    std::array<Errors, static_cast<std::size_t>(kErrorCells) * kErrorCells> cells;
    const auto add = [](const Errors& one, Errors& sum) {
      sum.noise += one.noise;
      sum.left += one.left;
      sum.total += one.total;
    };
    const auto width = static_cast<std::size_t>(image_.width);
    const auto height = static_cast<std::size_t>(image_.height);
    for (std::size_t pixel = 0; pixel < pixels(); ++pixel) {
      add(errors[pixel], all);
      if (is_left_out[pixel]) continue;
      const std::size_t x = pixel % width, y = pixel / width;
      add(errors[pixel], cells[y * kErrorCells / height * kErrorCells + x * kErrorCells / width]);
    }
    Errors kept;
    for (const Errors& cell : cells)
      add(cell, kept);
    if (!(kept.noise > 0)) return;
    result.noise_left = kept.left / kept.noise;
    const double left = kept.total / kept.noise;
    result.blur = left - result.noise_left;
    double squares = 0;
    for (const Errors& cell : cells) {
      const double off = cell.total - left * cell.noise;
      squares += off * off;
    }
    result.deviation = std::sqrt(squares) / kept.noise;
    result.all_left = std::max(all.total, all.left) / all.noise;
  }

  NoisyImage image_;
  ThreadTeam& team_;
  double floor_ = 0;
  ColorColumns steady_;
};

}  // namespace

DenoisedImage Denoise(NoisyImage image, ThreadTeam& team) {
  return Denoiser(std::move(image), team).Run();
}

DenoisedError ErrorOfDenoised(const DenoisedImage& denoised, const ErrorEstimate& of_image) {
  const SquaredError& before = of_image.relative;
  DenoisedError error;
  const double blur = before.noise * std::max(0.0, denoised.blur);
  error.relative.noise = before.noise * denoised.noise_left;
  error.relative.bias = before.bias + blur;
  // What is not known of the image's own error stays so. What the filter blurs adds to what the
  // kernels have blurred, by as much as their product at most, and seldom takes of it.
  const double share = before.total() > 0 ? error.relative.total() / before.total() : 1;
  const double chance = 2 * before.noise * denoised.deviation;
  // At its lower end the image's interval may be noise alone, without any of the bias.
  const double model = std::exp(kModelError);
  const double least =
      std::min(before.low * share,
               error.relative.noise / model + std::max(0.0, before.low - before.noise * model));
  error.relative.low = std::max(0.0, least - chance);
  error.relative.high =
      (before.high * share + chance + 2 * std::sqrt(std::max(0.0, before.bias) * blur)) *
      std::exp(2 * kModelError * denoised.feature_share);
  error.untrimmed =
      std::max(error.relative.total(),
               before.bias + std::max(0.0, of_image.untrimmed - before.bias) * denoised.all_left);
  return error;
}

}  // namespace lucerna
