// Sensors, films, filters and integrators: what the view is and how it is rendered.
#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <iterator>
#include <numbers>
#include <utility>

#include "render/base/text.h"
#include "render/formats/mitsuba/translator.h"

namespace lucerna {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;
// Integrators that render what "path" does.
constexpr std::string_view kOfAllPaths[] = {
    "path",   "volpath",    "volpathmis", "volpath_simple", "prb", "prb_basic",
    "bdpt",   "prbvolpath", "ptracer",    "photonmapper",   "ppm", "prb_projective",
    "sppm",   "mlt",        "pssmlt",     "erpt",           "vpl", "particle",
    "moment", "stokes",     "adaptive",   "irrcache"};

// The full angle of the shorter side of an image, from that along `axis`.
double FovOfShorterSide(double fov_deg, std::string_view axis, double width, double height) {
  const double half = std::tan(fov_deg / 2 / kDegrees);
  const double shorter = std::min(width, height);
  double along = width;
  if (axis == "y") along = height;
  if (axis == "smaller") along = shorter;
  if (axis == "larger") along = std::max(width, height);
  if (axis == "diagonal") along = std::hypot(width, height);
  return 2 * std::atan(half * shorter / along) * kDegrees;
}

// Of film that is 36 mm wide and 24 mm high, along its diagonal: "50mm".
std::optional<double> FovOfFocalLength(std::string_view text) {
  const auto numbers = ListedNumbers(text.substr(0, text.find("mm")));
  if (!numbers.has_value() || numbers->size() != 1) return std::nullopt;
  const double length_mm = numbers->front();
  if (!(length_mm > 0) || length_mm > 1e4) return std::nullopt;
  return 2 * std::atan(std::hypot(36, 24) / 2 / length_mm) * kDegrees;
}

// What Mitsuba takes where a scene has none.
MitsubaObject StandIn(std::string tag, std::string type, const MitsubaObject& around) {
  MitsubaObject object;
  object.tag = std::move(tag);
  object.type = std::move(type);
  object.location = around.location;
  return object;
}

}  // namespace

void MitsubaTranslator::TranslateFilter(const MitsubaObject& film) {
  const MitsubaObject* given = ChildOf(film, "rfilter");
  const MitsubaObject filter = given != nullptr ? *given : StandIn("rfilter", "gaussian", film);
  const std::string& type = filter.type;
  MadeDirective made = Directive("PixelFilter", filter);
  ParameterList list = ListOf(filter);
  const auto add = [&](const char* name, double value) {
    made.parameters.push_back(MakeNumber(name, value, made.location));
  };
  double radius = 2;
  if (type == "gaussian") {
    const double sigma = list.Float("stddev", 0.5, {1e-3, 1e2});
    add("sigma", sigma);
    radius = 4 * sigma;
  } else if (type == "box") {
    radius = list.Float("radius", 0.5, kAboveZero);
  } else if (type == "tent") {
    radius = list.Float("radius", 1, kAboveZero);
  } else if (type == "mitchell") {
    add("B", list.Float("b", list.Float("B", 1.0 / 3)));
    add("C", list.Float("c", list.Float("C", 1.0 / 3)));
  } else if (type == "catmullrom") {
    add("B", 0);
    add("C", 0.5);
  } else if (type == "lanczos") {
    radius = static_cast<double>(list.FindInteger("lobes", {1, 32}).value_or(3));
    add("tau", radius);
  } else {
    list.Warning("",
                 "is rendered as \"gaussian\"; there are box, tent, gaussian, mitchell, "
                 "catmullrom and lanczos");
  }
  add("xradius", radius);
  add("yradius", radius);
  made.strings = {type == "box"                                ? "box"
                  : type == "tent"                             ? "triangle"
                  : type == "mitchell" || type == "catmullrom" ? "mitchell"
                  : type == "lanczos"                          ? "sinc"
                                                               : "gaussian"};
  list.WarnOfUnread();
  reader_.CarryOut(std::move(made));
}

void MitsubaTranslator::TranslateFilm(const MitsubaObject& sensor) {
  const MitsubaObject* given = ChildOf(sensor, "film");
  const MitsubaObject film = given != nullptr ? *given : StandIn("film", "hdrfilm", sensor);
  ParameterList list = ListOf(film);
  constexpr Range kSize = {1, 1 << 20};
  const auto width = list.FindInteger("width", kSize).value_or(768);
  const auto height = list.FindInteger("height", kSize).value_or(576);
  for (const std::string_view name : {"file_format", "pixel_format", "component_format", "banner",
                                      "attach_log", "high_quality_edges", "gamma", "tonemap_method",
                                      "exposure", "compensate", "sample_border", "label"})
    list.Ignore(name);
  MadeDirective made = Directive("Film", film);
  made.strings = {"rgb"};
  const auto add = [&](const char* name, std::vector<double> numbers) {
    Parameter parameter = MakeNumber(name, 0, made.location);
    parameter.type = "integer";
    parameter.numbers = std::move(numbers);
    made.parameters.push_back(std::move(parameter));
  };
  add("xresolution", {static_cast<double>(width)});
  add("yresolution", {static_cast<double>(height)});
  if (list.Has("crop_width") || list.Has("crop_height")) {
    const auto x0 =
        static_cast<double>(list.FindInteger("crop_offset_x", {0, 1 << 20}).value_or(0));
    const auto y0 =
        static_cast<double>(list.FindInteger("crop_offset_y", {0, 1 << 20}).value_or(0));
    const auto w = static_cast<double>(list.FindInteger("crop_width", kSize).value_or(width));
    const auto h = static_cast<double>(list.FindInteger("crop_height", kSize).value_or(height));
    add("pixelbounds", {x0, x0 + w, y0, y0 + h});
  }
  list.WarnOfUnread();
  reader_.CarryOut(std::move(made));
  TranslateFilter(film);

  MadeDirective camera = Directive("Camera", sensor);
  ParameterList view = ListOf(sensor);
  for (const std::string_view name : {"shutter_open", "shutter_close"})
    view.Ignore(name);
  const auto warn_unless = [&view](std::string_view name, double value, std::string_view message) {
    const auto number = view.FindFloat(name);
    // What is written in decimals may be rounded.
    if (number.has_value() && std::abs(*number - value) > 1e-5 * value) view.Warning(name, message);
  };
  warn_unless("near_clip", 1e-2, "is ignored: what is near is seen too");
  warn_unless("far_clip", 1e4, "is ignored: what is far is seen too");
  for (const std::string_view name : {"principal_point_offset_x", "principal_point_offset_y"})
    warn_unless(name, 0, "is ignored: the view is around the middle of the image");
  const bool is_orthographic = sensor.type == "orthographic";
  camera.strings = {is_orthographic ? "orthographic" : "perspective"};
  const auto add_number = [&](const char* name, double value) {
    camera.parameters.push_back(MakeNumber(name, value, sensor.location));
  };
  if (is_orthographic) {
    // Mitsuba's view is 2 wide; here the shorter side is 2 long.
    const double aspect = static_cast<double>(width) / static_cast<double>(height);
    if (aspect > 1) {
      Parameter window = MakeNumber("screenwindow", 0, sensor.location);
      window.numbers = {-1, 1, -1 / aspect, 1 / aspect};
      camera.parameters.push_back(std::move(window));
    }
  } else if (sensor.type == "perspective" || sensor.type == "thinlens") {
    std::string axis = view.String("fov_axis", "x");
    for (char& c : axis)
      c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    constexpr std::array<std::string_view, 5> kAxes = {"x", "y", "diagonal", "smaller", "larger"};
    if (std::ranges::find(kAxes, axis) == kAxes.end())
      view.Error("fov_axis", "must be x, y, diagonal, smaller or larger");
    double fov_deg = view.Float("fov", 0, {0, 179.999});
    if (const auto length = view.FindString("focal_length"); length.has_value()) {
      const auto of_length = FovOfFocalLength(*length);
      if (!of_length.has_value()) view.Error("focal_length", "must be a length such as 50mm");
      fov_deg = FovOfShorterSide(of_length.value_or(50), "diagonal", static_cast<double>(width),
                                 static_cast<double>(height));
    } else if (fov_deg > 0) {
      fov_deg =
          FovOfShorterSide(fov_deg, axis, static_cast<double>(width), static_cast<double>(height));
    } else {
      fov_deg = FovOfShorterSide(FovOfFocalLength("50mm").value_or(50), "diagonal",
                                 static_cast<double>(width), static_cast<double>(height));
    }
    add_number("fov", fov_deg);
    if (sensor.type == "thinlens") {
      add_number("lensradius", view.Float("aperture_radius", 0, kZeroOrMore));
      const double far = view.Float("far_clip", 1e4, kAboveZero);
      add_number("focaldistance", view.Float("focus_distance", far, kAboveZero));
    } else {
      view.Ignore("focus_distance");
    }
  } else {
    view.Error("is not supported; there are perspective, thinlens and orthographic");
  }
  view.WarnOfUnread();
  // Mitsuba's camera has +x to the left of the image.
  const StatusOr<Transform> to_camera = (ToWorld(sensor) * Transform::Scale(-1, 1, 1)).Inverse();
  if (!to_camera.ok()) {
    view.Error("has a transform that cannot be inverted");
    return;
  }
  SetTransform(*to_camera, sensor);
  if (const std::string medium = MediumOf(sensor, ""); !medium.empty()) {
    MadeDirective interface = Directive("MediumInterface", sensor);
    interface.strings = {"", medium};
    reader_.CarryOut(std::move(interface));
  }
  reader_.CarryOut(std::move(camera));
  // Lights without extent are in no medium unless they say so.
  MadeDirective outside = Directive("MediumInterface", sensor);
  outside.strings = {"", ""};
  reader_.CarryOut(std::move(outside));
}

void MitsubaTranslator::TranslateIntegrator(const MitsubaObject& integrator) {
  // Such as <integrator type="adaptive"> around another.
  if (const MitsubaObject* inner = ChildOf(integrator, "integrator")) {
    if (integrator.type == "aov") {
      diagnostics_.Warning(integrator.location,
                           Concat(SubjectOf(integrator), ": its layers are not written"));
    }
    TranslateIntegrator(*inner);
    return;
  }
  MadeDirective made = Directive("Integrator", integrator);
  made.strings = {"sppm"};
  ParameterList list = ListOf(integrator);
  const auto add = [&](const char* name, const char* type, double value) {
    Parameter parameter = MakeNumber(name, value, integrator.location);
    parameter.type = type;
    made.parameters.push_back(std::move(parameter));
  };
  const std::int64_t depth = list.FindInteger("max_depth", {-1, 1 << 30}).value_or(-1);
  // Mitsuba counts the segments of a path, pbrt its vertices between camera and light.
  constexpr std::int64_t kLeast = 2;
  constexpr std::int64_t kMost = 10'001;
  if (depth >= 0) {
    const std::int64_t held = std::clamp(depth, kLeast, kMost);
    if (held != depth) {
      list.Warning("max_depth", Concat("is taken as ", held, ": it must be from ", kLeast, " to ",
                                       kMost, ", or -1"));
    }
    add("maxdepth", "integer", static_cast<double>(held - 1));
  }
  if (std::ranges::find(kOfAllPaths, integrator.type) == std::end(kOfAllPaths))
    list.Warning("", "is not what is rendered: light goes all ways, as with \"path\"");
  if (list.Bool("hide_emitters", false))
    list.Warning("hide_emitters", "is ignored: lights are seen");
  if (const double radius = list.Float("initial_radius", 0, kZeroOrMore); radius > 0)
    add("radius", "float", radius);
  reader_.CarryOut(std::move(made));
  diagnostics_.Note(integrator.location,
                    Concat(SubjectOf(integrator), " only sets how long paths become"));
}

void MitsubaTranslator::TranslateView() {
  const MitsubaObject* sensor = nullptr;
  const MitsubaObject* integrator = nullptr;
  for (const MitsubaObject& object : document_.scene.children) {
    if (object.tag == "sensor") {
      if (sensor != nullptr)
        diagnostics_.Warning(object.location, "a second sensor is ignored: the first is rendered");
      if (sensor == nullptr) sensor = &object;
    }
    if (object.tag == "integrator") integrator = &object;
  }
  if (integrator != nullptr) TranslateIntegrator(*integrator);
  // Mitsuba's paths may become as long as they like. Those that lose light end by roulette long
  // before this; those between perfect mirrors and in clear glass must end too.
  constexpr int kUnlimited = 1000;
  IntegratorSettings& settings = reader_.scene().integrator;
  if (!settings.max_depth.has_value()) settings.max_depth = kUnlimited;
  if (sensor == nullptr) return;  // FinishScene says so
  TranslateFilm(*sensor);
  if (const MitsubaObject* sampler = ChildOf(*sensor, "sampler")) {
    ParameterList list = ListOf(*sampler);
    MadeDirective made = Directive("Sampler", *sampler);
    made.strings = {"independent"};
    if (const auto samples = list.FindInteger("sample_count", {1, 1 << 30}); samples.has_value()) {
      Parameter parameter =
          MakeNumber("pixelsamples", static_cast<double>(*samples), sampler->location);
      parameter.type = "integer";
      made.parameters.push_back(std::move(parameter));
    }
    reader_.CarryOut(std::move(made));
  }
}

}  // namespace lucerna
