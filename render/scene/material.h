// How a surface scatters, as numbers, and the properties that follow from them.
//
// A kind of material is one row of LUCERNA_MATERIALS, with its numbers below where there are none
// for them yet, and three files: its properties in render/scene/material_NAME.cc, how pbrt files
// give it in render/formats/pbrt/material_NAME.cc, and its BSDF in render/transport/bsdf_NAME.cc
// (docs/adding.md). Functions that differ between kinds are declared from the rows, here, in
// formats/pbrt/material_readers.h and in transport/bsdf_kinds.h; the rest of the program uses
// MaterialProperties.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "render/math/rgb.h"
#include "render/scene/texture.h"

// The kinds of material, in the order of Material::Kind.
// ROW(Name, name): Material::Kind::kName, and its name in messages and in pbrt files.
#define LUCERNA_MATERIALS(ROW)  \
  ROW(Diffuse, "diffuse")       \
  ROW(Conductor, "conductor")   \
  ROW(Dielectric, "dielectric") \
  ROW(Interface, "interface")

namespace lucerna {

// What all kinds of material are made of. Each kind uses some of the members.
struct MaterialNumbers {
#define LUCERNA_KIND(Name, name) k##Name,
  enum class Kind : std::uint8_t { LUCERNA_MATERIALS(LUCERNA_KIND) };
#undef LUCERNA_KIND

  Kind kind = Kind::kDiffuse;
  Rgb reflectance = {0.5F, 0.5F, 0.5F};  // diffuse
  Rgb eta = {1, 1, 1};                   // conductor: index of refraction per channel
  Rgb k = {0, 0, 0};                     // conductor: absorption per channel
  float ior = 1.5F;                      // dielectric: inside over outside
  float alpha_u = 0;                     // conductor, dielectric: GGX widths; 0 and 0 = smooth
  float alpha_v = 0;
  // In place of the reflectance of a diffuse surface, and of a conductor's eta and k.
  std::int32_t texture = kNoTexture;
  // On shapes much thinner than the discs of hitpoints: nothing is gathered there.
  bool is_on_thin_shapes = false;

  bool operator==(const MaterialNumbers&) const = default;

  // Calls `visit` for each colour that a path is multiplied by. Indices of refraction are none.
  template <typename Visit>
  void ForEachColor(const Visit& visit) {
    visit(reflectance);
  }
};

struct Material : MaterialNumbers {
  std::string name;  // for messages and the plan

  bool operator==(const Material&) const = default;
};

// What the renderer uses of a material besides its BSDF.
struct MaterialProperties {
  // The BSDF is reflectance / pi on the side of `wo` and 0 on the other.
  bool is_diffuse = false;
  bool is_smooth = false;  // all scattering goes into single directions
  bool is_black = false;   // nothing is scattered
  // Light passes unchanged: the surface only separates media. Paths never scatter there.
  bool is_interface = false;
  // Some light goes to the other side: the surface casts no shadow and encloses nothing.
  bool transmits = false;
  // Where eye paths stop and photons are kept.
  bool gathers = false;
  // Of a thin shape: eye paths go on, and no photons are kept.
  bool is_thin = false;
  // The GGX width of the lobes, the larger one; +infinity: light is scattered so broadly that it
  // keeps no detail over angle.
  float lobe_width = HUGE_VALF;
  float ior = 1;  // inside over outside, of light that is refracted

  // Where direct light may be sampled: light is scattered, and not into single directions.
  [[nodiscard]] bool scatters_broadly() const { return !is_smooth && !is_black && !is_interface; }
  // Where eye paths go on although a range of directions is scattered: what eye paths do not find
  // of the light there, caustic photons bring (transport/caustic_weight.h).
  [[nodiscard]] bool gathers_caustics() const { return scatters_broadly() && !gathers && !is_thin; }
  [[nodiscard]] bool has_narrow_lobes() const { return lobe_width < HUGE_VALF; }
};

// Rougher than this, photons are gathered; smoother, eye paths go on. A narrow lobe accepts few of
// the photons around it, while a direction drawn from it is a good guess.
inline constexpr float kGatherAlpha = 0.2F;
// The same for dielectrics: refraction bends less than reflection, so their lobes are narrower, and
// what is seen through frosted glass has passed two of them.
inline constexpr float kGatherAlphaDielectric = 0.5F;

// A conductor given by its reflectance at right angles has eta = 1 and this k, capped as in
// pbrt-v4.
[[nodiscard]] inline float AbsorptionFor(float reflectance) {
  const float capped = std::min(reflectance, 0.9999F);
  return 2 * std::sqrt(capped) / std::sqrt(1 - capped);
}

// What differs between kinds, each in a file of its own, material_NAME.cc:
// Properties     of a material, which a texture may change at single points.
// Textured       The parameter in whose place a texture is looked up; meaningless without textures.
// SetTextured    Sets that parameter.
// TexturedValue  Its value where the texture has `color` (linear Rec. 709), for a scene in the
//                working space.
#define LUCERNA_DECLARE(Name, name)                                        \
  struct Name##Kind {                                                      \
    static MaterialProperties Properties(const MaterialNumbers& material); \
    static Rgb Textured(const MaterialNumbers& material);                  \
    static void SetTextured(MaterialNumbers& material, Rgb value);         \
    static Rgb TexturedValue(Rgb color);                                   \
  };
LUCERNA_MATERIALS(LUCERNA_DECLARE)
#undef LUCERNA_DECLARE

[[nodiscard]] MaterialProperties PropertiesOf(const MaterialNumbers& material);
// [materials], computed once for loops over paths. A texture may change them at single points.
[[nodiscard]] std::vector<MaterialProperties> PropertiesOf(const std::vector<Material>& materials);
// "conductor".
[[nodiscard]] std::string_view NameOf(MaterialNumbers::Kind kind);

// See above.
[[nodiscard]] Rgb TexturedParameter(const MaterialNumbers& material);
void SetTexturedParameter(MaterialNumbers& material, Rgb value);
[[nodiscard]] Rgb TexturedValue(MaterialNumbers::Kind kind, Rgb color);

// Single properties, where speed does not matter.
[[nodiscard]] inline bool IsDiffuse(const Material& material) {
  return PropertiesOf(material).is_diffuse;
}
[[nodiscard]] inline bool IsSmooth(const Material& material) {
  return PropertiesOf(material).is_smooth;
}
[[nodiscard]] inline bool ScattersNothing(const Material& material) {
  return PropertiesOf(material).is_black;
}
[[nodiscard]] inline bool IsInterface(const Material& material) {
  return PropertiesOf(material).is_interface;
}
[[nodiscard]] inline bool Transmits(const Material& material) {
  return PropertiesOf(material).transmits;
}
[[nodiscard]] inline bool Gathers(const Material& material) {
  return PropertiesOf(material).gathers;
}
[[nodiscard]] inline bool HasNarrowLobes(const Material& material) {
  return PropertiesOf(material).has_narrow_lobes();
}
[[nodiscard]] inline bool ScattersBroadly(const Material& material) {
  return PropertiesOf(material).scatters_broadly();
}
[[nodiscard]] inline bool GathersCaustics(const Material& material) {
  return PropertiesOf(material).gathers_caustics();
}

}  // namespace lucerna
