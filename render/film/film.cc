#include "render/film/film.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "render/base/status.h"
#include "render/math/color_space.h"

namespace lucerna {
namespace {

// Features are known well after so many passes, and sums of more would lose what a float rounds.
constexpr std::uint32_t kEnoughHits = 1U << 14;

}  // namespace

Film::Film(int width, int height, double exposure, double max_component)
    : width_(width),
      height_(height),
      exposure_(exposure),
      max_component_(max_component),
      direct_sum_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height)),
      feature_sum_(direct_sum_.size()) {}

void Film::Add(std::size_t pixel, Rgb direct, Rgb albedo, Vec3 normal, float distance) {
  RgbSum& sum = direct_sum_[pixel];
  sum[0] += static_cast<double>(direct.r);
  sum[1] += static_cast<double>(direct.g);
  sum[2] += static_cast<double>(direct.b);
  Features& features = feature_sum_[pixel];
  if (!std::isfinite(distance) || features.hits == kEnoughHits) return;
  features.albedo += albedo;
  features.normal = features.normal + normal;
  features.distance += distance;
  ++features.hits;
}

Image Film::MakeImage(const PixelStatistics& statistics, const PixelStatistics* caustics,
                      const RadiusController& controller, const Kernel& kernel) const {
  LUCERNA_CHECK(statistics.passes() > 0);
  Image image;
  image.width = width_;
  image.height = height_;
  const std::size_t pixels = direct_sum_.size();
  const auto channel = [&](std::string name) -> std::size_t {
    image.channels.push_back({std::move(name), std::vector<float>(pixels)});
    return image.channels.size() - 1;
  };
  const std::size_t beauty = channel("R");
  channel("G");
  channel("B");
  const std::size_t direct = channel("direct.R");
  channel("direct.G");
  channel("direct.B");
  const std::size_t photons = channel("photons.R");
  channel("photons.G");
  channel("photons.B");
  const std::size_t albedo = channel("albedo.R");
  channel("albedo.G");
  channel("albedo.B");
  const std::size_t normal = channel("N.X");
  channel("N.Y");
  channel("N.Z");
  const std::size_t depth = channel("Z");
  const std::size_t radius = channel("radius");
  const std::size_t photon_count = channel("photon_count");

  const auto set = [&](std::size_t number, std::size_t pixel, double value) {
    image.channels[number].pixels[pixel] = static_cast<float>(value);
  };
  const double to_pixel = exposure_ / static_cast<double>(statistics.passes());
  for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
    RgbSum from_direct = ToRec709(direct_sum_[pixel]);
    RgbSum from_photons = statistics.radiance_sum()[pixel];
    if (caustics != nullptr) {
      for (std::size_t c = 0; c < 3; ++c)
        from_photons[c] += caustics->radiance_sum()[pixel][c];
    }
    from_photons = ToRec709(from_photons);
    double largest = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      from_direct[c] *= to_pixel;
      from_photons[c] *= to_pixel;
      largest = std::max(largest, from_direct[c] + from_photons[c]);
    }
    const double limit = largest > max_component_ ? max_component_ / largest : 1;
    for (std::size_t c = 0; c < 3; ++c) {
      set(beauty + c, pixel, (from_direct[c] + from_photons[c]) * limit);
      set(direct + c, pixel, from_direct[c] * limit);
      set(photons + c, pixel, from_photons[c] * limit);
    }
    const Features& features = feature_sum_[pixel];
    const double per_hit = features.hits == 0 ? 0 : 1.0 / features.hits;
    const RgbSum albedo_sum =
        ToRec709({static_cast<double>(features.albedo.r), static_cast<double>(features.albedo.g),
                  static_cast<double>(features.albedo.b)});
    for (int c = 0; c < 3; ++c) {
      const auto offset = static_cast<std::size_t>(c);
      set(albedo + offset, pixel, albedo_sum[offset] * per_hit);
      set(normal + offset, pixel, static_cast<double>(features.normal[c]) * per_hit);
    }
    set(depth, pixel,
        features.hits == 0 ? HUGE_VAL : static_cast<double>(features.distance) * per_hit);
    set(radius, pixel, static_cast<double>(statistics.last_radius()[pixel]));
    set(photon_count, pixel, static_cast<double>(statistics.photon_count()[pixel]));
  }
  if (controller.Predicts()) {
    const std::size_t bandwidth = channel("bandwidth");
    const std::size_t min_radius = channel("min_radius");
    const std::size_t bias = channel("relative_bias");
    for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
      const auto prediction = controller.Predict(statistics.memory(pixel));
      const auto unit = static_cast<double>(statistics.last_unit_radius()[pixel]);
      if (!prediction || !(unit > 0)) continue;
      const double in_units = static_cast<double>(statistics.last_radius()[pixel]) / unit;
      set(bandwidth, pixel, std::sqrt(prediction->trace) / unit);
      set(min_radius, pixel, prediction->min_radius * unit);
      set(bias, pixel, RelativeBiasBound(prediction->trace, in_units, kernel.Moments()));
    }
  }
  return image;
}

}  // namespace lucerna
