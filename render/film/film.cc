#include "render/film/film.h"

#include <algorithm>
#include <cmath>

#include "render/base/status.h"
#include "render/film/layers.h"
#include "render/frequency/bandwidth.h"
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
  const double to_pixel = exposure_ / static_cast<double>(statistics.passes());
  const auto values_of = [&](std::size_t pixel) {
    PixelValues values;
    values.direct = ToRec709(direct_sum_[pixel]);
    values.photons = statistics.radiance_sum()[pixel];
    if (caustics != nullptr) {
      for (std::size_t c = 0; c < 3; ++c)
        values.photons[c] += caustics->radiance_sum()[pixel][c];
    }
    values.photons = ToRec709(values.photons);
    double largest = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      values.direct[c] *= to_pixel;
      values.photons[c] *= to_pixel;
      largest = std::max(largest, values.direct[c] + values.photons[c]);
    }
    values.limit = largest > max_component_ ? max_component_ / largest : 1;
    const Features& features = feature_sum_[pixel];
    const double per_hit = features.hits == 0 ? 0 : 1.0 / features.hits;
    values.albedo =
        ToRec709({static_cast<double>(features.albedo.r), static_cast<double>(features.albedo.g),
                  static_cast<double>(features.albedo.b)});
    for (int c = 0; c < 3; ++c) {
      const auto offset = static_cast<std::size_t>(c);
      values.albedo[offset] *= per_hit;
      values.normal[offset] = static_cast<double>(features.normal[c]) * per_hit;
    }
    values.distance =
        features.hits == 0 ? HUGE_VAL : static_cast<double>(features.distance) * per_hit;
    values.radius = static_cast<double>(statistics.last_radius()[pixel]);
    values.photon_count = static_cast<double>(statistics.photon_count()[pixel]);
    return values;
  };
  AddLayers(LayerSource::kEveryImage, values_of, image);
  if (!controller.Predicts()) return image;
  const auto predictions_of = [&](std::size_t pixel) {
    PixelValues values;
    const auto prediction = controller.Predict(statistics.memory(pixel));
    const auto unit = static_cast<double>(statistics.last_unit_radius()[pixel]);
    if (!prediction || !(unit > 0)) return values;
    const double in_units = static_cast<double>(statistics.last_radius()[pixel]) / unit;
    values.bandwidth = std::sqrt(prediction->trace) / unit;
    values.min_radius = prediction->min_radius * unit;
    values.relative_bias = RelativeBiasBound(prediction->trace, in_units, kernel.Moments());
    return values;
  };
  AddLayers(LayerSource::kPredictions, predictions_of, image);
  return image;
}

}  // namespace lucerna
