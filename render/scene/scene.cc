#include "render/scene/scene.h"

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

}  // namespace lucerna
