#include "render/geometry/surface_uv.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "render/math/warp.h"

namespace lucerna {
namespace {

constexpr double kPiD = std::numbers::pi;

std::array<Vec2, 3> CornersOf(const TriangleMesh& mesh, std::uint32_t triangle) {
  if (mesh.uvs.empty()) return {Vec2{0, 0}, Vec2{1, 0}, Vec2{1, 1}};
  const std::uint32_t* corner = &mesh.indices[std::size_t{3} * triangle];
  return {mesh.uvs[corner[0]], mesh.uvs[corner[1]], mesh.uvs[corner[2]]};
}

// The share of a full turn from x to y, in [0, 1).
float Turn(float x, float y) {
  if (x == 0 && y == 0) return 0;
  const float turn = std::atan2(y, x) * (0.5F * kInversePi);
  return turn < 0 ? std::min(turn + 1, 0x1.fffffep-1F) : turn;
}

double DotDouble(Vec3 a, Vec3 b) {
  return static_cast<double>(a.x) * static_cast<double>(b.x) +
         static_cast<double>(a.y) * static_cast<double>(b.y) +
         static_cast<double>(a.z) * static_cast<double>(b.z);
}

}  // namespace

Vec2 UvAt(const Scene& scene, const SurfacePoint& point) {
  if (point.geometry < scene.meshes.size()) {
    const std::array<Vec2, 3> uv = CornersOf(scene.meshes[point.geometry], point.primitive);
    const float rest = 1 - point.u - point.v;
    return {uv[0].x * rest + uv[1].x * point.u + uv[2].x * point.v,
            uv[0].y * rest + uv[1].y * point.u + uv[2].y * point.v};
  }
  if (point.geometry == scene.meshes.size()) {
    const Sphere& sphere = scene.spheres[point.primitive];
    const Vec3 local = (point.position - sphere.center) / sphere.radius;
    const float height = std::min(std::max(Dot(local, sphere.axes.z), -1.0F), 1.0F);
    return {Turn(Dot(local, sphere.axes.x), Dot(local, sphere.axes.y)),
            1 - std::acos(height) * kInversePi};
  }
  const Disk& disk = scene.disks[point.primitive];
  const Vec3 local = point.position - disk.center;
  const float x = Dot(local, disk.axes.x);
  const float y = Dot(local, disk.axes.y);
  return {Turn(x, y), (disk.radius - std::sqrt(x * x + y * y)) / (disk.radius - disk.inner_radius)};
}

UvSlopes UvSlopesAt(const Scene& scene, const SurfacePoint& point) {
  if (point.geometry < scene.meshes.size()) {
    const TriangleMesh& mesh = scene.meshes[point.geometry];
    const std::uint32_t* corner = &mesh.indices[std::size_t{3} * point.primitive];
    const Vec3 e1 = mesh.positions[corner[1]] - mesh.positions[corner[0]];
    const Vec3 e2 = mesh.positions[corner[2]] - mesh.positions[corner[0]];
    const std::array<Vec2, 3> uv = CornersOf(mesh, point.primitive);
    // The gradient g of a linear function lies in the plane and has g·e1 = d1, g·e2 = d2.
    const double a = DotDouble(e1, e1);
    const double b = DotDouble(e1, e2);
    const double c = DotDouble(e2, e2);
    const double determinant = a * c - b * b;
    if (!(determinant > 1e-12 * a * c)) return {};
    const auto squared = [&](float first, float second, float third) {
      const auto d1 = static_cast<double>(second - first);
      const auto d2 = static_cast<double>(third - first);
      return (c * d1 * d1 - 2 * b * d1 * d2 + a * d2 * d2) / determinant;
    };
    return {squared(uv[0].x, uv[1].x, uv[2].x), squared(uv[0].y, uv[1].y, uv[2].y)};
  }
  const auto around = [](double distance) {
    // The pole, where the gradient has no end, is a point.
    const double turn = 2 * kPiD * distance;
    return 1 / (turn * turn);
  };
  if (point.geometry == scene.meshes.size()) {
    const Sphere& sphere = scene.spheres[point.primitive];
    const auto radius = static_cast<double>(sphere.radius);
    const Vec3 local = point.position - sphere.center;
    const auto height = static_cast<double>(Dot(local, sphere.axes.z));
    const double from_axis = std::sqrt(std::max(radius * radius - height * height, 0.0));
    return {around(std::max(from_axis, 1e-3 * radius)), 1 / (kPiD * radius * kPiD * radius)};
  }
  const Disk& disk = scene.disks[point.primitive];
  const double from_center = static_cast<double>(Length(point.position - disk.center));
  const double width = static_cast<double>(disk.radius) - static_cast<double>(disk.inner_radius);
  return {around(std::max(from_center, 1e-3 * static_cast<double>(disk.radius))),
          1 / (width * width)};
}

}  // namespace lucerna
