#include "render/formats/gltf/cameras.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "render/base/text.h"

namespace lucerna {
namespace {

// [pixels]
constexpr int kShorterSide = 720;
constexpr double kLargestAspect = 10;

double Degrees(double angle_rad) {
  return angle_rad * 180 / std::numbers::pi;
}

void SetFilm(FilmSettings& film, double aspect) {
  const auto longer = static_cast<int>(std::lround(kShorterSide * std::max(aspect, 1 / aspect)));
  film.width = film.crop_x1 = aspect >= 1 ? longer : kShorterSide;
  film.height = film.crop_y1 = aspect >= 1 ? kShorterSide : longer;
}

// Cameras of the file look along -z with x to the right, those of a Scene along +z. The two spaces
// differ by a mirror at z = 0, which the matrix keeps. The scale of nodes has no effect.
std::optional<Transform> CameraToWorld(const Transform& node_to_world) {
  std::array<std::array<double, 4>, 4> m = node_to_world.rows();
  for (std::size_t column = 0; column < 3; ++column) {
    const double length = std::hypot(m[0][column], m[1][column], m[2][column]);
    if (!(length > 0) || !std::isfinite(length)) return std::nullopt;
    for (std::size_t row = 0; row < 3; ++row)
      m[row][column] /= length;
  }
  Transform to_world = Transform(m) * Transform::Scale(1, 1, -1);
  if (!to_world.Inverse().ok()) return std::nullopt;
  return to_world;
}

void ReadPerspective(const JsonObject& camera, Scene& scene) {
  const JsonObject lens = camera.Child("perspective");
  if (!lens.Has("yfov")) camera.Error("needs perspective.yfov");
  const double height_rad = lens.Number("yfov", 1, {1e-4, 3.14});
  if (lens.Has("aspectRatio"))
    SetFilm(scene.film, lens.Held("aspectRatio", 1, {1 / kLargestAspect, kLargestAspect}));
  // The angle of the shorter side of the image.
  const double aspect = static_cast<double>(scene.film.width) / scene.film.height;
  const double shorter_rad =
      aspect >= 1 ? height_rad : 2 * std::atan(aspect * std::tan(height_rad / 2));
  scene.camera.fov_deg = std::clamp(Degrees(shorter_rad), 0.001, 179.999);
}

// xmag or ymag. Of a negative one the sign, which would mirror the image, is not meant.
double HalfSize(const JsonObject& lens, const char* name) {
  constexpr double kLeast = 1e-12;
  const double size = lens.Number(name, 1, {-1e12, 1e12});
  if (std::abs(size) < kLeast) {
    lens.Error(Concat(name, " is ", size, ", which leaves nothing to see"));
    return 1;
  }
  if (size < 0) lens.Warning(Concat(name, " is ", size, ", and is read as ", -size));
  return std::abs(size);
}

void ReadOrthographic(const JsonObject& camera, Scene& scene) {
  const JsonObject lens = camera.Child("orthographic");
  if (!lens.Has("xmag") || !lens.Has("ymag")) camera.Error("needs orthographic.xmag and ymag");
  const double half_width = HalfSize(lens, "xmag");
  const double half_height = HalfSize(lens, "ymag");
  SetFilm(scene.film, std::clamp(half_width / half_height, 1 / kLargestAspect, kLargestAspect));
  scene.camera.kind = Camera::Kind::kOrthographic;
  scene.camera.window_scale = std::min(half_width, half_height);
}

}  // namespace

void SetGltfCamera(const GltfDocument& document, const std::vector<GltfPlace>& places,
                   Scene& scene) {
  const GltfPlace& place = places.front();
  const JsonObject camera = document.At("cameras", place.index);
  if (places.size() > 1) {
    document.diagnostics().Note(document.whole(),
                                Concat("the scene has ", places.size(), " cameras; the first, ",
                                       camera.Name(), ", is used"));
  }
  const std::string type = camera.String("type", "");
  if (type == "perspective") {
    ReadPerspective(camera, scene);
  } else if (type == "orthographic") {
    ReadOrthographic(camera, scene);
  } else {
    camera.Error(Concat("type is ", Quoted(type), ", not perspective or orthographic"));
  }
  const std::optional<Transform> to_world = CameraToWorld(place.to_world);
  if (to_world.has_value()) {
    scene.camera.camera_to_world = *to_world;
  } else {
    camera.Error("is flattened by the transform of its node");
  }
}

}  // namespace lucerna
