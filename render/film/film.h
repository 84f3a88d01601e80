// What has been collected for every pixel besides photons, and how does it all become an image?
#pragma once

#include <cstdint>
#include <vector>

#include "render/estimate/statistics.h"
#include "render/image/image.h"
#include "render/math/rgb.h"
#include "render/math/vector.h"

namespace lucerna {

class Film {
 public:
  // exposure: factor from radiance to pixel values. max_component: pixel values are scaled down
  // until no channel is larger.
  Film(int width, int height, double exposure, double max_component);

  // Adds what the eye path of one pass saw at `pixel` (row-major); colours in the working space,
  // which MakeImage turns into Rec. 709. distance: HUGE_VALF where
  // nothing was hit.
  void Add(std::size_t pixel, Rgb direct, Rgb albedo, Vec3 normal, float distance);

  // The image of all passes that `statistics` holds; every pixel has been added as often. What the
  // hitpoints of `caustics` (or nullptr) gathered is added to the photons' light.
  // The layers of kEveryImage, and of kPredictions if the controller makes any (film/layers.h).
  [[nodiscard]] Image MakeImage(const PixelStatistics& statistics, const PixelStatistics* caustics,
                                const RadiusController& controller, const Kernel& kernel) const;

  // Sums over passes [pixels].
  [[nodiscard]] const std::vector<RgbSum>& direct_sum() const { return direct_sum_; }

 private:
  struct Features {
    Rgb albedo;
    Vec3 normal;
    float distance = 0;
    std::uint32_t hits = 0;
  };

  int width_, height_;
  double exposure_, max_component_;
  std::vector<RgbSum> direct_sum_;
  std::vector<Features> feature_sum_;
};

}  // namespace lucerna
