#include "render/scene/scene.h"

#include <cmath>
#include <numbers>

#include "render/base/text.h"

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
  const double scale = camera.kind == Camera::Kind::kOrthographic
                           ? camera.window_scale
                           : std::tan(camera.fov_deg * std::numbers::pi / 360);
  return {window.low_x * scale, window.high_x * scale, window.low_y * scale, window.high_y * scale};
}

double PixelFootprint(const Camera& camera, int width, int height, double distance) {
  const Window window = ScreenWindow(camera, width, height);
  const double pixel_width = (window.high_x - window.low_x) / width;
  const double pixel_height = (window.high_y - window.low_y) / height;
  const double of_window = std::sqrt(pixel_width * pixel_height);
  switch (camera.kind) {
    case Camera::Kind::kPerspective:
      return of_window * distance;
    case Camera::Kind::kOrthographic:
      return of_window;
    case Camera::Kind::kSensors:
      return camera.window_scale;
    case Camera::Kind::kEqualArea:
    case Camera::Kind::kEquirectangular:
      break;
  }
  // Its mean share of all directions.
  return std::sqrt(4 * std::numbers::pi / (static_cast<double>(width) * height)) * distance;
}

double LensReach(const Camera& camera) {
  const auto radius = static_cast<float>(camera.lens_radius);
  const double x = static_cast<double>(Length(camera.camera_to_world.Vector({radius, 0, 0})));
  const double y = static_cast<double>(Length(camera.camera_to_world.Vector({0, radius, 0})));
  return std::hypot(x, y);
}

std::string Scene::SourceOf(const ShapeTraits& traits) const {
  if (traits.source < 0 || static_cast<std::size_t>(traits.source) >= sources.size()) return "";
  const ShapeSource& source = sources[static_cast<std::size_t>(traits.source)];
  if (source.file >= source_files.size()) return "";
  return Concat(source_files[source.file], ":", source.line);
}

}  // namespace lucerna
