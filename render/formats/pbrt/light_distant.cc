// LightSource "distant".
#include <utility>

#include "render/formats/pbrt/light_readers.h"

namespace lucerna {

void ReadDistantLight(const LightInput& input) {
  ParameterList& parameters = input.parameters;
  GivenSpectrum spectrum;
  const Rgb color = parameters.FindEmission("L", &spectrum).value_or(Gray(1));
  double scale = parameters.Float("scale", 1, kZeroOrMore);
  const double illuminance = parameters.Float("illuminance", -1);
  if (illuminance > 0) scale *= illuminance;
  const Vec3 from = parameters.Point("from", {0, 0, 0});
  const Vec3 to = parameters.Point("to", {0, 0, 1});
  DistantLight light;
  light.direction = Direction(parameters, input.to_world, from, to);
  light.irradiance = ScaledEmission(parameters, color, scale);
  light.spectrum = std::move(spectrum);
  input.scene.distant_lights.push_back(light);
  WarnIfBlack(parameters, light.irradiance);
}

}  // namespace lucerna
