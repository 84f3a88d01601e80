#include "render/formats/gltf/lights.h"

#include <cmath>
#include <numbers>
#include <optional>

#include "render/base/text.h"

namespace lucerna {
namespace {

// Candela and lux are lumens. Exporters that know radiometric lights, Blender's among them, convert
// a watt to 683 lumens, the efficacy at 555 nm that defines the candela, whatever the colour; this
// takes it back. `rgb 1 1 1` has luminance 1 in a Scene, so no other factor is left.
constexpr double kLumensPerWatt = 683;

// Of the outer cone of a spot: between them the light falls.
constexpr double kWidestInner = 0.999;

// Lights look along -z of their node; its scale has no effect.
std::optional<Vec3> DirectionOf(const Transform& to_world) {
  const auto& m = to_world.rows();
  const double length = std::hypot(m[0][2], m[1][2], m[2][2]);
  if (!(length > 0) || !std::isfinite(length)) return std::nullopt;
  return Normalize({static_cast<float>(-m[0][2] / length), static_cast<float>(-m[1][2] / length),
                    static_cast<float>(-m[2][2] / length)});
}

Vec3 PositionOf(const Transform& to_world) {
  return to_world.Point({0, 0, 0});
}

void SetCone(const JsonObject& light, SpotLight& spot) {
  constexpr double kPi2 = std::numbers::pi / 2;
  const JsonObject cone = light.Child("spot");
  // Written out with few digits, a right angle may be a little more.
  const double outer_rad = cone.Held("outerConeAngle", std::numbers::pi / 4, {1e-6, kPi2});
  double inner_rad = cone.Held("innerConeAngle", 0, {0, kPi2});
  if (inner_rad >= outer_rad) {
    cone.Warning(Concat("innerConeAngle is ", inner_rad, ", not below outerConeAngle (", outer_rad,
                        "), and is held there"));
    inner_rad = kWidestInner * outer_rad;
  }
  spot.cos_total_width = static_cast<float>(std::cos(outer_rad));
  spot.cos_falloff_start = static_cast<float>(std::cos(inner_rad));
}

}  // namespace

void AddGltfLights(const GltfDocument& document, const std::vector<GltfPlace>& places,
                   Scene& scene) {
  if (places.empty()) return;
  const std::vector<JsonObject> lights =
      ExtensionOf(document.Root(), "KHR_lights_punctual").Children("lights");
  for (const GltfPlace& place : places) {
    if (place.index >= lights.size()) {
      document.diagnostics().Error(
          document.whole(), Concat("a node refers to light ", place.index, ", and there are ",
                                   lights.size(), " (KHR_lights_punctual)"));
      continue;
    }
    const JsonObject& light = lights[place.index];
    const std::vector<double> color = light.HeldNumbers("color", {1, 1, 1}, kJsonFactor);
    const double strength = light.Number("intensity", 1, {0, 1e20}) / kLumensPerWatt;
    const Rgb emitted = {static_cast<float>(color[0] * strength),
                         static_cast<float>(color[1] * strength),
                         static_cast<float>(color[2] * strength)};
    const Vec3 position = PositionOf(place.to_world);
    const std::optional<Vec3> direction = DirectionOf(place.to_world);
    const std::string type = light.String("type", "");
    if (light.Has("range")) {
      document.diagnostics().Note(document.whole(), "the range of lights is ignored");
    }
    if (!IsFinite(position)) {
      light.Error("stands outside single precision");
    } else if (type == "point") {
      scene.point_lights.push_back({position, emitted});
    } else if (type != "spot" && type != "directional") {
      light.Error(Concat("type is ", Quoted(type), ", not point, spot or directional"));
    } else if (!direction.has_value()) {
      document.diagnostics().Note(document.whole(),
                                  Concat(light.Name(),
                                         ": is left out: the transform of a node flattens "
                                         "it, so it has no direction"));
    } else if (type == "spot") {
      SpotLight spot;
      spot.position = position;
      spot.direction = *direction;
      spot.intensity = emitted;
      SetCone(light, spot);
      scene.spot_lights.push_back(spot);
    } else {
      scene.distant_lights.push_back({*direction, emitted});
    }
  }
}

}  // namespace lucerna
