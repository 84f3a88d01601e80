#include "client/selfcheck/selfcheck_agreement.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace lucerna {
namespace {

// Large against the radius of a pixel, so that what tiles differ by is hardly the same photons.
constexpr int kTilesAcross = 4;

// [tiles] the means of one channel.
StatusOr<std::vector<double>> TileMeans(const Image& image, const char* name, const Image& first) {
  const ImageChannel* channel = image.Find(name);
  if (channel == nullptr || image.width != first.width || image.height != first.height) {
    return absl::InternalError("images of one scene differ in size or channels");
  }
  std::vector<double> sums(kTilesAcross * kTilesAcross, 0);
  std::vector<double> counts(sums.size(), 0);
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const auto tile = static_cast<std::size_t>(y * kTilesAcross / image.height * kTilesAcross +
                                                 x * kTilesAcross / image.width);
      sums[tile] +=
          static_cast<double>(channel->pixels[static_cast<std::size_t>(y * image.width + x)]);
      counts[tile] += 1;
    }
  }
  for (std::size_t tile = 0; tile < sums.size(); ++tile)
    sums[tile] /= std::max(1.0, counts[tile]);
  return sums;
}

// Mean and variance of each tile over several images.
struct Spread {
  std::vector<double> mean;
  std::vector<double> variance;  // of one image; 0 when there is but one
};

StatusOr<Spread> SpreadOf(std::span<const Image* const> images, const char* channel,
                          const Image& first) {
  Spread spread;
  std::vector<std::vector<double>> all;
  for (const Image* image : images) {
    LUCERNA_ASSIGN_OR_RETURN(all.emplace_back(), TileMeans(*image, channel, first));
  }
  const auto count = static_cast<double>(images.size());
  for (std::size_t tile = 0; tile < all.front().size(); ++tile) {
    double sum = 0;
    for (const std::vector<double>& means : all)
      sum += means[tile] / count;
    double square = 0;
    for (const std::vector<double>& means : all)
      square += (means[tile] - sum) * (means[tile] - sum);
    spread.mean.push_back(sum);
    spread.variance.push_back(square / std::max(1.0, count - 1));
  }
  return spread;
}

// An F-distributed `ratio` with `n` over `m` degrees of freedom, as a normal variable.
double NormalFromF(double ratio, double n, double m) {
  const double root = std::cbrt(ratio);
  const double a = 2 / (9 * n);
  const double b = 2 / (9 * m);
  return ((1 - b) * root - (1 - a)) / std::sqrt(b * root * root + a);
}

}  // namespace

StatusOr<double> DeviationsBeyondNoise(std::span<const Image* const> base,
                                       std::span<const Image* const> others) {
  LUCERNA_CHECK(base.size() >= 3 && !others.empty());
  double most = -HUGE_VAL;
  for (const char* channel : {"R", "G", "B"}) {
    LUCERNA_ASSIGN_OR_RETURN(const Spread known, SpreadOf(base, channel, *base.front()));
    LUCERNA_ASSIGN_OR_RETURN(const Spread asked, SpreadOf(others, channel, *base.front()));
    double difference = 0;
    double variance = 0;
    double variance_square = 0;
    for (std::size_t tile = 0; tile < known.mean.size(); ++tile) {
      const double apart = known.mean[tile] - asked.mean[tile];
      difference += apart * apart;
      variance += known.variance[tile];
      variance_square += known.variance[tile] * known.variance[tile];
    }
    if (!std::isfinite(difference)) return HUGE_VAL;
    if (difference == 0) continue;
    if (!(variance > 0)) return HUGE_VAL;
    const double of_means =
        1 / static_cast<double>(base.size()) + 1 / static_cast<double>(others.size());
    const double freedom = static_cast<double>(base.size() - 1);
    // Tiles of unequal noise count for fewer of equal noise (Satterthwaite); squares of estimated
    // variances are too large by the second factor.
    const double tiles = variance * variance / variance_square * (1 + 2 / freedom);
    most = std::max(most, NormalFromF(difference / (variance * of_means), tiles, tiles * freedom));
  }
  return most;
}

}  // namespace lucerna
