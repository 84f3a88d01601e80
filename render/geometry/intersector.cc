#include "render/geometry/intersector.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <type_traits>

#include <embree3/rtcore.h>

#include "render/geometry/embree_device.h"
#include "render/geometry/shape_geometry.h"
#include "render/math/double3.h"
#include "render/math/rng.h"
#include "render/scene/scene_extent.h"

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

// Whether a ray passes through a shape of this alpha as if it were not there. The number that
// decides belongs to the ray, the shape and how often the ray has met it before, so that equal rays
// meet the same.
bool PassesThrough(float alpha, const RTCRay& ray, std::uint32_t geometry, std::uint32_t primitive,
                   std::uint32_t met_before = 0) {
  const auto pair = [](float a, float b) {
    return (std::uint64_t{std::bit_cast<std::uint32_t>(a)} << 32) | std::bit_cast<std::uint32_t>(b);
  };
  std::uint64_t key = (std::uint64_t{geometry} << 32) | primitive;
  key = CombineKeys(key, pair(ray.org_x, ray.org_y));
  key = CombineKeys(key, pair(ray.org_z, ray.dir_x));
  key = CombineKeys(key, pair(ray.dir_y, ray.dir_z));
  if (met_before > 0) key = CombineKeys(key, met_before);
  return !(KeyedRng(key).Uniform() < alpha);
}

// The alpha of a shape at a place of it.
float AlphaAt(const Scene& scene, const ShapeTraits& traits, const TexturePlace& place) {
  return TextureNumber(scene.textures, traits.alpha_texture, place);
}

template <typename Shape>
bool PassesThroughShape(const Scene& scene, const Shape& shape, const RTCRay& ray, float t,
                        std::uint32_t geometry, std::uint32_t primitive, std::uint32_t met_before) {
  float alpha = shape.traits.alpha;
  if (shape.traits.alpha_texture != kNoTexture) {
    const Ray along = {
        {ray.org_x, ray.org_y, ray.org_z}, {ray.dir_x, ray.dir_y, ray.dir_z}, HUGE_VALF};
    const ShapeFace face = FaceAt(shape, along, t);
    alpha = AlphaAt(scene, shape.traits, {UvOf(shape, face.position), face.position, face.normal});
  }
  return PassesThrough(alpha, ray, geometry, primitive, met_before);
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

// Rays leave a tube unseen, by whichever of its pieces.
template <typename Shape>
bool LeavesTube(const std::vector<Shape>& shapes, const RTCRay& ray, float t, std::uint32_t index) {
  if constexpr (std::is_same_v<Shape, CurvePiece>) {
    return IsWithinNextPiece(
        shapes, index,
        {{ray.org_x, ray.org_y, ray.org_z}, {ray.dir_x, ray.dir_y, ray.dir_z}, HUGE_VALF}, t);
  } else {
    return false;
  }
}

// Where a ray meets a shape first, of its places those that its alpha leaves: through a hole in the
// near wall of a ball the far one is met.
template <typename Shape>
bool MeetsShape(const Scene& scene, const std::vector<Shape>& shapes, const RTCRay& ray,
                std::uint32_t geometry, std::uint32_t index, float& t) {
  const Shape& shape = shapes[index];
  // A line meets no shape more often.
  constexpr std::uint32_t kMostPlaces = 4;
  float from = ray.tnear;
  for (std::uint32_t met_before = 0; met_before < kMostPlaces; ++met_before) {
    if (!IntersectShape(shape, {ray.org_x, ray.org_y, ray.org_z}, {ray.dir_x, ray.dir_y, ray.dir_z},
                        from, ray.tfar, t)) {
      return false;
    }
    if (LeavesTube(shapes, ray, t, index)) return false;
    if (IsWhole(shape.traits) ||
        !PassesThroughShape(scene, shape, ray, t, geometry, index, met_before)) {
      return true;
    }
    from = std::nextafter(t, HUGE_VALF);
  }
  return false;
}

template <typename Shape, std::vector<Shape> Scene::*kShapes>
void IntersectedShape(const RTCIntersectFunctionNArguments* arguments) {
  if (arguments->valid[0] == 0) return;
  const auto& scene = *static_cast<const Scene*>(arguments->geometryUserPtr);
  auto* ray_hit = reinterpret_cast<RTCRayHit*>(arguments->rayhit);
  RTCRay& ray = ray_hit->ray;
  float t = 0;
  if (!MeetsShape(scene, scene.*kShapes, ray, arguments->geomID, arguments->primID, t)) return;
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
  const auto& scene = *static_cast<const Scene*>(arguments->geometryUserPtr);
  auto* ray = reinterpret_cast<RTCRay*>(arguments->ray);
  float t = 0;
  if (MeetsShape(scene, scene.*kShapes, *ray, arguments->geomID, arguments->primID, t))
    ray->tfar = -HUGE_VALF;
}

// What Embree's filter of meshes with an alpha gets.
struct MaskedMesh {
  const Scene* scene;
  const TriangleMesh* mesh;
};

// The place of a triangle that a ray meets; within an instance the ray is in the space of the
// object, and the place is in the world.
TexturePlace PlaceOn(const MaskedMesh& masked, const RTCRay& ray, const RTCHit& hit) {
  const Scene& scene = *masked.scene;
  const std::array<Vec2, 3> uv = UvsOf(*masked.mesh, hit.primID);
  const float rest = 1 - hit.u - hit.v;
  TexturePlace place;
  place.uv = {uv[0].x * rest + uv[1].x * hit.u + uv[2].x * hit.v,
              uv[0].y * rest + uv[1].y * hit.u + uv[2].y * hit.v};
  place.position =
      Vec3{ray.org_x, ray.org_y, ray.org_z} + Vec3{ray.dir_x, ray.dir_y, ray.dir_z} * ray.tfar;
  std::uint32_t instance = kNoInstance;
  if (hit.instID[0] != RTC_INVALID_GEOMETRY_ID) {
    instance = hit.instID[0] - (static_cast<std::uint32_t>(scene.meshes.size()) + kShapeKinds);
    place.position = scene.instances[instance].to_world.Point(place.position);
  }
  const auto [p0, p1, p2] = CornersOf(scene, *masked.mesh, hit.primID, instance);
  place.normal = TriangleNormal(p0, p1, p2);
  return place;
}

// Their user data is a MaskedMesh.
void FilterByAlpha(const RTCFilterFunctionNArguments* arguments) {
  const auto& masked = *static_cast<const MaskedMesh*>(arguments->geometryUserPtr);
  const auto& ray = *reinterpret_cast<const RTCRay*>(arguments->ray);
  const auto& hit = *reinterpret_cast<const RTCHit*>(arguments->hit);
  const ShapeTraits& traits = masked.mesh->traits;
  const float alpha = traits.alpha_texture == kNoTexture
                          ? traits.alpha
                          : AlphaAt(*masked.scene, traits, PlaceOn(masked, ray, hit));
  if (PassesThrough(alpha, ray, hit.geomID, hit.primID)) arguments->valid[0] = 0;
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

// How far off its instance a point may lie, beyond what its corners tell. Embree brings rays into
// the space of the object by a matrix of floats; there and back, rounding grows by as much as the
// transform turns a ball into an ellipsoid.
float ClearanceOf(const Scene& scene, const Instance& instance) {
  const auto largest_row = [](const Transform& transform) {
    double largest = 0;
    for (std::size_t row = 0; row < 3; ++row) {
      const auto& numbers = transform.rows()[row];
      largest =
          std::max(largest, std::abs(numbers[0]) + std::abs(numbers[1]) + std::abs(numbers[2]));
    }
    return largest;
  };
  const StatusOr<Transform> inverse = instance.to_world.Inverse();
  const double stretch = largest_row(instance.to_world);
  const double distortion = inverse.ok() ? stretch * largest_row(*inverse) : 1;
  const Bounds& box = scene.objects[instance.object].box;
  const Bounds around = BoundsOf(scene, instance);
  const double size = stretch * static_cast<double>(std::max(MaxAbs(box.low), MaxAbs(box.high))) +
                      static_cast<double>(std::max(MaxAbs(around.low), MaxAbs(around.high)));
  return static_cast<float>(static_cast<double>(kClearance) * size * std::max(1.0, distortion));
}

}  // namespace

struct Intersector::EmbreeScene {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  std::vector<RTCScene> objects;  // the trees of Scene::objects
  // Embree reads 16 bytes at a vertex, so the last one must have four more bytes after it; our
  // copies have one vertex too many.
  std::vector<std::vector<Vec3>> padded_positions;
  std::vector<std::unique_ptr<MaskedMesh>> masked_meshes;

  // Adds a mesh to a scene, and keeps a copy of its positions.
  void AttachMesh(RTCScene to, std::uint32_t number, const Scene& of, const TriangleMesh& mesh) {
    std::vector<Vec3>& padded = padded_positions.emplace_back();
    padded.reserve(mesh.positions.size() + 1);
    padded.assign(mesh.positions.begin(), mesh.positions.end());
    padded.emplace_back();
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                               padded.data(), 0, sizeof(Vec3), mesh.positions.size());
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                               mesh.indices.data(), 0, 3 * sizeof(std::uint32_t),
                               mesh.indices.size() / 3);
    if (!IsWhole(mesh.traits)) {
      masked_meshes.push_back(std::make_unique<MaskedMesh>(MaskedMesh{&of, &mesh}));
      rtcSetGeometryUserData(geometry, masked_meshes.back().get());
      rtcSetGeometryIntersectFilterFunction(geometry, FilterByAlpha);
      rtcSetGeometryOccludedFilterFunction(geometry, FilterByAlpha);
    }
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(to, geometry, number);
    rtcReleaseGeometry(geometry);
  }

  ~EmbreeScene() {
    for (RTCScene object : objects) {
      if (object != nullptr) rtcReleaseScene(object);
    }
    if (scene != nullptr) rtcReleaseScene(scene);
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
  shape_count_ = shapes;
}

Intersector::~Intersector() = default;

StatusOr<std::unique_ptr<Intersector>> Intersector::Create(const Scene& scene, RayNeeds needs) {
  auto intersector = std::unique_ptr<Intersector>(new Intersector(scene, needs.shading_normals));
  EmbreeScene& embree = *intersector->embree_;
  LUCERNA_ASSIGN_OR_RETURN(embree.device, SharedEmbreeDevice());
  const auto new_scene = [&] {
    RTCScene made = rtcNewScene(embree.device);
    rtcSetSceneFlags(made, needs.robust_rays ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE);
    rtcSetSceneBuildQuality(
        made, needs.split_triangles ? RTC_BUILD_QUALITY_HIGH : RTC_BUILD_QUALITY_MEDIUM);
    return made;
  };
  embree.scene = new_scene();

  Bounds& bounds = intersector->bounds_;
  std::uint32_t number = 0;
  embree.padded_positions.reserve(scene.meshes.size() + scene.object_meshes.size());
  for (const TriangleMesh& mesh : scene.meshes) {
    for (const Vec3& p : mesh.positions)
      bounds.Add(p);
    embree.AttachMesh(embree.scene, number++, scene, mesh);
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
  for (const InstancedObject& object : scene.objects) {
    RTCScene made = embree.objects.emplace_back(new_scene());
    for (std::uint32_t i = 0; i < object.mesh_count; ++i)
      embree.AttachMesh(made, i, scene, scene.object_meshes[object.first_mesh + i]);
    rtcCommitScene(made);
  }
  // The same at all times: what follows from the size of the scene does not change between passes.
  if (const Bounds& swept = scene.motion.swept; !swept.empty()) {
    bounds.Add(swept.low);
    bounds.Add(swept.high);
  }
  LUCERNA_RETURN_IF_ERROR(intersector->AddInstances());
  rtcCommitScene(embree.scene);
  LUCERNA_RETURN_IF_ERROR(EmbreeStatus(embree.device));
  return intersector;
}

Status Intersector::AddInstances() {
  if (scene_.instances.empty()) return absl::OkStatus();
  const auto first_id = static_cast<std::uint32_t>(scene_.meshes.size()) + kShapeKinds;
  std::uint64_t triangles = 0;
  std::vector<std::uint64_t> of_object;
  // Analytic shapes come last among those that are in memory.
  std::uint64_t before = shape_count_;
  for (const InstancedObject& object : scene_.objects) {
    triangles = 0;
    for (std::uint32_t i = 0; i < object.mesh_count; ++i) {
      first_of_mesh_.push_back(static_cast<std::uint32_t>(triangles));
      triangles += scene_.object_meshes[object.first_mesh + i].indices.size() / 3;
    }
    of_object.push_back(triangles);
  }
  for (std::uint32_t i = 0; i < scene_.instances.size(); ++i) {
    const Instance& instance = scene_.instances[i];
    first_of_instance_.push_back(static_cast<std::uint32_t>(before));
    before += of_object[instance.object];
    if (before >= kNoShape) {
      return absl::ResourceExhaustedError(
          "the scene has more than 2^32 triangles, each counted wherever an instance repeats it");
    }
    const Bounds box = BoundsOf(scene_, instance);
    bounds_.Add(box.low);
    bounds_.Add(box.high);
    instance_clearance_.push_back(ClearanceOf(scene_, instance));

    const auto& rows = instance.to_world.rows();
    std::array<float, 12> columns{};
    for (std::size_t column = 0; column < 4; ++column) {
      for (std::size_t row = 0; row < 3; ++row)
        columns[3 * column + row] = static_cast<float>(rows[row][column]);
    }
    RTCGeometry geometry = rtcNewGeometry(embree_->device, RTC_GEOMETRY_TYPE_INSTANCE);
    rtcSetGeometryInstancedScene(geometry, embree_->objects[instance.object]);
    rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, columns.data());
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(embree_->scene, geometry, first_id + i);
    rtcReleaseGeometry(geometry);
  }
  return absl::OkStatus();
}

bool Intersector::Intersect(const Ray& ray, Hit& hit) const {
  if (!IsInEmbreesRange(ray.origin, ray.direction)) return false;
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
  hit.instance = kNoInstance;
  if (ray_hit.hit.instID[0] != RTC_INVALID_GEOMETRY_ID) {
    const auto first_id = static_cast<std::uint32_t>(scene_.meshes.size()) + kShapeKinds;
    hit.instance = ray_hit.hit.instID[0] - first_id;
    hit.geometry += first_id + scene_.objects[scene_.instances[hit.instance].object].first_mesh;
  }
  return true;
}

bool Intersector::Occluded(const Ray& ray) const {
  if (!IsInEmbreesRange(ray.origin, ray.direction)) return false;
  RTCRay embree_ray = ToEmbree(ray);
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(embree_->scene, &context, &embree_ray);
  return embree_ray.tfar < 0;
}

std::uint32_t Intersector::ShapeOf(const Hit& hit) const {
  if (hit.instance == kNoInstance) return first_shape_[hit.geometry] + hit.primitive;
  const std::size_t mesh = hit.geometry - first_shape_.size();
  return first_of_instance_[hit.instance] + first_of_mesh_[mesh] + hit.primitive;
}

Hit Intersector::HitOn(std::uint32_t shape, const Ray& ray) const {
  const auto index_of = [](auto begin, auto end, std::uint32_t number) {
    return static_cast<std::uint32_t>(std::upper_bound(begin, end, number) - begin - 1);
  };
  Hit hit;
  if (!first_of_instance_.empty() && shape >= first_of_instance_.front()) {
    hit.instance = index_of(first_of_instance_.begin(), first_of_instance_.end(), shape);
    const InstancedObject& object = scene_.objects[scene_.instances[hit.instance].object];
    const std::uint32_t within = shape - first_of_instance_[hit.instance];
    const auto meshes = first_of_mesh_.begin() + object.first_mesh;
    const std::uint32_t mesh = index_of(meshes, meshes + object.mesh_count, within);
    hit.geometry = static_cast<std::uint32_t>(first_shape_.size()) + object.first_mesh + mesh;
    hit.primitive = within - meshes[mesh];
  } else {
    hit.geometry = index_of(first_shape_.begin(), first_shape_.end(), shape);
    hit.primitive = shape - first_shape_[hit.geometry];
  }
  const TriangleMesh* mesh = MeshOf(scene_, hit.geometry);
  if (mesh == nullptr) {
    // The function that Embree calls: the same bits, and of a shape with an alpha the same wall.
    const RTCRay embree_ray = ToEmbree(ray);
    switch (KindOf(scene_, hit.geometry)) {
#define LUCERNA_CASE(Name, list, name)                                               \
  case ShapeKind::k##Name:                                                           \
    MeetsShape(scene_, scene_.list, embree_ray, hit.geometry, hit.primitive, hit.t); \
    break;
      LUCERNA_ANALYTIC_SHAPES(LUCERNA_CASE)
#undef LUCERNA_CASE
    }
  } else {
    const TriangleHit at = HitTriangle(CornersOf(scene_, *mesh, hit.primitive, hit.instance), ray);
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
  point.instance = hit.instance;
  const ShapeTraits* traits = nullptr;
  if (const TriangleMesh* of_hit = MeshOf(scene_, hit.geometry)) {
    const TriangleMesh& mesh = *of_hit;
    const std::uint32_t* corner = &mesh.indices[std::size_t{3} * hit.primitive];
    const auto [p0, p1, p2] = CornersOf(scene_, mesh, hit.primitive, hit.instance);
    const Vec3 e1 = p1 - p0;
    const Vec3 e2 = p2 - p0;
    // From the corners, not along the ray: the error then has the size of the triangle.
    point.position = p0 + e1 * hit.u + e2 * hit.v;
    point.clearance = kClearance * (MaxAbs(p0) + MaxAbs(e1) + MaxAbs(e2));
    const Transform* to_world = nullptr;
    if (hit.instance == kNoInstance) {
      point.geometric_normal = TriangleNormal(p0, p1, p2);
    } else {
      to_world = &scene_.instances[hit.instance].to_world;
      point.clearance += instance_clearance_[hit.instance];
      // Of the triangle in the space of the object: in the world it may be too small to have one.
      const auto [o0, o1, o2] = CornersOf(scene_, mesh, hit.primitive, kNoInstance);
      point.geometric_normal = Normalize(to_world->Normal(TriangleNormal(o0, o1, o2)));
    }
    point.shading_normal = point.geometric_normal;
    if (has_shading_normals_ && !mesh.normals.empty()) {
      const auto normal_at = [&](std::size_t i) {
        const Vec3 own = mesh.normals[corner[i]];
        if (to_world == nullptr || own == Vec3()) return own;
        const Vec3 turned = to_world->Normal(own);
        return turned == Vec3() ? turned : Normalize(turned);
      };
      const Vec3 n =
          normal_at(0) * (1 - hit.u - hit.v) + normal_at(1) * hit.u + normal_at(2) * hit.v;
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
