// Emitters that are no part of a shape.
#include <algorithm>
#include <utility>

#include "render/base/text.h"
#include "render/formats/environment_picture.h"
#include "render/formats/mitsuba/translator.h"

namespace lucerna {
void MitsubaTranslator::TranslateEnvironment(const MitsubaObject& emitter, ParameterList& list) {
  const std::optional<std::string> file = list.FindString("filename");
  if (!file.has_value()) {
    list.Error("needs <string name=\"filename\">");
    return;
  }
  const double scale = list.Float("scale", 1, kZeroOrMore);
  list.Ignore("mis_compensation");
  const StatusOr<std::shared_ptr<const Picture>> map = assets_.ReadPicture(*file, {});
  if (!map.ok()) {
    list.Error("filename", Concat("cannot be read: ", map.status().message()));
    return;
  }
  const StatusOr<InfiniteLight> light = EnvironmentLight(**map, scale, ToWorld(emitter));
  if (!light.ok()) {
    list.Error(std::string(light.status().message()));
    return;
  }
  reader_.scene().infinite_lights.push_back(*light);
}

void MitsubaTranslator::TranslateEmitter(const MitsubaObject& emitter) {
  ParameterList list = ListOf(emitter);
  list.Ignore("sampling_weight");
  MadeDirective made = Directive("LightSource", emitter);
  const auto number = [&](const char* name, double value) {
    made.parameters.push_back(MakeNumber(name, value, emitter.location));
  };
  const auto light = [&](const char* as, const char* name) {
    made.parameters.push_back(MakeColor(as, FindLight(emitter, list, name), emitter.location));
  };
  const auto place = [&](const char* as, Vec3 point) {
    Parameter parameter = MakeNumber(as, 0, emitter.location);
    parameter.type = "point3";
    parameter.numbers = {static_cast<double>(point.x), static_cast<double>(point.y),
                         static_cast<double>(point.z)};
    made.parameters.push_back(std::move(parameter));
  };
  Transform to_world = ToWorld(emitter);
  if (emitter.type == "point") {
    made.strings = {"point"};
    light("I", "intensity");
    if (list.Has("position")) {
      place("from", list.Point("position", {}));
      to_world = {};
    }
  } else if (emitter.type == "spot") {
    made.strings = {"spot"};
    light("I", "intensity");
    const double cutoff_deg = list.Float("cutoff_angle", 20, {0, 180, false});
    const double beam_deg = list.Float("beam_width", cutoff_deg * 3 / 4, {0, 180});
    number("coneangle", cutoff_deg);
    number("conedeltaangle", std::max(0.0, cutoff_deg - beam_deg));
    list.Ignore("texture");
    if (ChildOf(emitter, "texture") != nullptr)
      list.Error("with a texture is not supported; it would be a projection light");
    if (cutoff_deg > beam_deg)
      list.Warning("", "fades from its beam to its cutoff by a smooth step, not by a straight one");
  } else if (emitter.type == "directional") {
    made.strings = {"distant"};
    light("L", "irradiance");
    if (list.Has("direction")) {
      place("from", {0, 0, 0});
      place("to", list.Vector("direction", {0, 0, 1}));
      to_world = {};
    }
  } else if (emitter.type == "constant") {
    made.strings = {"infinite"};
    light("L", "radiance");
  } else if (emitter.type == "envmap") {
    TranslateEnvironment(emitter, list);
    list.WarnOfUnread();
    return;
  } else if (emitter.type == "area") {
    list.Error("must be part of a shape");
    return;
  } else {
    list.Error("is not supported; there are area, point, spot, directional, constant and envmap");
    return;
  }
  list.WarnOfUnread();
  RefuseOthers(emitter, {"texture"});
  reader_.CarryOut(Directive("AttributeBegin", emitter));
  SetTransform(to_world, emitter);
  reader_.CarryOut(std::move(made));
  reader_.CarryOut(Directive("AttributeEnd", emitter));
}

void MitsubaTranslator::TranslateAreaEmitter(const MitsubaObject& emitter) {
  ParameterList list = ListOf(emitter);
  if (emitter.type != "area") {
    list.Error("in a shape is not supported; there is area");
    return;
  }
  list.Ignore("sampling_weight");
  MadeDirective made = Directive("AreaLightSource", emitter);
  made.strings = {"diffuse"};
  // A picture lies on the shape as those of its material do.
  const MitsubaObject* picture = nullptr;
  for (const MitsubaObject& child : emitter.children) {
    const MitsubaObject* const resolved = child.name == "radiance" ? Resolve(child) : nullptr;
    if (resolved != nullptr && resolved->tag == "texture" && resolved->type == "bitmap")
      picture = resolved;
  }
  if (picture == nullptr) {
    made.parameters = {MakeColor("L", FindLight(emitter, list, "radiance"), emitter.location)};
    list.WarnOfUnread();
    reader_.CarryOut(std::move(made));
    return;
  }
  list.Ignore("radiance");
  list.WarnOfUnread();
  ParameterList of_picture = ListOf(*picture);
  MadeDirective bitmap;
  for (const std::string_view name : {"raw", "gamma"}) {
    if (of_picture.Has(name))
      of_picture.Warning(name, "is ignored: bytes of pictures that shine are decoded as sRGB");
  }
  const Placement placement = TranslateBitmap(*picture, of_picture, bitmap);
  of_picture.WarnOfUnread();
  for (Parameter& parameter : bitmap.parameters) {
    if (parameter.name == "filename") made.parameters.push_back(std::move(parameter));
  }
  std::vector<AreaLight>& lights = reader_.scene().area_lights;
  const std::size_t lights_before = lights.size();
  reader_.CarryOut(std::move(made));
  if (lights.size() == lights_before) return;  // there was an error, or the picture is black
  lights.back().mapping = placement.mapping;
  lights.back().wrap_u = placement.wrap_u;
  lights.back().wrap_v = placement.wrap_v;
}

}  // namespace lucerna
