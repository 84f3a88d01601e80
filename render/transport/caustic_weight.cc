#include "render/transport/caustic_weight.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace lucerna {
namespace {

// The nominal radius over the first one: about what is left of it after some hundred passes, in
// which most photons are gathered.
constexpr double kNominalShare = 1.0 / 3;

}  // namespace

CausticWeight::CausticWeight(const Scene& scene, const RenderSettings& settings,
                             const Bounds& bounds) {
  double radius = settings.initial_radius / scene.unit;
  if (!(radius > 0) && !bounds.empty()) {
    // The first radius as seen from the camera in the middle of the scene.
    const Window window = ScreenWindow(scene.camera, settings.width, settings.height);
    const double pixel = std::sqrt((window.high_x - window.low_x) / settings.width *
                                   (window.high_y - window.low_y) / settings.height);
    const auto extent = static_cast<double>(bounds.Diagonal());
    const Vec3 to_middle = bounds.Center() - scene.camera.camera_to_world.Point({});
    const double distance =
        std::clamp(static_cast<double>(Length(to_middle)), extent / 4, extent * 4);
    radius = settings.initial_footprints * pixel * distance;
    if (scene.camera.kind != Camera::Kind::kPerspective) {
      radius = settings.initial_footprints *
               PixelFootprint(scene.camera, settings.width, settings.height, distance);
    }
  }
  radius *= kNominalShare;
  photon_area_ =
      static_cast<double>(settings.photons_per_pass) * std::numbers::pi * radius * radius;
}

}  // namespace lucerna
