#include "render/transport/material_at.h"

#include <algorithm>
#include <bit>

#include "render/geometry/surface_uv.h"
#include "render/math/rng.h"
#include "render/math/uplift.h"
#include "render/transport/bump.h"
#include "render/transport/coat.h"

namespace lucerna {
namespace {

// What a texture's colour makes of a parameter, in the scene's colours.
Rgb ValueOf(const Scene& scene, const Material& material, Rgb color) {
  if (scene.uplift == nullptr) return TexturedValue(material.kind, color);
  return TexturedValueAtWavelengths(material.kind, scene.uplift->Reflectance(color));
}

// Held at 1, as in pbrt-v4.
Rgb Scaled(Rgb color, float scale) {
  return {std::min(color.r * scale, 1.0F), std::min(color.g * scale, 1.0F),
          std::min(color.b * scale, 1.0F)};
}

// A number in [0, 1) that belongs to a place and a direction: their bits, mixed.
float NumberOf(Vec3 position, Vec3 direction) {
  const auto pair = [](float a, float b) {
    return (std::uint64_t{std::bit_cast<std::uint32_t>(a)} << 32) | std::bit_cast<std::uint32_t>(b);
  };
  constexpr std::uint64_t kMix = 0x4D4958ULL;
  std::uint64_t key = CombineKeys(kMix, pair(position.x, position.y));
  key = CombineKeys(key, pair(position.z, direction.x));
  key = CombineKeys(key, pair(direction.y, direction.z));
  return KeyedRng(key).Uniform();
}

// The one of the materials of a mix that a ray meets. Each of mixes within mixes draws anew.
const Material& Chosen(const Scene& scene, SurfacePoint& point, const TexturePlace& place,
                       Vec3 wo) {
  const Material* material = &scene.materials[point.material];
  float left = material->kind == Material::Kind::kMix ? NumberOf(point.position, wo) : 0;
  while (material->kind == Material::Kind::kMix) {
    const float amount = material->amount_texture == kNoTexture
                             ? material->amount
                             : TextureNumber(scene.textures, material->amount_texture, place);
    const bool is_second = left < amount;
    // What is left of the number is as good as another one.
    const float share = is_second ? amount : 1 - amount;
    if (share > 0 && share < 1)
      left = std::min((is_second ? left : left - amount) / share, 0x1.fffffep-1F);
    point.material = static_cast<std::uint32_t>(material->mixed[is_second ? 1 : 0]);
    material = &scene.materials[point.material];
  }
  return *material;
}

void LookUpRoughness(const Scene& scene, const TexturePlace& place, const Material& material,
                     Material& here) {
  const auto width = [&](std::size_t i, float constant) {
    const std::int32_t texture = material.roughness_textures[i];
    if (texture != kNoTexture) return TextureNumber(scene.textures, texture, place);
    // Back to a roughness, with which the other one is to be compared.
    return material.remaps_roughness ? constant * constant : constant;
  };
  const auto& textures = material.roughness_textures;
  if ((textures[0] & textures[1]) != kNoTexture) {
    const FacetWidths widths =
        WidthsOf(width(0, material.alpha_u), width(1, material.alpha_v), material.remaps_roughness);
    here.alpha_u = widths.u;
    here.alpha_v = widths.v;
  }
  if ((textures[2] & textures[3]) != kNoTexture) {
    const FacetWidths widths = WidthsOf(width(2, material.base_alpha_u),
                                        width(3, material.base_alpha_v), material.remaps_roughness);
    here.base_alpha_u = widths.u;
    here.base_alpha_v = widths.v;
  }
  here.may_be_smooth = false;
  here.base_may_be_smooth = false;
  FitCoat(here);
}

}  // namespace

TexturePlace PlaceOf(const Scene& scene, const SurfacePoint& point) {
  return {UvAt(scene, point), point.position, point.geometric_normal, VertexColorAt(scene, point)};
}

float AlphaAt(const Scene& scene, const SurfacePoint& point) {
  const ShapeTraits& traits = TraitsOf(scene, point);
  const float alpha =
      traits.alpha_texture == kNoTexture
          ? traits.alpha
          : TextureNumber(scene.textures, traits.alpha_texture, PlaceOf(scene, point));
  return alpha > kLeastAlpha ? std::min(alpha, 1.0F) : kLeastAlpha;
}

std::array<float, 4> NumbersOf(const MaterialNumbers& here) {
  if (here.thickness_texture != kNoTexture) return {here.thickness, 0, 0, 0};
  return {here.alpha_u, here.alpha_v, here.base_alpha_u, here.base_alpha_v};
}

void SetNumbers(MaterialNumbers& material, const std::array<float, 4>& numbers) {
  if (!material.HasCoatTexture()) return;
  if (material.thickness_texture != kNoTexture) {
    material.thickness = numbers[0];
  } else {
    material.alpha_u = numbers[0];
    material.alpha_v = numbers[1];
    material.base_alpha_u = numbers[2];
    material.base_alpha_v = numbers[3];
    material.may_be_smooth = false;
    material.base_may_be_smooth = false;
  }
  FitCoat(material);
}

namespace material_at_internal {

const Material& AtPlace(const Scene& scene, SurfacePoint& point, Vec3 wo,
                        std::optional<Material>& storage, const PathWavelength& wavelength) {
  const TexturePlace place = PlaceOf(scene, point);
  const Material& material = Chosen(scene, point, place, wo);
  if (!material.DependsOnPlace()) return material;
  Material& here = storage.emplace();
  static_cast<MaterialNumbers&>(here) = static_cast<const MaterialNumbers&>(material);
  if (material.texture != kNoTexture) {
    const Rgb color = TextureColor(scene.textures, material.texture, place);
    SetTexturedParameter(here, ValueOf(scene, material, Scaled(color, material.texture_scale)));
  }
  if (material.second_texture != kNoTexture) {
    const Rgb color = TextureColor(scene.textures, material.second_texture, place);
    here.transmittance = ValueOf(scene, material, Scaled(color, material.texture_scale));
  }
  if (material.Disperses() && wavelength.is_drawn())
    here.ior = IndexAt(wavelength.nm(), material.ior, material.dispersion);
  if (material.HasRoughnessTexture()) LookUpRoughness(scene, place, material, here);
  if (material.thickness_texture != kNoTexture) {
    here.thickness = std::clamp(TextureNumber(scene.textures, material.thickness_texture, place),
                                0.0F, material.thickness);
    FitCoat(here);
  }
  const bool is_turned = here.alpha_u != here.alpha_v || here.base_alpha_u != here.base_alpha_v ||
                         here.kind == Material::Kind::kHair || here.is_measured_with_direction;
  if (material.HasBumps()) {
    TurnShadingNormal(scene, material, place, point);
    if (!is_turned) point.tangent = {};
  } else if (is_turned) {
    FindTangent(scene, point);
  }
  return here;
}

}  // namespace material_at_internal
}  // namespace lucerna
