// Material "conductor", and the metal of "coatedconductor".
#include <utility>

#include "render/base/text.h"
#include "render/formats/pbrt/material_readers.h"
#include "render/formats/pbrt/metal_fit.h"
#include "render/formats/pbrt/optical_constants.h"

namespace lucerna {

void ReadMetal(const MetalParameters& called, const MaterialInput& input, Material& material) {
  ParameterList& parameters = input.parameters;
  const bool is_textured = parameters.IsTexture("reflectance");
  if (is_textured) material.texture = FindTexture("reflectance", input);
  MaterialSpectra given;
  const std::optional<Rgb> reflectance =
      is_textured ? Gray(0.5F) : parameters.FindReflectance("reflectance", &given.reflectance);
  if (reflectance.has_value()) {
    if (parameters.Has(called.eta) || parameters.Has(called.k)) {
      parameters.Error("reflectance", Concat("and ", called.eta, " or ", called.k,
                                             " exclude each other; give one or the other"));
    }
    parameters.Ignore(called.eta);
    parameters.Ignore(called.k);
    material.eta = Gray(1);
    material.k = {AbsorptionFor(reflectance->r), AbsorptionFor(reflectance->g),
                  AbsorptionFor(reflectance->b)};
  } else {
    const MetalConstants copper = MetalNamed("Cu").value();
    given.eta = MetalSpectrumNamed("metal-Cu-eta");
    given.k = MetalSpectrumNamed("metal-Cu-k");
    material.eta =
        parameters.FindOpticalConstant(called.eta, {0, 100}, &given.eta).value_or(copper.eta);
    material.k = parameters.FindOpticalConstant(called.k, {0, 1000}, &given.k).value_or(copper.k);
    if (given.eta.is_given() && given.k.is_given()) {
      const MetalConstants fitted =
          FitMetal(*given.eta.curve, *given.k.curve, {material.eta, material.k});
      material.eta = fitted.eta;
      material.k = fitted.k;
    }
  }
  material.given = OwnedSpectra(std::move(given));
}

void ReadConductor(const MaterialInput& input, Material& material) {
  ReadMetal({"eta", "k"}, input, material);
  ReadRoughness("", Facets::kSurface, input, material);
}

}  // namespace lucerna
