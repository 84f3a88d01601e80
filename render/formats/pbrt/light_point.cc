// LightSource "point".
#include <utility>

#include "render/formats/pbrt/light_readers.h"
#include "render/math/warp.h"

namespace lucerna {

void ReadPointLight(const LightInput& input) {
  ParameterList& parameters = input.parameters;
  GivenSpectrum spectrum;
  const Rgb color = parameters.FindEmission("I", &spectrum).value_or(Gray(1));
  double scale = parameters.Float("scale", 1, kZeroOrMore);
  const double power_w = parameters.Float("power", -1);
  const Vec3 from = parameters.Point("from", {0, 0, 0});
  if (power_w > 0) scale *= power_w / (4 * kPi64);
  PointLight light;
  light.position = FinitePoint(parameters, input.to_world, from);
  light.intensity = ScaledEmission(parameters, color, scale);
  light.spectrum = std::move(spectrum);
  input.scene.point_lights.push_back(light);
  WarnIfBlack(parameters, light.intensity);
}

}  // namespace lucerna
