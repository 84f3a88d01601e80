#include "render/geometry/surface_tangents.h"

#include <array>
#include <cmath>

#include "render/geometry/shape_geometry.h"
#include "render/math/double3.h"
#include "render/scene/shape_lists.h"

namespace lucerna {
namespace {

// In a scene of tiny or huge numbers squares of floats would vanish or have no end.
bool AreParallel(const Double3& a, const Double3& b) {
  return !(Length(Cross(a, b)) > 0);
}

// Any two tangents.
SurfaceTangents AcrossNormal(Vec3 normal) {
  const Frame frame(normal);
  return {frame.s, frame.t, {}, {}};
}

// The derivatives by u and v of what changes evenly over a triangle.
struct Derivatives {
  Double3 by_u, by_v;
};
Derivatives DerivativesOf(const std::array<Vec2, 3>& uv, double inverse_determinant,
                          const Double3& a, const Double3& b, const Double3& c) {
  const Double3 d02 = a - c;
  const Double3 d12 = b - c;
  const auto du02 = static_cast<double>(uv[0].x - uv[2].x);
  const auto dv02 = static_cast<double>(uv[0].y - uv[2].y);
  const auto du12 = static_cast<double>(uv[1].x - uv[2].x);
  const auto dv12 = static_cast<double>(uv[1].y - uv[2].y);
  return {(d02 * dv12 - d12 * dv02) * inverse_determinant,
          (d12 * du02 - d02 * du12) * inverse_determinant};
}

SurfaceTangents OnTriangle(const Scene& scene, const TriangleMesh& mesh,
                           const SurfacePoint& point) {
  const std::array<Vec2, 3> uv = UvsOf(mesh, point.primitive);
  const auto [p0, p1, p2] = CornersOf(scene, mesh, point.primitive, point.instance);
  const double determinant =
      static_cast<double>(uv[0].x - uv[2].x) * static_cast<double>(uv[1].y - uv[2].y) -
      static_cast<double>(uv[0].y - uv[2].y) * static_cast<double>(uv[1].x - uv[2].x);
  // As in pbrt-v4: coordinates that hardly change give no direction.
  constexpr double kLeastDeterminant = 1e-9;
  if (!(std::abs(determinant) >= kLeastDeterminant)) return AcrossNormal(point.shading_normal);
  const Derivatives p = DerivativesOf(uv, 1 / determinant, Double3(p0), Double3(p1), Double3(p2));
  SurfaceTangents tangents = {ToFloat(p.by_u), ToFloat(p.by_v), {}, {}};
  if (!point.has_shading_normal) {
    return AreParallel(p.by_u, p.by_v) ? AcrossNormal(point.shading_normal) : tangents;
  }
  tangents.dpdv = Cross(point.shading_normal, tangents.dpdu);
  if (!(MaxAbs(tangents.dpdv) > 0)) return AcrossNormal(point.shading_normal);
  tangents.v_is_turned = Dot(Double3(tangents.dpdv), p.by_v) < 0;
  tangents.dpdu = Cross(tangents.dpdv, point.shading_normal);
  const Transform* to_world =
      point.instance == kNoInstance ? nullptr : &scene.instances[point.instance].to_world;
  const std::uint32_t* corner = &mesh.indices[std::size_t{3} * point.primitive];
  const auto normal_at = [&](std::size_t i) {
    const Vec3 own = mesh.normals[corner[i]];
    if (to_world == nullptr || own == Vec3()) return Double3(own);
    const Vec3 turned = to_world->Normal(own);
    return Double3(turned == Vec3() ? turned : Normalize(turned));
  };
  const Derivatives n =
      DerivativesOf(uv, 1 / determinant, normal_at(0), normal_at(1), normal_at(2));
  tangents.dndu = ToFloat(n.by_u);
  tangents.dndv = ToFloat(n.by_v);
  return tangents;
}

}  // namespace

SurfaceTangents TangentsAt(const Scene& scene, const SurfacePoint& point) {
  if (const TriangleMesh* mesh = MeshOf(scene, point.geometry))
    return OnTriangle(scene, *mesh, point);
  const SurfaceTangents tangents =
      VisitShape(scene, KindOf(scene, point.geometry), point.primitive,
                 [&](const auto& shape) { return TangentsOf(shape, point.position); });
  // The poles.
  return AreParallel(Double3(tangents.dpdu), Double3(tangents.dpdv))
             ? AcrossNormal(point.shading_normal)
             : tangents;
}

}  // namespace lucerna
