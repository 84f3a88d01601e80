#include "render/formats/pbrt/materials.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "render/base/text.h"
#include "render/formats/pbrt/kinds.h"
#include "render/formats/pbrt/material_readers.h"

namespace lucerna {
namespace {

// Below this width pbrt-v4 renders a surface as perfectly smooth.
constexpr double kSmoothAlpha = 1e-3;
constexpr Range kRoughness = {0, 1e3};

using MaterialReader = void (*)(ParameterList&, const TextureNames&, Material&);

#define LUCERNA_READER(Name, name)                                                      \
  {name, [](ParameterList& parameters, const TextureNames& names, Material& material) { \
     material.kind = Material::Kind::k##Name;                                           \
     Read##Name(parameters, names, material);                                           \
   }},
constexpr Kind<MaterialReader> kKinds[] = {LUCERNA_MATERIALS(LUCERNA_READER)};
#undef LUCERNA_READER

// An interface has three names.
std::string_view InOneWord(std::string_view type) {
  return type.empty() || type == "none" ? "interface" : type;
}

// Materials of pbrt that are refused by name, and why.
std::string_view WhyRefused(std::string_view type) {
  if (type == "subsurface") {
    return "is not supported: light does not travel below surfaces here";
  }
  if (type == "measured") return "is not supported: measured BSDFs (.bsdf files) are not read";
  if (type == "fourier") {
    return "is not supported, nor by pbrt-v4: Fourier BSDFs (.bsdf files) are not read";
  }
  if (type == "hair") return "is not supported: there is no scattering by hair";
  return "is not supported";
}

}  // namespace

void ReadRoughness(std::string_view prefix, ParameterList& parameters, Material& material) {
  const double roughness = parameters.Float(Concat(prefix, "roughness"), 0, kRoughness);
  const double u = parameters.Float(Concat(prefix, "uroughness"), roughness, kRoughness);
  const double v = parameters.Float(Concat(prefix, "vroughness"), roughness, kRoughness);
  const bool remap = parameters.Bool("remaproughness", true);
  const double alpha_u = remap ? std::sqrt(u) : u;
  const double alpha_v = remap ? std::sqrt(v) : v;
  if (std::max(alpha_u, alpha_v) < kSmoothAlpha) return;
  // A width of zero in one direction only would divide by zero.
  constexpr double kSmallestAlpha = 1e-4;
  material.alpha_u = static_cast<float>(std::max(alpha_u, kSmallestAlpha));
  material.alpha_v = static_cast<float>(std::max(alpha_v, kSmallestAlpha));
}

void ReadCoat(std::string_view eta, ParameterList& parameters, Material& material) {
  material.ior = static_cast<float>(parameters.FindRefractiveIndex(eta, kIndexRange).value_or(1.5));
  material.thickness = static_cast<float>(parameters.Float("thickness", 0.01, {0, 1e6}));
  const std::int64_t depth = parameters.FindInteger("maxdepth", {1, 1'000'000}).value_or(10);
  // Every second event is at the base.
  material.base_hits = static_cast<std::int32_t>(depth / 2 + depth % 2);
  const bool scatters = parameters.IsTexture("albedo") ||
                        !IsBlack(parameters.FindReflectance("albedo").value_or(Rgb{}));
  if (scatters) {
    parameters.Error("albedo", "above 0 is not supported: the layer under a coat only absorbs");
  }
  // Of what scatters in the layer, and of a random walk in it: neither is there.
  parameters.Ignore("g");
  parameters.Ignore("nsamples");
}

std::int32_t FindTexture(std::string_view name, ParameterList& parameters,
                         const TextureNames& names) {
  if (!parameters.IsTexture(name)) return kNoTexture;
  const std::optional<std::string> texture = parameters.FindTexture(name);
  if (!texture.has_value()) return kNoTexture;
  const auto named = names.find(*texture);
  if (named == names.end()) {
    parameters.Error(name, Concat("refers to the spectrum texture ", Quoted(*texture),
                                  ", which is not defined before it"));
    return kNoTexture;
  }
  if (named->second.number == kNoTexture) parameters.Error(name, named->second.why_not);
  return named->second.number;
}

bool IsPbrtV3Material(std::string_view type) {
  constexpr std::array<std::string_view, 10> kTypes = {
      "matte", "plastic",     "uber",      "glass",  "mirror",
      "metal", "translucent", "substrate", "disney", "kdsubsurface"};
  return std::find(kTypes.begin(), kTypes.end(), type) != kTypes.end();
}

bool IsSupportedMaterial(std::string_view type) {
  return FindReader<MaterialReader>(kKinds, InOneWord(type)) != nullptr;
}

Material ReadMaterial(std::string_view type, ParameterList& parameters, const TextureNames& names) {
  Material material;
  const MaterialReader read = FindReader<MaterialReader>(kKinds, InOneWord(type));
  if (read == nullptr) {
    parameters.Error(Concat(WhyRefused(type), "; ", SupportedKinds<MaterialReader>(kKinds)));
    return material;
  }
  read(parameters, names, material);
  if (parameters.Has("displacement") || parameters.Has("normalmap")) {
    parameters.Warning(parameters.Has("normalmap") ? "normalmap" : "displacement",
                       "is ignored: bumps are not rendered");
    parameters.Ignore("displacement");
    parameters.Ignore("normalmap");
  }
  parameters.WarnOfUnread();
  return material;
}

}  // namespace lucerna
