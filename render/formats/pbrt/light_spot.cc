// LightSource "spot".
#include <cmath>
#include <utility>

#include "render/formats/pbrt/light_readers.h"
#include "render/math/warp.h"

namespace lucerna {

void ReadSpotLight(const LightInput& input) {
  ParameterList& parameters = input.parameters;
  GivenSpectrum spectrum;
  const Rgb color = parameters.FindEmission("I", &spectrum).value_or(Gray(1));
  double scale = parameters.Float("scale", 1, kZeroOrMore);
  const double power_w = parameters.Float("power", -1);
  const Vec3 from = parameters.Point("from", {0, 0, 0});
  const Vec3 to = parameters.Point("to", {0, 0, 1});
  const double width_deg = parameters.Float("coneangle", 30, {0, 180, false});
  const double falloff_deg = parameters.Float("conedeltaangle", 5, {0, 180});
  if (falloff_deg > width_deg) parameters.Error("conedeltaangle", "is wider than coneangle");
  SpotLight light;
  const double cos_width = std::cos(width_deg * kPi64 / 180);
  const double cos_start = std::cos((width_deg - falloff_deg) * kPi64 / 180);
  if (power_w > 0) {
    // The integral of the smoothstep over its part of the cone is half of the part.
    scale *= power_w / (2 * kPi64 * ((1 - cos_start) + (cos_start - cos_width) / 2));
  }
  light.cos_total_width = static_cast<float>(cos_width);
  light.cos_falloff_start = static_cast<float>(cos_start);
  light.position = FinitePoint(parameters, input.to_world, from);
  light.direction = Direction(parameters, input.to_world, from, to);
  light.intensity = ScaledEmission(parameters, color, scale);
  light.spectrum = std::move(spectrum);
  input.scene.spot_lights.push_back(light);
  WarnIfBlack(parameters, light.intensity);
}

}  // namespace lucerna
