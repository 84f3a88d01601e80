// Material "subsurface".
//
// As in pbrt-v4, the first of these that is given decides what is below: `name`, sigma_a and
// sigma_s, reflectance and mfp, and a default.
#include <algorithm>
#include <string>
#include <utility>

#include "render/base/text.h"
#include "render/formats/pbrt/material_readers.h"
#include "render/formats/pbrt/measured_media.h"

namespace lucerna {
namespace {

// The model is one of light that is reflected back from inside.
constexpr Range kDenserThanAir = {1, 100};

// A constant per channel.
Rgb ConstantOf(std::string_view name, Rgb otherwise, Range range, ParameterList& parameters) {
  if (parameters.IsTexture(name)) {
    parameters.Error(name, "must not be a texture; give a colour or a number");
    return otherwise;
  }
  return parameters.FindOpticalConstant(name, range).value_or(otherwise);
}

void ReadReflectance(float scale, const MaterialInput& input, Material& material) {
  ParameterList& parameters = input.parameters;
  material.scatters_for_reflectance = true;
  if (parameters.IsTexture("reflectance")) {
    material.texture = FindTexture("reflectance", input);
  } else {
    MaterialSpectra given;
    material.reflectance = parameters.FindReflectance("reflectance", &given.reflectance)
                               .value_or(material.reflectance);
    material.given = OwnedSpectra(std::move(given));
  }
  const Rgb free_path = ConstantOf("mfp", Gray(1), kAboveZero, parameters) * scale;
  material.extinction = {1 / free_path.r, 1 / free_path.g, 1 / free_path.b};
}

void ReadCoefficients(float scale, const MaterialInput& input, Material& material) {
  ParameterList& parameters = input.parameters;
  const MeasuredMedium& milk = *FindMeasuredMedium("Wholemilk");
  material.absorption = milk.absorption;
  material.scattering = milk.scattering;
  if (parameters.Has("name")) {
    const std::string name = parameters.String("name", "");
    for (const std::string_view other : {"sigma_a", "sigma_s"}) {
      if (parameters.Has(other)) parameters.Error(other, "must not be given beside name");
    }
    if (const MeasuredMedium* measured = FindMeasuredMedium(name); measured != nullptr) {
      material.absorption = measured->absorption;
      material.scattering = measured->scattering;
    } else {
      parameters.Error(
          "name", Concat("is ", Quoted(name), ", which is not known; ", MeasuredMediaThereAre()));
    }
  } else if (parameters.Has("sigma_a") != parameters.Has("sigma_s")) {
    parameters.Error("sigma_a", "and sigma_s must be given together");
    parameters.Ignore("sigma_s");
  } else {
    material.absorption = ConstantOf("sigma_a", material.absorption, kZeroOrMore, parameters);
    material.scattering = ConstantOf("sigma_s", material.scattering, kZeroOrMore, parameters);
  }
  material.absorption *= scale;
  material.scattering *= scale;
  if (!IsFinite(material.absorption + material.scattering))
    parameters.Error("scale", "makes a coefficient too large");
}

}  // namespace

void ReadSubsurface(const MaterialInput& input, Material& material) {
  ParameterList& parameters = input.parameters;
  const RefractiveIndex index = parameters.FindRefractiveIndex("eta", kDenserThanAir)
                                    .value_or(RefractiveIndex{.at_d = 1.33F, .dispersion = {}});
  material.ior = index.at_d;
  if (!index.dispersion.is_none()) parameters.WarnOfOneIndex("eta");
  const auto scale = static_cast<float>(parameters.Float("scale", 1, kAboveZero));
  const double g = parameters.Float("g", 0, kPhaseCosine);
  // Those that were measured have been reduced by it.
  material.phase_g = parameters.Has("name") ? 0.0F : static_cast<float>(g);
  const bool has_coefficients =
      parameters.Has("name") || parameters.Has("sigma_a") || parameters.Has("sigma_s");
  if (parameters.Has("reflectance") && !has_coefficients) {
    ReadReflectance(scale, input, material);
  } else {
    if (parameters.Has("reflectance")) {
      parameters.Warning("reflectance",
                         "is ignored, as by pbrt-v4, because coefficients are given");
      parameters.Ignore("reflectance");
    }
    parameters.Ignore("mfp");
    ReadCoefficients(scale, input, material);
  }
  ReadRoughness("", Facets::kSurface, input, material);
  const Rgb extinction = material.extinction + material.absorption + material.scattering;
  if (!IsFinite(extinction)) parameters.Error("mfp", "is too short for single precision");
}

}  // namespace lucerna
