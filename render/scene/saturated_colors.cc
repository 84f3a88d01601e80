#include "render/scene/saturated_colors.h"

#include <algorithm>

#include "render/scene/measured_table.h"

namespace lucerna {
namespace {

bool IsSaturated(Rgb color, float share = kSaturatedShare) {
  // Next to black a colour does not matter.
  constexpr float kDark = 0.02F;
  const float least = std::min(color.r, std::min(color.g, color.b));
  const float largest = MaxChannel(color);
  return largest > kDark && least < share * largest;
}

// Of light as of a reflectance, however bright it is.
bool IsSaturatedLight(Rgb strength) {
  const float largest = MaxChannel(strength);
  return largest > 0 && IsSaturated(strength / largest);
}

// Of a metal, at right angles.
Rgb MetalColor(const Material& metal) {
  const auto channel = [](float eta, float k) {
    return ((eta - 1) * (eta - 1) + k * k) / ((eta + 1) * (eta + 1) + k * k);
  };
  return {channel(metal.eta.r, metal.k.r), channel(metal.eta.g, metal.k.g),
          channel(metal.eta.b, metal.k.b)};
}

bool IsMetalByWavelength(const Material& metal) {
  return metal.given.spectra != nullptr && metal.given.spectra->eta.is_given();
}

bool IsSaturated(const Material& material) {
  if (material.Disperses()) return true;
  using Kind = Material::Kind;
  // Not what a texture replaces.
  const bool has_color = material.texture == kNoTexture;
  if (material.is_tinted && (IsSaturated(material.reflection_tint) ||
                             (has_color && IsSaturated(material.transmission_tint)))) {
    return true;
  }
  switch (material.kind) {
    case Kind::kConductor:
    case Kind::kCoatedConductor:
      return has_color &&
             IsSaturated(MetalColor(material),
                         IsMetalByWavelength(material) ? kSaturatedMetal : kSaturatedShare);
    case Kind::kDiffuse:
    case Kind::kCoatedDiffuse:
    case Kind::kSubsurface:
      return has_color && IsSaturated(material.reflectance);
    case Kind::kDiffuseTransmission:
      return (has_color && IsSaturated(material.reflectance)) ||
             (material.second_texture == kNoTexture && IsSaturated(material.transmittance));
    case Kind::kMeasured:
      return IsSaturated(material.measured->Albedo(material.measured->WorkingSpace()));
    default:
      return false;
  }
}

}  // namespace

bool HasSaturatedColors(const Scene& scene) {
  if (std::ranges::any_of(scene.materials, [](const Material& m) { return IsSaturated(m); }))
    return true;
  bool has_light = std::ranges::any_of(
      scene.area_lights, [](const AreaLight& light) { return IsSaturatedLight(light.radiance); });
  ForEachDeltaList(scene, [&](const auto& lights) {
    for (const auto& light : lights)
      has_light = has_light || IsSaturatedLight(light.Strength());
  });
  return has_light || std::ranges::any_of(scene.infinite_lights, [](const InfiniteLight& light) {
           return IsSaturatedLight(light.radiance);
         });
}

}  // namespace lucerna
