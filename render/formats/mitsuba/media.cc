// Media: what is inside or outside of a shape, or around a sensor.
#include <algorithm>

#include "render/base/text.h"
#include "render/formats/mitsuba/translator.h"

namespace lucerna {

std::string MitsubaTranslator::MediumOf(const MitsubaObject& object, std::string_view name) {
  const MitsubaObject* medium = ChildOf(object, "medium", name);
  if (medium == nullptr) return {};
  const auto known = media_.find(medium);
  if (known != media_.end()) return known->second;
  return media_.emplace(medium, TranslateMedium(*medium)).first->second;
}

bool MitsubaTranslator::IsEven(const MitsubaObject& medium) const {
  return std::ranges::all_of(medium.children, [this](const MitsubaObject& child) {
    const MitsubaObject* part = FindResolved(child);
    return part == nullptr || part->tag != "volume" || part->type == "constvolume";
  });
}

std::string MitsubaTranslator::TranslateMedium(const MitsubaObject& medium) {
  ParameterList list = ListOf(medium);
  const bool is_even_grid = medium.type == "heterogeneous" && IsEven(medium);
  if (medium.type != "homogeneous" && !is_even_grid) {
    list.Error("is not supported; there is homogeneous, and heterogeneous of constvolume alone");
    return {};
  }
  if (list.Has("material")) {
    list.Error("material", "is not supported: give sigma_t and albedo, or sigma_a and sigma_s");
    return {};
  }
  Rgb absorption;
  Rgb scattering;
  if (list.Has("sigma_a") || list.Has("sigma_s")) {
    absorption = FindColor(medium, list, "sigma_a", {});
    scattering = FindColor(medium, list, "sigma_s", {});
  } else {
    const char* density = list.Has("density") ? "density" : "sigma_t";
    const Rgb extinction = FindColor(medium, list, density, Gray(1));
    const Rgb albedo = FindColor(medium, list, "albedo", Gray(0.75F));
    if (MaxChannel(albedo) > 1) list.Error("albedo", "must be at most 1");
    scattering = extinction * albedo;
    absorption = extinction * (Gray(1) - albedo);
  }
  for (const std::string_view name :
       {"sample_emitters", "has_spectral_extinction", "strategy", "method"})
    list.Ignore(name);
  const std::string name = NewName(medium);
  MadeDirective made = Directive("MakeNamedMedium", medium);
  made.strings = {name};
  made.parameters = {MakeString("type", "homogeneous", medium.location),
                     MakeColor("sigma_a", absorption, medium.location),
                     MakeColor("sigma_s", scattering, medium.location),
                     MakeNumber("scale", list.Float("scale", 1, kZeroOrMore), medium.location)};
  if (const MitsubaObject* phase = ChildOf(medium, "phase")) {
    ParameterList of_phase = ListOf(*phase);
    if (phase->type == "hg") {
      made.parameters.push_back(MakeNumber("g", of_phase.Float("g", 0.8), phase->location));
    } else if (phase->type != "isotropic") {
      of_phase.Error("is not supported; there are isotropic and hg");
    }
    of_phase.WarnOfUnread();
  }
  list.WarnOfUnread();
  RefuseOthers(medium, {"phase", "volume"});
  reader_.CarryOut(std::move(made));
  return name;
}

}  // namespace lucerna
