#include "render/geometry/surface_uv.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "render/geometry/shape_geometry.h"
#include "render/math/warp.h"
#include "render/scene/shape_lists.h"

namespace lucerna {

std::array<Vec2, 3> UvsOf(const TriangleMesh& mesh, std::uint32_t triangle) {
  if (mesh.uvs.empty()) return {Vec2{0, 0}, Vec2{1, 0}, Vec2{1, 1}};
  const std::uint32_t* corner = &mesh.indices[std::size_t{3} * triangle];
  return {mesh.uvs[corner[0]], mesh.uvs[corner[1]], mesh.uvs[corner[2]]};
}

namespace {

double DotDouble(Vec3 a, Vec3 b) {
  return static_cast<double>(a.x) * static_cast<double>(b.x) +
         static_cast<double>(a.y) * static_cast<double>(b.y) +
         static_cast<double>(a.z) * static_cast<double>(b.z);
}

}  // namespace

double TurnSlope(double distance) {
  const double turn = 2 * std::numbers::pi * distance;
  return 1 / (turn * turn);
}

Vec2 UvAt(const Scene& scene, const SurfacePoint& point) {
  if (const TriangleMesh* mesh = MeshOf(scene, point.geometry)) {
    const std::array<Vec2, 3> uv = UvsOf(*mesh, point.primitive);
    const float rest = 1 - point.u - point.v;
    return {uv[0].x * rest + uv[1].x * point.u + uv[2].x * point.v,
            uv[0].y * rest + uv[1].y * point.u + uv[2].y * point.v};
  }
  return VisitShape(scene, KindOf(scene, point.geometry), point.primitive,
                    [&](const auto& shape) { return UvOf(shape, point.position); });
}

Rgb VertexColorAt(const Scene& scene, const SurfacePoint& point) {
  const TriangleMesh* const mesh = MeshOf(scene, point.geometry);
  if (mesh == nullptr || mesh->colors.empty()) return Gray(1);
  const std::uint32_t* corner = &mesh->indices[std::size_t{3} * point.primitive];
  return mesh->colors[corner[0]] * (1 - point.u - point.v) + mesh->colors[corner[1]] * point.u +
         mesh->colors[corner[2]] * point.v;
}

UvSlopes UvSlopesAt(const Scene& scene, const SurfacePoint& point) {
  if (const TriangleMesh* mesh = MeshOf(scene, point.geometry)) {
    const auto [p0, p1, p2] = CornersOf(scene, *mesh, point.primitive, point.instance);
    const Vec3 e1 = p1 - p0;
    const Vec3 e2 = p2 - p0;
    const std::array<Vec2, 3> uv = UvsOf(*mesh, point.primitive);
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
  return VisitShape(scene, KindOf(scene, point.geometry), point.primitive,
                    [&](const auto& shape) { return UvSlopesOf(shape, point.position); });
}

}  // namespace lucerna
