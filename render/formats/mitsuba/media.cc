// Media: what is inside or outside of a shape, or around a sensor.
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

std::string MitsubaTranslator::TranslateMedium(const MitsubaObject& medium) {
  ParameterList list = ListOf(medium);
  if (medium.type != "homogeneous") {
    list.Error("is not supported; there is homogeneous");
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
    const Rgb extinction = FindColor(medium, list, "sigma_t", Gray(1));
    const Rgb albedo = FindColor(medium, list, "albedo", Gray(0.75F));
    if (MaxChannel(albedo) > 1) list.Error("albedo", "must be at most 1");
    scattering = extinction * albedo;
    absorption = extinction * (Gray(1) - albedo);
  }
  for (const std::string_view name : {"sample_emitters", "has_spectral_extinction", "strategy"})
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
  RefuseOthers(medium, {"phase"});
  reader_.CarryOut(std::move(made));
  return name;
}

}  // namespace lucerna
