// Material "diffusetransmission".
#include <utility>

#include "render/formats/pbrt/material_readers.h"

namespace lucerna {

void ReadDiffuseTransmission(const MaterialInput& input, Material& material) {
  ParameterList& parameters = input.parameters;
  const float scale = static_cast<float>(parameters.Float("scale", 1, {0, 1}));
  material.texture_scale = scale;
  MaterialSpectra given;
  const auto read = [&](std::string_view name, Rgb& color, GivenSpectrum& spectrum,
                        std::int32_t& texture) {
    if (parameters.IsTexture(name)) {
      texture = FindTexture(name, input);
    } else {
      color = parameters.FindReflectance(name, &spectrum).value_or(Gray(0.25F)) * scale;
      spectrum.factor = scale;
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
