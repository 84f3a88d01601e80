#include "render/formats/sensors/sensors_reader.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <initializer_list>
#include <utility>
#include <vector>

#include "absl/strings/numbers.h"

#include "render/base/text.h"
#include "render/formats/ply_file.h"
#include "render/formats/read_scene.h"
#include "render/math/vector.h"

namespace lucerna {
namespace {

constexpr std::string_view kScene = "lucerna scene ";
constexpr std::string_view kSpacing = "lucerna spacing ";
// Lengths of normals may differ from 1 by what few digits in a text leave.
constexpr float kUnitLength = 1e-2F;

// The rest of the first comment that begins with `key`; empty when there is none.
std::string CommentAfter(const std::vector<std::string>& comments, std::string_view key) {
  for (const std::string& comment : comments) {
    if (comment.starts_with(key)) return comment.substr(key.size());
  }
  return {};
}

// An image with a pixel for each sensor.
void SetFilm(Scene& scene) {
  const auto count = static_cast<double>(scene.sensors.size());
  FilmSettings& film = scene.film;
  film = FilmSettings();
  film.width = static_cast<int>(std::ceil(std::sqrt(count)));
  film.height = static_cast<int>(std::ceil(count / film.width));
  film.crop_x0 = 0;
  film.crop_y0 = 0;
  film.crop_x1 = film.width;
  film.crop_y1 = film.height;
}

}  // namespace

bool BeginsAsSensors(std::string_view text) {
  return text.starts_with("ply\n") || text.starts_with("ply\r");
}

UnfinishedScene ReadSensors(const std::string& main_path, std::string_view text,
                            AssetReader& assets, Diagnostics& diagnostics) {
  const SourceLocation whole = {&main_path, 0, 0};
  const auto fail = [&](std::string message) -> UnfinishedScene {
    diagnostics.Error(whole, std::move(message));
    return {};
  };
  StatusOr<PlyPoints> points = ParsePlyPoints(text);
  if (!points.ok()) return fail(std::string(points.status().message()));
  const std::string scene_path = CommentAfter(points->comments, kScene);
  if (scene_path.empty()) {
    return fail("its header does not name a scene; add a line \"comment lucerna scene FILE\"");
  }
  double spacing = 0;
  const std::string spacing_text = CommentAfter(points->comments, kSpacing);
  if (points->spacings.empty() &&
      (!absl::SimpleAtod(spacing_text, &spacing) || !std::isfinite(spacing) || !(spacing > 0))) {
    return fail(
        "its header has no distance between points; add a line \"comment lucerna spacing NUMBER\" "
        "with a number above 0, or give each point a property \"spacing\"");
  }
  if (points->positions.empty()) return fail("it has no points");
  // As many as an image may have pixels.
  constexpr std::size_t kMostPoints = std::size_t{65536} * 65536;
  if (points->positions.size() > kMostPoints) return fail("it has too many points");
  if (!points->buckets.empty() && points->buckets.size() != points->positions.size()) {
    return fail(Concat("it has ", points->buckets.size(), " buckets for ", points->positions.size(),
                       " points; give each point one, or none"));
  }

  UnfinishedScene unfinished = ReadUnfinishedScene(*diagnostics.NameOfFile(scene_path),
                                                   SceneLayer::kView, assets, diagnostics);
  if (diagnostics.has_error()) return unfinished;
  Scene& scene = unfinished.scene;
  scene.sensors.resize(points->positions.size());
  double sum = 0;
  for (std::size_t i = 0; i < scene.sensors.size(); ++i) {
    const Vec3 normal = points->normals[i];
    if (!(std::abs(Length(normal) - 1) <= kUnitLength)) {
      return fail(Concat("the normal of point ", i, " does not have length 1"));
    }
    const float own = points->spacings.empty() ? static_cast<float>(spacing) : points->spacings[i];
    if (!(own > 0) || !std::isfinite(own)) {
      return fail(Concat("the spacing of point ", i, " is not above 0"));
    }
    scene.sensors[i] = {points->positions[i], Normalize(normal), own};
    sum += static_cast<double>(own);
  }
  scene.sensor_borders = std::move(points->segments);
  scene.sensor_buckets = std::move(points->buckets);
  scene.camera.kind = Camera::Kind::kSensors;
  scene.camera.camera_to_world = Transform();
  scene.motion.of_camera.reset();
  scene.camera.lens_radius = 0;
  scene.camera.window_scale = sum / static_cast<double>(scene.sensors.size());
  SetFilm(scene);
  scene.filter = {.kind = PixelFilter::Kind::kBox, .radius_x = 0.5F, .radius_y = 0.5F};
  unfinished.has_camera = true;
  return unfinished;
}

std::string SensorsFile(const std::string& scene_path, const SensorSet& set) {
  std::string bytes = Concat("ply\nformat binary_little_endian 1.0\ncomment ", kScene, scene_path,
                             "\nelement vertex ", set.sensors.size(), "\n");
  const auto add_properties = [&](std::initializer_list<std::string_view> names) {
    for (const std::string_view name : names)
      bytes += Concat("property float ", name, "\n");
  };
  add_properties({"x", "y", "z", "nx", "ny", "nz", "spacing"});
  if (!set.buckets.empty()) {
    bytes += Concat("element bucket ", set.buckets.size(), "\n");
    add_properties({"ax", "ay", "az", "bx", "by", "bz", "cx", "cy", "cz", "ox", "oy", "oz", "r"});
  }
  bytes += Concat("element segment ", set.borders.size(), "\n");
  add_properties({"ax", "ay", "az", "bx", "by", "bz"});
  bytes += "end_header\n";
  const auto add = [&](std::initializer_list<float> row) {
    for (const float value : row) {
      const auto raw = std::bit_cast<std::array<char, sizeof(float)>>(value);
      bytes.append(raw.data(), raw.size());
    }
  };
  const auto add_point = [&](Vec3 p) { add({p.x, p.y, p.z}); };
  for (const Sensor& sensor : set.sensors) {
    add_point(sensor.position);
    add_point(sensor.normal);
    add({sensor.spacing});
  }
  for (const SensorBucket& bucket : set.buckets) {
    for (const Vec3 corner : bucket.corners)
      add_point(corner);
    add_point(bucket.ball_center);
    add({bucket.ball_radius});
  }
  for (const auto& [a, b] : set.borders) {
    add_point(a);
    add_point(b);
  }
  return bytes;
}

}  // namespace lucerna
