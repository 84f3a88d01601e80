#include "render/scene/material.h"

namespace lucerna {
namespace {

// Calls `visit` with what declares the functions of `kind`.
template <typename Visit>
auto WithKind(MaterialNumbers::Kind kind, const Visit& visit) {
  using Kind = MaterialNumbers::Kind;
  switch (kind) {
#define LUCERNA_CASE(Name, name) \
  case Kind::k##Name:            \
    return visit(Name##Kind());
    LUCERNA_MATERIALS(LUCERNA_CASE)
#undef LUCERNA_CASE
  }
  return visit(DiffuseKind());
}

}  // namespace

MaterialProperties PropertiesOf(const MaterialNumbers& material) {
  MaterialProperties properties =
      WithKind(material.kind, [&](auto kind) { return kind.Properties(material); });
  if (material.is_on_thin_shapes) {
    properties.is_thin = true;
    properties.gathers = false;
    // A hair is thinner than what light travels below its surface.
    properties.scatters_below = false;
  }
  if (material.is_in_mix && properties.weighs_photons) {
    // Photons that another material of the mix met are not weighed: hitpoints do all.
    properties.weighs_photons = false;
    properties.is_separable = false;
  }
  return properties;
}

std::vector<MaterialProperties> PropertiesOf(const std::vector<Material>& materials) {
  std::vector<MaterialProperties> properties;
  properties.reserve(materials.size());
  for (const Material& material : materials)
    properties.push_back(PropertiesOf(material));
  return properties;
}

FacetWidths WidthsOf(float roughness_u, float roughness_v, bool is_remapped) {
  const auto width = [&](float roughness) {
    const float held = roughness > 0 ? std::min(roughness, kMaxRoughness) : 0;
    return is_remapped ? std::sqrt(held) : held;
  };
  const float u = width(roughness_u);
  const float v = width(roughness_v);
  if (std::max(u, v) < kSmoothAlpha) return {};
  // A width of zero in one direction only would divide by zero.
  constexpr float kSmallestAlpha = 1e-4F;
  return {std::max(u, kSmallestAlpha), std::max(v, kSmallestAlpha)};
}

std::string_view NameOf(MaterialNumbers::Kind kind) {
  switch (kind) {
#define LUCERNA_CASE(Name, name)       \
  case MaterialNumbers::Kind::k##Name: \
    return name;
    LUCERNA_MATERIALS(LUCERNA_CASE)
#undef LUCERNA_CASE
  }
  return "";
}

Rgb TexturedParameter(const MaterialNumbers& material) {
  return WithKind(material.kind, [&](auto kind) { return kind.Textured(material); });
}

void SetTexturedParameter(MaterialNumbers& material, Rgb value) {
  WithKind(material.kind, [&](auto kind) { kind.SetTextured(material, value); });
}

Rgb TexturedValue(MaterialNumbers::Kind kind, Rgb color) {
  return WithKind(kind, [&](auto of_kind) { return of_kind.TexturedValue(color); });
}

Rgb TexturedValueAtWavelengths(MaterialNumbers::Kind kind, Rgb values) {
  // Of grey, each channel follows from that channel alone.
  return {TexturedValue(kind, Gray(values.r)).r, TexturedValue(kind, Gray(values.g)).g,
          TexturedValue(kind, Gray(values.b)).b};
}

}  // namespace lucerna
