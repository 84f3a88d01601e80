// What does a ray meet first? The only floor that includes Embree.
//
// Triangles are Embree's; analytic shapes are exact, never tessellated. Objects that are not
// written out have a tree of their own, which their instances share. Of a shape with an alpha below
// 1, or a texture of it, a ray meets so large a share: a number that follows from the ray's own
// bits decides. The instruction set is pinned, and only single rays are traced, so that equal rays
// have equal hits in every process of one numeric profile.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "render/base/status.h"
#include "render/math/vector.h"
#include "render/scene/scene.h"
#include "render/scene/shape_lists.h"

namespace lucerna {

// Which tree rays are traced through, and what hits contain.
struct RayNeeds {
  bool robust_rays = true;
  bool split_triangles = false;
  bool shading_normals = true;

  bool operator==(const RayNeeds&) const = default;
};

struct Ray {
  Vec3 origin;
  Vec3 direction;  // unit, except for tests of occlusion alone
  float t_max = HUGE_VALF;
};

// How far off a surface rays start and end, relative to the largest numbers that its points are
// computed from. Positions computed from three corners or a centre and a radius are off by one or
// two units in the last place; four leave room for Embree's own rounding.
inline constexpr float kClearance = 0x1p-22F;

// In place of a shape's number where a ray meets nothing.
inline constexpr std::uint32_t kNoShape = UINT32_MAX;
// In place of an instance's number on shapes that are none of an instance.
inline constexpr std::uint32_t kNoInstance = UINT32_MAX;

// Geometry numbers: meshes in scene order, then one for all analytic shapes of a kind, then the
// meshes of objects.
struct Hit {
  float t = 0;
  float u = 0, v = 0;  // barycentric, of the triangle's second and third corner
  std::uint32_t geometry = 0;
  std::uint32_t primitive = 0;           // triangle, or analytic shape of the kind
  std::uint32_t instance = kNoInstance;  // of an object's mesh
};

// A point on a surface, ready for scattering.
struct SurfacePoint {
  Vec3 position;
  Vec3 geometric_normal;  // unit, outward
  Vec3 shading_normal;    // unit, in the hemisphere of the geometric one
  std::uint32_t material = 0;
  std::int32_t area_light = kNoAreaLight;
  std::uint32_t geometry = 0, primitive = 0, instance = kNoInstance;
  float u = 0, v = 0;  // barycentric, as in Hit
  // How far off the surface `position` may lie from rounding [scene units]; rays leave from a
  // point so far off that they do not meet the surface again.
  float clearance = 0;
  bool has_shading_normal = false;  // the two normals may differ
  // Where u grows, unit, at right angles to the shading normal. Zero: not needed
  // (transport/material_at.h).
  Vec3 tangent;
};

// Around the shading normal.
[[nodiscard]] inline Frame ShadingFrame(const SurfacePoint& point) {
  if (point.tangent == Vec3()) [[likely]]
    return Frame(point.shading_normal);
  return {point.tangent, point.shading_normal};
}

class Intersector {
 public:
  // Keeps a reference to `scene`, which must outlive it and not change. Hits do not depend on
  // whether triangles are split. Without shading normals every surface is as flat as its triangles.
  // Errors: RESOURCE_EXHAUSTED or INTERNAL with Embree's words; RESOURCE_EXHAUSTED for 2^32
  // triangles, each counted wherever it stands.
  [[nodiscard]] static StatusOr<std::unique_ptr<Intersector>> Create(const Scene& scene,
                                                                     RayNeeds needs = {});
  ~Intersector();
  Intersector(const Intersector&) = delete;
  Intersector& operator=(const Intersector&) = delete;

  // True and `hit` when something is met before ray.t_max. Rays that are no numbers, or begin more
  // than 1.8e18 from the origin, meet nothing, here and in Occluded. Threads: any.
  [[nodiscard]] bool Intersect(const Ray& ray, Hit& hit) const;
  // True when anything is met before ray.t_max. Threads: any.
  [[nodiscard]] bool Occluded(const Ray& ray) const;

  // The number of the triangle or analytic shape that was hit, among all of the scene.
  [[nodiscard]] std::uint32_t ShapeOf(const Hit& hit) const;
  // The hit of a ray with the one shape that it is known to meet first: computed from that alone.
  // Where rounding has it just miss a triangle, the hit is on its edge.
  [[nodiscard]] Hit HitOn(std::uint32_t shape, const Ray& ray) const;

  [[nodiscard]] SurfacePoint SurfaceAt(const Ray& ray, const Hit& hit) const;

  [[nodiscard]] const Bounds& bounds() const { return bounds_; }

 private:
  Intersector(const Scene& scene, bool has_shading_normals);
  Status AddInstances();
  struct EmbreeScene;

  const Scene& scene_;
  std::unique_ptr<EmbreeScene> embree_;
  bool has_shading_normals_;
  std::vector<std::uint32_t> first_shape_;        // [geometries but those of objects] ascending
  std::uint32_t shape_count_ = 0;                 // without instances
  std::vector<std::uint32_t> first_of_instance_;  // [instances] number of its first triangle
  std::vector<std::uint32_t> first_of_mesh_;  // [object meshes] triangles before it in its object
  std::vector<float> instance_clearance_;     // [instances] [scene units]
  Bounds bounds_;
};

// The mesh that has this geometry number; nullptr for analytic shapes.
[[nodiscard]] inline const TriangleMesh* MeshOf(const Scene& scene, std::uint32_t geometry) {
  if (geometry < scene.meshes.size()) return &scene.meshes[geometry];
  const std::size_t of_objects = scene.meshes.size() + kShapeKinds;
  return geometry < of_objects ? nullptr : &scene.object_meshes[geometry - of_objects];
}
// The corners of a triangle of that mesh in the world.
[[nodiscard]] inline std::array<Vec3, 3> CornersOf(const Scene& scene, const TriangleMesh& mesh,
                                                   std::uint32_t triangle, std::uint32_t instance) {
  const std::uint32_t* corner = &mesh.indices[std::size_t{3} * triangle];
  const std::array<Vec3, 3> own = {mesh.positions[corner[0]], mesh.positions[corner[1]],
                                   mesh.positions[corner[2]]};
  if (instance == kNoInstance) return own;
  const Transform& to_world = scene.instances[instance].to_world;
  return {to_world.Point(own[0]), to_world.Point(own[1]), to_world.Point(own[2])};
}

// The kind of the analytic shapes that have this geometry number. Requires one that is no mesh's.
[[nodiscard]] inline ShapeKind KindOf(const Scene& scene, std::uint32_t geometry) {
  return static_cast<ShapeKind>(geometry - scene.meshes.size());
}
// What holds for the shape that was hit as a whole.
[[nodiscard]] inline const ShapeTraits& TraitsOf(const Scene& scene, const SurfacePoint& surface) {
  if (const TriangleMesh* mesh = MeshOf(scene, surface.geometry)) return mesh->traits;
  return VisitShape(scene, KindOf(scene, surface.geometry), surface.primitive,
                    [](const auto& shape) -> const ShapeTraits& { return shape.traits; });
}
[[nodiscard]] inline std::uint32_t GeometryOf(const Scene& scene, ShapeKind kind) {
  return static_cast<std::uint32_t>(scene.meshes.size()) + static_cast<std::uint32_t>(kind);
}

// Where a ray that leaves `point` towards `direction` starts.
[[nodiscard]] inline Vec3 LeavingPoint(const SurfacePoint& point, Vec3 direction) {
  const float side = Dot(direction, point.geometric_normal) < 0 ? -1.0F : 1.0F;
  return point.position + point.geometric_normal * (side * point.clearance);
}

}  // namespace lucerna
