#include "render/geometry/intersector.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <embree3/rtcore.h>

#include "render/geometry/embree_device.h"
#include "render/math/double3.h"

namespace lucerna {
namespace {

// The nearer root in (t_near, t_far), else the farther one; false without either. The roots are
// found from the larger one, so that neither suffers cancellation.
bool SphereRoot(const Sphere& sphere, Vec3 origin, Vec3 direction, float t_near, float t_far,
                float& t) {
  const Double3 o(origin);
  const Double3 c(sphere.center);
  const Double3 d(direction);
  const Double3 oc = o - c;
  const auto radius = static_cast<double>(sphere.radius);
  const double dd = Dot(d, d);
  const double b = -Dot(oc, d);
  // The discriminant by the distance of the centre from the line: exact for far spheres too.
  const double along = b / dd;
  const Double3 nearest = oc + d * along;
  const double discriminant = radius * radius - Dot(nearest, nearest);
  if (!(discriminant >= 0)) return false;
  const double root = std::sqrt(dd * discriminant);
  const double q = b + std::copysign(root, b);
  const double other = (Dot(oc, oc) - radius * radius);
  double t0 = q == 0 ? 0 : other / q;
  double t1 = q / dd;
  if (t0 > t1) std::swap(t0, t1);
  const auto near_f = static_cast<float>(t0);
  if (near_f > t_near && near_f < t_far) {
    t = near_f;
    return true;
  }
  const auto far_f = static_cast<float>(t1);
  if (far_f > t_near && far_f < t_far) {
    t = far_f;
    return true;
  }
  return false;
}

bool DiskRoot(const Disk& disk, Vec3 origin, Vec3 direction, float t_near, float t_far, float& t) {
  const float slope = Dot(direction, disk.normal);
  if (slope == 0) return false;
  t = Dot(disk.center - origin, disk.normal) / slope;
  if (!(t > t_near && t < t_far)) return false;
  const float squared = LengthSquared(origin + direction * t - disk.center);
  return squared <= disk.radius * disk.radius && squared >= disk.inner_radius * disk.inner_radius;
}

struct TriangleHit {
  float t, u, v;
};

// Where a line meets the plane of a triangle, by volumes (Möller and Trumbore 1997), moved into the
// triangle.
TriangleHit HitTriangle(const std::array<Vec3, 3>& corners, const Ray& ray) {
  const Double3 p0(corners[0]);
  const Double3 e1 = Double3(corners[1]) - p0;
  const Double3 e2 = Double3(corners[2]) - p0;
  const Double3 d(ray.direction);
  const Double3 from = Double3(ray.origin) - p0;
  const Double3 across = Cross(d, e2);
  const double volume = Dot(across, e1);
  const Double3 side = Cross(from, e1);
  if (volume == 0) {
    // Seen edge-on: anywhere on it will do.
    const Double3 middle = (e1 + e2) * (1.0 / 3) - from;
    return {static_cast<float>(std::max(0.0, Dot(middle, d))), 1.0F / 3, 1.0F / 3};
  }
  const double u = std::clamp(Dot(from, across) / volume, 0.0, 1.0);
  const double v = std::clamp(Dot(d, side) / volume, 0.0, 1 - u);
  const double t = std::max(0.0, Dot(e2, side) / volume);
  return {static_cast<float>(t), static_cast<float>(u), static_cast<float>(v)};
}

void SphereBounds(const RTCBoundsFunctionArguments* arguments) {
  const Sphere& sphere =
      static_cast<const Scene*>(arguments->geometryUserPtr)->spheres[arguments->primID];
  // A little outwards, for the rounding of centre ± radius.
  const float r = sphere.radius + kClearance * (MaxAbs(sphere.center) + sphere.radius);
  RTCBounds* box = arguments->bounds_o;
  box->lower_x = sphere.center.x - r;
  box->lower_y = sphere.center.y - r;
  box->lower_z = sphere.center.z - r;
  box->upper_x = sphere.center.x + r;
  box->upper_y = sphere.center.y + r;
  box->upper_z = sphere.center.z + r;
}

void DiskBounds(const RTCBoundsFunctionArguments* arguments) {
  const Disk& disk =
      static_cast<const Scene*>(arguments->geometryUserPtr)->disks[arguments->primID];
  const float slack = kClearance * (MaxAbs(disk.center) + disk.radius);
  const auto reach = [&](float n) {
    return disk.radius * std::sqrt(std::max(0.0F, 1 - n * n)) + slack;
  };
  RTCBounds* box = arguments->bounds_o;
  box->lower_x = disk.center.x - reach(disk.normal.x);
  box->lower_y = disk.center.y - reach(disk.normal.y);
  box->lower_z = disk.center.z - reach(disk.normal.z);
  box->upper_x = disk.center.x + reach(disk.normal.x);
  box->upper_y = disk.center.y + reach(disk.normal.y);
  box->upper_z = disk.center.z + reach(disk.normal.z);
}

bool RootOf(const Sphere& shape, Vec3 o, Vec3 d, float t_near, float t_far, float& t) {
  return SphereRoot(shape, o, d, t_near, t_far, t);
}
bool RootOf(const Disk& shape, Vec3 o, Vec3 d, float t_near, float t_far, float& t) {
  return DiskRoot(shape, o, d, t_near, t_far, t);
}

template <typename Shape, std::vector<Shape> Scene::*kShapes>
void IntersectShape(const RTCIntersectFunctionNArguments* arguments) {
  if (arguments->valid[0] == 0) return;
  const Shape& shape =
      (static_cast<const Scene*>(arguments->geometryUserPtr)->*kShapes)[arguments->primID];
  auto* ray_hit = reinterpret_cast<RTCRayHit*>(arguments->rayhit);
  RTCRay& ray = ray_hit->ray;
  float t = 0;
  if (!RootOf(shape, {ray.org_x, ray.org_y, ray.org_z}, {ray.dir_x, ray.dir_y, ray.dir_z},
              ray.tnear, ray.tfar, t)) {
    return;
  }
  ray.tfar = t;
  ray_hit->hit.geomID = arguments->geomID;
  ray_hit->hit.primID = arguments->primID;
  ray_hit->hit.instID[0] = arguments->context->instID[0];
  ray_hit->hit.u = 0;
  ray_hit->hit.v = 0;
}

template <typename Shape, std::vector<Shape> Scene::*kShapes>
void OccludedByShape(const RTCOccludedFunctionNArguments* arguments) {
  if (arguments->valid[0] == 0) return;
  const Shape& shape =
      (static_cast<const Scene*>(arguments->geometryUserPtr)->*kShapes)[arguments->primID];
  auto* ray = reinterpret_cast<RTCRay*>(arguments->ray);
  float t = 0;
  if (RootOf(shape, {ray->org_x, ray->org_y, ray->org_z}, {ray->dir_x, ray->dir_y, ray->dir_z},
             ray->tnear, ray->tfar, t)) {
    ray->tfar = -HUGE_VALF;
  }
}

RTCRay ToEmbree(const Ray& ray) {
  RTCRay out{};
  out.org_x = ray.origin.x;
  out.org_y = ray.origin.y;
  out.org_z = ray.origin.z;
  out.dir_x = ray.direction.x;
  out.dir_y = ray.direction.y;
  out.dir_z = ray.direction.z;
  out.tnear = 0;
  out.tfar = ray.t_max;
  out.mask = 0xFFFFFFFFU;
  return out;
}

}  // namespace

struct Intersector::EmbreeScene {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  // Embree reads 16 bytes at a vertex, so the last one must have four more bytes after it; our
  // copies have one vertex too many.
  std::vector<std::vector<Vec3>> padded_positions;

  ~EmbreeScene() {
    if (scene != nullptr) rtcReleaseScene(scene);
    if (device != nullptr) rtcReleaseDevice(device);
  }
};

Intersector::Intersector(const Scene& scene, bool has_shading_normals)
    : scene_(scene),
      embree_(std::make_unique<EmbreeScene>()),
      has_shading_normals_(has_shading_normals),
      sphere_geometry_(static_cast<std::uint32_t>(scene.meshes.size())) {
  std::uint32_t shapes = 0;
  for (const TriangleMesh& mesh : scene.meshes) {
    first_shape_.push_back(shapes);
    shapes += static_cast<std::uint32_t>(mesh.indices.size() / 3);
  }
  first_shape_.push_back(shapes);
  first_shape_.push_back(shapes + static_cast<std::uint32_t>(scene.spheres.size()));
}

Intersector::~Intersector() = default;

StatusOr<std::unique_ptr<Intersector>> Intersector::Create(const Scene& scene, RayNeeds needs) {
  auto intersector = std::unique_ptr<Intersector>(new Intersector(scene, needs.shading_normals));
  EmbreeScene& embree = *intersector->embree_;
  LUCERNA_ASSIGN_OR_RETURN(embree.device, NewEmbreeDevice());
  embree.scene = rtcNewScene(embree.device);
  rtcSetSceneFlags(embree.scene, needs.robust_rays ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE);
  rtcSetSceneBuildQuality(
      embree.scene, needs.split_triangles ? RTC_BUILD_QUALITY_HIGH : RTC_BUILD_QUALITY_MEDIUM);

  Bounds& bounds = intersector->bounds_;
  std::uint32_t number = 0;
  embree.padded_positions.reserve(scene.meshes.size());
  for (const TriangleMesh& mesh : scene.meshes) {
    for (const Vec3& p : mesh.positions)
      bounds.Add(p);
    std::vector<Vec3>& padded = embree.padded_positions.emplace_back();
    padded.reserve(mesh.positions.size() + 1);
    padded.assign(mesh.positions.begin(), mesh.positions.end());
    padded.emplace_back();
    RTCGeometry geometry = rtcNewGeometry(embree.device, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                               padded.data(), 0, sizeof(Vec3), mesh.positions.size());
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                               mesh.indices.data(), 0, 3 * sizeof(std::uint32_t),
                               mesh.indices.size() / 3);
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(embree.scene, geometry, number++);
    rtcReleaseGeometry(geometry);
  }

  const auto attach = [&](std::size_t count, RTCBoundsFunction bounds_of,
                          RTCIntersectFunctionN intersect, RTCOccludedFunctionN occluded) {
    RTCGeometry geometry = rtcNewGeometry(embree.device, RTC_GEOMETRY_TYPE_USER);
    rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned int>(count));
    rtcSetGeometryUserData(geometry, const_cast<Scene*>(&scene));
    rtcSetGeometryBoundsFunction(geometry, bounds_of, nullptr);
    rtcSetGeometryIntersectFunction(geometry, intersect);
    rtcSetGeometryOccludedFunction(geometry, occluded);
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(embree.scene, geometry, number);
    rtcReleaseGeometry(geometry);
  };
  if (!scene.spheres.empty()) {
    attach(scene.spheres.size(), SphereBounds, IntersectShape<Sphere, &Scene::spheres>,
           OccludedByShape<Sphere, &Scene::spheres>);
  }
  ++number;
  if (!scene.disks.empty()) {
    attach(scene.disks.size(), DiskBounds, IntersectShape<Disk, &Scene::disks>,
           OccludedByShape<Disk, &Scene::disks>);
  }
  for (const Sphere& sphere : scene.spheres) {
    const Vec3 reach = {sphere.radius, sphere.radius, sphere.radius};
    bounds.Add(sphere.center - reach);
    bounds.Add(sphere.center + reach);
  }
  for (const Disk& disk : scene.disks) {
    const Vec3 reach = {disk.radius, disk.radius, disk.radius};
    bounds.Add(disk.center - reach);
    bounds.Add(disk.center + reach);
  }
  rtcCommitScene(embree.scene);
  LUCERNA_RETURN_IF_ERROR(EmbreeStatus(embree.device));
  return intersector;
}

bool Intersector::Intersect(const Ray& ray, Hit& hit) const {
  RTCRayHit ray_hit;
  ray_hit.ray = ToEmbree(ray);
  ray_hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  ray_hit.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(embree_->scene, &context, &ray_hit);
  if (ray_hit.hit.geomID == RTC_INVALID_GEOMETRY_ID) return false;
  hit.t = ray_hit.ray.tfar;
  hit.u = ray_hit.hit.u;
  hit.v = ray_hit.hit.v;
  hit.geometry = ray_hit.hit.geomID;
  hit.primitive = ray_hit.hit.primID;
  return true;
}

bool Intersector::Occluded(const Ray& ray) const {
  RTCRay embree_ray = ToEmbree(ray);
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(embree_->scene, &context, &embree_ray);
  return embree_ray.tfar < 0;
}

std::uint32_t Intersector::ShapeOf(const Hit& hit) const {
  return first_shape_[hit.geometry] + hit.primitive;
}

Hit Intersector::HitOn(std::uint32_t shape, const Ray& ray) const {
  const auto next = std::upper_bound(first_shape_.begin(), first_shape_.end(), shape);
  const auto geometry = static_cast<std::uint32_t>(next - first_shape_.begin() - 1);
  const std::uint32_t primitive = shape - first_shape_[geometry];
  Hit hit{.geometry = geometry, .primitive = primitive};
  if (geometry == sphere_geometry_) {
    // As Embree was told: the same bits.
    SphereRoot(scene_.spheres[primitive], ray.origin, ray.direction, 0, ray.t_max, hit.t);
  } else if (geometry > sphere_geometry_) {
    DiskRoot(scene_.disks[primitive], ray.origin, ray.direction, 0, ray.t_max, hit.t);
  } else {
    const TriangleMesh& mesh = scene_.meshes[geometry];
    const std::uint32_t* corner = &mesh.indices[std::size_t{3} * primitive];
    const TriangleHit at = HitTriangle(
        {mesh.positions[corner[0]], mesh.positions[corner[1]], mesh.positions[corner[2]]}, ray);
    hit.t = at.t;
    hit.u = at.u;
    hit.v = at.v;
  }
  return hit;
}

SurfacePoint Intersector::SurfaceAt(const Ray& ray, const Hit& hit) const {
  SurfacePoint point;
  point.geometry = hit.geometry;
  point.primitive = hit.primitive;
  point.u = hit.u;
  point.v = hit.v;
  const ShapeTraits* traits = nullptr;
  if (hit.geometry < sphere_geometry_) {
    const TriangleMesh& mesh = scene_.meshes[hit.geometry];
    const std::uint32_t* corner = &mesh.indices[std::size_t{3} * hit.primitive];
    const Vec3 p0 = mesh.positions[corner[0]];
    const Vec3 e1 = mesh.positions[corner[1]] - p0;
    const Vec3 e2 = mesh.positions[corner[2]] - p0;
    // From the corners, not along the ray: the error then has the size of the triangle.
    point.position = p0 + e1 * hit.u + e2 * hit.v;
    point.clearance = kClearance * (MaxAbs(p0) + MaxAbs(e1) + MaxAbs(e2));
    point.geometric_normal =
        TriangleNormal(p0, mesh.positions[corner[1]], mesh.positions[corner[2]]);
    point.shading_normal = point.geometric_normal;
    if (has_shading_normals_ && !mesh.normals.empty()) {
      const Vec3 n = mesh.normals[corner[0]] * (1 - hit.u - hit.v) +
                     mesh.normals[corner[1]] * hit.u + mesh.normals[corner[2]] * hit.v;
      const float squared = LengthSquared(n);
      if (squared > 1e-12F) {
        point.shading_normal = FaceForward(n * (1 / std::sqrt(squared)), point.geometric_normal);
        point.has_shading_normal = true;
      }
    }
    traits = &mesh.traits;
  } else if (hit.geometry == sphere_geometry_) {
    const Sphere& sphere = scene_.spheres[hit.primitive];
    const Vec3 from_center = ray.origin - sphere.center + ray.direction * hit.t;
    const Vec3 outward = Normalize(from_center);
    // Put back onto the sphere: whatever t lost, the point is on the surface.
    point.position = sphere.center + outward * sphere.radius;
    point.clearance = kClearance * (MaxAbs(sphere.center) + sphere.radius);
    point.geometric_normal = sphere.inward ? -outward : outward;
    point.shading_normal = point.geometric_normal;
    traits = &sphere.traits;
  } else {
    const Disk& disk = scene_.disks[hit.primitive];
    const Vec3 p = ray.origin + ray.direction * hit.t;
    point.position = p - disk.normal * Dot(p - disk.center, disk.normal);
    point.clearance = kClearance * (MaxAbs(disk.center) + disk.radius);
    point.geometric_normal = disk.normal;
    point.shading_normal = disk.normal;
    traits = &disk.traits;
  }
  point.material = static_cast<std::uint32_t>(traits->material);
  point.area_light = traits->area_light;
  return point;
}

}  // namespace lucerna
