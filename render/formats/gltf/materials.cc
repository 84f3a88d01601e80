#include "render/formats/gltf/materials.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "render/base/text.h"

namespace lucerna {
namespace {

constexpr double kDefaultIor = 1.5;

Rgb ToRgb(const std::vector<double>& numbers) {
  return {static_cast<float>(numbers[0]), static_cast<float>(numbers[1]),
          static_cast<float>(numbers[2])};
}

bool IsWhite(Rgb color) {
  return color.r >= 1 && color.g >= 1 && color.b >= 1;
}

// With which pictures of roughness are read as those of GGX widths.
PixelEncoding SquaredNumbers() {
  PixelEncoding squared;
  squared.kind = PixelEncoding::Kind::kGamma;
  squared.gamma = 2;
  return squared;
}

// A number of a material, or a texture in its place.
struct Amount {
  float least = 0, largest = 0;
  std::int32_t texture = kNoTexture;
};

// The facets of the surface itself.
void SetRoughness(const Amount& alpha, Material& material) {
  const FacetWidths widest = WidthsOf(alpha.largest, alpha.largest, false);
  material.remaps_roughness = false;
  material.alpha_u = widest.u;
  material.alpha_v = widest.v;
  if (alpha.texture == kNoTexture || widest.u == 0) return;
  material.may_be_smooth = WidthsOf(alpha.least, alpha.least, false).u == 0;
  material.roughness_textures[0] = material.roughness_textures[1] = alpha.texture;
}

// Those of the metal under a coat.
void SetBaseRoughness(const Amount& alpha, Material& material) {
  const FacetWidths widest = WidthsOf(alpha.largest, alpha.largest, false);
  material.remaps_roughness = false;
  material.base_alpha_u = widest.u;
  material.base_alpha_v = widest.v;
  if (alpha.texture == kNoTexture || widest.u == 0) return;
  material.base_may_be_smooth = WidthsOf(alpha.least, alpha.least, false).u == 0;
  material.roughness_textures[2] = material.roughness_textures[3] = alpha.texture;
}

// Reads one material.
class MaterialReader {
 public:
  MaterialReader(const JsonObject& object, GltfTextures& textures, Scene& scene, bool has_colors)
      : object_(object), textures_(textures), scene_(scene), has_colors_(has_colors) {}

  GltfSurface Read();

 private:
  // A texture of numbers times `factor`; `otherwise` stands for a texture that is not there or has
  // an error.
  Amount ReadAmount(const JsonObject& info, PictureUse use, const PixelEncoding& encoding,
                    float factor, float otherwise);
  // All textures of a material are placed by one TEXCOORD_n.
  void NoteTexCoord(const JsonObject& info);
  std::int32_t AppendTexture(const JsonObject& info, const GltfTextureUse& use);
  std::int32_t Add(Material material);
  std::int32_t AddMix(std::int32_t first, std::int32_t second, const Amount& amount);

  void ReadSpecular();
  void ReadBaseColor(const JsonObject& pbr);
  void ReadRoughness(const JsonObject& pbr);
  std::int32_t ReadSurface(const JsonObject& pbr);
  // Metal as `metallic` says, else glass as `transmission` says, else a coat over a diffuse base.
  std::int32_t AddBare(const Amount& metallic, const Amount& transmission);
  // The same below a clear coat whose facets have the GGX width `coat`.
  std::int32_t AddBelowClearcoat(const Amount& metallic, const Amount& coat);
  [[nodiscard]] Material Metal() const;
  std::int32_t AddMetal();
  std::int32_t AddMetalBelow(const Amount& coat);
  std::int32_t AddCoated(float coat_ior, const Amount& coat);
  std::int32_t AddGlass();
  // What fills the glass, or kNoMedium.
  std::int32_t AddMedium(const JsonObject& volume, double thickness);
  void ReadEmission();
  void ReadAlpha();

  const JsonObject& object_;
  GltfTextures& textures_;
  Scene& scene_;
  const bool has_colors_;
  GltfSurface surface_;
  std::optional<std::uint64_t> tex_coord_;
  Rgb base_color_ = {1, 1, 1};
  float opacity_ = 1;
  JsonObject base_texture_info_ = object_.Child("pbrMetallicRoughness").Child("baseColorTexture");
  std::int32_t base_texture_ = kNoTexture;
  std::int32_t normal_map_ = kNoTexture;
  float normal_scale_ = 1;
  Amount alpha_;           // GGX width: the square of the roughness
  float ior_ = 1.5F;       // of glass
  float coat_ior_ = 1.5F;  // of the coat of what is not
};

void MaterialReader::NoteTexCoord(const JsonObject& info) {
  const std::uint64_t tex_coord = GltfTextures::TexCoordOf(info);
  if (tex_coord_.value_or(tex_coord) != tex_coord) {
    info.Warning(Concat("is placed by TEXCOORD_", *tex_coord_,
                        " like the other textures of its material, not by TEXCOORD_", tex_coord));
  } else {
    tex_coord_ = tex_coord;
  }
}

std::int32_t MaterialReader::AppendTexture(const JsonObject& info, const GltfTextureUse& use) {
  NoteTexCoord(info);
  return textures_.Append(info, use);
}

Amount MaterialReader::ReadAmount(const JsonObject& info, PictureUse use,
                                  const PixelEncoding& encoding, float factor, float otherwise) {
  const GltfPicture* picture =
      info.exists() && factor > 0 ? textures_.FindPicture(info, use, encoding) : nullptr;
  if (picture == nullptr) return {factor * otherwise, factor * otherwise};
  Amount amount = {factor * picture->least, factor * picture->largest};
  // An even picture needs no lookups.
  if (amount.least < amount.largest)
    amount.texture = AppendTexture(info, {use, encoding, Gray(factor)});
  return amount;
}

std::int32_t MaterialReader::Add(Material material) {
  material.normal_map = normal_map_;
  material.normal_map_follows_v = true;
  material.normal_scale = normal_scale_;
  material.name = object_.String("name", object_.place());
  scene_.materials.push_back(std::move(material));
  return static_cast<std::int32_t>(scene_.materials.size()) - 1;
}

std::int32_t MaterialReader::AddMix(std::int32_t first, std::int32_t second, const Amount& amount) {
  Material mix;
  mix.kind = Material::Kind::kMix;
  mix.name = object_.String("name", object_.place());
  mix.mixed = {first, second};
  for (const std::int32_t part : mix.mixed) {
    mix.mix_depth =
        std::max(mix.mix_depth, scene_.materials[static_cast<std::size_t>(part)].mix_depth + 1);
  }
  mix.amount = amount.largest;
  mix.amount_texture = amount.texture;
  scene_.materials.push_back(std::move(mix));
  return static_cast<std::int32_t>(scene_.materials.size()) - 1;
}

// The index of refraction whose reflectance at right angles is that share of the one of `ior_`.
void MaterialReader::ReadSpecular() {
  const JsonObject specular = ExtensionOf(object_, "KHR_materials_specular");
  if (!specular.exists()) return;
  const Rgb color = ToRgb(specular.Numbers("specularColorFactor", {1, 1, 1}, kJsonZeroOrMore));
  const double factor = specular.Held("specularFactor", 1, kJsonFactor);
  if (specular.Has("specularTexture") || specular.Has("specularColorTexture"))
    specular.Warning("textures are not used");
  const double root = (static_cast<double>(ior_) - 1) / (static_cast<double>(ior_) + 1);
  constexpr double kMostReflected = 0.9;
  const double reflected =
      std::min(kMostReflected, factor * static_cast<double>(MaxChannel(color)) * root * root);
  coat_ior_ = static_cast<float>((1 + std::sqrt(reflected)) / (1 - std::sqrt(reflected)));
}

void MaterialReader::ReadBaseColor(const JsonObject& pbr) {
  const std::vector<double> factor = pbr.HeldNumbers("baseColorFactor", {1, 1, 1, 1}, kJsonFactor);
  base_color_ = ToRgb(factor);
  opacity_ = static_cast<float>(factor[3]);
  if (IsBlack(base_color_)) return;
  if (base_texture_info_.exists()) {
    const GltfPicture* picture =
        textures_.FindPicture(base_texture_info_, PictureUse::kColors, PixelEncoding());
    if (picture == nullptr) return;
    base_texture_ =
        AppendTexture(base_texture_info_, {PictureUse::kColors, PixelEncoding(), base_color_});
  }
  if (!has_colors_) return;
  Texture colors;
  colors.kind = Texture::Kind::kVertexColor;
  colors.parts[0] = base_texture_;
  if (base_texture_ == kNoTexture) colors.tint = base_color_;
  base_texture_ = static_cast<std::int32_t>(scene_.textures.size());
  scene_.textures.push_back(std::move(colors));
}

void MaterialReader::ReadRoughness(const JsonObject& pbr) {
  const auto roughness = static_cast<float>(pbr.Held("roughnessFactor", 1, kJsonFactor));
  alpha_ = ReadAmount(pbr.Child("metallicRoughnessTexture"), PictureUse::kGreen, SquaredNumbers(),
                      roughness * roughness, 1);
}

Material MaterialReader::Metal() const {
  Material metal;
  metal.kind = Material::Kind::kConductor;
  metal.eta = Gray(1);
  metal.k = {AbsorptionFor(base_color_.r), AbsorptionFor(base_color_.g),
             AbsorptionFor(base_color_.b)};
  metal.texture = base_texture_;
  return metal;
}

std::int32_t MaterialReader::AddMetal() {
  Material metal = Metal();
  SetRoughness(alpha_, metal);
  return Add(std::move(metal));
}

std::int32_t MaterialReader::AddMetalBelow(const Amount& coat) {
  Material metal = Metal();
  metal.kind = Material::Kind::kCoatedConductor;
  metal.is_metal_in_coat = true;
  metal.ior = static_cast<float>(kDefaultIor);
  metal.base_hits = 100;  // until nothing is left
  SetRoughness(coat, metal);
  SetBaseRoughness(alpha_, metal);
  return Add(std::move(metal));
}

std::int32_t MaterialReader::AddCoated(float coat_ior, const Amount& coat) {
  Material coated;
  // An index of 1 reflects nothing.
  coated.kind = coat_ior > 1 ? Material::Kind::kCoatedDiffuse : Material::Kind::kDiffuse;
  coated.reflectance = base_color_;
  coated.texture = base_texture_;
  coated.ior = coat_ior;
  coated.coat_passes_rest = coat_ior > 1;
  if (coat_ior > 1) SetRoughness(coat, coated);
  return Add(std::move(coated));
}

std::int32_t MaterialReader::AddMedium(const JsonObject& volume, double thickness) {
  // A channel of less is all but gone after any length that matters.
  constexpr double kLeastColor = 1e-6;
  const std::vector<double> color = volume.HeldNumbers("attenuationColor", {1, 1, 1}, kJsonFactor);
  const double given_distance = volume.Number("attenuationDistance", 0, {0, HUGE_VAL});
  // For an endless distance some exporters write 0 or the largest number.
  const bool is_endless = given_distance == 0 || given_distance > 1e30;
  const double distance = is_endless ? HUGE_VAL : std::max(given_distance, 1e-12);
  std::array<double, 3> absorption{};
  for (std::size_t c = 0; c < 3; ++c) {
    absorption[c] = -std::log(std::max(color[c], kLeastColor)) / distance;
    const double base =
        std::max(static_cast<double>(base_color_[static_cast<int>(c)]), kLeastColor);
    absorption[c] -= std::log(base) / thickness;
  }
  if (!IsWhite(base_color_)) {
    object_.Warning("the base colour of glass is read as absorption over its thicknessFactor");
  }
  const auto in_range = [](double number) {
    return static_cast<float>(std::clamp(number, 0.0, 1e15));
  };
  Medium medium;
  medium.name = object_.String("name", object_.place());
  medium.absorption = {in_range(absorption[0]), in_range(absorption[1]), in_range(absorption[2])};
  if (IsBlack(medium.absorption)) return kNoMedium;
  scene_.media.push_back(std::move(medium));
  return static_cast<std::int32_t>(scene_.media.size()) - 1;
}

std::int32_t MaterialReader::AddGlass() {
  const JsonObject volume = ExtensionOf(object_, "KHR_materials_volume");
  const double thickness = volume.Number("thicknessFactor", 0, kJsonZeroOrMore);
  Material glass;
  glass.ior = ior_;
  if (thickness > 0) {
    if (base_texture_ != kNoTexture) {
      object_.Warning("light that goes through is not coloured by the texture of the base colour");
    }
    glass.kind = Material::Kind::kDielectric;
    // Facets between equal media bend nothing.
    if (ior_ > 1) SetRoughness(alpha_, glass);
    surface_.traits.medium_inside = AddMedium(volume, thickness);
    return Add(std::move(glass));
  }
  glass.kind = Material::Kind::kThinDielectric;
  if (WidthsOf(alpha_.largest, alpha_.largest, false).u > 0) {
    object_.Warning(
        "thin glass is rendered as smooth; give it a volume (KHR_materials_volume) to make it "
        "rough");
  }
  // Light that goes through has crossed the surface once, as a sheet.
  glass.transmission_tint = base_color_;
  glass.is_tinted = !IsWhite(base_color_);
  glass.texture = base_texture_;
  return Add(std::move(glass));
}

std::int32_t MaterialReader::AddBare(const Amount& metallic, const Amount& transmission) {
  if (metallic.least >= 1) return AddMetal();
  std::int32_t surface = transmission.largest > 0 ? AddGlass() : AddCoated(coat_ior_, alpha_);
  if (transmission.largest > 0 && transmission.least < 1)
    surface = AddMix(AddCoated(coat_ior_, alpha_), surface, transmission);
  return metallic.largest > 0 ? AddMix(surface, AddMetal(), metallic) : surface;
}

std::int32_t MaterialReader::AddBelowClearcoat(const Amount& metallic, const Amount& coat) {
  if (metallic.least >= 1) return AddMetalBelow(coat);
  // What has nearly the coat's index reflects nothing below it.
  const std::int32_t base = AddCoated(static_cast<float>(kDefaultIor), coat);
  return metallic.largest > 0 ? AddMix(base, AddMetalBelow(coat), metallic) : base;
}

std::int32_t MaterialReader::ReadSurface(const JsonObject& pbr) {
  if (ExtensionOf(object_, "KHR_materials_unlit").exists()) return AddCoated(1, {});
  const auto factor = [](const JsonObject& object, const char* name, double otherwise) {
    return static_cast<float>(object.Held(name, otherwise, kJsonFactor));
  };
  const PixelEncoding linear = {PixelEncoding::Kind::kLinear};
  const Amount metallic = ReadAmount(pbr.Child("metallicRoughnessTexture"), PictureUse::kBlue,
                                     linear, factor(pbr, "metallicFactor", 1), 1);
  Amount transmission;
  if (metallic.least < 1) {
    const JsonObject given = ExtensionOf(object_, "KHR_materials_transmission");
    transmission = ReadAmount(given.Child("transmissionTexture"), PictureUse::kRed, linear,
                              factor(given, "transmissionFactor", 0), 1);
  }
  const JsonObject given = ExtensionOf(object_, "KHR_materials_clearcoat");
  const Amount clearcoat = ReadAmount(given.Child("clearcoatTexture"), PictureUse::kRed, linear,
                                      factor(given, "clearcoatFactor", 0), 1);
  if (!(clearcoat.largest > 0)) return AddBare(metallic, transmission);
  if (transmission.largest > 0) {
    given.Warning("is left out: glass has no coat");
    return AddBare(metallic, transmission);
  }
  if (given.Has("clearcoatNormalTexture") || normal_map_ != kNoTexture)
    given.Warning("follows normalTexture, as what is below it does");
  const float roughness = factor(given, "clearcoatRoughnessFactor", 0);
  Amount coat = ReadAmount(given.Child("clearcoatRoughnessTexture"), PictureUse::kGreen,
                           SquaredNumbers(), roughness * roughness, 1);
  if (coat.texture != kNoTexture && alpha_.texture != kNoTexture && metallic.largest > 0) {
    given.Warning("has its largest roughness everywhere, since that of the metal is a texture");
    coat = {coat.largest, coat.largest};
  }
  const std::int32_t coated = AddBelowClearcoat(metallic, coat);
  if (clearcoat.least >= 1) return coated;
  return AddMix(AddBare(metallic, transmission), coated, clearcoat);
}

void MaterialReader::ReadEmission() {
  Rgb radiance = ToRgb(object_.HeldNumbers("emissiveFactor", {0, 0, 0}, kJsonFactor));
  radiance *= static_cast<float>(ExtensionOf(object_, "KHR_materials_emissive_strength")
                                     .Number("emissiveStrength", 1, {0, 1e12}));
  const JsonObject info = object_.Child("emissiveTexture");
  if (IsBlack(radiance)) return;
  AreaLight light = {radiance, object_.Bool("doubleSided", false)};
  if (info.exists()) {
    const GltfPicture* picture = textures_.FindPicture(info, PictureUse::kColors, PixelEncoding());
    if (picture == nullptr || !(picture->largest > 0)) return;
    NoteTexCoord(info);
    const std::optional<Texture> texture = textures_.Make(info, {});
    if (!texture.has_value()) return;
    light.picture = texture->picture;
    light.largest_pixel = picture->largest;
    light.mapping = texture->mapping;
    light.wrap_u = texture->wrap_u;
    light.wrap_v = texture->wrap_v;
  }
  surface_.traits.area_light = static_cast<std::int32_t>(scene_.area_lights.size());
  scene_.area_lights.push_back(std::move(light));
}

void MaterialReader::ReadAlpha() {
  const std::string mode = object_.String("alphaMode", "OPAQUE");
  if (mode == "OPAQUE") return;
  if (mode != "MASK" && mode != "BLEND") {
    object_.Error(Concat("alphaMode is ", Quoted(mode), ", not OPAQUE, MASK or BLEND"));
    return;
  }
  Amount alpha;
  if (mode == "MASK") {
    const auto cutoff = static_cast<float>(object_.Number("alphaCutoff", 0.5, kJsonZeroOrMore));
    // Of the image alone. Each pixel is there or not; between two of them the share rises.
    PixelEncoding step;
    step.kind = PixelEncoding::Kind::kStep;
    step.threshold = opacity_ > 0 ? static_cast<double>(cutoff / opacity_)
                     : cutoff > 0 ? HUGE_VAL
                                  : 0;
    const float untextured = opacity_ >= cutoff ? 1 : 0;
    alpha = ReadAmount(base_texture_info_, PictureUse::kOpacity, step, 1, untextured);
  } else {
    alpha = ReadAmount(base_texture_info_, PictureUse::kOpacity, {PixelEncoding::Kind::kLinear},
                       opacity_, 1);
  }
  if (alpha.least >= 1) return;
  // What nothing meets does not shine either.
  if (!(alpha.largest > 0)) surface_.traits.area_light = kNoAreaLight;
  surface_.traits.alpha = alpha.largest;
  surface_.traits.alpha_texture = alpha.largest > 0 ? alpha.texture : kNoTexture;
}

GltfSurface MaterialReader::Read() {
  const JsonObject pbr = object_.Child("pbrMetallicRoughness");
  const double ior = ExtensionOf(object_, "KHR_materials_ior").Held("ior", kDefaultIor, {0, 100});
  ior_ = static_cast<float>(ior < 1 ? kDefaultIor : ior);
  coat_ior_ = ior_;
  if (ior < 1) object_.Warning("an index of refraction below 1 is read as 1.5");
  ReadSpecular();
  ReadBaseColor(pbr);
  ReadRoughness(pbr);
  const JsonObject normals = object_.Child("normalTexture");
  if (normals.exists() && textures_.FindPicture(normals, PictureUse::kVectors,
                                                {PixelEncoding::Kind::kLinear}) != nullptr) {
    normal_scale_ = static_cast<float>(normals.Number("scale", 1, {-1e6, 1e6}));
    normal_map_ = AppendTexture(normals, {PictureUse::kVectors, {PixelEncoding::Kind::kLinear}});
  }
  surface_.traits.material = ReadSurface(pbr);
  ReadEmission();
  ReadAlpha();
  surface_.tex_coord = tex_coord_.value_or(0);
  surface_.has_textures = tex_coord_.has_value();
  return surface_;
}

}  // namespace

const GltfSurface& GltfMaterials::Get(std::optional<std::size_t> material, bool has_colors) {
  const auto [known, is_new] = surfaces_.try_emplace({material, has_colors});
  if (is_new) {
    const JsonObject object = material.has_value()
                                  ? document_.At("materials", *material)
                                  : JsonObject(document_, nullptr, "the default material");
    known->second = MaterialReader(object, textures_, scene_, has_colors).Read();
  }
  return known->second;
}

}  // namespace lucerna
