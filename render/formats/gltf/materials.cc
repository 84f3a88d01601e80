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

// A number of a material, or a texture in its place.
struct Amount {
  float least = 0, largest = 0;
  std::int32_t texture = kNoTexture;
};

// Reads one material.
class MaterialReader {
 public:
  MaterialReader(const GltfObject& object, GltfTextures& textures, Scene& scene)
      : object_(object), textures_(textures), scene_(scene) {}

  GltfSurface Read();

 private:
  // A texture of numbers times `factor`; `otherwise` stands for a texture that is not there or has
  // an error.
  Amount ReadAmount(const GltfObject& info, PictureUse use, const PixelEncoding& encoding,
                    float factor, float otherwise);
  std::int32_t AppendTexture(const GltfObject& info, const GltfTextureUse& use);
  std::int32_t Add(Material material);
  std::int32_t AddMix(std::int32_t first, std::int32_t second, const Amount& amount);
  void SetRoughness(Material& material) const;

  void ReadBaseColor(const GltfObject& pbr);
  void ReadRoughness(const GltfObject& pbr);
  std::int32_t ReadSurface(const GltfObject& pbr);
  std::int32_t AddMetal();
  std::int32_t AddCoated();
  std::int32_t AddGlass();
  // What fills the glass, or kNoMedium.
  std::int32_t AddMedium(const GltfObject& volume, double thickness);
  void ReadEmission();
  void ReadAlpha();

  const GltfObject& object_;
  GltfTextures& textures_;
  Scene& scene_;
  GltfSurface surface_;
  std::optional<std::uint64_t> tex_coord_;
  Rgb base_color_ = {1, 1, 1};
  float opacity_ = 1;
  GltfObject base_texture_info_ = object_.Child("pbrMetallicRoughness").Child("baseColorTexture");
  std::int32_t base_texture_ = kNoTexture;
  std::int32_t normal_map_ = kNoTexture;
  Amount alpha_;  // GGX width: the square of the roughness
  float ior_ = 1.5F;
};

std::int32_t MaterialReader::AppendTexture(const GltfObject& info, const GltfTextureUse& use) {
  const std::uint64_t tex_coord = GltfTextures::TexCoordOf(info);
  if (tex_coord_.value_or(tex_coord) != tex_coord) {
    info.Warning(Concat("is placed by TEXCOORD_", *tex_coord_,
                        " like the other textures of its material, not by TEXCOORD_", tex_coord));
  } else {
    tex_coord_ = tex_coord;
  }
  return textures_.Append(info, use);
}

Amount MaterialReader::ReadAmount(const GltfObject& info, PictureUse use,
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

void MaterialReader::SetRoughness(Material& material) const {
  const FacetWidths widest = WidthsOf(alpha_.largest, alpha_.largest, false);
  const FacetWidths narrowest = WidthsOf(alpha_.least, alpha_.least, false);
  material.remaps_roughness = false;
  material.alpha_u = widest.u;
  material.alpha_v = widest.v;
  if (alpha_.texture == kNoTexture || widest.u == 0) return;
  material.may_be_smooth = narrowest.u == 0;
  material.roughness_textures[0] = alpha_.texture;
  material.roughness_textures[1] = alpha_.texture;
}

void MaterialReader::ReadBaseColor(const GltfObject& pbr) {
  const std::vector<double> factor = pbr.HeldNumbers("baseColorFactor", {1, 1, 1, 1}, kGltfFactor);
  base_color_ = ToRgb(factor);
  opacity_ = static_cast<float>(factor[3]);
  if (!base_texture_info_.exists()) return;
  const GltfPicture* picture =
      textures_.FindPicture(base_texture_info_, PictureUse::kColors, PixelEncoding());
  if (picture == nullptr || IsBlack(base_color_)) return;
  base_texture_ =
      AppendTexture(base_texture_info_, {PictureUse::kColors, PixelEncoding(), base_color_});
}

void MaterialReader::ReadRoughness(const GltfObject& pbr) {
  const auto roughness = static_cast<float>(pbr.Held("roughnessFactor", 1, kGltfFactor));
  // Pictures of roughness are read as those of its square.
  PixelEncoding squared;
  squared.kind = PixelEncoding::Kind::kGamma;
  squared.gamma = 2;
  alpha_ = ReadAmount(pbr.Child("metallicRoughnessTexture"), PictureUse::kGreen, squared,
                      roughness * roughness, 1);
}

std::int32_t MaterialReader::AddMetal() {
  Material metal;
  metal.kind = Material::Kind::kConductor;
  metal.eta = Gray(1);
  metal.k = {AbsorptionFor(base_color_.r), AbsorptionFor(base_color_.g),
             AbsorptionFor(base_color_.b)};
  metal.texture = base_texture_;
  SetRoughness(metal);
  return Add(std::move(metal));
}

std::int32_t MaterialReader::AddCoated() {
  Material coated;
  // An index of 1 reflects nothing.
  coated.kind = ior_ > 1 ? Material::Kind::kCoatedDiffuse : Material::Kind::kDiffuse;
  coated.reflectance = base_color_;
  coated.texture = base_texture_;
  coated.ior = ior_;
  if (ior_ > 1) SetRoughness(coated);
  return Add(std::move(coated));
}

std::int32_t MaterialReader::AddMedium(const GltfObject& volume, double thickness) {
  // A channel of less is all but gone after any length that matters.
  constexpr double kLeastColor = 1e-6;
  const std::vector<double> color = volume.HeldNumbers("attenuationColor", {1, 1, 1}, kGltfFactor);
  const double distance = volume.Number("attenuationDistance", HUGE_VAL, {1e-12, 1e30});
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
  const GltfObject volume = object_.Extension("KHR_materials_volume");
  const double thickness = volume.Number("thicknessFactor", 0, kGltfZeroOrMore);
  Material glass;
  glass.ior = ior_;
  if (base_texture_ != kNoTexture) {
    object_.Warning("light that goes through is not coloured by the texture of the base colour");
  }
  if (thickness > 0) {
    glass.kind = Material::Kind::kDielectric;
    SetRoughness(glass);
    surface_.traits.medium_inside = AddMedium(volume, thickness);
    return Add(std::move(glass));
  }
  glass.kind = Material::Kind::kThinDielectric;
  if (WidthsOf(alpha_.largest, alpha_.largest, false).u > 0) {
    object_.Warning(
        "thin glass is rendered as smooth; give it a volume (KHR_materials_volume) to make it "
        "rough");
  }
  if (!IsWhite(base_color_)) {
    object_.Warning(
        "thin glass is rendered as clear; give it a volume (KHR_materials_volume) to colour it");
  }
  return Add(std::move(glass));
}

std::int32_t MaterialReader::ReadSurface(const GltfObject& pbr) {
  const auto metallic_factor = static_cast<float>(pbr.Held("metallicFactor", 1, kGltfFactor));
  const PixelEncoding linear = {PixelEncoding::Kind::kLinear};
  const Amount metallic = ReadAmount(pbr.Child("metallicRoughnessTexture"), PictureUse::kBlue,
                                     linear, metallic_factor, 1);
  if (metallic.least >= 1) return AddMetal();
  const GltfObject transmission_of = object_.Extension("KHR_materials_transmission");
  const Amount transmission =
      ReadAmount(transmission_of.Child("transmissionTexture"), PictureUse::kRed, linear,
                 static_cast<float>(transmission_of.Held("transmissionFactor", 0, kGltfFactor)), 1);
  std::int32_t surface = transmission.largest > 0 ? AddGlass() : AddCoated();
  if (transmission.largest > 0 && transmission.least < 1)
    surface = AddMix(AddCoated(), surface, transmission);
  return metallic.largest > 0 ? AddMix(surface, AddMetal(), metallic) : surface;
}

void MaterialReader::ReadEmission() {
  Rgb radiance = ToRgb(object_.HeldNumbers("emissiveFactor", {0, 0, 0}, kGltfFactor));
  radiance *= static_cast<float>(object_.Extension("KHR_materials_emissive_strength")
                                     .Number("emissiveStrength", 1, {0, 1e12}));
  const GltfObject info = object_.Child("emissiveTexture");
  if (IsBlack(radiance)) return;
  if (info.exists()) {
    const GltfPicture* picture = textures_.FindPicture(info, PictureUse::kColors, PixelEncoding());
    if (picture == nullptr) return;
    if (picture->least < picture->largest) {
      info.Warning("lights have one colour: the mean of the image is used");
    }
    radiance *= picture->mean;
    if (IsBlack(radiance)) return;
  }
  surface_.traits.area_light = static_cast<std::int32_t>(scene_.area_lights.size());
  scene_.area_lights.push_back({radiance, object_.Bool("doubleSided", false)});
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
    const auto cutoff = static_cast<float>(object_.Number("alphaCutoff", 0.5, kGltfZeroOrMore));
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
  if (surface_.traits.area_light != kNoAreaLight) {
    object_.Warning("emits light, so its alpha is not used");
    return;
  }
  surface_.traits.alpha = alpha.largest;
  surface_.traits.alpha_texture = alpha.largest > 0 ? alpha.texture : kNoTexture;
}

GltfSurface MaterialReader::Read() {
  const GltfObject pbr = object_.Child("pbrMetallicRoughness");
  const double ior = object_.Extension("KHR_materials_ior").Number("ior", kDefaultIor, {0, 100});
  ior_ = static_cast<float>(ior < 1 ? kDefaultIor : ior);
  if (ior < 1) object_.Warning("an index of refraction below 1 is read as 1.5");
  ReadBaseColor(pbr);
  ReadRoughness(pbr);
  const GltfObject normals = object_.Child("normalTexture");
  if (normals.exists() && textures_.FindPicture(normals, PictureUse::kVectors,
                                                {PixelEncoding::Kind::kLinear}) != nullptr) {
    if (normals.Number("scale", 1, kGltfAnyNumber) != 1) normals.Warning("scale is read as 1");
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

const GltfSurface& GltfMaterials::Get(std::optional<std::size_t> material) {
  const auto [known, is_new] = surfaces_.try_emplace(material);
  if (is_new) {
    const GltfObject object = material.has_value()
                                  ? document_.At("materials", *material)
                                  : GltfObject(document_, nullptr, "the default material");
    known->second = MaterialReader(object, textures_, scene_).Read();
  }
  return known->second;
}

}  // namespace lucerna
