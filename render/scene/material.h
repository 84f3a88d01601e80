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
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "render/math/dispersion.h"
#include "render/math/rgb.h"
#include "render/scene/given_spectrum.h"
#include "render/scene/texture.h"

// The kinds of material, in the order of Material::Kind.
// ROW(Name, name): Material::Kind::kName, and its name in messages and in pbrt files.
#define LUCERNA_MATERIALS(ROW)                    \
  ROW(Diffuse, "diffuse")                         \
  ROW(Conductor, "conductor")                     \
  ROW(Dielectric, "dielectric")                   \
  ROW(Interface, "interface")                     \
  ROW(CoatedDiffuse, "coateddiffuse")             \
  ROW(ThinDielectric, "thindielectric")           \
  ROW(DiffuseTransmission, "diffusetransmission") \
  ROW(CoatedConductor, "coatedconductor")         \
  ROW(Mix, "mix")                                 \
  ROW(Hair, "hair")                               \
  ROW(Measured, "measured")                       \
  ROW(Subsurface, "subsurface")

namespace lucerna {

// Of a material that scatters as the sum of two parts, all or one of them: eye paths choose one at
// random and meet a surface of that part alone (docs/decisions/materials-in-parts.md).
enum class Parts : std::uint8_t {
  kAll,
  kFirst,  // what a coat reflects; the reflection of a sheet
  kSecond  // what the base under a coat scatters; the transmission of a sheet; what goes below
};

struct CoatTable;        // scene/coat_table.h
struct CoatFamily;       // the same
struct SubsurfaceTable;  // scene/subsurface_table.h
class MeasuredTable;     // scene/measured_table.h
struct MaterialProperties;

// What all kinds of material are made of. Each kind uses some of the members.
struct MaterialNumbers {
#define LUCERNA_KIND(Name, name) k##Name,
  enum class Kind : std::uint8_t { LUCERNA_MATERIALS(LUCERNA_KIND) };
#undef LUCERNA_KIND

  Kind kind = Kind::kDiffuse;
  Parts parts = Parts::kAll;  // of a material that has two
  // Diffuse, coated diffuse, diffuse transmission, hair; subsurface: of light that has entered.
  Rgb reflectance = {0.5F, 0.5F, 0.5F};
  Rgb transmittance;               // diffuse transmission
  Rgb eta = {1, 1, 1};             // conductor, under a coat too: index of refraction
  Rgb k = {0, 0, 0};               // the same: absorption
  bool is_at_wavelengths = false;  // eta and k are those of a pass's wavelengths
  bool is_metal_in_coat = false;   // eta and k are against the coat, else against vacuum
  float ior = 1.5F;                // dielectric, coat, hair, subsurface: inside over outside
  Dispersion dispersion;           // dielectric; `ior` is that at the d line
  float alpha_u = 0;               // of metals, dielectrics and coats: GGX widths; 0 and 0:
  float alpha_v = 0;               // smooth
  float base_alpha_u = 0;          // of the metal under a coat: GGX widths; 0 and 0: smooth
  float base_alpha_v = 0;
  float thickness = 0;  // of a coat [mean free paths], at right angles
  Rgb coat_albedo;      // of one scattering in it; black: it only absorbs
  // Of a coat without thickness over a diffuse base: all light that the coat's surface does not
  // reflect reaches the base, and all light that the base reflects leaves (docs/decisions/gltf.md).
  bool coat_passes_rest = false;
  // Of metals and dielectrics: what files multiply reflected light by, and light that goes through.
  Rgb reflection_tint = {1, 1, 1}, transmission_tint = {1, 1, 1};
  bool is_tinted = false;      // one of them is not white
  std::int32_t base_hits = 5;  // how often light in a coat meets the base, at most
  // Of a coated material, once it is prepared (transport/coat.h); owned by Material. `coat_above`
  // and its share are those of a coat between two tables.
  const CoatTable* coat = nullptr;
  const CoatTable* coat_above = nullptr;
  float coat_above_share = 0;
  const CoatFamily* coats = nullptr;  // of a coated one with HasCoatTexture()
  // Of hair: roughness along the fibre and around it, in [0.01, 1], and the angle by which its
  // scales are tilted [rad].
  float beta_m = 0.3F, beta_n = 0.3F, scale_tilt = 0;
  Rgb absorption;  // of hair, per radius of the fibre; subsurface: [1/scene unit]
  bool absorbs_for_reflectance = false;  // the absorption follows from `reflectance`
  float phase_g = 0;  // the mean cosine of scattering in a coat, and below a surface
  // Subsurface [1/scene unit]: `extinction` and `reflectance` are given, or follow from absorption
  // and scattering (transport/subsurface.h). The table is owned by Material.
  Rgb scattering, extinction;
  bool scatters_for_reflectance = false;
  const SubsurfaceTable* below = nullptr;
  // Of a measured surface; owned by Material. Which of its planes are the three colours.
  const MeasuredTable* measured = nullptr;
  std::array<float, 3> measured_planes = {};
  bool is_measured_with_direction = false;  // it matters how it is turned around the normal
  // In place of `reflectance`, of a conductor's eta and k, and of `absorption`.
  std::int32_t texture = kNoTexture;
  std::int32_t second_texture = kNoTexture;  // in place of `transmittance`
  float texture_scale = 1;                   // of both textures' colours: diffuse transmission
  // Of the roughness from which alpha_u, alpha_v, base_alpha_u and base_alpha_v follow. Where there
  // is one, the number in the material is the largest that it gives anywhere.
  std::array<std::int32_t, 4> roughness_textures = {kNoTexture, kNoTexture, kNoTexture, kNoTexture};
  bool remaps_roughness = true;  // a width is the root of the roughness
  // Of the thickness of a coat; `thickness` is then the largest that it gives anywhere.
  std::int32_t thickness_texture = kNoTexture;
  // With textures of roughness: the surface, or the metal under a coat, is smooth at some places.
  bool may_be_smooth = false, base_may_be_smooth = false;
  // What turns shading normals: heights [scene units], or a picture of normals (as a texture).
  std::int32_t displacement = kNoTexture;
  std::int32_t normal_map = kNoTexture;
  Vec2 slope_step;         // of `displacement` (SlopeStep)
  float normal_scale = 1;  // what the slopes of `normal_map` are multiplied by
  // Green of `normal_map` points where v grows; else at right angles to u, on the left of it.
  bool normal_map_follows_v = false;
  // Of a mix: indices of the two materials, and the share of the second.
  std::array<std::int32_t, 2> mixed = {-1, -1};
  std::int32_t mix_depth = 0;  // more than that of any mix that it is made of
  float amount = 0.5F;
  std::int32_t amount_texture = kNoTexture;  // in place of `amount`
  // Of a mix: what holds for it as a whole (JoinMixes); owned by Material.
  const MaterialProperties* mixed_properties = nullptr;
  // One of the materials of a mix: photons that others of them met count here too.
  bool is_in_mix = false;
  // On shapes much thinner than the discs of hitpoints: nothing is gathered there.
  bool is_on_thin_shapes = false;

  bool operator==(const MaterialNumbers&) const = default;

  // Calls `visit` for each colour that a path is multiplied by. Indices of refraction are none.
  template <typename Visit>
  void ForEachColor(const Visit& visit) {
    visit(reflectance);
    visit(transmittance);
    if (is_tinted) {
      visit(reflection_tint);
      visit(transmission_tint);
    }
    // Over a metal it is multiplied by what follows from indices, in their space.
    if (kind != Kind::kCoatedConductor) visit(coat_albedo);
  }
  [[nodiscard]] bool HasTexture() const {
    const auto& rough = roughness_textures;
    // kNoTexture has all bits.
    return (texture & second_texture & rough[0] & rough[1] & rough[2] & rough[3] &
            thickness_texture & displacement & normal_map & amount_texture) != kNoTexture;
  }
  [[nodiscard]] bool HasRoughnessTexture() const {
    const auto& rough = roughness_textures;
    return (rough[0] & rough[1] & rough[2] & rough[3]) != kNoTexture;
  }
  // Whether a coat, or the metal under it, is another one at each place.
  [[nodiscard]] bool HasCoatTexture() const {
    return HasRoughnessTexture() || thickness_texture != kNoTexture;
  }
  // Whether it turns shading normals.
  [[nodiscard]] bool HasBumps() const {
    return (displacement & normal_map) != kNoTexture;
  }
  // Whether it matters how it is turned around the normal.
  [[nodiscard]] bool IsAnisotropic() const {
    return alpha_u != alpha_v || base_alpha_u != base_alpha_v ||
           roughness_textures[0] != roughness_textures[1] ||
           roughness_textures[2] != roughness_textures[3] || kind == Kind::kHair ||
           is_measured_with_direction;
  }
  // Of a coated material: whether the layer under the coat's surface scatters light.
  [[nodiscard]] bool HasHaze() const {
    return coat_albedo.r > 0 || coat_albedo.g > 0 || coat_albedo.b > 0;
  }
  // Whether what its second part scatters leaves at another point.
  [[nodiscard]] bool ScattersBelow() const {
    return kind == Kind::kSubsurface && !is_on_thin_shapes;
  }
  // Whether it sends each wavelength into another direction.
  [[nodiscard]] bool Disperses() const {
    return kind == Kind::kDielectric && !dispersion.is_none() && alpha_u == 0 && alpha_v == 0 &&
           !HasRoughnessTexture();
  }
  // Whether it is not known before a place on a surface, and a path's wavelength, is.
  [[nodiscard]] bool DependsOnPlace() const {
    return HasTexture() || kind == Kind::kMix || IsAnisotropic() || Disperses();
  }
};

struct Material : MaterialNumbers {
  std::string name;  // for messages and the plan
  std::shared_ptr<const CoatTable> owned_coat;
  std::shared_ptr<const CoatFamily> owned_coats;
  std::shared_ptr<const MeasuredTable> owned_measured;
  std::shared_ptr<const SubsurfaceTable> owned_below;
  std::shared_ptr<const MaterialProperties> owned_mixed_properties;
  OwnedSpectra given;  // colours that the file gives by wavelength

  bool operator==(const Material&) const = default;
};

// What the renderer uses of a material besides its BSDF.
struct MaterialProperties {
  // The BSDF is reflectance / pi on the side of `wo` and 0 on the other.
  bool is_diffuse = false;
  bool is_smooth = false;  // all scattering goes into single directions
  // The BSDF is a sum of two parts, of which eye paths choose one.
  bool has_parts = false;
  bool is_mix = false;  // one of several materials at each place, for each ray
  // Some scattering goes into single directions: that of the first part, or all.
  bool scatters_smoothly = false;
  // The BSDF is a factor of the direction to the eye (EyeFactor) times one of the direction to the
  // light (PhotonFactor), on one side for each: hitpoints of it travel without a BSDF.
  bool is_separable = false;
  bool weighs_photons = false;  // PhotonFactor is not 1 everywhere
  bool is_black = false;        // nothing is scattered
  // Light passes unchanged: the surface only separates media. Paths never scatter there.
  bool is_interface = false;
  // Some light goes to the other side: the surface casts no shadow and encloses nothing.
  bool transmits = false;
  // Where eye paths stop and photons are kept; with two parts, those that choose one of them.
  bool gathers = false;
  // What is not reflected, the second part, leaves at another point (transport/subsurface.h).
  bool scatters_below = false;
  // Of a thin shape: eye paths go on, and no photons are kept.
  bool is_thin = false;
  // With two parts: where eye paths go on at the first.
  bool has_rough_coat = false;
  // The GGX width of the lobes, the larger one; +infinity: light is scattered so broadly that it
  // keeps no detail over angle.
  float lobe_width = HUGE_VALF;
  float ior = 1;  // inside over outside, of light that is refracted

  // Where direct light may be sampled: light is scattered, and not into single directions.
  [[nodiscard]] bool scatters_broadly() const { return !is_smooth && !is_black && !is_interface; }
  // Where eye paths go on although a range of directions is scattered: what eye paths do not find
  // of the light there, caustic photons bring (transport/caustic_weight.h).
  [[nodiscard]] bool gathers_caustics() const {
    return !is_thin && (has_rough_coat || (scatters_broadly() && !gathers));
  }
  // Where paths choose, or are scattered otherwise than diffusely and go on.
  [[nodiscard]] bool needs_choice() const {
    return has_parts || is_mix || (!gathers && !is_black && !is_interface);
  }
  [[nodiscard]] bool has_narrow_lobes() const { return lobe_width < HUGE_VALF; }
};

// Rougher than this, photons are gathered; smoother, eye paths go on. A narrow lobe accepts few of
// the photons around it, while a direction drawn from it is a good guess.
inline constexpr float kGatherAlpha = 0.2F;
// The same for dielectrics: refraction bends less than reflection, so their lobes are narrower, and
// what is seen through frosted glass has passed two of them.
inline constexpr float kGatherAlphaDielectric = 0.5F;

// The GGX width below which pbrt-v4 renders a surface as perfectly smooth.
inline constexpr float kSmoothAlpha = 1e-3F;
// Of a roughness as files give it. 0 and 0 where the surface is smooth.
struct FacetWidths {
  float u = 0, v = 0;
};
inline constexpr float kMaxRoughness = 1e3F;
[[nodiscard]] FacetWidths WidthsOf(float roughness_u, float roughness_v, bool is_remapped);

// A conductor given by its reflectance at right angles has eta = 1 and this k, capped as in
// pbrt-v4.
[[nodiscard]] inline float AbsorptionFor(float reflectance) {
  const float capped = std::min(reflectance, 0.9999F);
  return 2 * std::sqrt(capped) / std::sqrt(1 - capped);
}

// The absorption with which hair of roughness `beta_n` has this reflectance, about, when light is
// scattered by many of its fibres (Chiang et al. 2016, section 4), and the reflectance that goes
// with an absorption.
[[nodiscard]] Rgb HairAbsorption(Rgb reflectance, float beta_n);
[[nodiscard]] Rgb HairReflectance(Rgb absorption, float beta_n);

// Of a metal under a coat, as light meets it that crosses the coat's surface twice: GGX widths of
// the half vectors of directions that are refracted at the mean surface. A facet that is turned by
// the angle t turns what crosses it by t·(1 - 1/ior), inside, to first order, and a half vector by
// half of that. Were the squares of widths to add up, `widening` would be a half; sums of slopes
// with such long tails are wider in the middle (CoatTable::widening).
[[nodiscard]] inline float BaseWidthSeen(float base_alpha, float coat_alpha, float ior,
                                         float widening) {
  const float turned = (1 - 1 / ior) * coat_alpha;
  return std::sqrt(base_alpha * base_alpha + widening * turned * turned);
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
// The same of reflectances at three wavelengths.
[[nodiscard]] Rgb TexturedValueAtWavelengths(MaterialNumbers::Kind kind, Rgb values);

// Gives mixes the properties of what they are made of: each material of a mix becomes a copy that
// says that it is one. Mixes that have their properties get them anew.
void JoinMixes(std::vector<Material>& materials);
// A copy of a material that stands on thin shapes, with copies of all that it mixes; JoinMixes
// completes them. Returns its index. `copies`: indices of copies by those of their originals.
std::int32_t CopyForThinShapes(std::vector<Material>& materials, std::int32_t index,
                               std::map<std::int32_t, std::int32_t>& copies);

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
// Paths go on there, and on one side alone.
[[nodiscard]] inline bool GoesOnByReflectionAlone(const Material& material) {
  const MaterialProperties properties = PropertiesOf(material);
  return !properties.gathers && !properties.transmits;
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
[[nodiscard]] inline bool ScattersSmoothly(const Material& material) {
  return PropertiesOf(material).scatters_smoothly;
}
[[nodiscard]] inline bool GathersCaustics(const Material& material) {
  return PropertiesOf(material).gathers_caustics();
}

}  // namespace lucerna
