#include "render/formats/cloud_density.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <tuple>
#include <utility>

#include "render/scene/noise.h"

namespace lucerna {
namespace {

// Of the features of an octave over those of the next.
constexpr float kLacunarity = 1.99F;

// A difference over a step, which pbrt-v4 takes for the slope of noise.
Vec3 SlopeOfNoise(Vec3 p) {
  constexpr float kStep = 0.01F;
  const float here = NoiseAt(p);
  const auto along = [&](Vec3 step) { return (NoiseAt(p + step) - here) / kStep; };
  return {along({kStep, 0, 0}), along({0, kStep, 0}), along({0, 0, kStep})};
}

}  // namespace

float CloudDensityAt(const CloudShape& shape, Vec3 place) {
  constexpr int kOctaves = 5;
  constexpr int kWisps = 2;
  const float floor = 2 * std::max(0.0F, 0.5F - place.y);
  if (floor >= 1) return 1;
  Vec3 p = place * shape.frequency;
  if (shape.wispiness > 0) {
    float by = 0.05F * shape.wispiness;
    float frequency = 10;
    for (int i = 0; i < kWisps; ++i, by *= 0.5F, frequency *= kLacunarity)
      p = p + SlopeOfNoise(p * frequency) * by;
  }
  const float noise = 0.5F * FbmAt(p, 0.5F, kOctaves);
  // Thinner with the height.
  const float puffs = std::clamp((1 - place.y) * 4.5F * shape.density * noise, 0.0F, 1.0F);
  return std::min(puffs + floor, 1.0F);
}

std::array<int, 3> CloudGridSize(const CloudShape& shape, Vec3 low, Vec3 high) {
  constexpr double kPointsPerFeature = 2 * 16;  // of the widest octave
  constexpr double kMost = 0x1p24;
  const auto points = [&](double per_unit) {
    std::array<int, 3> size{};
    double all = 1;
    for (int axis = 0; axis < 3; ++axis) {
      const double extent = static_cast<double>(high[axis]) - static_cast<double>(low[axis]);
      size[static_cast<std::size_t>(axis)] =
          static_cast<int>(std::clamp(std::ceil(extent * per_unit), 2.0, 4096.0));
      all *= size[static_cast<std::size_t>(axis)];
    }
    return std::pair{size, all};
  };
  double per_unit = kPointsPerFeature * static_cast<double>(shape.frequency);
  auto [size, all] = points(per_unit);
  while (all > kMost) {
    per_unit *= std::min(0.99, std::cbrt(kMost / all));
    std::tie(size, all) = points(per_unit);
  }
  return size;
}

std::vector<float> CloudDensities(const CloudShape& shape, const std::array<int, 3>& size, Vec3 low,
                                  Vec3 high) {
  const auto middle = [&](int axis, int point) {
    const float share = (static_cast<float>(point) + 0.5F) /
                        static_cast<float>(size[static_cast<std::size_t>(axis)]);
    return low[axis] + (high[axis] - low[axis]) * share;
  };
  std::vector<float> densities;
  densities.reserve(static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]) *
                    static_cast<std::size_t>(size[2]));
  for (int z = 0; z < size[2]; ++z) {
    for (int y = 0; y < size[1]; ++y) {
      for (int x = 0; x < size[0]; ++x) {
        densities.push_back(CloudDensityAt(shape, {middle(0, x), middle(1, y), middle(2, z)}));
      }
    }
  }
  return densities;
}

}  // namespace lucerna
