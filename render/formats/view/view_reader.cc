#include "render/formats/view/view_reader.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include "render/base/text.h"
#include "render/formats/environment_picture.h"
#include "render/formats/json_document.h"
#include "render/formats/read_scene.h"
#include "render/math/double3.h"

namespace lucerna {
namespace {

constexpr double kFovDeg = 40;
// Of the JSON; there are some twenty.
constexpr std::size_t kMostValues = 256;

std::array<double, 3> Three(const JsonObject& object, const char* name, double otherwise) {
  const std::vector<double> numbers =
      object.Numbers(name, {otherwise, otherwise, otherwise}, kJsonAnyNumber);
  return {numbers[0], numbers[1], numbers[2]};
}

// Whether the image of a world would be mirrored without a mirror in its camera.
bool IsRightHanded(const Scene& scene) {
  return scene.camera.camera_to_world.SwapsHandedness();
}

void SetCamera(const JsonObject& given, const std::array<double, 3>& up, bool is_right_handed,
               UnfinishedScene& unfinished) {
  if (!given.exists()) return;
  given.RefuseOthers({"from", "to", "fov"});
  if (!given.Has("from") || !given.Has("to")) {
    given.Error("needs \"from\" and \"to\", each an array of three numbers");
    return;
  }
  Camera camera;
  camera.medium = unfinished.scene.camera.medium;
  camera.fov_deg = given.Number("fov", kFovDeg, {0.001, 179.999});
  const StatusOr<Transform> to_camera =
      Transform::LookAt(Three(given, "from", 0), Three(given, "to", 0), up);
  const StatusOr<Transform> to_world = to_camera.ok() ? to_camera->Inverse() : to_camera;
  if (!to_world.ok()) {
    given.Error(std::string(to_world.status().message()));
    return;
  }
  camera.camera_to_world = *to_world;
  if (is_right_handed) camera.camera_to_world = *to_world * Transform::Scale(-1, 1, 1);
  unfinished.scene.camera = camera;
  unfinished.scene.motion.of_camera.reset();
  unfinished.has_camera = true;
}

// Of a map whose top is +y and whose middle is +z, so that its top is `up` and its middle -z, as
// far as that is not up or down. Requires up of a length above 0.
StatusOr<Transform> EnvironmentToWorld(const std::array<double, 3>& up, double turn_deg,
                                       bool is_right_handed) {
  const double cosine = up[1] / std::hypot(up[0], up[1], up[2]);
  const double sine = std::hypot(up[0], up[2]);
  // About y × up, or about x where the two are parallel.
  const std::array<double, 3> axis =
      sine > 0 ? std::array<double, 3>{up[2], 0, -up[0]} : std::array<double, 3>{1, 0, 0};
  const double angle_deg = std::acos(std::clamp(cosine, -1.0, 1.0)) * 180 / std::numbers::pi;
  LUCERNA_ASSIGN_OR_RETURN(const Transform upright,
                           Transform::Rotate(angle_deg, axis[0], axis[1], axis[2]));
  LUCERNA_ASSIGN_OR_RETURN(
      const Transform turned,
      Transform::Rotate(180 + (is_right_handed ? turn_deg : -turn_deg), 0, 1, 0));
  return upright * turned * Transform::Scale(is_right_handed ? 1 : -1, 1, 1);
}

void SetEnvironment(const JsonObject& given, const std::array<double, 3>& up, bool is_right_handed,
                    AssetReader& assets, Scene& scene) {
  if (!given.exists()) return;
  given.RefuseOthers({"image", "color", "scale", "turn"});
  const double scale = given.Number("scale", 1, kJsonZeroOrMore);
  const double turn_deg = given.Number("turn", 0, {-360, 360});
  scene.infinite_lights.clear();
  if (given.Has("image") == given.Has("color")) {
    given.Error("needs either \"image\", the path of a picture, or \"color\", three numbers");
    return;
  }
  if (given.Has("color")) {
    const std::vector<double> color = given.Numbers("color", {1, 1, 1}, {0, 1e15});
    if (scale > 1e5) given.Error("scale is above 1e5");
    InfiniteLight light;
    light.radiance = Rgb(static_cast<float>(color[0] * scale), static_cast<float>(color[1] * scale),
                         static_cast<float>(color[2] * scale));
    scene.infinite_lights.push_back(std::move(light));
    return;
  }
  const StatusOr<std::shared_ptr<const Picture>> map =
      assets.ReadPicture(given.String("image", ""), {});
  if (!map.ok()) {
    given.Error(Concat("image cannot be read: ", map.status().message()));
    return;
  }
  const StatusOr<Transform> to_world = EnvironmentToWorld(up, turn_deg, is_right_handed);
  const StatusOr<InfiniteLight> light =
      to_world.ok() ? EnvironmentLight(**map, scale, *to_world) : to_world.status();
  if (!light.ok()) {
    given.Error(std::string(light.status().message()));
    return;
  }
  scene.infinite_lights.push_back(*light);
}

}  // namespace

bool BeginsAsView(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  return first != std::string_view::npos && text[first] == '{' &&
         text.find("\"scene\"") != std::string_view::npos;
}

UnfinishedScene ReadView(const std::string& main_path, std::string_view text, AssetReader& assets,
                         Diagnostics& diagnostics) {
  JsonDocument document(main_path, diagnostics);
  document.Parse(text, kMostValues);
  if (diagnostics.has_error()) return {};
  const JsonObject root = document.Root();
  root.RefuseOthers({"scene", "up", "camera", "environment"});
  const std::string scene_path = root.String("scene", "");
  if (scene_path.empty()) root.Error("needs \"scene\", the path of the scene that is seen");
  std::array<double, 3> up = {0, 1, 0};
  if (root.Has("up")) up = Three(root, "up", 0);
  if (!(std::hypot(up[0], up[1], up[2]) > 0)) root.Error("up must have a length above 0");
  if (diagnostics.has_error()) return {};
  UnfinishedScene unfinished = ReadUnfinishedScene(*diagnostics.NameOfFile(scene_path),
                                                   SceneLayer::kWhole, assets, diagnostics);
  if (diagnostics.has_error()) return unfinished;
  const bool is_right_handed = IsRightHanded(unfinished.scene);
  SetCamera(root.Child("camera"), up, is_right_handed, unfinished);
  SetEnvironment(root.Child("environment"), up, is_right_handed, assets, unfinished.scene);
  return unfinished;
}

std::string ViewFile(const std::string& scene_path, const SceneView& view) {
  nlohmann::ordered_json file = {{"scene", scene_path}};
  if (view.up) file["up"] = *view.up;
  if (view.from) {
    file["camera"] = {{"from", *view.from}, {"to", *view.to}};
    if (view.fov_deg) file["camera"]["fov"] = *view.fov_deg;
  }
  if (!view.environment.empty()) {
    file["environment"] = {{"image", view.environment}};
    if (view.scale) file["environment"]["scale"] = *view.scale;
    if (view.turn_deg) file["environment"]["turn"] = *view.turn_deg;
  }
  return file.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace lucerna
