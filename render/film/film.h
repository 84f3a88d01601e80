// How do sums over passes become an image?
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include "render/base/parallel.h"
#include "render/estimate/image_sums.h"
#include "render/estimate/pixel_radii.h"
#include "render/estimate/radius_controller.h"
#include "render/estimate/without_blur.h"
#include "render/image/image.h"
#include "render/math/color_space.h"
#include "render/math/kernel.h"
#include "render/scene/render_settings.h"
#include "render/scene/scene.h"

namespace lucerna {

struct FilmFormat {
  double exposure = 1;  // factor from radiance to pixel values
  std::optional<ColorMatrix> white_balance;
  // Pixel values are scaled down until no channel is larger.
  double max_component = HUGE_VAL;
  bool has_coverage = false;  // the layer of kCoverage
};

// What a pixel's eye paths saw first: means over those that met a surface.
struct FilmFeatures {
  std::array<double, 3> albedo{}, normal{};  // albedo: Rec. 709
  double normal_variance = 0;                // of the mean normal, from its length
  double distance = HUGE_VAL;                // [scene units]
};
[[nodiscard]] FilmFeatures FeaturesOf(const ImageSums::Features& sums);

// The factor that keeps a pixel below the film's maximum, whose largest channel is `largest`.
[[nodiscard]] constexpr double LimitOf(double largest, double max_component) {
  return largest > max_component ? max_component / largest : 1;
}

// The pixels [first, last) of the image of all passes of `sums`, Rec. 709, as `shown` has them.
// `last_radii` are those of the last round [unit radii]. The layers of kEveryImage, of kCoverage on
// request, and of kPredictions if the controller makes any (film/layers.h). Requires sums.passes()
// > 0.
[[nodiscard]] std::vector<ImageChannel> MakeFilmPixels(
    const FilmFormat& format, std::size_t first, std::size_t last, const ImageSums& sums,
    const WithoutBlur& shown, const RadiusColumn& last_radii, const PixelRadii& radii,
    const RadiusController& controller, const Kernel& kernel, ThreadTeam& team);

// Says of an image that it is a part of a whole, where the settings crop it.
void SetImageWindow(const RenderSettings& settings, Image& image);

}  // namespace lucerna
