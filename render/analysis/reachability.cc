#include "render/analysis/reachability.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "render/analysis/enclosures.h"
#include "render/analysis/line_crossing.h"
#include "render/base/status.h"
#include "render/geometry/intersector.h"
#include "render/scene/scene_extent.h"

namespace lucerna {
namespace {

// Tests of single triangles before a scene is given up as too large to analyse.
constexpr double kMaxTriangleTests = 0x1p28;
// Lights of more triangles than this are treated as the box around them.
constexpr std::size_t kFewTriangles = 64;
// How many shapes are tried for a line of sight to a light, before all are tested.
constexpr std::size_t kFewPlaces = 8;

// Building a tree takes as long as some twenty tests of all triangles, and a light takes two, or up
// to eight.
constexpr std::size_t kFewLights = 4;

// Where a light, or the camera, is: points and boxes to be tested against closed surfaces.
class LightExtent {
 public:
  // Outside everything.
  LightExtent() = default;
  explicit LightExtent(Vec3 point) { pieces_.push_back({point}); }
  // Anywhere in a box.
  explicit LightExtent(const Bounds& box)
      : hidden_(static_cast<double>(box.high.x - box.low.x) / 2) {
    const std::array<Vec3, 8> corners = CornersOf(box);
    pieces_.emplace_back(corners.begin(), corners.end());
  }
  explicit LightExtent(const TriangleMesh& mesh) {
    const std::size_t count = mesh.indices.size() / 3;
    if (count > kFewTriangles) {
      *this = LightExtent(BoxAround(mesh.positions));
      return;
    }
    for (std::size_t i = 0; i < count; ++i) {
      const Triangle triangle = TriangleOf(mesh, i);
      pieces_.emplace_back(triangle.begin(), triangle.end());
    }
  }

  // Whether all of it is inside, or all outside; absent when that cannot be proved.
  [[nodiscard]] std::optional<bool> IsIn(const ClosedSurface& surface) const {
    std::optional<bool> inside;
    if (pieces_.empty()) return false;
    for (const std::vector<Vec3>& piece : pieces_) {
      if (!surface.IsApartFrom(piece)) return std::nullopt;
      const std::optional<bool> here = surface.Contains(piece[0]);
      if (!here || (inside && *inside != *here)) return std::nullopt;
      inside = here;
    }
    return inside;
  }
  // How far around Point() the light itself stands in the way.
  [[nodiscard]] double hidden() const { return hidden_; }
  // Some point of it.
  [[nodiscard]] std::optional<Vec3> Point() const {
    if (pieces_.empty()) return std::nullopt;
    Vec3 middle;
    for (const Vec3& point : pieces_[0])
      middle = middle + point * (1 / static_cast<float>(pieces_[0].size()));
    return middle;
  }

 private:
  std::vector<std::vector<Vec3>> pieces_;
  double hidden_ = 0;
};

struct NumberedLight {
  std::uint32_t number = 0;
  LightExtent extent;
};

std::vector<NumberedLight> LightsOf(const Scene& scene) {
  const LightNumbers numbers(scene);
  std::vector<NumberedLight> lights;
  const auto add = [&](std::uint32_t first, const auto& items, const auto& extent_of) {
    for (std::uint32_t i = 0; i < items.size(); ++i)
      lights.push_back({first + i, extent_of(items[i])});
  };
  const auto add_shapes = [&](std::uint32_t first, const auto& shapes, const auto& extent_of) {
    for (std::uint32_t i = 0; i < shapes.size(); ++i) {
      if (shapes[i].traits.area_light != kNoAreaLight)
        lights.push_back({first + i, extent_of(shapes[i])});
    }
  };
  const auto around = [](const auto& shape) {
    return LightExtent(BoxAround(shape.center, shape.Reach()));
  };
  const auto everywhere = [](const auto& /*light*/) { return LightExtent(); };
  add_shapes(0, scene.meshes, [](const TriangleMesh& mesh) { return LightExtent(mesh); });
#define LUCERNA_ADD(Name, list, name) add_shapes(numbers.list, scene.list, around);
  LUCERNA_ANALYTIC_SHAPES(LUCERNA_ADD)
#undef LUCERNA_ADD
#define LUCERNA_ADD(Name, list, name)                                               \
  add(numbers.list, scene.list, [](const Name##Light& light) {                      \
    return Name##Light::kIsAtInfinity ? LightExtent() : LightExtent(light.Place()); \
  });
  LUCERNA_DELTA_LIGHTS(LUCERNA_ADD)
#undef LUCERNA_ADD
  add(numbers.infinite, scene.infinite_lights, everywhere);
  return lights;
}

// Light that goes below the one side of a shell may come out on the other.
bool IsOpaque(const Material& material) {
  const MaterialProperties properties = PropertiesOf(material);
  return !properties.transmits && !properties.scatters_below;
}

// The shapes of the materials that some predicate accepts, as rays meet them.
class WallRays {
 public:
  // Of meshes a tree is built where it takes less time than trying all triangles for each of so
  // many lights. Keeps a reference to the scene.
  // Errors: those of Intersector::Create.
  static StatusOr<std::unique_ptr<WallRays>> Create(const Scene& scene,
                                                    const MaterialPredicate& is_wall,
                                                    std::size_t lights) {
    std::unique_ptr<WallRays> walls(new WallRays);
    const auto accepts = [&](const ShapeTraits& traits) {
      return IsWhole(traits) && is_wall(scene.materials[static_cast<std::size_t>(traits.material)]);
    };
    for (const TriangleMesh& mesh : scene.meshes) {
      if (!accepts(mesh.traits)) continue;
      if (lights <= kFewLights) {
        walls->tried_.push_back(&mesh);
        continue;
      }
      TriangleMesh& wall = walls->shapes_.meshes.emplace_back();
      wall.positions = mesh.positions;
      wall.indices = mesh.indices;
    }
#define LUCERNA_ADD(Name, list, name)                                  \
  if constexpr (Name::kIsClosed && !Name::kIsThin) {                   \
    for (const Name& shape : scene.list) {                             \
      if (accepts(shape.traits)) walls->shapes_.list.push_back(shape); \
    }                                                                  \
  }
    LUCERNA_ANALYTIC_SHAPES(LUCERNA_ADD)
#undef LUCERNA_ADD
    LUCERNA_ASSIGN_OR_RETURN(walls->intersector_, Intersector::Create(walls->shapes_));
    return walls;
  }

  // Whether some wall may lie between a point and a light. No is certain: a closed wall that
  // separates them crosses the line between them, and robust rays slip through no edge.
  [[nodiscard]] bool MayBeBetween(Vec3 point, const LightExtent& light) const {
    if (const std::optional<Vec3> there = light.Point()) {
      const Double3 way = Double3(*there) - Double3(point);
      // The light's own surface is no wall.
      const double length = (Length(way) - light.hidden()) * (1 - kNear);
      if (!(length > 0)) return false;
      // From both ends: the direction is rounded, so that a ray from afar may miss a small wall.
      const Double3 direction = way * (1 / Length(way));
      const Double3 end = Double3(point) + direction * length;
      return IsMet(point, direction, length) || IsMet(ToFloat(end), direction * -1, length);
    }
    return std::ranges::all_of(kParityRayDirections, [&](const Axes& line) {
      return IsMet(point, line.z, HUGE_VAL) && IsMet(point, line.z * -1, HUGE_VAL);
    });
  }

 private:
  WallRays() = default;

  static Vec3 ToFloat(Double3 v) {
    return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
  }
  [[nodiscard]] bool IsMet(Vec3 from, Double3 direction, double length) const {
    if (intersector_->Occluded({from, ToFloat(direction), static_cast<float>(length)})) return true;
    const Axes line(direction.x, direction.y, direction.z);
    return std::ranges::any_of(tried_, [&](const TriangleMesh* mesh) {
      for (std::size_t i = 0; i < mesh->indices.size() / 3; ++i) {
        if (MayMeet(line, Double3(from), length, TriangleOf(*mesh, i))) return true;
      }
      return false;
    });
  }
  // No is certain.
  static bool MayMeet(const Axes& line, Double3 from, double length, const Triangle& triangle) {
    std::array<Double3, 3> corners;
    for (std::size_t k = 0; k < 3; ++k)
      corners[k] = line.In(Double3(triangle[k]) - from);
    double along = 0;
    const Crossing crossing = CrossingOf(corners, along);
    if (crossing == Crossing::kNone) return false;
    // At an edge only that the line is met between the corners is known.
    const auto [lowest, highest] = std::minmax({corners[0].z, corners[1].z, corners[2].z});
    const bool is_once = crossing == Crossing::kOnce;
    return (is_once ? along : highest) >= 0 && (is_once ? along : lowest) <= length;
  }

  std::vector<const TriangleMesh*> tried_;
  Scene shapes_;  // all others
  std::unique_ptr<Intersector> intersector_;
};

// The lights whose light cannot reach the camera, however it is scattered.
std::vector<std::uint32_t> FindSeparated(const Scene& scene,
                                         const std::vector<NumberedLight>& lights) {
  // Rays of an orthographic camera begin on a plane, sensors are anywhere, and a camera that moves
  // may pass a wall: none is looked at here.
  if (scene.camera.kind == Camera::Kind::kOrthographic ||
      scene.camera.kind == Camera::Kind::kSensors || scene.motion.of_camera) {
    return {};
  }
  const auto walls = WallRays::Create(scene, IsOpaque, lights.size());
  if (!walls.ok()) return {};
  const Vec3 eye = scene.camera.camera_to_world.Point({});
  std::vector<const NumberedLight*> candidates;
  for (const NumberedLight& light : lights) {
    if ((*walls)->MayBeBetween(eye, light.extent)) candidates.push_back(&light);
  }
  if (candidates.empty()) return {};
  const auto lens = static_cast<float>(LensReach(scene.camera));
  const LightExtent camera = lens > 0 ? LightExtent(BoxAround(eye, lens)) : LightExtent(eye);
  std::vector<std::uint32_t> unreachable;
  for (const ClosedSurface& wall : ClosedSurfacesOf(scene, IsOpaque)) {
    const std::optional<bool> holds_camera = camera.IsIn(wall);
    if (!holds_camera) continue;
    for (const NumberedLight* light : candidates) {
      const std::optional<bool> holds_light = light->extent.IsIn(wall);
      if (holds_light && *holds_light != *holds_camera) unreachable.push_back(light->number);
    }
  }
  std::ranges::sort(unreachable);
  unreachable.erase(std::unique(unreachable.begin(), unreachable.end()), unreachable.end());
  return unreachable;
}

// Whether all surfaces at which lights are sampled, but the light's own, lie on the side of the
// surface that `inside` names.
bool AllSampledLie(const Scene& scene, const ClosedSurface& surface, bool inside,
                   std::uint32_t but_light) {
  const auto is_lit = [&](const ShapeTraits& traits) {
    return ScattersBroadly(scene.materials[static_cast<std::size_t>(traits.material)]);
  };
  // Shapes that move may do so into it or out of it.
  bool all_stand_still = true;
  ForEachShapeTraits(scene, [&](const ShapeTraits& traits) {
    all_stand_still = all_stand_still && (traits.motion == kNoMotion || !is_lit(traits));
  });
  for (const Instance& instance : scene.instances)
    all_stand_still = all_stand_still && instance.motion == kNoMotion;
  if (!all_stand_still) return false;
  const double far = kNear * LargestCoordinate(surface.bounds());
  const auto lies = [&](std::span<const Vec3> points) {
    if (!inside && AreDisjoint(BoxAround(points), surface.bounds(), far)) return true;
    return surface.IsApartFrom(points) && surface.Contains(points[0]) == inside;
  };
  double triangle_tests = 0;
  for (std::uint32_t m = 0; m < scene.meshes.size(); ++m) {
    const TriangleMesh& mesh = scene.meshes[m];
    if (!is_lit(mesh.traits)) continue;
    if (!inside && AreDisjoint(BoxAround(mesh.positions), surface.bounds(), far)) continue;
    for (std::size_t i = 0; i < mesh.indices.size() / 3; ++i) {
      triangle_tests += static_cast<double>(surface.triangle_count());
      if (triangle_tests > kMaxTriangleTests || !lies(TriangleOf(mesh, i))) return false;
    }
  }
  for (const Instance& instance : scene.instances) {
    const InstancedObject& object = scene.objects[instance.object];
    for (std::uint32_t i = 0; i < object.mesh_count; ++i) {
      if (!is_lit(scene.object_meshes[object.first_mesh + i].traits)) continue;
      if (!lies(CornersOf(BoundsOf(scene, instance)))) return false;
      break;
    }
  }
  const LightNumbers numbers(scene);
  const auto all_lie = [&](const auto& shapes, std::uint32_t first) {
    for (std::uint32_t i = 0; i < shapes.size(); ++i) {
      if (!is_lit(shapes[i].traits)) continue;
      if (first + i == but_light && !shapes[i].LightsItself()) continue;
      if (!lies(CornersOf(BoxAround(shapes[i].center, shapes[i].Reach())))) return false;
    }
    return true;
  };
  bool do_all_lie = true;
#define LUCERNA_TEST(Name, list, name) do_all_lie = do_all_lie && all_lie(scene.list, numbers.list);
  LUCERNA_ANALYTIC_SHAPES(LUCERNA_TEST)
#undef LUCERNA_TEST
  return do_all_lie;
}

bool ScattersNarrowly(const Material& material) {
  return !ScattersBroadly(material) && !IsInterface(material);
}

// The lights that nothing which scatters their light has a line of sight to.
std::vector<std::uint32_t> FindWithoutLineOfSight(const Scene& scene,
                                                  const std::vector<NumberedLight>& lights,
                                                  const std::vector<std::uint32_t>& but) {
  const auto walls = WallRays::Create(scene, ScattersNarrowly, lights.size());
  if (!walls.ok()) return {};
  // Some points where they would be sampled.
  std::vector<Vec3> lit;
  for (const TriangleMesh& mesh : scene.meshes) {
    if (mesh.indices.empty() || mesh.traits.area_light != kNoAreaLight) continue;
    if (!ScattersBroadly(scene.materials[static_cast<std::size_t>(mesh.traits.material)])) continue;
    const Triangle triangle = TriangleOf(mesh, mesh.indices.size() / 6);
    lit.push_back((triangle[0] + triangle[1] + triangle[2]) * (1.0F / 3));
    if (lit.size() == kFewPlaces) break;
  }
  std::vector<const NumberedLight*> candidates;
  for (const NumberedLight& light : lights) {
    if (std::ranges::binary_search(but, light.number)) continue;
    if (std::ranges::all_of(
            lit, [&](Vec3 place) { return (*walls)->MayBeBetween(place, light.extent); }))
      candidates.push_back(&light);
  }
  if (candidates.empty()) return {};
  std::vector<std::uint32_t> never;
  for (const ClosedSurface& shell : ClosedSurfacesOf(scene, ScattersNarrowly)) {
    for (const NumberedLight* light : candidates) {
      const std::optional<bool> holds_light = light->extent.IsIn(shell);
      if (holds_light && AllSampledLie(scene, shell, !*holds_light, light->number))
        never.push_back(light->number);
    }
  }
  std::ranges::sort(never);
  never.erase(std::unique(never.begin(), never.end()), never.end());
  return never;
}

}  // namespace

UnreachableLights FindUnreachableLights(const Scene& scene) {
  const std::vector<NumberedLight> lights = LightsOf(scene);
  UnreachableLights unreachable;
  if (static_cast<double>(lights.size()) * static_cast<double>(scene.TriangleCount()) >
      kMaxTriangleTests)
    return unreachable;
  unreachable.of_photons = FindSeparated(scene, lights);
  unreachable.of_sampling = FindWithoutLineOfSight(scene, lights, unreachable.of_photons);
  return unreachable;
}

}  // namespace lucerna
