// BSDFs: materials, and what is wrapped around them.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "absl/strings/ascii.h"

#include "render/base/text.h"
#include "render/formats/mitsuba/translator.h"
#include "render/formats/pbrt/optical_constants.h"

namespace lucerna {
namespace {

struct NamedIndex {
  std::string_view name;
  double value;
};
// Mitsuba's names of indices of refraction.
constexpr std::array kIndices = {NamedIndex{"vacuum", 1},
                                 NamedIndex{"helium", 1.000036},
                                 NamedIndex{"hydrogen", 1.000132},
                                 NamedIndex{"air", 1.000277},
                                 NamedIndex{"carbon dioxide", 1.00045},
                                 NamedIndex{"water", 1.333},
                                 NamedIndex{"water ice", 1.31},
                                 NamedIndex{"acetone", 1.36},
                                 NamedIndex{"ethanol", 1.361},
                                 NamedIndex{"carbon tetrachloride", 1.461},
                                 NamedIndex{"glycerol", 1.4729},
                                 NamedIndex{"fused quartz", 1.458},
                                 NamedIndex{"pyrex", 1.47},
                                 NamedIndex{"benzene", 1.501},
                                 NamedIndex{"silicone oil", 1.52045},
                                 NamedIndex{"bromine", 1.661},
                                 NamedIndex{"acrylic glass", 1.49},
                                 NamedIndex{"polypropylene", 1.49},
                                 NamedIndex{"bk7", 1.5046},
                                 NamedIndex{"sodium chloride", 1.544},
                                 NamedIndex{"amber", 1.55},
                                 NamedIndex{"pet", 1.575},
                                 NamedIndex{"diamond", 2.419}};
constexpr double kAir = 1.000277;
constexpr double kGlass = 1.5046;
constexpr double kPlastic = 1.49;

// Roughness is a width.
Parameter WithoutRemap(const SourceLocation& location) {
  Parameter remap;
  remap.location = location;
  remap.type = "bool";
  remap.name = "remaproughness";
  remap.bools = {false};
  return remap;
}

constexpr std::string_view kSupported =
    "there are diffuse, roughdiffuse, dielectric, roughdielectric, thindielectric, conductor, "
    "roughconductor, plastic, roughplastic, principled, phong, coating, difftrans, measured, null, "
    "blendbsdf, "
    "mixturebsdf, twosided, mask, bumpmap and normalmap";

}  // namespace

double MitsubaTranslator::FindIndex(ParameterList& list, std::string_view name, double otherwise) {
  const Parameter* value = list.FindWhole(name);
  if (value == nullptr) return otherwise;
  if (value->type == "string") {
    const std::string wanted = absl::AsciiStrToLower(value->strings.front());
    for (const NamedIndex& known : kIndices) {
      if (known.name == wanted) return known.value;
    }
    std::vector<std::string_view> names;
    for (const NamedIndex& known : kIndices)
      names.push_back(known.name);
    list.Error(name, Concat("is unknown; there are ", Listed(names), ", or a number"));
    return otherwise;
  }
  return list.Float(name, otherwise, {0.01, 100});
}

void MitsubaTranslator::AddRoughness(const MitsubaObject& bsdf, ParameterList& list,
                                     MadeDirective& made) {
  constexpr std::array<std::array<std::string_view, 2>, 3> kNames = {
      {{"alpha", "roughness"}, {"alpha_u", "uroughness"}, {"alpha_v", "vroughness"}}};
  bool is_given = false;
  for (const auto& [name, as] : kNames) {
    if (auto found = Find(bsdf, list, name, std::string(as), Meaning::kNumber); found.has_value()) {
      made.parameters.push_back(*std::move(found));
      is_given = true;
    }
  }
  if (!is_given) made.parameters.push_back(MakeNumber("roughness", 0.1, bsdf.location));
  Parameter remap = WithoutRemap(bsdf.location);
  made.parameters.push_back(std::move(remap));
  if (list.String("distribution", "beckmann") != "ggx") {
    diagnostics_.Warning(
        bsdf.location,
        "the distribution of facets is rendered as \"ggx\" of the same alpha, whose highlights "
        "have wider tails");
  }
  list.Ignore("sample_visible");
}

Rgb MitsubaTranslator::FindTint(const MitsubaObject& bsdf, ParameterList& list,
                                std::string_view name) {
  const auto tint = Find(bsdf, list, name, std::string(name), Meaning::kColor);
  if (!tint.has_value()) return Gray(1);
  if (tint->type != "rgb" || tint->numbers.size() != 3) {
    list.Warning(name, "is ignored: it may be a colour, not a texture or a spectrum");
    return Gray(1);
  }
  const auto held = [](double channel) {
    return static_cast<float>(std::clamp(channel, 0.0, 1.0));
  };
  return {held(tint->numbers[0]), held(tint->numbers[1]), held(tint->numbers[2])};
}

bool MitsubaTranslator::AddDielectric(const MitsubaObject& bsdf, ParameterList& list,
                                      MadeDirective& made) {
  const double inside = FindIndex(list, "int_ior", kGlass);
  const double outside = FindIndex(list, "ext_ior", kAir);
  made.parameters.push_back(MakeNumber("eta", inside / outside, list.location()));
  tints_ = {FindTint(bsdf, list, "specular_reflectance"),
            FindTint(bsdf, list, "specular_transmittance")};
  return true;
}

bool MitsubaTranslator::AddConductor(const MitsubaObject& bsdf, ParameterList& list,
                                     MadeDirective& made) {
  const bool has_constants = list.Has("eta") || list.Has("k");
  const std::string metal = list.String("material", document_.is_old() ? "Cu" : "none");
  const double outside = FindIndex(list, "ext_eta", FindIndex(list, "ext_ior", 1));
  if (outside < 0.99 || outside > 1.01) list.Warning("", "is rendered as a metal in air");
  tints_.emplace();
  if (!has_constants && metal == "none") {
    made.parameters.push_back(
        Find(bsdf, list, "specular_reflectance", "reflectance", Meaning::kColor)
            .value_or(MakeColor("reflectance", Gray(1), bsdf.location)));
    return true;
  }
  tints_ = {FindTint(bsdf, list, "specular_reflectance"), Gray(1)};
  if (has_constants) {
    for (const std::string_view name : {"eta", "k"}) {
      if (auto value = Find(bsdf, list, name, std::string(name), Meaning::kColor);
          value.has_value()) {
        made.parameters.push_back(*std::move(value));
      }
    }
    return true;
  }
  if (!MetalNamed(metal).has_value()) {
    list.Error("material", Concat("has no constants for ", Quoted(metal),
                                  "; there are Ag, Al, Au, Cu, CuZn, MgO, TiO2 and none; or give "
                                  "eta and k"));
    return false;
  }
  for (const std::string_view name : {"eta", "k"}) {
    Parameter value =
        MakeString(std::string(name), Concat("metal-", metal, "-", name), bsdf.location);
    value.type = "spectrum";
    made.parameters.push_back(std::move(value));
  }
  return true;
}

namespace {

// Of unpolarised light that meets a surface from within a body of this index.
double FresnelFromInside(double cosine, double index) {
  const double sin2 = index * index * (1 - cosine * cosine);
  if (sin2 >= 1) return 1;
  const double beyond = std::sqrt(1 - sin2);
  const double parallel = (cosine - index * beyond) / (cosine + index * beyond);
  const double across = (index * cosine - beyond) / (index * cosine + beyond);
  return (parallel * parallel + across * across) / 2;
}

// The share of diffuse light that a surface of GGX facets of width alpha sends back into a body of
// this index: over facets m with the density D(m) cos(m), of light from all sides with the density
// cosine / pi (Walter et al. 2007, "Microfacet Models for Refraction through Rough Surfaces").
double InnerReflectance(double index, double alpha) {
  constexpr int kSlopes = 32;
  constexpr int kAzimuths = 32;
  constexpr int kCosines = 128;
  const double a2 = std::clamp(alpha * alpha, 1e-12, 1e6);
  const auto visible = [&](double cosine) {
    const double c2 = cosine * cosine;
    return 2 / (1 + std::sqrt(1 + a2 * (1 - c2) / c2));
  };
  double sum = 0;
  for (int i = 0; i < kCosines; ++i) {
    const double cos_w = std::sqrt((i + 0.5) / kCosines);
    const double sin_w = std::sqrt(1 - cos_w * cos_w);
    for (int j = 0; j < kSlopes; ++j) {
      const double u = (j + 0.5) / kSlopes;
      const double cos_m = 1 / std::sqrt(1 + a2 * u / (1 - u));
      const double sin_m = std::sqrt(1 - cos_m * cos_m);
      for (int k = 0; k < kAzimuths; ++k) {
        const double azimuth = 2 * std::numbers::pi * (k + 0.5) / kAzimuths;
        const double to_facet = sin_w * sin_m * std::cos(azimuth) + cos_w * cos_m;
        const double cos_out = 2 * to_facet * cos_m - cos_w;
        if (to_facet <= 0 || cos_out <= 0) continue;
        sum += FresnelFromInside(to_facet, index) * visible(cos_w) * visible(cos_out) * to_facet /
               (cos_w * cos_m);
      }
    }
  }
  return std::min(sum / (kCosines * kSlopes * kAzimuths), 1.0);
}

// The width that AddRoughness has added, or 0: of a texture its middle is not known here.
double AlphaOf(const MadeDirective& made) {
  double squares = 0;
  int count = 0;
  for (const Parameter& parameter : made.parameters) {
    if (parameter.name == "remaproughness" || !parameter.name.ends_with("roughness")) continue;
    if (parameter.numbers.size() != 1) continue;
    squares += parameter.numbers[0] * parameter.numbers[0];
    ++count;
  }
  return count > 0 ? std::sqrt(squares / count) : 0;
}

}  // namespace

bool MitsubaTranslator::AddPlastic(const MitsubaObject& bsdf, ParameterList& list,
                                   MadeDirective& made) {
  const double index = FindIndex(list, "int_ior", kPlastic) / FindIndex(list, "ext_ior", kAir);
  const bool is_nonlinear = list.Bool("nonlinear", false);
  // What the base reflects is multiplied by 1 / (1 - F), as if it were white under its coat, F
  // being the share of diffuse light that the surface reflects back to it. With the reflectance
  // below the same follows from reflections back and forth, which are what is rendered.
  const double inside = is_nonlinear ? 0 : InnerReflectance(index, AlphaOf(made));
  const MitsubaObject* texture = ChildOf(bsdf, "texture", "diffuse_reflectance");
  if (texture != nullptr && texture->type == "bitmap") returned_ = inside;
  assets_.ReadPicturesAsMitsuba(returned_);
  auto reflectance = Find(bsdf, list, "diffuse_reflectance", "reflectance", Meaning::kColor);
  assets_.ReadPicturesAsMitsuba();
  const bool is_picture = std::exchange(returned_, 0) > 0;
  if (!reflectance.has_value()) reflectance = MakeColor("reflectance", Gray(0.5F), bsdf.location);
  if (!is_nonlinear && reflectance->type == "rgb") {
    for (double& rho : reflectance->numbers)
      rho = rho / (1 - inside + rho * inside);
  } else if (inside > 0 && !is_picture) {
    list.Warning("diffuse_reflectance",
                 "is neither a colour nor a bitmap and is rendered as with nonlinear: its colours "
                 "are darker and more saturated");
  }
  made.parameters.push_back(*std::move(reflectance));
  made.parameters.push_back(MakeNumber("eta", index, bsdf.location));
  made.parameters.push_back(MakeNumber("thickness", 0, bsdf.location));
  Parameter depth = MakeNumber("maxdepth", 40, bsdf.location);
  depth.type = "integer";
  made.parameters.push_back(std::move(depth));
  if (list.Has("specular_reflectance"))
    list.Warning("specular_reflectance", "is ignored: the index of refraction decides");
  list.Ignore("specular_reflectance");
  return true;
}

bool MitsubaTranslator::AddParts(const MitsubaObject& bsdf, ParameterList& list,
                                 MadeDirective& made) {
  Parameter materials = MakeString("materials", "", bsdf.location);
  materials.strings.clear();
  for (const MitsubaObject& child : bsdf.children) {
    const MitsubaObject* part = Resolve(child);
    if (part == nullptr || part->tag != "bsdf") continue;
    const std::optional<Surface> surface = SurfaceOf(*part);
    if (!surface.has_value()) return false;
    if (surface->alpha.has_value()) list.Error("must not blend a mask");
    materials.strings.push_back(surface->material);
  }
  if (materials.strings.size() != 2) {
    list.Error("needs two bsdfs");
    return false;
  }
  made.parameters.push_back(std::move(materials));
  return true;
}

bool MitsubaTranslator::AddBlend(const MitsubaObject& bsdf, ParameterList& list,
                                 MadeDirective& made) {
  if (!AddParts(bsdf, list, made)) return false;
  if (auto weight = Find(bsdf, list, "weight", "amount", Meaning::kNumber); weight.has_value())
    made.parameters.push_back(*std::move(weight));
  return true;
}

bool MitsubaTranslator::AddMixture(const MitsubaObject& bsdf, ParameterList& list,
                                   MadeDirective& made) {
  if (!AddParts(bsdf, list, made)) return false;
  const auto weights = ListedNumbers(list.String("weights", ""));
  if (!weights.has_value() || weights->size() != 2 || (*weights)[0] < 0 || (*weights)[1] < 0 ||
      !((*weights)[0] + (*weights)[1] > 0)) {
    list.Error("needs <string name=\"weights\">, two numbers of at least 0");
    return false;
  }
  const double sum = (*weights)[0] + (*weights)[1];
  if (sum < 0.999)
    list.Warning("weights", "are taken times what makes their sum 1, where Mitsuba absorbs light");
  made.parameters.push_back(MakeNumber("amount", (*weights)[1] / sum, bsdf.location));
  return true;
}

std::string MitsubaTranslator::AddNamedMaterial(const MitsubaObject& around, std::string_view type,
                                                std::vector<Parameter> parameters) {
  MitsubaObject named;
  named.id = Concat(type, " of ", around.type, " in line ", around.location.line);
  MadeDirective made = Directive("MakeNamedMaterial", around);
  made.strings = {NewName(named)};
  made.parameters = std::move(parameters);
  made.parameters.push_back(MakeString("type", std::string(type), around.location));
  std::string name = made.strings.front();
  reader_.CarryOut(std::move(made));
  return name;
}

// A lobe of cos^n is about as wide as facets of the width sqrt(2 / (n + 2)) make one. Of diffuse kd
// and the lobe ks the mix has both with its share of the paths, so each is divided by its own.
bool MitsubaTranslator::AddPhong(const MitsubaObject& bsdf, ParameterList& list,
                                 MadeDirective& made) {
  list.Warning("", "is rendered as a mix of \"diffuse\" and a rough metal");
  const auto diffuse = Find(bsdf, list, "diffuse_reflectance", "reflectance", Meaning::kColor)
                           .value_or(MakeColor("reflectance", Gray(0.5F), bsdf.location));
  auto specular = Find(bsdf, list, "specular_reflectance", "reflectance", Meaning::kColor)
                      .value_or(MakeColor("reflectance", Gray(0.2F), bsdf.location));
  if (specular.type == "texture") {
    list.Warning("specular_reflectance", "is a texture, which is rendered as 0.2");
    specular = MakeColor("reflectance", Gray(0.2F), bsdf.location);
  }
  const double exponent = list.Float("exponent", 30, kZeroOrMore);
  if (specular.type != "rgb" || (diffuse.type != "rgb" && diffuse.type != "texture")) {
    list.Error("needs reflectances that are rgb");
    return false;
  }
  const auto mean = [](const std::vector<double>& rgb) { return (rgb[0] + rgb[1] + rgb[2]) / 3; };
  const double of_diffuse = diffuse.type == "rgb" ? mean(diffuse.numbers) : 0.5;
  const double sum = of_diffuse + mean(specular.numbers);
  // All of a texture is kept.
  const double amount = diffuse.type != "rgb" ? mean(specular.numbers)
                        : sum > 0             ? mean(specular.numbers) / sum
                                              : 0;
  const auto divided = [](Parameter color, double by) {
    if (color.type != "rgb" || !(by > 0)) return color;
    for (double& channel : color.numbers)
      channel = std::clamp(channel / by, 0.0, 1.0);
    return color;
  };
  Parameter remap = WithoutRemap(bsdf.location);
  const double alpha = std::sqrt(2 / (exponent + 2));
  Parameter materials = MakeString("materials", "", bsdf.location);
  materials.strings = {
      AddNamedMaterial(bsdf, "diffuse", {divided(diffuse, 1 - amount)}),
      AddNamedMaterial(bsdf, "conductor",
                       {divided(specular, amount), MakeNumber("roughness", alpha, bsdf.location),
                        std::move(remap)})};
  made.parameters.push_back(std::move(materials));
  made.parameters.push_back(MakeNumber("amount", amount, bsdf.location));
  return true;
}

Parameter MitsubaTranslator::SquaredRoughness(const MitsubaObject& bsdf, ParameterList& list) {
  auto roughness = Find(bsdf, list, "roughness", "roughness", Meaning::kNumber)
                       .value_or(MakeNumber("roughness", 0.5, bsdf.location));
  if (roughness.type == "texture") {
    MadeDirective squared = Directive("Texture", bsdf);
    MitsubaObject named;
    named.id = Concat("squared roughness in line ", bsdf.location.line);
    squared.strings = {NewName(named), "float", "scale"};
    for (const std::string_view part : {"tex", "scale"}) {
      squared.parameters.push_back(roughness);
      squared.parameters.back().name = part;
    }
    roughness.strings = {squared.strings.front()};
    reader_.CarryOut(std::move(squared));
  } else {
    roughness.numbers.front() *= roughness.numbers.front();
  }
  return roughness;
}

// As of glTF's model, which has the same roots: a diffuse base under a coat that loses no light, a
// share of which is glass, and a share of all a metal of the same colour.
std::string MitsubaTranslator::TranslatePrincipled(const MitsubaObject& bsdf, ParameterList& list,
                                                   const Wrapping& wrapping) {
  const auto color = Find(bsdf, list, "base_color", "reflectance", Meaning::kColor)
                         .value_or(MakeColor("reflectance", Gray(0.5F), bsdf.location));
  const Parameter roughness = SquaredRoughness(bsdf, list);
  const double specular = list.Float("specular", 0.5, {0, 1});
  const double index =
      list.Has("eta") ? list.Float("eta", 1.5, {1, 100}) : 2 / (1 - std::sqrt(0.08 * specular)) - 1;
  Parameter remap = WithoutRemap(bsdf.location);
  for (const std::string_view name :
       {"anisotropic", "spec_tint", "sheen", "sheen_tint", "clearcoat", "clearcoat_gloss",
        "flatness", "diffuse_reflectance_sampling_rate"}) {
    const Parameter* const given = list.FindWhole(name);
    const bool is_none = given == nullptr || name == "clearcoat_gloss" || name == "sheen_tint" ||
                         (given->type == "float" && given->numbers.front() == 0);
    if (!is_none) list.Warning(name, "is ignored");
    list.Ignore(name);
  }
  std::vector<Material>& materials = reader_.scene().materials;
  // Its name, and the material, or nullptr after an error.
  const auto part = [&](std::string_view type, std::vector<Parameter> parameters) {
    parameters.insert(parameters.end(), wrapping.bumps.begin(), wrapping.bumps.end());
    const std::size_t before = materials.size();
    const std::size_t textures_before = reader_.scene().textures.size();
    std::string name = AddNamedMaterial(bsdf, type, std::move(parameters));
    if (wrapping.normals.has_value()) Place(*wrapping.normals, textures_before);
    return std::pair(std::move(name), materials.size() > before ? &materials.back() : nullptr);
  };
  const auto mix = [&](const std::string& first, const std::string& second, Parameter amount) {
    amount.name = "amount";
    Parameter parts = MakeString("materials", first, bsdf.location);
    parts.strings.push_back(second);
    return AddNamedMaterial(bsdf, "mix", {std::move(parts), std::move(amount)});
  };
  const auto share = [&](std::string_view name) {
    return Find(bsdf, list, name, "amount", Meaning::kNumber)
        .value_or(MakeNumber("amount", 0, bsdf.location));
  };
  const auto is_all = [](const Parameter& amount, double all) {
    return amount.type == "float" && amount.numbers.front() == all;
  };
  const Parameter metallic = share("metallic");
  const Parameter through = share("spec_trans");
  std::string surface;
  if (!is_all(through, 1)) {
    const bool has_coat = index > 1;
    std::vector<Parameter> coated = {color};
    if (has_coat) {
      coated.insert(coated.end(), {roughness, remap, MakeNumber("eta", index, bsdf.location),
                                   MakeNumber("thickness", 0, bsdf.location)});
    }
    const auto [name, material] = part(has_coat ? "coateddiffuse" : "diffuse", std::move(coated));
    if (has_coat && material != nullptr) material->coat_passes_rest = true;
    surface = name;
  }
  if (!is_all(through, 0)) {
    // Facets between equal media bend nothing.
    const Parameter of_glass = index > 1 ? roughness : MakeNumber("roughness", 0, bsdf.location);
    const auto [glass, material] =
        part("dielectric", {of_glass, remap, MakeNumber("eta", index, bsdf.location)});
    // Light crosses the surface twice.
    if (color.type == "rgb" && color.numbers.size() == 3 && material != nullptr) {
      const auto root = [&](std::size_t c) {
        return static_cast<float>(std::sqrt(std::clamp(color.numbers[c], 0.0, 1.0)));
      };
      material->transmission_tint = {root(0), root(1), root(2)};
      material->is_tinted = material->transmission_tint != Gray(1);
    } else if (color.type == "texture") {
      list.Warning("base_color", "is a texture, which does not colour what goes through");
    }
    surface = surface.empty() ? glass : mix(surface, glass, through);
  }
  if (!is_all(metallic, 0)) {
    const std::string metal = part("conductor", {color, roughness, remap}).first;
    surface = is_all(metallic, 1) ? metal : mix(surface, metal, metallic);
  }
  return surface;
}

void MitsubaTranslator::TintLastMaterial() {
  if (!tints_.has_value()) return;
  Material& material = reader_.scene().materials.back();
  material.reflection_tint = tints_->reflection;
  material.transmission_tint = tints_->transmission;
  material.is_tinted = tints_->reflection != Gray(1) || tints_->transmission != Gray(1);
  tints_.reset();
}

// A smooth dielectric over what pbrt has coats for.
bool MitsubaTranslator::AddCoating(const MitsubaObject& bsdf, ParameterList& list,
                                   MadeDirective& made) {
  const MitsubaObject* base = ChildOf(bsdf, "bsdf");
  for (int i = 0; i < 4 && base != nullptr && base->type == "twosided"; ++i)
    base = ChildOf(*base, "bsdf");
  const std::string_view type = base != nullptr ? std::string_view(base->type) : "";
  const bool is_metal = type == "conductor" || type == "roughconductor";
  if (!is_metal && type != "diffuse") {
    list.Error("is supported over diffuse, conductor and roughconductor alone");
    return false;
  }
  const double index = FindIndex(list, "int_ior", kGlass) / FindIndex(list, "ext_ior", kAir);
  for (const std::string_view name : {"sigma_a", "specular_reflectance"}) {
    if (list.Has(name)) list.Warning(name, "is ignored: the coat is clear");
    list.Ignore(name);
  }
  list.Ignore("thickness");
  ParameterList of_base = ListOf(*base);
  if (is_metal) {
    MadeDirective metal;
    if (type == "roughconductor") AddRoughness(*base, of_base, metal);
    if (!AddConductor(*base, of_base, metal)) return false;
    if (tints_->reflection != Gray(1))
      of_base.Warning("specular_reflectance",
                      "is ignored: eta and k say how much a metal reflects");
    tints_.reset();
    for (Parameter& parameter : metal.parameters) {
      if (parameter.name != "reflectance" && parameter.name != "remaproughness")
        parameter.name = Concat("conductor.", parameter.name);
      made.parameters.push_back(std::move(parameter));
    }
    made.parameters.push_back(MakeNumber("interface.roughness", 0, bsdf.location));
  } else {
    made.parameters.push_back(Find(*base, of_base, "reflectance", "reflectance", Meaning::kColor)
                                  .value_or(MakeColor("reflectance", Gray(0.5F), bsdf.location)));
  }
  of_base.WarnOfUnread();
  made.parameters.push_back(
      MakeString("type", is_metal ? "coatedconductor" : "coateddiffuse", bsdf.location));
  made.parameters.push_back(MakeNumber(is_metal ? "interface.eta" : "eta", index, bsdf.location));
  made.parameters.push_back(MakeNumber("thickness", 0, bsdf.location));
  Parameter depth = MakeNumber("maxdepth", 40, bsdf.location);
  depth.type = "integer";
  made.parameters.push_back(std::move(depth));
  return true;
}

bool MitsubaTranslator::AddMaterial(const MitsubaObject& bsdf, ParameterList& list,
                                    MadeDirective& made) {
  const std::string_view type = bsdf.type;
  const auto is = [&](std::string_view material) {
    made.parameters.push_back(MakeString("type", std::string(material), bsdf.location));
  };
  const auto color = [&](std::string_view name, std::string as, float otherwise) {
    auto found = Find(bsdf, list, name, as, Meaning::kColor);
    made.parameters.push_back(
        found.value_or(MakeColor(std::move(as), Gray(otherwise), bsdf.location)));
  };
  if (type == "diffuse" || type == "roughdiffuse") {
    is("diffuse");
    // Old files have both names.
    const bool has_old_name = document_.is_old() && list.Has("diffuse_reflectance");
    color(has_old_name ? "diffuse_reflectance" : "reflectance", "reflectance", 0.5F);
    if (type == "roughdiffuse") {
      list.Warning("", "is rendered as \"diffuse\"");
      list.Ignore("alpha");
      list.Ignore("use_fast_approx");
    }
    return true;
  }
  if (type == "dielectric" || type == "thindielectric") {
    is(type);
    return AddDielectric(bsdf, list, made);
  }
  if (type == "roughdielectric") {
    is("dielectric");
    AddRoughness(bsdf, list, made);
    return AddDielectric(bsdf, list, made);
  }
  if (type == "conductor") {
    is("conductor");
    return AddConductor(bsdf, list, made);
  }
  if (type == "roughconductor") {
    is("conductor");
    AddRoughness(bsdf, list, made);
    return AddConductor(bsdf, list, made);
  }
  if (type == "plastic") {
    is("coateddiffuse");
    return AddPlastic(bsdf, list, made);
  }
  if (type == "roughplastic") {
    is("coateddiffuse");
    AddRoughness(bsdf, list, made);
    return AddPlastic(bsdf, list, made);
  }
  if (type == "difftrans") {
    is("diffusetransmission");
    color("transmittance", "transmittance", 0.5F);
    made.parameters.push_back(MakeColor("reflectance", {}, bsdf.location));
    return true;
  }
  if (type == "measured") {
    is("measured");
    made.parameters.push_back(MakeString("filename", list.String("filename", ""), bsdf.location));
    return true;
  }
  if (type == "null") {
    is("interface");
    return true;
  }
  if (type == "blendbsdf") {
    is("mix");
    return AddBlend(bsdf, list, made);
  }
  if (type == "mixturebsdf") {
    is("mix");
    return AddMixture(bsdf, list, made);
  }
  if (type == "phong") {
    is("mix");
    return AddPhong(bsdf, list, made);
  }
  if (type == "coating") return AddCoating(bsdf, list, made);
  list.Error(Concat("is not supported; ", kSupported));
  return false;
}

std::optional<MitsubaTranslator::Surface> MitsubaTranslator::SurfaceOf(const MitsubaObject& bsdf) {
  const auto known = surfaces_.find(&bsdf);
  if (known != surfaces_.end()) return known->second;
  std::optional<Surface> surface = TranslateBsdf(bsdf, {});
  surfaces_.emplace(&bsdf, surface);
  return surface;
}

std::optional<MitsubaTranslator::Surface> MitsubaTranslator::TranslateBsdf(
    const MitsubaObject& bsdf, Wrapping wrapping) {
  if (!Open(bsdf)) return std::nullopt;
  std::optional<Surface> surface = TranslateOpenBsdf(bsdf, std::move(wrapping));
  Close(bsdf);
  return surface;
}

bool MitsubaTranslator::AddBumpMap(const MitsubaObject& bsdf, ParameterList& list,
                                   Wrapping& wrapping) {
  const MitsubaObject* heights = ChildOf(bsdf, "texture");
  for (const MitsubaObject& child : bsdf.children)
    list.Ignore(child.name);
  const auto name = heights == nullptr ? std::nullopt : TextureOf(*heights, Meaning::kNumber);
  if (heights == nullptr) list.Error("needs a texture");
  if (!name.has_value()) return false;
  std::string used = *name;
  if (const double scale = list.Float("scale", 1); scale != 1) {
    used = NewName(bsdf);
    MadeDirective scaled = Directive("Texture", bsdf);
    scaled.strings = {used, "float", "scale"};
    Parameter part = MakeString("tex", *name, bsdf.location);
    part.type = "texture";
    scaled.parameters = {std::move(part), MakeNumber("scale", scale, bsdf.location)};
    reader_.CarryOut(std::move(scaled));
  }
  Parameter bump = MakeString("displacement", used, bsdf.location);
  bump.type = "texture";
  wrapping.bumps.push_back(std::move(bump));
  return true;
}

bool MitsubaTranslator::AddNormalMap(const MitsubaObject& bsdf, ParameterList& list,
                                     Wrapping& wrapping) {
  const MitsubaObject* map = ChildOf(bsdf, "texture");
  for (const MitsubaObject& child : bsdf.children)
    list.Ignore(child.name);
  double scale = 1;
  // Few, for one may refer to itself.
  for (int i = 0; i < 4 && map != nullptr && map->type == "scale"; ++i) {
    ParameterList of_scale = ListOf(*map);
    for (const MitsubaObject& child : map->children)
      of_scale.Ignore(child.name);
    scale *= of_scale.Float("scale", 1, {0, 1e6});
    of_scale.WarnOfUnread();
    map = ChildOf(*map, "texture");
  }
  if (map == nullptr || map->type != "bitmap") {
    list.Error("needs a texture of type bitmap");
    return false;
  }
  ParameterList of_map = ListOf(*map);
  MadeDirective picture;
  Placement placement = TranslateBitmap(*map, of_map, picture);
  of_map.WarnOfUnread();
  placement.scale = static_cast<float>(scale);
  wrapping.normals = placement;
  // Normals are linear, whatever the file says.
  for (Parameter& parameter : picture.parameters) {
    if (parameter.name != "filename") continue;
    parameter.name = "normalmap";
    wrapping.bumps.push_back(std::move(parameter));
  }
  return true;
}

std::optional<MitsubaTranslator::Surface> MitsubaTranslator::TranslateOpenBsdf(
    const MitsubaObject& bsdf, Wrapping wrapping) {
  ParameterList list = ListOf(bsdf);
  const bool wraps = bsdf.type == "twosided" || bsdf.type == "mask" || bsdf.type == "bumpmap" ||
                     bsdf.type == "normalmap";
  if (wraps) {
    const MitsubaObject* inner = ChildOf(bsdf, "bsdf");
    if (inner == nullptr) {
      list.Error("needs a bsdf");
      return std::nullopt;
    }
    if (bsdf.type == "mask") {
      wrapping.alpha = Find(bsdf, list, "opacity", "alpha", Meaning::kNumber)
                           .value_or(MakeNumber("alpha", 0.5, bsdf.location));
    } else if (bsdf.type == "bumpmap") {
      if (!AddBumpMap(bsdf, list, wrapping)) return std::nullopt;
    } else if (bsdf.type == "normalmap") {
      if (!AddNormalMap(bsdf, list, wrapping)) return std::nullopt;
    } else if (std::ranges::count_if(bsdf.children, [this](const MitsubaObject& child) {
                 const MitsubaObject* resolved = FindResolved(child);
                 return resolved != nullptr && resolved->tag == "bsdf";
               }) > 1) {
      list.Warning("", "has a second bsdf, which is not used: both sides have the first");
    }
    list.WarnOfUnread();
    if (bsdf.type == "twosided" || bsdf.type == "mask") {
      RefuseOthers(bsdf, {"bsdf"});
    } else {
      RefuseOthers(bsdf, {"bsdf", "texture"});
    }
    return TranslateBsdf(*inner, std::move(wrapping));
  }
  if (bsdf.type == "principled") {
    std::string name = TranslatePrincipled(bsdf, list, wrapping);
    list.WarnOfUnread();
    RefuseOthers(bsdf, {});
    return Surface{std::move(name), std::move(wrapping.alpha), false};
  }
  MadeDirective made = Directive("MakeNamedMaterial", bsdf);
  const std::string name = NewName(bsdf);
  made.strings = {name};
  tints_.reset();
  if (!AddMaterial(bsdf, list, made)) return std::nullopt;
  made.parameters.insert(made.parameters.end(), wrapping.bumps.begin(), wrapping.bumps.end());
  list.WarnOfUnread();
  if (bsdf.type == "blendbsdf" || bsdf.type == "mixturebsdf" || bsdf.type == "coating") {
    RefuseOthers(bsdf, {"bsdf"});
  } else {
    RefuseOthers(bsdf, {});
  }
  const std::size_t textures_before = reader_.scene().textures.size();
  const std::size_t materials_before = reader_.scene().materials.size();
  reader_.CarryOut(std::move(made));
  if (reader_.scene().materials.size() > materials_before) TintLastMaterial();
  if (wrapping.normals.has_value()) Place(*wrapping.normals, textures_before);
  return Surface{name, std::move(wrapping.alpha), bsdf.type == "null"};
}

std::optional<MitsubaTranslator::Surface> MitsubaTranslator::SurfaceOfShape(
    const MitsubaObject& shape, bool has_media) {
  const MitsubaObject* bsdf = ChildOf(shape, "bsdf");
  const bool emits = ChildOf(shape, "emitter") != nullptr;
  std::optional<Surface> surface;
  if (bsdf != nullptr) {
    surface = SurfaceOf(*bsdf);
    if (!surface.has_value() || !surface->is_null || !emits) return surface;
    diagnostics_.Warning(shape.location, Concat(SubjectOf(shape),
                                                " with an emitter and the bsdf \"null\" is "
                                                "rendered as a black one: light does not pass "
                                                "through it"));
  } else {
    surface.emplace();
    surface->is_null = !emits && has_media && document_.version < std::array<int, 3>{0, 6, 1};
    if (!emits && !surface->is_null) return std::nullopt;
  }
  const std::string type = emits ? "diffuse" : "interface";
  std::string& material = stand_ins_[type];
  if (material.empty()) {
    std::vector<Parameter> black;
    if (emits) black.push_back(MakeColor("reflectance", {}, shape.location));
    material = AddNamedMaterial(shape, type, std::move(black));
  }
  surface->material = material;
  return surface;
}

bool MitsubaTranslator::HasTexture(const MitsubaObject& bsdf,
                                   std::set<const MitsubaObject*>& visited) const {
  if (!visited.insert(&bsdf).second) return false;
  return std::ranges::any_of(bsdf.children, [&](const MitsubaObject& child) {
    const MitsubaObject* part = FindResolved(child);
    if (part == nullptr) return false;
    return part->tag == "texture" || (part->tag == "bsdf" && HasTexture(*part, visited));
  });
}

}  // namespace lucerna
