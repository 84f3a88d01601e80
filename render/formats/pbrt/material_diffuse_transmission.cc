// Material "diffusetransmission".
#include <algorithm>
#include <memory>
#include <utility>

#include "render/formats/pbrt/material_readers.h"
#include "render/formats/wavelength_color.h"

namespace lucerna {
namespace {

float Held(float value) {
  return std::min(value, 1.0F);
}

// Each of the two is held at 1, as in pbrt-v4; their sum may be above.
void ScaleAndHold(float scale, Rgb& color, GivenSpectrum& spectrum) {
  if (!spectrum.is_given()) {
    color = {Held(color.r * scale), Held(color.g * scale), Held(color.b * scale)};
    return;
  }
  WavelengthCurve curve = *spectrum.curve;
  for (double& value : curve.value)
    value = std::min(value * static_cast<double>(scale), 1.0);
  color = ReflectanceColor(curve);
  spectrum.curve = std::make_shared<const WavelengthCurve>(std::move(curve));
}

}  // namespace

void ReadDiffuseTransmission(const MaterialInput& input, Material& material) {
  ParameterList& parameters = input.parameters;
  const float scale = static_cast<float>(parameters.Float("scale", 1, kZeroOrMore));
  material.texture_scale = scale;
  MaterialSpectra given;
  const auto read = [&](std::string_view name, Rgb& color, GivenSpectrum& spectrum,
                        std::int32_t& texture) {
    if (parameters.IsTexture(name)) {
      texture = FindTexture(name, input);
    } else {
      color = parameters.FindReflectance(name, &spectrum).value_or(Gray(0.25F));
      ScaleAndHold(scale, color, spectrum);
    }
  };
  read("reflectance", material.reflectance, given.reflectance, material.texture);
  read("transmittance", material.transmittance, given.transmittance, material.second_texture);
  material.given = OwnedSpectra(std::move(given));
  if (!material.HasTexture() &&
      MaxChannel(material.reflectance + material.transmittance) > 1 + 1e-5F) {
    parameters.Warning("",
                       "scatters more light than it gets: reflectance and transmittance "
                       "together are above 1");
  }
}

}  // namespace lucerna
