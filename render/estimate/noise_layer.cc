#include "render/estimate/noise_layer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "render/base/status.h"

namespace lucerna {
namespace {

// Octaves of variance that are told apart, below the largest.
constexpr int kOctaves = 48;
// The blur and the interpolation give a cell's pixels the weight of about this many cells' areas.
constexpr double kCellsInAverage = 16;
constexpr double kDegreesOfFreedom = 24;
constexpr double kLeastCell = 4;  // [pixels]

// Sums over pixels on a grid of three axes: x, y and octaves of variance.
class Grid {
 public:
  struct Sum {
    double ratio = 0;
    double weight = 0;
  };

  Grid(int nx, int ny) : size_{nx, ny, kOctaves} {
    sums_.resize(static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny) * kOctaves);
  }

  [[nodiscard]] int size(int axis) const { return size_[static_cast<std::size_t>(axis)]; }
  [[nodiscard]] Sum& At(int x, int y, int z) { return sums_[Index(x, y, z)]; }
  [[nodiscard]] const Sum& At(int x, int y, int z) const { return sums_[Index(x, y, z)]; }

  // Binomial weights of five along the axis with this stride and length.
  void Blur(int axis) {
    const auto length = static_cast<std::size_t>(size(axis));
    const std::size_t stride = axis == 2 ? 1 : axis == 0 ? kOctaves : kOctaves * Width();
    std::vector<Sum> line(length + 4);
    for (std::size_t start = 0; start < sums_.size(); ++start) {
      if (start / stride % length != 0) continue;
      for (std::size_t i = 0; i < length; ++i)
        line[i + 2] = sums_[start + i * stride];
      for (std::size_t i = 0; i < length; ++i) {
        const auto blurred = [&](double Sum::*of) {
          return line[i].*of + line[i + 4].*of + 4 * (line[i + 1].*of + line[i + 3].*of) +
                 6 * line[i + 2].*of;
        };
        sums_[start + i * stride] = {blurred(&Sum::ratio), blurred(&Sum::weight)};
      }
    }
  }

 private:
  [[nodiscard]] std::size_t Width() const { return static_cast<std::size_t>(size_[0]); }
  [[nodiscard]] std::size_t Index(int x, int y, int z) const {
    return (static_cast<std::size_t>(y) * Width() + static_cast<std::size_t>(x)) * kOctaves +
           static_cast<std::size_t>(z);
  }

  std::array<int, 3> size_;
  std::vector<Sum> sums_;
};

// How much a pixel's own halves count for it, against the pixels around: all where one pass makes
// the variance, a few percent where all passes do.
double OwnWeight(const PixelNoise& pixel) {
  return pixel.largest_share * pixel.largest_share;
}

// A number's place on an axis of cells: between the centres of `low` and `low` + 1.
struct Place {
  int low = 0;
  double share = 0;  // of the second
};
Place PlaceAt(double cells) {
  const double low = std::floor(cells - 0.5);
  return {static_cast<int>(low), cells - 0.5 - low};
}

}  // namespace

std::vector<float> NoiseOfPixels(int width, int height, double correlated_area,
                                 std::span<const PixelNoise> pixels) {
  const auto w = static_cast<std::size_t>(width);
  LUCERNA_CHECK(pixels.size() == w * static_cast<std::size_t>(height));
  const double wanted =
      std::sqrt(kDegreesOfFreedom / kCellsInAverage * std::max(correlated_area, 1.0));
  const double cell =
      std::clamp(wanted, kLeastCell, std::max<double>({kLeastCell, width / 2.0, height / 2.0}));

  int highest = 0;
  bool is_any = false;
  for (const PixelNoise& pixel : pixels) {
    if (!(pixel.of_passes > 0)) continue;
    highest = is_any ? std::max(highest, std::ilogb(pixel.of_passes)) : std::ilogb(pixel.of_passes);
    is_any = true;
  }
  const auto octave_of = [&](double variance) {
    return std::max(0, std::ilogb(variance) - highest + kOctaves - 1);
  };

  Grid grid(static_cast<int>((width - 1) / cell) + 1, static_cast<int>((height - 1) / cell) + 1);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const PixelNoise& pixel = pixels[i];
    if (!(pixel.of_passes > 0)) continue;
    Grid::Sum& sum =
        grid.At(static_cast<int>(static_cast<double>(i % w) / cell),
                static_cast<int>(static_cast<double>(i / w) / cell), octave_of(pixel.of_passes));
    const double weight = 1 - OwnWeight(pixel);
    sum.ratio += weight * pixel.of_halves / pixel.of_passes;
    sum.weight += weight;
  }
  for (int axis = 0; axis < 3; ++axis)
    grid.Blur(axis);

  std::vector<float> noise(pixels.size());
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const double variance = pixels[i].of_passes;
    if (!(variance > 0)) continue;
    const int octave = octave_of(variance);
    const std::array<Place, 3> places = {
        PlaceAt((static_cast<double>(i % w) + 0.5) / cell),
        PlaceAt((static_cast<double>(i / w) + 0.5) / cell),
        // Within its octave by the logarithm, whose whole part is exact.
        PlaceAt(octave + std::min(1.0, std::log2(std::scalbn(variance, -std::ilogb(variance)))))};
    Grid::Sum sum;
    for (int corner = 0; corner < 8; ++corner) {
      std::array<int, 3> at{};
      double weight = 1;
      for (int axis = 0; axis < 3; ++axis) {
        const auto a = static_cast<std::size_t>(axis);
        const bool is_second = (corner >> axis & 1) != 0;
        at[a] = std::clamp(places[a].low + (is_second ? 1 : 0), 0, grid.size(axis) - 1);
        weight *= is_second ? places[a].share : 1 - places[a].share;
      }
      const Grid::Sum& of_corner = grid.At(at[0], at[1], at[2]);
      sum.ratio += weight * of_corner.ratio;
      sum.weight += weight * of_corner.weight;
    }
    const double own = OwnWeight(pixels[i]);
    const double around = sum.weight > 0 ? variance * sum.ratio / sum.weight : variance;
    noise[i] = static_cast<float>(std::sqrt(std::lerp(around, pixels[i].of_halves, own)));
  }
  return noise;
}

}  // namespace lucerna
