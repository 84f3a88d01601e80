#include "render/formats/environment_picture.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "render/math/equal_area_square.h"
#include "render/scene/shape_moves.h"

namespace lucerna {
namespace {

// The equal-area square that shows what a picture in latitude and longitude does.
Picture EqualAreaOf(const Picture& map) {
  const double pixels = static_cast<double>(map.width) * map.height;
  const int side = std::clamp(static_cast<int>(std::ceil(std::sqrt(pixels))), 8, 8192);
  // Pixels near the poles are narrow: several places of each pixel are looked up.
  constexpr int kPlaces = 4096;
  const int parts = std::clamp(kPlaces / side, 2, 16);
  Picture square;
  square.width = square.height = side;
  square.channels = 3;
  square.linear.resize(static_cast<std::size_t>(side) * static_cast<std::size_t>(side) * 3);
  const float step = 1 / static_cast<float>(side * parts);
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      Rgb sum;
      for (int i = 0; i < parts * parts; ++i) {
        const Vec2 place = {(static_cast<float>(x * parts + i % parts) + 0.5F) * step,
                            (static_cast<float>(y * parts + i / parts) + 0.5F) * step};
        const Vec3 d = EqualAreaDirection(place);
        double u = std::atan2(static_cast<double>(d.x), static_cast<double>(-d.z)) /
                   (2 * std::numbers::pi);
        u -= std::floor(u);
        const double v =
            std::acos(std::clamp(static_cast<double>(d.y), -1.0, 1.0)) / std::numbers::pi;
        sum += map.At(std::min(static_cast<int>(u * map.width), map.width - 1),
                      std::min(static_cast<int>(v * map.height), map.height - 1));
      }
      sum *= 1 / static_cast<float>(parts * parts);
      float* pixel = &square.linear[(static_cast<std::size_t>(y) * static_cast<std::size_t>(side) +
                                     static_cast<std::size_t>(x)) *
                                    3];
      pixel[0] = sum.r;
      pixel[1] = sum.g;
      pixel[2] = sum.b;
    }
  }
  return square;
}

}  // namespace

StatusOr<InfiniteLight> EnvironmentLight(const Picture& map, double scale,
                                         const Transform& to_world) {
  const StatusOr<ShapeAxes> axes = AxesOf(to_world);
  if (!axes.ok()) {
    return absl::InvalidArgumentError(
        "is stretched by its transform, which is not supported; scale all axes alike");
  }
  // Summed over all pixels in single precision.
  if (!(scale * static_cast<double>(map.Largest()) < 1e20)) {
    return absl::InvalidArgumentError("is too bright for single precision");
  }
  InfiniteLight light;
  light.kind = InfiniteLight::Kind::kEnvironment;
  light.radiance = Gray(static_cast<float>(scale));
  light.axes = *axes;
  light.map = std::make_shared<const Picture>(EqualAreaOf(map));
  return light;
}

}  // namespace lucerna
