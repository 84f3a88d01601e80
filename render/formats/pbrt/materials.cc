#include "render/formats/pbrt/materials.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "render/base/text.h"
#include "render/formats/pbrt/kinds.h"
#include "render/formats/pbrt/material_readers.h"

namespace lucerna {
namespace {

constexpr Range kRoughness = {0, static_cast<double>(kMaxRoughness)};

using MaterialReader = void (*)(const MaterialInput&, Material&);

#define LUCERNA_READER(Name, name)                            \
  {name, [](const MaterialInput& input, Material& material) { \
     material.kind = Material::Kind::k##Name;                 \
     Read##Name(input, material);                             \
   }},
constexpr Kind<MaterialReader> kKinds[] = {LUCERNA_MATERIALS(LUCERNA_READER)};
#undef LUCERNA_READER

// An interface has three names.
std::string_view InOneWord(std::string_view type) {
  return type.empty() || type == "none" ? "interface" : type;
}

// Materials of pbrt that are refused by name, and why.
std::string_view WhyRefused(std::string_view type) {
  if (type == "fourier") {
    return "is not supported, nor by pbrt-v4: Fourier BSDFs (.bsdf files) are not read";
  }
  return "is not supported";
}

// `displacement` and `normalmap`. As in pbrt-v4 the map counts where there are both, and those of a
// mix and of hair are ignored.
void ReadBumps(const MaterialInput& input, Material& material) {
  ParameterList& parameters = input.parameters;
  const std::optional<std::string> map = parameters.FindString("normalmap");
  const NamedTexture* heights = nullptr;
  if (parameters.IsTexture("displacement")) {
    heights = FindNumbers("displacement", parameters, input.from.declared.numbers);
  } else {
    parameters.Ignore("displacement");  // the same everywhere is none
  }
  if (material.kind == Material::Kind::kMix || material.kind == Material::Kind::kInterface ||
      material.kind == Material::Kind::kHair) {
    for (const std::string_view name : {"displacement", "normalmap"}) {
      if (parameters.Has(name)) parameters.Warning(name, "is ignored, as by pbrt-v4");
    }
    return;
  }
  if (!map.has_value() || map->empty()) {
    // Even heights leave a surface as it is.
    if (heights == nullptr || !(heights->largest > heights->least)) return;
    material.displacement = heights->number;
    material.slope_step = SlopeStep(input.from.textures, heights->number);
    return;
  }
  Texture normals;
  normals.kind = Texture::Kind::kPicture;
  StatusOr<std::shared_ptr<const Picture>> picture =
      input.from.assets.ReadPicture(*map, {PixelEncoding::Kind::kLinear});
  if (!picture.ok()) {
    parameters.Error("normalmap", Concat("cannot be read: ", picture.status().message()));
    return;
  }
  if ((*picture)->channels != 3) {
    parameters.Error("normalmap", "must have the channels R, G and B");
    return;
  }
  normals.picture = *std::move(picture);
  material.normal_map = static_cast<std::int32_t>(input.from.textures.size());
  input.from.textures.push_back(std::move(normals));
}

// From a texture: what is below 0 is 0. Where it is nearly 0 everywhere it is the same everywhere,
// for tables between 0 and a number that rounding takes for 0 are all alike.
void ReadThickness(const MaterialInput& input, Material& material) {
  ParameterList& parameters = input.parameters;
  const NamedTexture* texture = FindNumbers("thickness", parameters, input.from.declared.numbers);
  if (texture == nullptr) return;
  // Beyond, nothing comes through.
  constexpr float kMostThickness = 1e4F;
  material.thickness = std::clamp(texture->largest, 0.0F, kMostThickness);
  constexpr float kLeastThickness = 1e-6F;
  if (material.thickness < kLeastThickness || !(texture->largest > texture->least)) return;
  material.thickness_texture = texture->number;
  if (material.HasRoughnessTexture())
    parameters.Error("thickness", "and a roughness cannot both be textures; give one a number");
}

}  // namespace

void ReadRoughness(std::string_view prefix, Facets facets, const MaterialInput& input,
                   Material& material) {
  ParameterList& parameters = input.parameters;
  struct Found {
    double number = 0;
    const NamedTexture* texture = nullptr;
  };
  const auto find = [&](const std::string& name, const Found& otherwise) {
    if (!parameters.IsTexture(name))
      return Found{parameters.Float(name, otherwise.number, kRoughness),
                   parameters.Has(name) ? nullptr : otherwise.texture};
    const NamedTexture* texture = FindNumbers(name, parameters, input.from.declared.numbers);
    if (texture != nullptr && !(texture->largest > texture->least)) {
      // A constant needs no lookups.
      return Found{std::clamp(static_cast<double>(texture->least), kRoughness.low, kRoughness.high),
                   nullptr};
    }
    return Found{0, texture};
  };
  const Found both = find(Concat(prefix, "roughness"), {});
  const Found u = find(Concat(prefix, "uroughness"), both);
  const Found v = find(Concat(prefix, "vroughness"), both);
  const bool remap = parameters.Bool("remaproughness", true);
  material.remaps_roughness = remap;
  const bool is_base = facets == Facets::kBase;
  float& alpha_u = is_base ? material.base_alpha_u : material.alpha_u;
  float& alpha_v = is_base ? material.base_alpha_v : material.alpha_v;
  if (u.texture == nullptr && v.texture == nullptr) {
    const double width_u = remap ? std::sqrt(u.number) : u.number;
    const double width_v = remap ? std::sqrt(v.number) : v.number;
    if (std::max(width_u, width_v) < static_cast<double>(kSmoothAlpha)) return;
    // A width of zero in one direction only would divide by zero.
    constexpr double kSmallestAlpha = 1e-4;
    alpha_u = static_cast<float>(std::max(width_u, kSmallestAlpha));
    alpha_v = static_cast<float>(std::max(width_v, kSmallestAlpha));
    return;
  }
  const auto least = [](const Found& found) {
    return found.texture != nullptr ? found.texture->least : static_cast<float>(found.number);
  };
  const auto largest = [](const Found& found) {
    return found.texture != nullptr ? found.texture->largest : static_cast<float>(found.number);
  };
  const FacetWidths widest = WidthsOf(largest(u), largest(v), remap);
  const FacetWidths narrowest = WidthsOf(least(u), least(v), remap);
  alpha_u = widest.u;
  alpha_v = widest.v;
  (is_base ? material.base_may_be_smooth : material.may_be_smooth) = narrowest.u == 0;
  const std::size_t first = is_base ? 2 : 0;
  if (u.texture != nullptr) material.roughness_textures[first] = u.texture->number;
  if (v.texture != nullptr) material.roughness_textures[first + 1] = v.texture->number;
}

void ReadCoat(std::string_view eta, const MaterialInput& input, Material& material) {
  ParameterList& parameters = input.parameters;
  material.ior = parameters.OneRefractiveIndex(eta, kIndexRange);
  if (parameters.IsTexture("thickness")) {
    ReadThickness(input, material);
  } else {
    material.thickness = static_cast<float>(parameters.Float("thickness", 0.01, {0, 1e6}));
  }
  const std::int64_t depth = parameters.FindInteger("maxdepth", {1, 1'000'000}).value_or(10);
  // Every second event is at the base. Of light that comes back more often nothing is left, but for
  // coats of an index far above those of this world.
  constexpr std::int64_t kMostHits = 1000;
  material.base_hits = static_cast<std::int32_t>(std::min(depth / 2 + depth % 2, kMostHits));
  if (parameters.IsTexture("albedo")) {
    parameters.Error("albedo", "must not be a texture; give a colour or a number");
  } else {
    material.coat_albedo = parameters.FindReflectance("albedo").value_or(Rgb{});
  }
  material.phase_g = static_cast<float>(parameters.Float("g", 0, kPhaseCosine));
  // Of a random walk for each evaluation: here there are tables of walks.
  parameters.Ignore("nsamples");
}

std::int32_t FindTexture(std::string_view name, const MaterialInput& input) {
  ParameterList& parameters = input.parameters;
  if (!parameters.IsTexture(name)) return kNoTexture;
  const std::optional<std::string> texture = parameters.FindTexture(name);
  if (!texture.has_value()) return kNoTexture;
  const TextureNames& names = input.from.declared.colors;
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

Material ReadMaterial(std::string_view type, ParameterList& parameters,
                      const MaterialSources& sources) {
  Material material;
  const MaterialReader read = FindReader<MaterialReader>(kKinds, InOneWord(type));
  if (read == nullptr) {
    parameters.Error(Concat(WhyRefused(type), "; ", SupportedKinds<MaterialReader>(kKinds)));
    return material;
  }
  const MaterialInput input = {parameters, sources};
  read(input, material);
  ReadBumps(input, material);
  parameters.WarnOfUnread();
  return material;
}

}  // namespace lucerna
