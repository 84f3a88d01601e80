#include "render/film/film.h"

#include <algorithm>
#include <cmath>

#include "render/base/status.h"
#include "render/estimate/slice_sums.h"
#include "render/film/image_color.h"
#include "render/film/layers.h"
#include "render/frequency/bandwidth.h"
#include "render/math/color_space.h"

namespace lucerna {

FilmFeatures FeaturesOf(const ImageSums::Features& sums) {
  FilmFeatures features;
  if (sums.hits == 0) return features;
  const double per_hit = 1 / static_cast<double>(sums.hits);
  features.albedo =
      ToRec709({static_cast<double>(sums.albedo.r), static_cast<double>(sums.albedo.g),
                static_cast<double>(sums.albedo.b)});
  for (int c = 0; c < 3; ++c) {
    const auto offset = static_cast<std::size_t>(c);
    features.albedo[offset] *= per_hit;
    features.normal[offset] = static_cast<double>(sums.normal[c]) * per_hit;
  }
  if (sums.hits > 1) {
    double square = 0;
    for (const double component : features.normal)
      square += component * component;
    // Each normal has the length 1.
    features.normal_variance = std::max(0.0, 1 - square) / (static_cast<double>(sums.hits) - 1);
  }
  features.distance = static_cast<double>(sums.distance) * per_hit;
  return features;
}

std::vector<ImageChannel> MakeFilmPixels(const FilmFormat& format, std::size_t first,
                                         std::size_t last, const ImageSums& sums,
                                         const WithoutBlur& shown, const RadiusColumn& last_radii,
                                         const PixelRadii& radii,
                                         const RadiusController& controller, const Kernel& kernel,
                                         ThreadTeam& team) {
  LUCERNA_CHECK(sums.passes() > 0 && first <= last && last <= sums.pixels());
  std::vector<ImageChannel> channels;
  const double to_pixel = format.exposure / sums.weights().all();
  const ImageColor color(format.white_balance);
  // Of the pixel's hitpoints [scene units]; 0 where there was none.
  const auto unit_radius = [&](std::size_t pixel) {
    const ImageSums::Features features = sums.FeaturesAt(pixel);
    return features.hitpoints > 0
               ? static_cast<double>(features.unit_radius) / static_cast<double>(features.hitpoints)
               : 0;
  };
  // Only these tell what surfaces look like.
  const auto feature_passes = static_cast<double>(std::min(sums.passes(), kFeaturePasses));
  const auto values_of = [&](std::size_t offset_in_band) {
    const std::size_t pixel = first + offset_in_band;
    const ImageSums::Pixel of_pixel = shown.At(pixel);
    PixelValues values;
    values.direct = color(of_pixel.direct);
    values.photons = color(of_pixel.photons);
    double largest = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      values.direct[c] *= to_pixel;
      values.photons[c] *= to_pixel;
      largest = std::max(largest, values.direct[c] + values.photons[c]);
    }
    values.limit = LimitOf(largest, format.max_component);
    const ImageSums::Features sums_of_features = sums.FeaturesAt(pixel);
    const FilmFeatures features = FeaturesOf(sums_of_features);
    values.albedo = features.albedo;
    values.normal = features.normal;
    values.distance = features.distance;
    values.coverage = static_cast<double>(sums_of_features.hits) / feature_passes;
    values.radius = static_cast<double>(last_radii[pixel]) * unit_radius(pixel);
    values.photon_count = of_pixel.photon_count;
    return values;
  };
  AddLayers(LayerSource::kEveryImage, values_of, last - first, team, channels);
  if (format.has_coverage)
    AddLayers(LayerSource::kCoverage, values_of, last - first, team, channels);
  if (!controller.Predicts()) return channels;
  const auto predictions_of = [&](std::size_t offset_in_band) {
    const std::size_t pixel = first + offset_in_band;
    PixelValues values;
    const auto prediction = controller.Predict(radii.memory(pixel));
    const double unit = unit_radius(pixel);
    if (!prediction || !(unit > 0)) return values;
    values.bandwidth = std::sqrt(prediction->trace) / unit;
    values.min_radius = prediction->min_radius * unit;
    values.relative_bias = RelativeBiasBound(
        prediction->trace, static_cast<double>(last_radii[pixel]), kernel.Moments());
    return values;
  };
  AddLayers(LayerSource::kPredictions, predictions_of, last - first, team, channels);
  return channels;
}

void SetImageWindow(const RenderSettings& settings, Image& image) {
  const bool is_whole =
      settings.crop_width() == settings.width && settings.crop_height() == settings.height;
  if (is_whole) return;
  image.x0 = settings.crop_x0;
  image.y0 = settings.crop_y0;
  image.whole_width = settings.width;
  image.whole_height = settings.height;
}

}  // namespace lucerna
