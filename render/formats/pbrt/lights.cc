#include "render/formats/pbrt/lights.h"

#include <cmath>

#include "render/base/text.h"
#include "render/formats/pbrt/kinds.h"
#include "render/formats/pbrt/light_readers.h"
#include "render/math/warp.h"

namespace lucerna {
namespace {

using LightReader = void (*)(const LightInput&);
#define LUCERNA_ROW(Name, list, name) {name, &Read##Name##Light},
constexpr Kind<LightReader> kKinds[] = {
    LUCERNA_DELTA_LIGHTS(LUCERNA_ROW)  //
    {"infinite", &ReadInfiniteLight},
};
#undef LUCERNA_ROW

// Of all pixels.
double MeanLuminance(const Picture& picture) {
  double sum = 0;
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x)
      sum += static_cast<double>(Luminance(picture.At(x, y)));
  }
  return sum / (static_cast<double>(picture.width) * static_cast<double>(picture.height));
}

AreaEmission ReadDiffuseEmission(ParameterList& parameters, AssetReader& assets) {
  AreaEmission emission;
  Rgb color = Gray(1);
  double largest = 1;
  if (parameters.HasText("filename")) {
    if (parameters.Has("L")) {
      parameters.Error("L", "and filename exclude each other; give one or the other");
      parameters.Ignore("L");
    }
    emission.picture = ReadLightPicture(parameters, assets);
    if (emission.picture != nullptr) {
      largest = static_cast<double>(emission.picture->Largest());
      emission.mean_luminance = MeanLuminance(*emission.picture);
      // A black picture is no light, as one of scale 0.
      if (!(largest > 0)) color = Rgb{};
    }
  } else {
    color = parameters.FindEmission("L", &emission.spectrum).value_or(color);
  }
  const double scale = parameters.Float("scale", 1, kZeroOrMore);
  emission.radiance = ScaledEmission(parameters, color, scale);
  // Summed over all pixels in single precision.
  if (emission.picture != nullptr && !(scale * largest < 1e30))
    parameters.Error("is too bright for single precision");
  emission.two_sided = parameters.Bool("twosided", false);
  const double power_w = parameters.Float("power", -1);
  if (power_w > 0) emission.power_w = power_w;
  return emission;
}

using AreaLightReader = AreaEmission (*)(ParameterList&, AssetReader&);
constexpr Kind<AreaLightReader> kAreaKinds[] = {{"diffuse", &ReadDiffuseEmission}};

}  // namespace

Rgb ScaledEmission(ParameterList& parameters, Rgb color, double scale) {
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

std::shared_ptr<const Picture> ReadLightPicture(ParameterList& parameters, AssetReader& assets) {
  if (!parameters.HasText("filename")) {
    parameters.Error("needs \"string filename\": the picture that says how strong it is");
    return nullptr;
  }
  const std::optional<std::string> file = parameters.FindString("filename");
  if (!file.has_value()) return nullptr;
  StatusOr<std::shared_ptr<const Picture>> map = assets.ReadPicture(*file, {});
  if (!map.ok()) {
    parameters.Error("filename", Concat("cannot be read: ", map.status().message()));
    return nullptr;
  }
  // Summed over all pixels in single precision.
  if (!((*map)->Largest() < 1e20F)) {
    parameters.Error("filename", "is too bright for single precision");
    return nullptr;
  }
  return *std::move(map);
}

void WarnIfBlack(ParameterList& parameters, Rgb emitted) {
  if (IsBlack(emitted)) parameters.Warning("", "emits nothing: its colour or scale is 0");
}

std::optional<AreaEmission> ReadAreaEmission(std::string_view type, ParameterList& parameters,
                                             AssetReader& assets) {
  const AreaLightReader read = FindReader<AreaLightReader>(kAreaKinds, type);
  if (read == nullptr) {
    parameters.Error(Concat("is not supported; ", SupportedKinds<AreaLightReader>(kAreaKinds)));
    return std::nullopt;
  }
  AreaEmission emission = read(parameters, assets);
  parameters.WarnOfUnread();
  return emission;
}

AreaLight MakeAreaLight(const AreaEmission& emission, double area_m2) {
  AreaLight light = {emission.radiance, emission.two_sided, emission.picture};
  if (light.picture != nullptr) light.largest_pixel = light.picture->Largest();
  light.spectrum = emission.spectrum;
  if (emission.power_w.has_value()) {
    const double sides = emission.two_sided ? 2 : 1;
    light.radiance *=
        static_cast<float>(*emission.power_w / (sides * kPi64 * area_m2 * emission.mean_luminance));
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
