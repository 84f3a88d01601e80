// Material "conductor".
#include "render/formats/pbrt/material_readers.h"
#include "render/formats/pbrt/optical_constants.h"

namespace lucerna {

void ReadConductor(ParameterList& parameters, const TextureNames& names, Material& material) {
  const bool is_textured = parameters.IsTexture("reflectance");
  if (is_textured) material.texture = FindTexture("reflectance", parameters, names);
  const std::optional<Rgb> reflectance =
      is_textured ? Gray(0.5F) : parameters.FindReflectance("reflectance");
  if (reflectance.has_value()) {
    if (parameters.Has("eta") || parameters.Has("k")) {
      parameters.Error("reflectance", "and eta or k exclude each other; give one or the other");
    }
    parameters.Ignore("eta");
    parameters.Ignore("k");
    material.eta = Gray(1);
    material.k = {AbsorptionFor(reflectance->r), AbsorptionFor(reflectance->g),
                  AbsorptionFor(reflectance->b)};
  } else {
    const MetalConstants copper = MetalNamed("Cu").value();
    material.eta = parameters.FindOpticalConstant("eta", {0, 100}).value_or(copper.eta);
    material.k = parameters.FindOpticalConstant("k", {0, 1000}).value_or(copper.k);
  }
  ReadRoughness(parameters, material);
}

}  // namespace lucerna
