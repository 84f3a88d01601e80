// LightSource "projection".
#include <algorithm>
#include <cmath>

#include "render/formats/pbrt/light_readers.h"
#include "render/formats/pbrt/shapes.h"
#include "render/math/warp.h"

namespace lucerna {
namespace {

// Cells along the longer side of the picture, at least.
constexpr int kFewestCells = 256;

}  // namespace

void ReadProjectionLight(const LightInput& input) {
  ParameterList& parameters = input.parameters;
  double scale = parameters.Float("scale", 1, kZeroOrMore);
  const double power_w = parameters.Float("power", -1);
  const double fov_deg = parameters.Float("fov", 90, {0, 180, false});
  const std::shared_ptr<const Picture> map = ReadLightPicture(parameters, input.assets);
  const StatusOr<ShapeAxes> axes = AxesOf(input.to_world);
  if (!axes.ok()) {
    parameters.Error("is stretched by its transform, which is not supported; scale all axes alike");
  }
  if (map == nullptr || !axes.ok()) return;
  ProjectionLight light;
  light.map = map;
  light.parts = std::max(1, kFewestCells / std::max(map->width, map->height));
  // The field of view is that of the shorter side.
  const double half = std::tan(fov_deg * kPi64 / 360);
  const double aspect = static_cast<double>(map->width) / static_cast<double>(map->height);
  light.half_width = static_cast<float>(half * std::max(1.0, aspect));
  light.half_height = static_cast<float>(half * std::max(1.0, 1 / aspect));
  light.axes = *axes;
  light.position = FinitePoint(parameters, input.to_world, {0, 0, 0});
  light.cells = std::make_shared<const PiecewiseConstant2D>(
      light.columns(), light.rows(), [&](int x, int y) { return light.WeightOf(x, y); });
  const double sum = light.cells->sum();
  if (power_w > 0 && sum > 0) {
    // As luminances of Rec. 709, which those of the cells are about.
    double luminances = 0;
    for (int y = 0; y < light.rows(); ++y) {
      for (int x = 0; x < light.columns(); ++x) {
        const Vec3 towards =
            light.TowardsPlace({static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F});
        luminances += static_cast<double>(Luminance(map->At(x / light.parts, y / light.parts)) *
                                          ProjectionLight::SolidAngleOverArea(towards));
      }
    }
    const double area = 4 * static_cast<double>(light.half_width) *
                        static_cast<double>(light.half_height) /
                        (static_cast<double>(light.columns()) * light.rows());
    scale *= power_w / (luminances * area);
  }
  light.intensity = sum > 0 ? ScaledEmission(parameters, Gray(1), scale) : Rgb{};
  input.scene.projection_lights.push_back(light);
  WarnIfBlack(parameters, light.intensity);
}

}  // namespace lucerna
