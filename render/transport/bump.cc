#include "render/transport/bump.h"

#include <algorithm>
#include <cmath>

#include "render/geometry/surface_tangents.h"

namespace lucerna {
namespace {

// Tangents of the surface as bumps make it.
struct Turned {
  Vec3 dpdu, dpdv;
};

// Heights at places nearby, along u and along v. The step is one that floats of these coordinates
// can tell apart, and what rounding makes of it.
Turned Displaced(const Scene& scene, const Material& material, const TexturePlace& place,
                 const SurfaceTangents& tangents, Vec3 normal) {
  // A height is in units of the file.
  const auto per_unit = static_cast<float>(1 / scene.unit);
  const auto height_at = [&](const TexturePlace& at) {
    return TextureNumber(scene.textures, material.displacement, at) * per_unit;
  };
  constexpr float kLeastShare = 0x1p-20F;  // of a coordinate
  const auto step_from = [](float coordinate, float step) {
    const float shifted = coordinate + std::max(step, kLeastShare * std::abs(coordinate));
    return shifted - coordinate;
  };
  const float height = height_at(place);
  const float du = step_from(place.uv.x, material.slope_step.x);
  const float dv = step_from(place.uv.y, material.slope_step.y);
  TexturePlace along_u = place;
  along_u.uv.x += du;
  along_u.position = place.position + tangents.dpdu * du;
  TexturePlace along_v = place;
  along_v.uv.y += dv;
  along_v.position = place.position + tangents.dpdv * dv;
  return {tangents.dpdu + normal * ((height_at(along_u) - height) / du) + tangents.dndu * height,
          tangents.dpdv + normal * ((height_at(along_v) - height) / dv) + tangents.dndv * height};
}

// Its direction, however small or large it is; zero where there is none.
Vec3 DirectionOf(Vec3 v) {
  const float size = MaxAbs(v);
  return size > 0 && std::isfinite(size) ? Normalize(v / size) : Vec3();
}

// Unit, along dpdu at right angles to the normal; zero where there is none.
Vec3 TangentAlong(Vec3 dpdu, Vec3 normal) {
  const Vec3 u = DirectionOf(dpdu);
  return DirectionOf(u - normal * Dot(u, normal));
}

Turned Mapped(const Scene& scene, const Material& material, const TexturePlace& place,
              const SurfaceTangents& tangents, Vec3 normal) {
  const Rgb color = TextureColor(scene.textures, material.normal_map, place);
  Vec3 local = {(2 * color.r - 1) * material.normal_scale,
                (2 * color.g - 1) * material.normal_scale, 2 * color.b - 1};
  const Vec3 along = TangentAlong(tangents.dpdu, normal);
  if (!(LengthSquared(local) > 0) || along == Vec3()) return {};
  // Where the picture is mirrored on the surface.
  const bool is_mirrored = tangents.v_is_turned || Dot(Cross(normal, along), tangents.dpdv) < 0;
  if (material.normal_map_follows_v && is_mirrored) local.y = -local.y;
  const Vec3 turned = Normalize(Frame(along, normal).ToWorld(Normalize(local)));
  const Vec3 u = DirectionOf(tangents.dpdu);
  const Vec3 dpdu = u - turned * Dot(u, turned);
  return {dpdu, Cross(turned, dpdu)};
}

}  // namespace

void TurnShadingNormal(const Scene& scene, const Material& material, const TexturePlace& place,
                       SurfacePoint& point) {
  const SurfaceTangents tangents = TangentsAt(scene, point);
  point.tangent = TangentAlong(tangents.dpdu, point.shading_normal);
  const Turned turned = material.normal_map != kNoTexture
                            ? Mapped(scene, material, place, tangents, point.shading_normal)
                            : Displaced(scene, material, place, tangents, point.shading_normal);
  const Vec3 across = DirectionOf(Cross(DirectionOf(turned.dpdu), DirectionOf(turned.dpdv)));
  if (across == Vec3()) return;
  point.shading_normal = FaceForward(across, point.geometric_normal);
  point.has_shading_normal = true;
  point.tangent = TangentAlong(turned.dpdu, point.shading_normal);
}

void FindTangent(const Scene& scene, SurfacePoint& point) {
  point.tangent = TangentAlong(TangentsAt(scene, point).dpdu, point.shading_normal);
}

}  // namespace lucerna
