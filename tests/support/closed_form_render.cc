#include "tests/support/closed_form_render.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "render/analysis/prepared_scene.h"
#include "render/base/parallel.h"
#include "render/base/status.h"
#include "render/math/color_space.h"
#include "render/math/double3.h"
#include "render/scene/shape_lists.h"

namespace lucerna {
namespace {

// Of each pixel: a Fibonacci lattice, in which edges of any slope lie alike.
constexpr int kPoints = 1597;
constexpr int kStep = 987;
constexpr float kHardlyBends = 1e-3F;

using Triangle = std::array<Double3, 3>;
using Polygon = std::vector<Double3>;

// Irradiance of a polygon of radiance 1 that is seen from the origin and in front of its plane.
double IrradianceOf(const Polygon& polygon, Double3 normal) {
  double sum = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Double3 a = polygon[i];
    const Double3 b = polygon[(i + 1) % polygon.size()];
    const Double3 across = Cross(a, b);
    const double sine = Length(across);
    if (sine > 0) sum += std::atan2(sine, Dot(a, b)) * Dot(normal, across) / sine;
  }
  return std::abs(sum) / 2;
}

// What of a convex polygon is on the side of a plane through the origin that `normal` points to.
Polygon Cut(const Polygon& polygon, Double3 normal) {
  Polygon kept;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Double3 a = polygon[i];
    const Double3 b = polygon[(i + 1) % polygon.size()];
    const double of_a = Dot(normal, a);
    const double of_b = Dot(normal, b);
    if (of_a >= 0) kept.push_back(a);
    if ((of_a < 0) != (of_b < 0)) kept.push_back(a + (b - a) * (of_a / (of_a - of_b)));
  }
  return kept;
}

// What of a light is behind a triangle, both as seen from the origin.
Polygon Hidden(Polygon light, const Triangle& by) {
  for (std::size_t i = 0; i < 3 && !light.empty(); ++i) {
    const Double3 across = Cross(by[i], by[(i + 1) % 3]);
    light = Cut(light, Dot(across, by[(i + 2) % 3]) < 0 ? across * -1 : across);
  }
  return light;
}

class ClosedForm {
 public:
  explicit ClosedForm(const Scene& scene) {
    LUCERNA_CHECK(ShapeCount(scene) == scene.meshes.size() && scene.instances.empty() &&
                  DeltaLightCount(scene) == 0 && scene.infinite_lights.empty() &&
                  scene.media.empty() && !scene.motion.Moves());
    for (const TriangleMesh& mesh : scene.meshes)
      Add(scene, mesh);
    LUCERNA_CHECK(!floor_.empty());
    const Triangle& first = floor_.front();
    const Double3 across = Cross(first[1] - first[0], first[2] - first[0]);
    normal_ = across * (1 / Length(across));
    if (!lights_.empty() && Height(lights_.front().triangle[0]) < 0) normal_ = normal_ * -1;
    for (const Triangle& triangle : floor_) {
      for (const Double3 corner : triangle)
        LUCERNA_CHECK(std::abs(Height(corner)) < 1e-6);
    }
    for (const Light& light : lights_) {
      for (const Double3 corner : light.triangle) {
        LUCERNA_CHECK(Height(corner) > 0);
        for (const Triangle& black : black_) {
          for (const Double3 below : black)
            LUCERNA_CHECK(Height(below) > 0 && Height(below) < Height(corner));
        }
      }
    }
  }

  // Radiance in the working space towards `eye` from what is seen in a direction.
  [[nodiscard]] std::array<double, 3> RadianceAlong(Double3 eye, Double3 direction) const {
    std::optional<double> nearest;
    std::array<double, 3> radiance = {};
    const auto meets = [&](const Triangle& triangle) {
      const std::optional<double> distance = DistanceTo(triangle, eye, direction);
      if (!distance || (nearest && *distance >= *nearest)) return false;
      nearest = distance;
      radiance = {};
      return true;
    };
    for (const Triangle& triangle : black_)
      static_cast<void>(meets(triangle));
    for (const Light& light : lights_) {
      if (meets(light.triangle)) radiance = ToArray(light.radiance);
    }
    bool is_floor = false;
    for (const Triangle& triangle : floor_)
      is_floor |= meets(triangle);
    return is_floor && Dot(normal_, direction) < 0 ? ReflectedAt(eye + direction * *nearest)
                                                   : radiance;
  }

 private:
  struct Light {
    Triangle triangle;
    Rgb radiance;
  };
  static std::array<double, 3> ToArray(Rgb color) {
    return {static_cast<double>(color.r), static_cast<double>(color.g),
            static_cast<double>(color.b)};
  }

  void Add(const Scene& scene, const TriangleMesh& mesh) {
    const Material& material = scene.materials[static_cast<std::size_t>(mesh.traits.material)];
    if (material.kind == Material::Kind::kDielectric) {
      LUCERNA_CHECK(std::abs(material.ior - 1) <= kHardlyBends);
      return;
    }
    LUCERNA_CHECK(material.kind == Material::Kind::kDiffuse && IsWhole(mesh.traits));
    const bool is_black = material.reflectance == Rgb();
    for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
      Triangle triangle;
      for (std::size_t corner = 0; corner < 3; ++corner)
        triangle[corner] = Double3(mesh.positions[mesh.indices[i + corner]]);
      if (mesh.traits.area_light != kNoAreaLight) {
        LUCERNA_CHECK(is_black);
        lights_.push_back(
            {triangle,
             scene.area_lights[static_cast<std::size_t>(mesh.traits.area_light)].radiance});
      } else if (is_black) {
        black_.push_back(triangle);
      } else {
        LUCERNA_CHECK(floor_.empty() || albedo_ == material.reflectance);
        albedo_ = material.reflectance;
        floor_.push_back(triangle);
      }
    }
  }

  [[nodiscard]] double Height(Double3 point) const {
    return Dot(normal_, point - floor_.front()[0]);
  }

  static std::optional<double> DistanceTo(const Triangle& triangle, Double3 eye,
                                          Double3 direction) {
    const Double3 ab = triangle[1] - triangle[0];
    const Double3 ac = triangle[2] - triangle[0];
    const Double3 across = Cross(ab, ac);
    const double along = Dot(across, direction);
    if (along == 0) return std::nullopt;
    const double distance = Dot(across, triangle[0] - eye) / along;
    if (!(distance > 0)) return std::nullopt;
    const Double3 at = eye + direction * distance;
    for (std::size_t i = 0; i < 3; ++i) {
      const Double3 side = triangle[(i + 1) % 3] - triangle[i];
      if (Dot(Cross(side, at - triangle[i]), across) < 0) return std::nullopt;
    }
    return distance;
  }

  [[nodiscard]] std::array<double, 3> ReflectedAt(Double3 place) const {
    std::array<double, 3> radiance = {};
    for (const Light& light : lights_) {
      Polygon seen;
      for (const Double3 corner : light.triangle)
        seen.push_back(corner - place);
      double irradiance = IrradianceOf(seen, normal_);
      for (const Triangle& black : black_) {
        const Triangle by = {black[0] - place, black[1] - place, black[2] - place};
        irradiance -= IrradianceOf(Hidden(seen, by), normal_);
      }
      const std::array<double, 3> emitted = ToArray(light.radiance);
      const std::array<double, 3> albedo = ToArray(albedo_);
      for (std::size_t c = 0; c < 3; ++c)
        radiance[c] += albedo[c] * emitted[c] * irradiance / std::numbers::pi;
    }
    return radiance;
  }

  std::vector<Triangle> floor_, black_;
  std::vector<Light> lights_;
  Rgb albedo_;
  Double3 normal_;
};

}  // namespace

Image RenderClosedForm(const Scene& of_file, const RenderSettings& settings) {
  const PreparedScene prepared(of_file);  // its colours are in the working space
  const Scene& scene = prepared.scene();
  const PixelFilter& filter = scene.filter;
  LUCERNA_CHECK(scene.camera.kind == Camera::Kind::kPerspective &&
                !(scene.camera.lens_radius > 0) && filter.kind == PixelFilter::Kind::kBox &&
                filter.radius_x == 0.5F && filter.radius_y == 0.5F);
  const ClosedForm closed_form(scene);
  const Window window = ScreenWindow(scene.camera, settings.width, settings.height);
  const Transform& to_world = scene.camera.camera_to_world;
  const Double3 eye = Double3(to_world.Point({}));
  const Double3 right = Double3(to_world.Vector({1, 0, 0}));
  const Double3 up = Double3(to_world.Vector({0, 1, 0}));
  const Double3 ahead = Double3(to_world.Vector({0, 0, 1}));
  const auto width = static_cast<std::size_t>(settings.width);
  const auto height = static_cast<std::size_t>(settings.height);

  Image image;
  image.width = settings.width;
  image.height = settings.height;
  for (const char* const channel : {"R", "G", "B"})
    image.channels.push_back({channel, std::vector<float>(width * height)});
  ThreadTeam team(0);
  team.For(height, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t pixel = begin * width; pixel < end * width; ++pixel) {
      std::array<double, 3> sum = {};
      for (int i = 0; i < kPoints; ++i) {
        const double x = static_cast<double>(pixel % width) + (i + 0.5) / kPoints;
        const double y = static_cast<double>(pixel / width) + (i * kStep % kPoints + 0.5) / kPoints;
        const double across = window.low_x + (window.high_x - window.low_x) * x / settings.width;
        const double above = window.high_y - (window.high_y - window.low_y) * y / settings.height;
        const std::array<double, 3> radiance =
            closed_form.RadianceAlong(eye, right * across + up * above + ahead);
        for (std::size_t c = 0; c < 3; ++c)
          sum[c] += radiance[c];
      }
      const std::array<double, 3> rec709 = ToRec709(sum);
      for (std::size_t c = 0; c < 3; ++c) {
        image.channels[c].pixels[pixel] =
            static_cast<float>(scene.film.exposure * rec709[c] / kPoints);
      }
    }
  });
  return image;
}

}  // namespace lucerna
