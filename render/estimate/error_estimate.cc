#include "render/estimate/error_estimate.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "render/base/status.h"

namespace lucerna {
namespace {

// Of relMSE, as in film/image_metrics.h.
constexpr double kEpsilon = 0.01;

// Kernels of neighbouring tiles overlap, so a tile is wider than most kernels, and there are enough
// tiles for their spread to be known.
constexpr int kSmallestTile = 12;
constexpr double kTilesWanted = 256;

double Middle(double a, double b, double c) {
  return std::max(std::min(a, b), std::min(std::max(a, b), c));
}

// The mean over the 7 × 7 pixels around one, without itself; its own where there are no others.
RgbSum MeanAround(const std::vector<RgbSum>& image, int width, int height, int x, int y) {
  constexpr int kReach = 3;
  const auto at = [&](int i, int j) -> const RgbSum& {
    return image[static_cast<std::size_t>(j) * static_cast<std::size_t>(width) +
                 static_cast<std::size_t>(i)];
  };
  RgbSum sum{};
  double count = 0;
  for (int j = std::max(0, y - kReach); j <= std::min(height - 1, y + kReach); ++j) {
    for (int i = std::max(0, x - kReach); i <= std::min(width - 1, x + kReach); ++i) {
      if (i == x && j == y) continue;
      for (std::size_t c = 0; c < 3; ++c)
        sum[c] += at(i, j)[c];
      count += 1;
    }
  }
  if (!(count > 0)) return at(x, y);
  for (double& value : sum)
    value /= count;
  return sum;
}

// A mean over the image, with the sums of its tiles for its spread.
class TiledMean {
 public:
  TiledMean(int width, int height) {
    const double pixels = static_cast<double>(width) * static_cast<double>(height);
    side_ = std::max(kSmallestTile, static_cast<int>(std::sqrt(pixels / kTilesWanted)));
    across_ = (width + side_ - 1) / side_;
    tiles_.resize(static_cast<std::size_t>(across_) *
                  static_cast<std::size_t>((height + side_ - 1) / side_));
  }

  void Add(int x, int y, double noise, double bias) {
    Tile& tile = tiles_[static_cast<std::size_t>(y / side_) * static_cast<std::size_t>(across_) +
                        static_cast<std::size_t>(x / side_)];
    tile.noise += noise;
    tile.bias += bias;
    tile.count += 1;
  }

  [[nodiscard]] SquaredError Finish(double z) const {
    double noise = 0;
    double bias = 0;
    double count = 0;
    for (const Tile& tile : tiles_) {
      noise += tile.noise;
      bias += tile.bias;
      count += tile.count;
    }
    if (!(count > 0)) return {};
    SquaredError error;
    error.noise = noise / count;
    // The product of two halves may fall below 0 where there is no bias to speak of.
    error.bias = std::max(bias / count, 0.0);
    const double total = error.total();
    const double mean = (noise + bias) / count;
    double squares = 0;
    for (const Tile& tile : tiles_) {
      const double off = tile.noise + tile.bias - mean * tile.count;
      squares += off * off;
    }
    const auto n = static_cast<double>(tiles_.size());
    const double spread = n > 1 ? std::sqrt(squares * n / (n - 1)) / count : total;
    // The estimate's own spread, and that of the truth around what is expected of it.
    const double log_width = total > 0 ? z * std::numbers::sqrt2 * spread / total : 0;
    error.low = total * std::exp(-log_width);
    error.high = total * std::exp(log_width);
    return error;
  }

 private:
  struct Tile {
    double noise = 0, bias = 0, count = 0;
  };
  int side_ = 1;
  int across_ = 1;
  std::vector<Tile> tiles_;
};

}  // namespace

ErrorStatistics::ErrorStatistics(std::size_t pixels)
    : even_sum_(pixels), even_photons_(pixels), square_sum_(pixels) {
  for (std::vector<double>& sum : bias_sum_)
    sum.resize(pixels);
}

void ErrorStatistics::AddPass(std::uint64_t pass, std::span<const RgbSum> radiance,
                              std::span<const RgbSum> photons, std::span<const double> bias) {
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
      even_photons_[pixel][c] += photons[pixel][c];
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

  TiledMean relative(width, height);
  TiledMean absolute(width, height);
  std::vector<RgbSum> means(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (std::size_t i = 0; i < means.size(); ++i) {
    means[i] = sums_at(i).all;
    for (double& value : means[i])
      value /= passes;
  }
  double halves = 0;
  double independent = 0;
  std::size_t pixel = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const PixelSums sums = sums_at(pixel++);
      RgbSum difference{};
      double noise_sum = 0, bias_sum = 0, relative_noise = 0, relative_bias = 0;
      const RgbSum around = MeanAround(means, width, height, x, y);
      for (std::size_t c = 0; c < 3; ++c) {
        const double even = sums.even[c] / even_passes;
        const double odd = (sums.all[c] - sums.even[c]) / odd_passes;
        const double photons = sums.even_photons[c] / even_passes -
                               (sums.photons[c] - sums.even_photons[c]) / odd_passes;
        difference[c] = even - odd;
        const double direct = difference[c] - photons;
        const double bias = sums.even_bias[c] / even_passes * (sums.odd_bias[c] / odd_passes);
        const double own = sums.all[c] / passes;
        const double likely = Middle(even, odd, around[c]);
        noise_sum += difference[c] * difference[c] * to_noise;
        bias_sum += bias;
        relative_noise += to_noise * (direct * direct / (own * own + kEpsilon) +
                                      photons * photons / (likely * likely + kEpsilon));
        relative_bias += bias / (own * own + kEpsilon);
      }
      absolute.Add(x, y, noise_sum / 3, bias_sum / 3);
      relative.Add(x, y, relative_noise / 3, relative_bias / 3);
      const double luminance = LuminanceOf(difference);
      halves += luminance * luminance * to_noise;
      const double mean = LuminanceOf(sums.all) / passes;
      independent += std::max(0.0, sums.square / passes - mean * mean) / (passes - 1);
    }
  }
  ErrorEstimate estimate;
  estimate.relative = relative.Finish(z);
  estimate.absolute = absolute.Finish(z);
  estimate.noise_factor = independent > 0 ? halves / independent : 1;
  return estimate;
}

}  // namespace lucerna
