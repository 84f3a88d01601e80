// BSDFs: materials, and what is wrapped around them.
#include <algorithm>
#include <array>
#include <utility>

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
                                 NamedIndex{"water", 1.333},
                                 NamedIndex{"water ice", 1.31},
                                 NamedIndex{"acetone", 1.36},
                                 NamedIndex{"ethanol", 1.361},
                                 NamedIndex{"fused quartz", 1.458},
                                 NamedIndex{"pyrex", 1.47},
                                 NamedIndex{"benzene", 1.501},
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

constexpr std::string_view kSupported =
    "there are diffuse, roughdiffuse, dielectric, roughdielectric, thindielectric, conductor, "
    "roughconductor, plastic, roughplastic, difftrans, measured, null, blendbsdf, twosided, mask, "
    "bumpmap and normalmap";

}  // namespace

double MitsubaTranslator::FindIndex(ParameterList& list, std::string_view name, double otherwise) {
  const Parameter* value = list.FindWhole(name);
  if (value == nullptr) return otherwise;
  if (value->type == "string") {
    for (const NamedIndex& known : kIndices) {
      if (known.name == value->strings.front()) return known.value;
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
  Parameter remap = MakeNumber("remaproughness", 0, bsdf.location);
  remap.type = "bool";
  remap.numbers.clear();
  remap.bools = {false};
  made.parameters.push_back(std::move(remap));
  if (list.String("distribution", "beckmann") != "ggx") {
    diagnostics_.Warning(
        bsdf.location,
        "the distribution of facets is rendered as \"ggx\" of the same alpha, whose highlights "
        "have wider tails");
  }
  list.Ignore("sample_visible");
}

bool MitsubaTranslator::AddDielectric(ParameterList& list, MadeDirective& made) {
  const double inside = FindIndex(list, "int_ior", kGlass);
  const double outside = FindIndex(list, "ext_ior", kAir);
  made.parameters.push_back(MakeNumber("eta", inside / outside, list.location()));
  for (const std::string_view name : {"specular_reflectance", "specular_transmittance"}) {
    if (list.Has(name)) list.Warning(name, "is ignored: glass reflects and lets pass all light");
    list.Ignore(name);
  }
  return true;
}

bool MitsubaTranslator::AddConductor(const MitsubaObject& bsdf, ParameterList& list,
                                     MadeDirective& made) {
  const bool has_constants = list.Has("eta") || list.Has("k");
  const std::string metal = list.String("material", document_.is_old ? "Cu" : "none");
  auto reflectance = Find(bsdf, list, "specular_reflectance", "reflectance", Meaning::kColor);
  const double outside = FindIndex(list, "ext_eta", FindIndex(list, "ext_ior", 1));
  if (outside < 0.99 || outside > 1.01) list.Warning("", "is rendered as a metal in air");
  if (!has_constants && metal == "none") {
    made.parameters.push_back(
        reflectance.value_or(MakeColor("reflectance", Gray(1), bsdf.location)));
    return true;
  }
  if (reflectance.has_value()) {
    list.Warning("specular_reflectance", "is ignored: eta and k say how much a metal reflects");
  }
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

bool MitsubaTranslator::AddPlastic(const MitsubaObject& bsdf, ParameterList& list,
                                   MadeDirective& made) {
  const double index = FindIndex(list, "int_ior", kPlastic) / FindIndex(list, "ext_ior", kAir);
  auto reflectance = Find(bsdf, list, "diffuse_reflectance", "reflectance", Meaning::kColor);
  if (!reflectance.has_value()) reflectance = MakeColor("reflectance", Gray(0.5F), bsdf.location);
  const bool is_nonlinear = list.Bool("nonlinear", false);
  if (!is_nonlinear && reflectance->type == "rgb") {
    // What the base reflects is multiplied by 1 / (1 - F), as if it were white under its coat, F
    // being the share of diffuse light that the surface reflects back to it. With the reflectance
    // below the same follows from reflections back and forth, which are what is rendered.
    // F by Egan, Hilgeman & Reichman 1973, "Determination of Absorption and Scattering
    // Coefficients for Nonhomogeneous Media. 2: Experiment".
    const double inside = (-1.4399 / index + 0.7099) / index + 0.6681 + 0.0636 * index;
    for (double& rho : reflectance->numbers)
      rho = rho / (1 - inside + rho * inside);
  } else if (!is_nonlinear) {
    list.Warning("diffuse_reflectance",
                 "is a texture, which is rendered as with nonlinear: its colours are darker and "
                 "more saturated");
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

bool MitsubaTranslator::AddBlend(const MitsubaObject& bsdf, ParameterList& list,
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
  if (auto weight = Find(bsdf, list, "weight", "amount", Meaning::kNumber); weight.has_value())
    made.parameters.push_back(*std::move(weight));
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
    color("reflectance", "reflectance", 0.5F);
    if (type == "roughdiffuse") {
      list.Warning("", "is rendered as \"diffuse\"");
      list.Ignore("alpha");
      list.Ignore("use_fast_approx");
    }
    return true;
  }
  if (type == "dielectric" || type == "thindielectric") {
    is(type);
    return AddDielectric(list, made);
  }
  if (type == "roughdielectric") {
    is("dielectric");
    AddRoughness(bsdf, list, made);
    return AddDielectric(list, made);
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
      const MitsubaObject* heights = ChildOf(bsdf, "texture");
      const auto name = heights == nullptr ? std::nullopt : TextureOf(*heights, Meaning::kNumber);
      if (heights == nullptr) list.Error("needs a texture");
      if (!name.has_value()) return std::nullopt;
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
    } else if (bsdf.type == "normalmap") {
      const MitsubaObject* map = ChildOf(bsdf, "texture");
      if (map == nullptr || map->type != "bitmap") {
        list.Error("needs a texture of type bitmap");
        return std::nullopt;
      }
      ParameterList of_map = ListOf(*map);
      wrapping.bumps.push_back(
          MakeString("normalmap", of_map.String("filename", ""), map->location));
    }
    list.WarnOfUnread();
    RefuseOthers(bsdf, {"bsdf", "texture"});
    return TranslateBsdf(*inner, std::move(wrapping));
  }
  MadeDirective made = Directive("MakeNamedMaterial", bsdf);
  const std::string name = NewName(bsdf);
  made.strings = {name};
  if (!AddMaterial(bsdf, list, made)) return std::nullopt;
  made.parameters.insert(made.parameters.end(), wrapping.bumps.begin(), wrapping.bumps.end());
  list.WarnOfUnread();
  RefuseOthers(bsdf, {"bsdf", "texture"});
  reader_.CarryOut(std::move(made));
  return Surface{name, std::move(wrapping.alpha)};
}

}  // namespace lucerna
