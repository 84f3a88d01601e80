#include "render/scene/scene.h"

#include <cmath>
#include <numbers>

namespace lucerna {

Window ScreenWindow(const Camera& camera, int width, int height) {
  Window window;
  if (camera.screen_window.has_value()) {
    window = *camera.screen_window;
  } else {
    const double aspect = camera.frame_aspect_ratio.value_or(static_cast<double>(width) /
                                                             static_cast<double>(height));
    if (aspect > 1) {
      window = {-aspect, aspect, -1, 1};
    } else {
      window = {-1, 1, -1 / aspect, 1 / aspect};
    }
  }
  const double scale = std::tan(camera.fov_deg * std::numbers::pi / 360);
  return {window.low_x * scale, window.high_x * scale, window.low_y * scale, window.high_y * scale};
}

double LensReach(const Camera& camera) {
  const auto radius = static_cast<float>(camera.lens_radius);
  const double x = static_cast<double>(Length(camera.camera_to_world.Vector({radius, 0, 0})));
  const double y = static_cast<double>(Length(camera.camera_to_world.Vector({0, radius, 0})));
  return std::hypot(x, y);
}

}  // namespace lucerna
