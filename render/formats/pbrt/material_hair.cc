// Material "hair".
//
// As in pbrt-v4, the first of these that is given decides on the colour: sigma_a, reflectance (or
// color, its older name), the concentrations of the two melanins, and a default.
#include <array>
#include <numbers>

#include "render/base/text.h"
#include "render/formats/pbrt/material_readers.h"

namespace lucerna {
namespace {

// Absorption per radius at concentration 1, for red, green and blue light: d'Eon et al. 2011, "An
// Energy-Conserving Hair Reflectance Model".
constexpr Rgb kEumelanin = {0.419F, 0.697F, 1.37F};
constexpr Rgb kPheomelanin = {0.187F, 0.4F, 1.05F};
// Of brown hair.
constexpr double kDefaultEumelanin = 1.3;

// As in pbrt-v4, nothing is smoother.
constexpr double kLeastRoughness = 0.01;
// The fits of the model end here.
constexpr double kMostRoughness = 1;

// A number, or a texture of a single one.
double NumberOf(std::string_view name, double otherwise, Range range, const MaterialInput& input) {
  ParameterList& parameters = input.parameters;
  if (!parameters.IsTexture(name)) return parameters.Float(name, otherwise, range);
  const NamedTexture* texture = FindNumbers(name, parameters, input.from.declared.numbers);
  if (texture == nullptr) return otherwise;
  if (texture->largest > texture->least) {
    parameters.Error(name, "must not be a texture that varies; give a number");
    return otherwise;
  }
  return std::clamp(static_cast<double>(texture->least), range.low, range.high);
}

void ReadColor(const MaterialInput& input, Material& material) {
  ParameterList& parameters = input.parameters;
  // Those that a parameter before them has decided for.
  const auto ignore = [&](std::string_view name, std::string_view because) {
    if (parameters.Has(name)) {
      parameters.Warning(name, Concat("is ignored, as by pbrt-v4, because ", because, " is given"));
    }
    parameters.Ignore(name);
  };
  const std::string_view reflectance = parameters.Has("reflectance") ? "reflectance" : "color";
  if (parameters.Has("sigma_a")) {
    for (const std::string_view name : {"reflectance", "color", "eumelanin", "pheomelanin"})
      ignore(name, "sigma_a");
    if (parameters.IsTexture("sigma_a")) {
      material.texture = FindTexture("sigma_a", input);
    } else {
      MaterialSpectra given;
      material.absorption =
          parameters.FindOpticalConstant("sigma_a", kZeroOrMore, &given.absorption).value_or(Rgb());
      material.given = OwnedSpectra(std::move(given));
    }
    return;
  }
  if (parameters.Has(reflectance)) {
    for (const std::string_view name : {"color", "eumelanin", "pheomelanin"}) {
      if (name != reflectance) ignore(name, reflectance);
    }
    material.absorbs_for_reflectance = true;
    if (parameters.IsTexture(reflectance)) {
      material.texture = FindTexture(reflectance, input);
    } else {
      MaterialSpectra given;
      material.reflectance = parameters.FindReflectance(reflectance, &given.reflectance)
                                 .value_or(material.reflectance);
      material.given = OwnedSpectra(std::move(given));
    }
    return;
  }
  const bool has_melanin = parameters.Has("eumelanin") || parameters.Has("pheomelanin");
  const double eumelanin =
      NumberOf("eumelanin", has_melanin ? 0 : kDefaultEumelanin, kZeroOrMore, input);
  const double pheomelanin = NumberOf("pheomelanin", 0, kZeroOrMore, input);
  material.absorption =
      kEumelanin * static_cast<float>(eumelanin) + kPheomelanin * static_cast<float>(pheomelanin);
}

}  // namespace

void ReadHair(const MaterialInput& input, Material& material) {
  const auto roughness = [&](std::string_view name) {
    const double given = NumberOf(name, 0.3, kZeroOrMore, input);
    if (given > kMostRoughness) {
      input.parameters.Warning(
          name, Concat("is ", given, " and is held at ", kMostRoughness, ", as by pbrt-v4"));
    }
    return static_cast<float>(std::clamp(given, kLeastRoughness, kMostRoughness));
  };
  material.beta_m = roughness("beta_m");
  material.beta_n = roughness("beta_n");
  material.ior = static_cast<float>(NumberOf("eta", 1.55, {1, kIndexRange.high}, input));
  const double alpha_deg = NumberOf("alpha", 2, {-90, 90}, input);
  material.scale_tilt = static_cast<float>(alpha_deg * std::numbers::pi / 180);
  ReadColor(input, material);
  if (!IsFinite(material.absorption))
    input.parameters.Error("absorbs more than single precision holds");
}

}  // namespace lucerna
