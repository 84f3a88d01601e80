// LightSource "goniometric".
#include <utility>

#include "render/base/text.h"
#include "render/formats/pbrt/light_readers.h"
#include "render/formats/pbrt/shapes.h"
#include "render/math/warp.h"

namespace lucerna {

void ReadGoniometricLight(const LightInput& input) {
  ParameterList& parameters = input.parameters;
  GivenSpectrum spectrum;
  const Rgb color = parameters.FindEmission("I", &spectrum).value_or(Gray(1));
  double scale = parameters.Float("scale", 1, kZeroOrMore);
  const double power_w = parameters.Float("power", -1);
  const std::shared_ptr<const Picture> map = ReadLightPicture(parameters, input.assets);
  const StatusOr<ShapeAxes> axes = AxesOf(input.to_world);
  if (!axes.ok()) {
    parameters.Error("is stretched by its transform, which is not supported; scale all axes alike");
  }
  if (map == nullptr || !axes.ok()) return;
  if (map->width != map->height) {
    parameters.Error("filename",
                     Concat("has ", map->width, " x ", map->height,
                            " pixels; the directions of a light are an equal-area map, which is "
                            "square (pbrt-v4 converts others: imgtool makeequiarea)"));
    return;
  }
  GoniometricLight light;
  light.map = map;
  light.directions = std::make_shared<const PiecewiseConstant2D>(
      map->width, map->height, [&](int x, int y) { return GoniometricLight::GrayOf(*map, x, y); });
  const double pixels = static_cast<double>(map->width) * static_cast<double>(map->height);
  const double mean = light.directions->sum() / pixels;
  if (power_w > 0 && mean > 0) scale *= power_w / (4 * kPi64 * mean);
  light.position = FinitePoint(parameters, input.to_world, {0, 0, 0});
  // The map's pole is along y of the light, as in pbrt-v4.
  light.axes = {axes->x, axes->z, axes->y};
  light.intensity = mean > 0 ? ScaledEmission(parameters, color, scale) : Rgb{};
  light.spectrum = std::move(spectrum);
  input.scene.goniometric_lights.push_back(light);
  WarnIfBlack(parameters, light.intensity);
}

}  // namespace lucerna
