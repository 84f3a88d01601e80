// Emitters that are no part of a shape.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "render/base/text.h"
#include "render/formats/mitsuba/translator.h"
#include "render/formats/pbrt/shapes.h"
#include "render/math/equal_area_square.h"

namespace lucerna {
namespace {

// The equal-area square that shows what a picture in latitude and longitude does: its top is +y,
// its middle -z, and from there it goes on to +x.
Picture EqualAreaOf(const Picture& map) {
  const double pixels = static_cast<double>(map.width) * map.height;
  const int side = std::clamp(static_cast<int>(std::ceil(std::sqrt(pixels))), 8, 8192);
  // Pixels near the poles are narrow: several places of each pixel are looked up.
  constexpr int kPlaces = 4096;
  const int parts = std::clamp(kPlaces / side, 2, 16);
  Picture square;
  square.width = square.height = side;
  square.channels = 3;
  square.linear.resize(static_cast<std::size_t>(side) * static_cast<std::size_t>(side) * 3);
  const float step = 1 / static_cast<float>(side * parts);
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      Rgb sum;
      for (int i = 0; i < parts * parts; ++i) {
        const Vec2 place = {(static_cast<float>(x * parts + i % parts) + 0.5F) * step,
                            (static_cast<float>(y * parts + i / parts) + 0.5F) * step};
        const Vec3 d = EqualAreaDirection(place);
        double u = std::atan2(static_cast<double>(d.x), static_cast<double>(-d.z)) /
                   (2 * std::numbers::pi);
        u -= std::floor(u);
        const double v =
            std::acos(std::clamp(static_cast<double>(d.y), -1.0, 1.0)) / std::numbers::pi;
        sum += map.At(std::min(static_cast<int>(u * map.width), map.width - 1),
                      std::min(static_cast<int>(v * map.height), map.height - 1));
      }
      sum *= 1 / static_cast<float>(parts * parts);
      float* pixel = &square.linear[(static_cast<std::size_t>(y) * static_cast<std::size_t>(side) +
                                     static_cast<std::size_t>(x)) *
                                    3];
      pixel[0] = sum.r;
      pixel[1] = sum.g;
      pixel[2] = sum.b;
    }
  }
  return square;
}

}  // namespace

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
  const StatusOr<ShapeAxes> axes = AxesOf(ToWorld(emitter));
  if (!axes.ok()) {
    list.Error("is stretched by its transform, which is not supported; scale all axes alike");
    return;
  }
  // Summed over all pixels in single precision.
  if (!(scale * static_cast<double>((*map)->Largest()) < 1e20)) {
    list.Error("is too bright for single precision");
    return;
  }
  InfiniteLight light;
  light.kind = InfiniteLight::Kind::kEnvironment;
  light.radiance = Gray(static_cast<float>(scale));
  light.axes = *axes;
  light.map = std::make_shared<const Picture>(EqualAreaOf(**map));
  reader_.scene().infinite_lights.push_back(std::move(light));
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
  made.parameters = {MakeColor("L", FindLight(emitter, list, "radiance"), emitter.location)};
  list.WarnOfUnread();
  reader_.CarryOut(std::move(made));
}

}  // namespace lucerna
