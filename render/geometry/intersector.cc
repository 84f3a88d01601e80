#include "render/geometry/intersector.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <embree3/rtcore.h>

#include "render/geometry/embree_device.h"
#include "render/geometry/shape_geometry.h"
#include "render/math/double3.h"

namespace lucerna {
namespace {

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

template <typename Shape, std::vector<Shape> Scene::*kShapes>
void BoundsOfShape(const RTCBoundsFunctionArguments* arguments) {
  const Bounds bounds =
      BoxOf((static_cast<const Scene*>(arguments->geometryUserPtr)->*kShapes)[arguments->primID]);
  RTCBounds* box = arguments->bounds_o;
  box->lower_x = bounds.low.x;
  box->lower_y = bounds.low.y;
  box->lower_z = bounds.low.z;
  box->upper_x = bounds.high.x;
  box->upper_y = bounds.high.y;
  box->upper_z = bounds.high.z;
}

template <typename Shape, std::vector<Shape> Scene::*kShapes>
void IntersectedShape(const RTCIntersectFunctionNArguments* arguments) {
  if (arguments->valid[0] == 0) return;
  const Shape& shape =
      (static_cast<const Scene*>(arguments->geometryUserPtr)->*kShapes)[arguments->primID];
  auto* ray_hit = reinterpret_cast<RTCRayHit*>(arguments->rayhit);
  RTCRay& ray = ray_hit->ray;
  float t = 0;
  if (!IntersectShape(shape, {ray.org_x, ray.org_y, ray.org_z}, {ray.dir_x, ray.dir_y, ray.dir_z},
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
  if (IntersectShape(shape, {ray->org_x, ray->org_y, ray->org_z},
                     {ray->dir_x, ray->dir_y, ray->dir_z}, ray->tnear, ray->tfar, t)) {
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
      has_shading_normals_(has_shading_normals) {
  std::uint32_t shapes = 0;
  for (const TriangleMesh& mesh : scene.meshes) {
    first_shape_.push_back(shapes);
    shapes += static_cast<std::uint32_t>(mesh.indices.size() / 3);
  }
  ForEachAnalyticList(scene, [&](const auto& list) {
    first_shape_.push_back(shapes);
    shapes += static_cast<std::uint32_t>(list.size());
  });
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

  const auto attach = [&](std::size_t count, ShapeKind kind, RTCBoundsFunction bounds_of,
                          RTCIntersectFunctionN intersect, RTCOccludedFunctionN occluded) {
    RTCGeometry geometry = rtcNewGeometry(embree.device, RTC_GEOMETRY_TYPE_USER);
    rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned int>(count));
    rtcSetGeometryUserData(geometry, const_cast<Scene*>(&scene));
    rtcSetGeometryBoundsFunction(geometry, bounds_of, nullptr);
    rtcSetGeometryIntersectFunction(geometry, intersect);
    rtcSetGeometryOccludedFunction(geometry, occluded);
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(embree.scene, geometry, GeometryOf(scene, kind));
    rtcReleaseGeometry(geometry);
  };
#define LUCERNA_ATTACH(Name, list, name)                                               \
  if (!scene.list.empty()) {                                                           \
    attach(scene.list.size(), ShapeKind::k##Name, BoundsOfShape<Name, &Scene::list>,   \
           IntersectedShape<Name, &Scene::list>, OccludedByShape<Name, &Scene::list>); \
  }
  LUCERNA_ANALYTIC_SHAPES(LUCERNA_ATTACH)
#undef LUCERNA_ATTACH
  ForEachAnalyticShape(scene, [&](const auto& shape) {
    const Vec3 reach = {shape.Reach(), shape.Reach(), shape.Reach()};
    bounds.Add(shape.center - reach);
    bounds.Add(shape.center + reach);
  });
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
  if (geometry >= scene_.meshes.size()) {
    // The function that Embree calls: the same bits.
    VisitShape(scene_, KindOf(scene_, geometry), primitive, [&](const auto& s) {
      return IntersectShape(s, ray.origin, ray.direction, 0, ray.t_max, hit.t);
    });
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
  if (hit.geometry < scene_.meshes.size()) {
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
  } else {
    traits = VisitShape(scene_, KindOf(scene_, hit.geometry), hit.primitive, [&](const auto& s) {
      const ShapeFace face = FaceAt(s, ray, hit.t);
      point.position = face.position;
      point.clearance = ClearanceOf(s);
      point.geometric_normal = face.normal;
      point.shading_normal = face.normal;
      return &s.traits;
    });
  }
  point.material = static_cast<std::uint32_t>(traits->material);
  point.area_light = traits->area_light;
  return point;
}

}  // namespace lucerna
