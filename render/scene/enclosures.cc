#include "render/scene/enclosures.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "render/scene/mesh_edges.h"

namespace lucerna {
namespace {

using Triangle = std::array<Vec3, 3>;

// Of the largest coordinate: closer to a surface than this a point may lie on either side of it.
// Some eight units in the last place of a float.
constexpr double kNear = 1e-6;

// Questions put to single triangles before a scene is given up as too large to ask.
constexpr double kMostQuestions = 0x1p28;
// Lamps of more triangles than this are looked at as the box around them.
constexpr std::size_t kFewTriangles = 64;
// From how many shapes it is looked whether a light is in sight, before all are asked.
constexpr std::size_t kFewPlaces = 8;

Bounds BoxAround(std::span<const Vec3> points) {
  Bounds box;
  for (const Vec3& point : points)
    box.Add(point);
  return box;
}

Bounds BoxAround(Vec3 center, float radius) {
  const Vec3 reach = {radius, radius, radius};
  Bounds box;
  box.Add(center - reach);
  box.Add(center + reach);
  return box;
}

std::array<Vec3, 8> CornersOf(const Bounds& box) {
  std::array<Vec3, 8> corners;
  for (std::size_t i = 0; i < 8; ++i) {
    corners[i] = {(i & 1) != 0 ? box.high.x : box.low.x, (i & 2) != 0 ? box.high.y : box.low.y,
                  (i & 4) != 0 ? box.high.z : box.low.z};
  }
  return corners;
}

bool AreDisjoint(const Bounds& a, const Bounds& b, double distance) {
  for (int axis = 0; axis < 3; ++axis) {
    const auto gap = std::max(static_cast<double>(a.low[axis]) - static_cast<double>(b.high[axis]),
                              static_cast<double>(b.low[axis]) - static_cast<double>(a.high[axis]));
    if (gap > distance) return true;
  }
  return false;
}

// True when all points lie farther than `distance` from the triangle's plane, on one side of it.
bool LieOnOneSide(const Triangle& triangle, std::span<const Vec3> points, double distance) {
  const Double3 origin(triangle[0]);
  const Double3 cross = TriangleCross(triangle[0], triangle[1], triangle[2]);
  const double limit = distance * Length(cross);
  double lowest = HUGE_VAL;
  double highest = -HUGE_VAL;
  for (const Vec3& point : points) {
    const double height = Dot(Double3(point) - origin, cross);
    lowest = std::min(lowest, height);
    highest = std::max(highest, height);
  }
  return lowest > limit || highest < -limit;
}

double LargestCoordinate(const Bounds& box) {
  return static_cast<double>(std::max(MaxAbs(box.low), MaxAbs(box.high)));
}

Triangle TriangleOf(const TriangleMesh& mesh, std::size_t number) {
  const std::uint32_t* corner = &mesh.indices[3 * number];
  return {mesh.positions[corner[0]], mesh.positions[corner[1]], mesh.positions[corner[2]]};
}

// How often a line through a triangle passes it, told by two of the line's coordinates.
enum class Passage : std::uint8_t { kNot, kOnce, kAtTheEdge };

// The line goes along the third axis of a frame, through its origin; the triangle is given in that
// frame. `along` is where it passes.
Passage PassageThrough(const std::array<Double3, 3>& corner, double& along) {
  std::array<double, 3> side{};
  bool is_positive = true;
  bool is_negative = true;
  double size = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const Double3& a = corner[i];
    const Double3& b = corner[(i + 1) % 3];
    side[i] = a.x * b.y - a.y * b.x;
    size = std::max({size, std::abs(a.x), std::abs(a.y)});
    is_positive = is_positive && side[i] > 0;
    is_negative = is_negative && side[i] < 0;
  }
  // A corner's coordinates are as exact as the floats they are computed from.
  const double doubt = 1e-12 * size * size;
  if (std::ranges::any_of(side, [&](double s) { return std::abs(s) <= doubt; })) {
    // Only where all three may have one sign does the line come near the triangle.
    const bool may_be_positive = std::ranges::all_of(side, [&](double s) { return s >= -doubt; });
    const bool may_be_negative = std::ranges::all_of(side, [&](double s) { return s <= doubt; });
    return may_be_positive || may_be_negative ? Passage::kAtTheEdge : Passage::kNot;
  }
  if (!is_positive && !is_negative) return Passage::kNot;
  // Barycentric, opposite to the sides.
  const double sum = side[0] + side[1] + side[2];
  along = (side[1] * corner[0].z + side[2] * corner[1].z + side[0] * corner[2].z) / sum;
  return Passage::kOnce;
}

// Three axes at right angles; lines go along the third. None is along anything people build.
struct Axes {
  Double3 x, y, z;
  Axes(double a, double b, double c) {
    z = Double3(a, b, c) * (1 / std::sqrt(a * a + b * b + c * c));
    const Double3 side = Cross(z, std::abs(z.x) < 0.5 ? Double3(1, 0, 0) : Double3(0, 1, 0));
    x = side * (1 / Length(side));
    y = Cross(z, x);
  }
  [[nodiscard]] Double3 In(Double3 v) const { return {Dot(v, x), Dot(v, y), Dot(v, z)}; }
};

const std::array<Axes, 4> kLines = {Axes(0.5377, 0.8341, 0.1271), Axes(-0.3119, 0.2713, 0.9103),
                                    Axes(0.7717, -0.5231, 0.3613), Axes(-0.6871, -0.1931, -0.7013)};

// The sets of numbers below some count that were united.
class Unions {
 public:
  explicit Unions(std::size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), 0U);
  }
  std::uint32_t Find(std::uint32_t i) {
    while (parent_[i] != i)
      i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void Unite(std::uint32_t a, std::uint32_t b) {
    a = Find(a);
    b = Find(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::uint32_t> parent_;
};

// Triangles of all meshes that count, by their welded corners.
struct Walls {
  std::vector<Vec3> positions;
  std::vector<std::uint32_t> corners;  // [triangles × 3]

  [[nodiscard]] std::size_t size() const { return corners.size() / 3; }
  [[nodiscard]] Triangle At(std::uint32_t triangle) const {
    return {positions[corners[3 * triangle]], positions[corners[3 * triangle + 1]],
            positions[corners[3 * triangle + 2]]};
  }
};

Walls WallsOf(const Scene& scene, const Counts& counts) {
  Walls walls;
  std::vector<std::uint32_t> corners;
  for (const TriangleMesh& mesh : scene.meshes) {
    if (!counts(scene.materials[static_cast<std::size_t>(mesh.traits.material)])) continue;
    const auto first = static_cast<std::uint32_t>(walls.positions.size());
    walls.positions.insert(walls.positions.end(), mesh.positions.begin(), mesh.positions.end());
    for (const std::uint32_t index : mesh.indices)
      corners.push_back(first + index);
  }
  const std::vector<std::uint32_t> welded = WeldVertices(walls.positions, {});
  for (std::uint32_t& corner : corners)
    corner = welded[corner];
  // The same triangle twice is one wall.
  std::vector<std::pair<std::array<std::uint32_t, 3>, std::uint32_t>> sorted;
  sorted.reserve(corners.size() / 3);
  for (std::uint32_t t = 0; t < corners.size() / 3; ++t) {
    std::array<std::uint32_t, 3> key = {corners[3 * t], corners[3 * t + 1], corners[3 * t + 2]};
    std::ranges::sort(key);
    sorted.emplace_back(key, t);
  }
  std::ranges::sort(sorted);
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    const auto& [key, t] = sorted[i];
    if (i > 0 && sorted[i - 1].first == key) continue;
    if (key[0] == key[1] || key[1] == key[2]) continue;
    for (std::size_t k = 0; k < 3; ++k)
      walls.corners.push_back(corners[3 * t + k]);
  }
  return walls;
}

// Side 2t is the front of triangle t, 2t + 1 its back. Sides that face each other around an edge,
// with no triangle between them, look into the same region.
Unions RegionsOf(const Walls& walls, const std::vector<TriangleSide>& sides) {
  Unions regions(2 * walls.size());
  struct Around {
    double angle;
    std::uint32_t towards, away;  // its side that looks where angles grow, and the other
  };
  std::vector<Around> around;
  ForEachEdge(sides, [&](std::span<const TriangleSide> at_edge) {
    const Double3 low(walls.positions[at_edge[0].low]);
    const Double3 axis = Double3(walls.positions[at_edge[0].high]) - low;
    const Axes frame(axis.x, axis.y, axis.z);
    around.clear();
    for (const TriangleSide& side : at_edge) {
      const std::uint32_t triangle = side.triangle();
      const Double3 out = Double3(walls.positions[walls.corners[side.opposite]]) - low;
      const std::uint32_t next = 3 * triangle + (side.opposite + 1) % 3;
      // Wound from low to high, a triangle has its front where angles grow.
      const bool is_front = walls.corners[next] == side.low;
      around.push_back({std::atan2(Dot(out, frame.y), Dot(out, frame.x)),
                        2 * triangle + (is_front ? 0U : 1U), 2 * triangle + (is_front ? 1U : 0U)});
    }
    std::ranges::sort(around, {}, &Around::angle);
    for (std::size_t i = 0; i < around.size(); ++i)
      regions.Unite(around[i].towards, around[(i + 1) % around.size()].away);
  });
  return regions;
}

// Where a light is, as far as closed surfaces are concerned.
class Place {
 public:
  // Outside everything.
  Place() = default;
  explicit Place(Vec3 point) { pieces_.push_back({point}); }
  // All over a box, in whose middle there is something else to be seen than the light.
  explicit Place(const Bounds& box) : hidden_(static_cast<double>(box.high.x - box.low.x) / 2) {
    const std::array<Vec3, 8> corners = CornersOf(box);
    pieces_.emplace_back(corners.begin(), corners.end());
  }
  explicit Place(const TriangleMesh& mesh) {
    const std::size_t count = mesh.indices.size() / 3;
    if (count > kFewTriangles) {
      *this = Place(BoxAround(mesh.positions));
      return;
    }
    for (std::size_t i = 0; i < count; ++i) {
      const Triangle triangle = TriangleOf(mesh, i);
      pieces_.emplace_back(triangle.begin(), triangle.end());
    }
  }

  // Whether all of it is inside, or all outside; absent when it cannot be told.
  [[nodiscard]] std::optional<bool> IsIn(const ClosedSurface& surface) const {
    std::optional<bool> inside;
    if (pieces_.empty()) return false;
    for (const std::vector<Vec3>& piece : pieces_) {
      if (!surface.IsApartFrom(piece)) return std::nullopt;
      const std::optional<bool> here = surface.Holds(piece[0]);
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
  Place place;
};

std::vector<NumberedLight> LightsOf(const Scene& scene) {
  const LightNumbers numbers(scene);
  std::vector<NumberedLight> lights;
  const auto add = [&](std::uint32_t first, const auto& items, const auto& place_of) {
    for (std::uint32_t i = 0; i < items.size(); ++i)
      lights.push_back({first + i, place_of(items[i])});
  };
  const auto add_shapes = [&](std::uint32_t first, const auto& shapes, const auto& place_of) {
    for (std::uint32_t i = 0; i < shapes.size(); ++i) {
      if (shapes[i].traits.area_light != kNoAreaLight)
        lights.push_back({first + i, place_of(shapes[i])});
    }
  };
  const auto around = [](const auto& shape) {
    return Place(BoxAround(shape.center, shape.radius));
  };
  const auto at = [](const auto& light) { return Place(light.position); };
  const auto everywhere = [](const auto& /*light*/) { return Place(); };
  add_shapes(0, scene.meshes, [](const TriangleMesh& mesh) { return Place(mesh); });
  add_shapes(numbers.spheres, scene.spheres, around);
  add_shapes(numbers.disks, scene.disks, around);
  add(numbers.points, scene.point_lights, at);
  add(numbers.spots, scene.spot_lights, at);
  add(numbers.distant, scene.distant_lights, everywhere);
  add(numbers.infinite, scene.infinite_lights, everywhere);
  return lights;
}

bool IsOpaque(const Material& material) {
  return material.kind != Material::Kind::kDielectric;
}

// Whether something of a material that `counts` lies on the way from a point, `length` far.
bool IsBlocked(const Scene& scene, const Counts& counts, Vec3 from, Double3 way, double length) {
  const Double3 origin(from);
  const Axes frame(way.x, way.y, way.z);
  for (const TriangleMesh& mesh : scene.meshes) {
    if (!counts(scene.materials[static_cast<std::size_t>(mesh.traits.material)])) continue;
    for (std::size_t i = 0; i < mesh.indices.size() / 3; ++i) {
      const Triangle triangle = TriangleOf(mesh, i);
      double along = 0;
      const Passage passage = PassageThrough(
          {frame.In(Double3(triangle[0]) - origin), frame.In(Double3(triangle[1]) - origin),
           frame.In(Double3(triangle[2]) - origin)},
          along);
      if (passage == Passage::kAtTheEdge) return true;
      if (passage == Passage::kOnce && along > 0 && along < length * (1 - kNear)) return true;
    }
  }
  for (const Sphere& sphere : scene.spheres) {
    if (!counts(scene.materials[static_cast<std::size_t>(sphere.traits.material)])) continue;
    const Double3 center = frame.In(Double3(sphere.center) - origin);
    const auto radius = static_cast<double>(sphere.radius);
    const double square = radius * radius - center.x * center.x - center.y * center.y;
    if (!(square > 0)) continue;
    const double half = std::sqrt(square);
    if ((center.z - half > 0 && center.z - half < length * (1 - kNear)) ||
        (center.z + half > 0 && center.z + half < length * (1 - kNear)))
      return true;
  }
  return false;
}

// Whether closed surfaces of materials that count might keep a point and a light apart: they stand
// in the way. Asks for nothing but the shapes themselves.
bool MayBeApart(const Scene& scene, const Counts& counts, Vec3 point, const Place& light) {
  if (const std::optional<Vec3> there = light.Point()) {
    const Double3 way = Double3(*there) - Double3(point);
    const double length = Length(way) - light.hidden();
    return length > 0 && IsBlocked(scene, counts, point, way, length);
  }
  return std::ranges::all_of(kLines, [&](const Axes& line) {
    return IsBlocked(scene, counts, point, line.z, HUGE_VAL) &&
           IsBlocked(scene, counts, point, line.z * -1, HUGE_VAL);
  });
}

// The lights whose light cannot come to the camera, however it is scattered.
std::vector<std::uint32_t> ShutOut(const Scene& scene, const std::vector<NumberedLight>& lights) {
  const Vec3 eye = scene.camera.camera_to_world.Point({});
  std::vector<const NumberedLight*> candidates;
  for (const NumberedLight& light : lights) {
    if (MayBeApart(scene, IsOpaque, eye, light.place)) candidates.push_back(&light);
  }
  if (candidates.empty()) return {};
  const auto lens = static_cast<float>(LensReach(scene.camera));
  const Place camera = lens > 0 ? Place(BoxAround(eye, lens)) : Place(eye);
  std::vector<std::uint32_t> shut_out;
  for (const ClosedSurface& wall : ClosedSurfacesOf(scene, IsOpaque)) {
    const std::optional<bool> holds_camera = camera.IsIn(wall);
    if (!holds_camera) continue;
    for (const NumberedLight* light : candidates) {
      const std::optional<bool> holds_light = light->place.IsIn(wall);
      if (holds_light && *holds_light != *holds_camera) shut_out.push_back(light->number);
    }
  }
  std::ranges::sort(shut_out);
  shut_out.erase(std::unique(shut_out.begin(), shut_out.end()), shut_out.end());
  return shut_out;
}

// Whether all surfaces at which lights are sampled, but the light's own, lie on the side of the
// surface that `inside` names.
bool AllSampledLie(const Scene& scene, const ClosedSurface& surface, bool inside,
                   std::uint32_t but_light) {
  const auto is_asked = [&](const ShapeTraits& traits) {
    return ScattersBroadly(scene.materials[static_cast<std::size_t>(traits.material)]);
  };
  const double far = kNear * LargestCoordinate(surface.bounds());
  const auto lies = [&](std::span<const Vec3> points) {
    if (!inside && AreDisjoint(BoxAround(points), surface.bounds(), far)) return true;
    return surface.IsApartFrom(points) && surface.Holds(points[0]) == inside;
  };
  double questions = 0;
  for (std::uint32_t m = 0; m < scene.meshes.size(); ++m) {
    const TriangleMesh& mesh = scene.meshes[m];
    if (!is_asked(mesh.traits)) continue;
    if (!inside && AreDisjoint(BoxAround(mesh.positions), surface.bounds(), far)) continue;
    for (std::size_t i = 0; i < mesh.indices.size() / 3; ++i) {
      questions += static_cast<double>(surface.triangle_count());
      if (questions > kMostQuestions || !lies(TriangleOf(mesh, i))) return false;
    }
  }
  const LightNumbers numbers(scene);
  // A ball that shines outwards, and a disk, cast no light on themselves.
  const auto lights_itself = [](const auto& shape) {
    if constexpr (requires { shape.inward; }) return shape.inward;
    return false;
  };
  const auto all_lie = [&](const auto& shapes, std::uint32_t first) {
    for (std::uint32_t i = 0; i < shapes.size(); ++i) {
      if (!is_asked(shapes[i].traits)) continue;
      if (first + i == but_light && !lights_itself(shapes[i])) continue;
      if (!lies(CornersOf(BoxAround(shapes[i].center, shapes[i].radius)))) return false;
    }
    return true;
  };
  return all_lie(scene.spheres, numbers.spheres) && all_lie(scene.disks, numbers.disks);
}

bool ScattersNarrowly(const Material& material) {
  return !ScattersBroadly(material);
}

// The lights that are never in the line of sight of anything that scatters their light.
std::vector<std::uint32_t> NeverInSight(const Scene& scene,
                                        const std::vector<NumberedLight>& lights,
                                        const std::vector<std::uint32_t>& but) {
  // Some places where they would be sampled.
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
    if (std::ranges::all_of(lit, [&](Vec3 place) {
          return MayBeApart(scene, ScattersNarrowly, place, light.place);
        }))
      candidates.push_back(&light);
  }
  if (candidates.empty()) return {};
  std::vector<std::uint32_t> never;
  for (const ClosedSurface& shell : ClosedSurfacesOf(scene, ScattersNarrowly)) {
    for (const NumberedLight* light : candidates) {
      const std::optional<bool> holds_light = light->place.IsIn(shell);
      if (holds_light && AllSampledLie(scene, shell, !*holds_light, light->number))
        never.push_back(light->number);
    }
  }
  std::ranges::sort(never);
  never.erase(std::unique(never.begin(), never.end()), never.end());
  return never;
}

}  // namespace

ClosedSurface::ClosedSurface(std::vector<Triangle> triangles) : triangles_(std::move(triangles)) {
  for (const Triangle& triangle : triangles_) {
    for (const Vec3& corner : triangle)
      bounds_.Add(corner);
  }
  near_ = kNear * LargestCoordinate(bounds_);
}

ClosedSurface::ClosedSurface(const Sphere& sphere)
    : center_(sphere.center),
      radius_(static_cast<double>(sphere.radius)),
      bounds_(BoxAround(sphere.center, sphere.radius)),
      near_(kNear * LargestCoordinate(bounds_)) {}

std::optional<bool> ClosedSurface::Holds(Vec3 point) const {
  if (AreDisjoint(BoxAround({&point, 1}), bounds_, near_)) return false;
  const Double3 origin(point);
  if (triangles_.empty()) {
    const double off = Length(origin - center_) - radius_;
    if (std::abs(off) <= near_) return std::nullopt;
    return off < 0;
  }
  for (const Axes& line : kLines) {
    bool is_inside = false;
    bool is_clear = true;
    for (const Triangle& triangle : triangles_) {
      double along = 0;
      const Passage passage = PassageThrough(
          {line.In(Double3(triangle[0]) - origin), line.In(Double3(triangle[1]) - origin),
           line.In(Double3(triangle[2]) - origin)},
          along);
      if (passage == Passage::kNot) continue;
      is_clear = passage == Passage::kOnce && std::abs(along) > near_;
      if (!is_clear) break;
      if (along > 0) is_inside = !is_inside;
    }
    if (is_clear) return is_inside;
  }
  return std::nullopt;
}

bool ClosedSurface::IsOff(const Triangle& triangle, std::span<const Vec3> points,
                          const Bounds& box) const {
  if (AreDisjoint(BoxAround(triangle), box, near_)) return true;
  if (LieOnOneSide(triangle, points, near_)) return true;
  return points.size() == 3 && LieOnOneSide({points[0], points[1], points[2]}, triangle, near_);
}

bool ClosedSurface::IsApartFrom(std::span<const Vec3> points) const {
  const Bounds box = BoxAround(points);
  if (AreDisjoint(box, bounds_, near_)) return true;
  if (triangles_.empty()) {
    double nearest = 0;  // from the centre to the box, squared
    for (int axis = 0; axis < 3; ++axis) {
      const double c = axis == 0 ? center_.x : axis == 1 ? center_.y : center_.z;
      const double off = std::max(
          {0.0, static_cast<double>(box.low[axis]) - c, c - static_cast<double>(box.high[axis])});
      nearest += off * off;
    }
    if (std::sqrt(nearest) > radius_ + near_) return true;
    return std::ranges::all_of(points, [&](const Vec3& point) {
      return Length(Double3(point) - center_) < radius_ - near_;
    });
  }
  return std::ranges::all_of(
      triangles_, [&](const Triangle& triangle) { return IsOff(triangle, points, box); });
}

std::vector<ClosedSurface> ClosedSurfacesOf(const Scene& scene, const Counts& counts) {
  std::vector<ClosedSurface> surfaces;
  const Walls walls = WallsOf(scene, counts);
  const std::vector<TriangleSide> sides = SidesByEdge(walls.corners, walls.positions.size());
  Unions regions = RegionsOf(walls, sides);
  // A region is bounded by the triangles that have one side in it; those that have both are
  // surrounded by it. Around an edge one enters the region as often as one leaves it, so its
  // boundary has an even number of triangles there: it is closed.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> faces;  // region, triangle
  for (std::uint32_t t = 0; t < walls.size(); ++t) {
    const std::uint32_t front = regions.Find(2 * t);
    const std::uint32_t back = regions.Find(2 * t + 1);
    if (front == back) continue;
    faces.emplace_back(front, t);
    faces.emplace_back(back, t);
  }
  std::ranges::sort(faces);
  std::vector<std::vector<std::uint32_t>> told;
  for (std::size_t begin = 0, end = 0; begin < faces.size(); begin = end) {
    std::vector<std::uint32_t> triangles;
    while (end < faces.size() && faces[end].first == faces[begin].first)
      triangles.push_back(faces[end++].second);
    told.push_back(std::move(triangles));
  }
  // The same surface from within and from without.
  std::ranges::sort(told);
  told.erase(std::unique(told.begin(), told.end()), told.end());
  for (const std::vector<std::uint32_t>& triangles : told) {
    std::vector<Triangle> placed;
    placed.reserve(triangles.size());
    for (const std::uint32_t t : triangles)
      placed.push_back(walls.At(t));
    surfaces.emplace_back(std::move(placed));
  }
  for (const Sphere& sphere : scene.spheres) {
    if (counts(scene.materials[static_cast<std::size_t>(sphere.traits.material)]))
      surfaces.emplace_back(sphere);
  }
  return surfaces;
}

LightNumbers::LightNumbers(const Scene& scene)
    : spheres(static_cast<std::uint32_t>(scene.meshes.size())),
      disks(spheres + static_cast<std::uint32_t>(scene.spheres.size())),
      points(disks + static_cast<std::uint32_t>(scene.disks.size())),
      spots(points + static_cast<std::uint32_t>(scene.point_lights.size())),
      distant(spots + static_cast<std::uint32_t>(scene.spot_lights.size())),
      infinite(distant + static_cast<std::uint32_t>(scene.distant_lights.size())),
      end(infinite + static_cast<std::uint32_t>(scene.infinite_lights.size())) {}

LightsLeftOut FindLightsLeftOut(const Scene& scene) {
  const std::vector<NumberedLight> lights = LightsOf(scene);
  LightsLeftOut left_out;
  if (static_cast<double>(lights.size()) * static_cast<double>(scene.TriangleCount()) >
      kMostQuestions)
    return left_out;
  left_out.of_photons = ShutOut(scene, lights);
  left_out.of_sampling = NeverInSight(scene, lights, left_out.of_photons);
  return left_out;
}

}  // namespace lucerna
