#include "render/formats/pbrt/lights.h"

// Units are pbrt-v4's: an rgb is radiance, intensity or irradiance as it stands; power and
// illuminance set the luminance that a colour of luminance 1 and a scale of 1 would have.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "render/base/text.h"
#include "render/formats/pbrt/kinds.h"
#include "render/formats/pbrt/shapes.h"
#include "render/math/equal_area_square.h"

namespace lucerna {
namespace {

constexpr double kPiD = std::numbers::pi;

// S1: colours are finite, also after scaling.
Rgb Scaled(ParameterList& parameters, Rgb color, double scale) {
  const Rgb scaled = color * static_cast<float>(scale);
  if (IsFinite(scaled)) return scaled;
  parameters.Error("is too bright for single precision");
  return {};
}

Vec3 FinitePoint(ParameterList& parameters, const Transform& to_world, Vec3 point) {
  const Vec3 world = to_world.Point(point);
  if (IsFinite(world)) return world;
  parameters.Error("is moved out of the finite numbers by its transform");
  return {};
}

// The unit direction from `from` to `to`.
Vec3 Direction(ParameterList& parameters, const Transform& to_world, Vec3 from, Vec3 to) {
  // Scaled to about unit length before squaring, which could overflow or vanish.
  const Vec3 local = to - from;
  const float local_size = MaxAbs(local);
  if (local_size > 0 && std::isfinite(local_size)) {
    const Vec3 world = to_world.Vector(local / local_size);
    const float size = MaxAbs(world);
    if (size > 0 && std::isfinite(size)) return Normalize(world / size);
  }
  parameters.Error("has no direction: \"from\" and \"to\" are the same, or too far apart");
  return {0, 0, 1};
}

void WarnIfBlack(ParameterList& parameters, Rgb emitted) {
  if (IsBlack(emitted)) parameters.Warning("", "emits nothing: its colour or scale is 0");
}

// [W·m⁻²] luminance of what falls onto a plane that looks along z of the map. pbrt-v4 weighs each
// pixel by half its solid angle and so renders a map with an illuminance twice as bright; here it
// means what it means for a constant light.
double IlluminanceOf(const Picture& map) {
  // A pixel of a small map is large, and the horizon runs through some.
  constexpr int kFineSide = 512;
  const int parts = std::max(1, kFineSide / map.width);
  const int side = map.width * parts;
  double sum = 0;
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const Vec3 direction =
          EqualAreaDirection({(static_cast<float>(x) + 0.5F) / static_cast<float>(side),
                              (static_cast<float>(y) + 0.5F) / static_cast<float>(side)});
      if (!(direction.z > 0)) continue;
      sum += static_cast<double>(Luminance(map.At(x / parts, y / parts)) * direction.z);
    }
  }
  return sum * 4 * kPiD / (static_cast<double>(side) * side);
}

// What the readers of all kinds of light are given, and where they add it.
struct LightInput {
  ParameterList& parameters;
  const Transform& to_world;
  AssetReader& assets;
  Scene& scene;
};

void ReadEnvironment(const LightInput& input, double scale, double illuminance) {
  ParameterList& parameters = input.parameters;
  if (parameters.Has("L")) {
    parameters.Error("L", "and filename exclude each other; give one or the other");
    parameters.Ignore("L");
  }
  const std::optional<std::string> file = parameters.FindString("filename");
  if (!file.has_value()) return;
  StatusOr<std::shared_ptr<const Picture>> map = input.assets.ReadPicture(*file, {});
  if (!map.ok()) {
    parameters.Error("filename", Concat("cannot be read: ", map.status().message()));
    return;
  }
  if ((*map)->width != (*map)->height) {
    parameters.Error("filename", Concat("has ", (*map)->width, " x ", (*map)->height,
                                        " pixels; an environment is an equal-area map, which is "
                                        "square (pbrt-v4 converts others: imgtool makeequiarea)"));
    return;
  }
  const StatusOr<ShapeAxes> axes = AxesOf(input.to_world);
  if (!axes.ok()) {
    parameters.Error("is stretched by its transform, which is not supported; scale all axes alike");
    return;
  }
  if (illuminance > 0) {
    const double given = IlluminanceOf(**map);
    if (!(given > 0)) {
      parameters.Error("illuminance", "cannot be reached: the upper half of the map is black");
      return;
    }
    scale *= illuminance / given;
  }
  InfiniteLight light;
  light.radiance = Gray(static_cast<float>(scale));
  light.axes = *axes;
  // Summed over all pixels in single precision.
  if (!(scale * static_cast<double>((*map)->Largest()) < 1e30)) {
    parameters.Error("is too bright for single precision");
    return;
  }
  light.map = *std::move(map);
  input.scene.infinite_lights.push_back(std::move(light));
}

void ReadPoint(const LightInput& input) {
  ParameterList& parameters = input.parameters;
  const Rgb color = parameters.FindEmission("I").value_or(Gray(1));
  double scale = parameters.Float("scale", 1, kZeroOrMore);
  const double power_w = parameters.Float("power", -1);
  const Vec3 from = parameters.Point("from", {0, 0, 0});
  if (power_w > 0) scale *= power_w / (4 * kPiD);
  PointLight light;
  light.position = FinitePoint(parameters, input.to_world, from);
  light.intensity = Scaled(parameters, color, scale);
  input.scene.point_lights.push_back(light);
  WarnIfBlack(parameters, light.intensity);
}

void ReadSpot(const LightInput& input) {
  ParameterList& parameters = input.parameters;
  const Rgb color = parameters.FindEmission("I").value_or(Gray(1));
  double scale = parameters.Float("scale", 1, kZeroOrMore);
  const double power_w = parameters.Float("power", -1);
  const Vec3 from = parameters.Point("from", {0, 0, 0});
  const Vec3 to = parameters.Point("to", {0, 0, 1});
  const double width_deg = parameters.Float("coneangle", 30, {0, 180, false});
  const double falloff_deg = parameters.Float("conedeltaangle", 5, {0, 180});
  if (falloff_deg > width_deg) parameters.Error("conedeltaangle", "is wider than coneangle");
  SpotLight light;
  const double cos_width = std::cos(width_deg * kPiD / 180);
  const double cos_start = std::cos((width_deg - falloff_deg) * kPiD / 180);
  if (power_w > 0) {
    // The integral of the smoothstep over its part of the cone is half of the part.
    scale *= power_w / (2 * kPiD * ((1 - cos_start) + (cos_start - cos_width) / 2));
  }
  light.cos_total_width = static_cast<float>(cos_width);
  light.cos_falloff_start = static_cast<float>(cos_start);
  light.position = FinitePoint(parameters, input.to_world, from);
  light.direction = Direction(parameters, input.to_world, from, to);
  light.intensity = Scaled(parameters, color, scale);
  input.scene.spot_lights.push_back(light);
  WarnIfBlack(parameters, light.intensity);
}

void ReadDistant(const LightInput& input) {
  ParameterList& parameters = input.parameters;
  const Rgb color = parameters.FindEmission("L").value_or(Gray(1));
  double scale = parameters.Float("scale", 1, kZeroOrMore);
  const double illuminance = parameters.Float("illuminance", -1);
  if (illuminance > 0) scale *= illuminance;
  const Vec3 from = parameters.Point("from", {0, 0, 0});
  const Vec3 to = parameters.Point("to", {0, 0, 1});
  DistantLight light;
  light.direction = Direction(parameters, input.to_world, from, to);
  light.irradiance = Scaled(parameters, color, scale);
  input.scene.distant_lights.push_back(light);
  WarnIfBlack(parameters, light.irradiance);
}

void ReadInfinite(const LightInput& input) {
  ParameterList& parameters = input.parameters;
  if (parameters.Has("portal")) {
    parameters.Error("portal", "is not supported");
    parameters.Ignore("portal");
  }
  double scale = parameters.Float("scale", 1, kZeroOrMore);
  const double illuminance = parameters.Float("illuminance", -1);
  if (parameters.Has("filename")) {
    ReadEnvironment(input, scale, illuminance);
    return;
  }
  const Rgb color = parameters.FindEmission("L").value_or(Gray(1));
  // A surface that sees constant radiance L over its hemisphere receives pi L.
  if (illuminance > 0) scale *= illuminance / kPiD;
  InfiniteLight light;
  light.radiance = Scaled(parameters, color, scale);
  input.scene.infinite_lights.push_back(light);
  WarnIfBlack(parameters, light.radiance);
}

using LightReader = void (*)(const LightInput&);
constexpr Kind<LightReader> kKinds[] = {
    {"point", &ReadPoint},
    {"spot", &ReadSpot},
    {"distant", &ReadDistant},
    {"infinite", &ReadInfinite},
};

AreaEmission ReadDiffuseEmission(ParameterList& parameters) {
  AreaEmission emission;
  if (parameters.Has("filename")) {
    parameters.Error("filename", "is not supported: give L, the colour of the light");
    parameters.Ignore("filename");
  }
  const Rgb color = parameters.FindEmission("L").value_or(Gray(1));
  emission.radiance = Scaled(parameters, color, parameters.Float("scale", 1, kZeroOrMore));
  emission.two_sided = parameters.Bool("twosided", false);
  const double power_w = parameters.Float("power", -1);
  if (power_w > 0) emission.power_w = power_w;
  return emission;
}

using AreaLightReader = AreaEmission (*)(ParameterList&);
constexpr Kind<AreaLightReader> kAreaKinds[] = {{"diffuse", &ReadDiffuseEmission}};

}  // namespace

std::optional<AreaEmission> ReadAreaEmission(std::string_view type, ParameterList& parameters) {
  const AreaLightReader read = FindReader<AreaLightReader>(kAreaKinds, type);
  if (read == nullptr) {
    parameters.Error(Concat("is not supported; ", SupportedKinds<AreaLightReader>(kAreaKinds)));
    return std::nullopt;
  }
  const AreaEmission emission = read(parameters);
  parameters.WarnOfUnread();
  return emission;
}

AreaLight MakeAreaLight(const AreaEmission& emission, double area_m2) {
  AreaLight light = {emission.radiance, emission.two_sided};
  if (emission.power_w.has_value()) {
    const double sides = emission.two_sided ? 2 : 1;
    light.radiance *= static_cast<float>(*emission.power_w / (sides * kPiD * area_m2));
  }
  return light;
}

void ReadLight(std::string_view type, ParameterList& parameters, const Transform& to_world,
               AssetReader& assets, Scene& scene) {
  const LightReader read = FindReader<LightReader>(kKinds, type);
  if (read == nullptr) {
    parameters.Error(Concat("is not supported; ", SupportedKinds<LightReader>(kKinds)));
    return;
  }
  read({parameters, to_world, assets, scene});
  parameters.WarnOfUnread();
}

}  // namespace lucerna
