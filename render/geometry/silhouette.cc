#include "render/geometry/silhouette.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <tuple>
#include <type_traits>
#include <utility>

#include "render/geometry/embree_device.h"
#include "render/math/double3.h"
#include "render/scene/mesh_edges.h"

namespace lucerna {
namespace {

// Light goes on through glass: its outline bends light, which the operators of its surfaces model,
// and casts no shadow.
bool CastsShadow(const Scene& scene, const ShapeTraits& traits) {
  const auto material = static_cast<std::size_t>(traits.material);
  return material >= scene.materials.size() || !Transmits(scene.materials[material]);
}

// Nearer to an end of the segment than this part of its length is contact with the surface there.
constexpr double kContact = 1e-3;

// The cosine of 30 degrees: edges that turn by less are one outline, cut into pieces.
constexpr double kSameOutline = 0.866;

// Relative to the largest number that a box is computed from: it must not lose an edge that the
// exact test would keep.
constexpr float kBoxSlack = 0x1p-21F;

void SetBounds(RTCBounds* box, Vec3 low, Vec3 high, float reach) {
  const float margin = reach + kBoxSlack * (std::max(MaxAbs(low), MaxAbs(high)) + reach);
  box->lower_x = low.x - margin;
  box->lower_y = low.y - margin;
  box->lower_z = low.z - margin;
  box->upper_x = high.x + margin;
  box->upper_y = high.y + margin;
  box->upper_z = high.z + margin;
}

// Where two segments come nearest: at origin + t·direction with t in [0, length], and at `place` of
// the edge. Returns which end of the edge that is, -1 for none. Of parallel ones, some such place.
int NearestPlaces(Double3 origin, Double3 direction, double length, const Vec3 (&ends)[2],
                  double& t, Double3& place) {
  const Double3 start(ends[0]);
  const Double3 edge = Double3(ends[1]) - start;
  const Double3 offset = origin - start;
  const double dd = Dot(direction, direction);
  const double de = Dot(direction, edge);
  const double ee = Dot(edge, edge);
  const double d_offset = Dot(direction, offset);
  const double e_offset = Dot(edge, offset);
  const double determinant = dd * ee - de * de;
  t = determinant > 1e-14 * dd * ee
          ? std::clamp((de * e_offset - d_offset * ee) / determinant, 0.0, length)
          : 0.0;
  const double u = (de * t + e_offset) / ee;
  if (u > 0 && u < 1) {
    place = start + edge * u;
    return -1;
  }
  // From the end alone, so that all edges that share it come out equally near.
  const int end = u > 0 ? 1 : 0;
  place = Double3(ends[end]);
  t = std::clamp(Dot(direction, place - origin) / dd, 0.0, length);
  return end;
}

// The two wings that enclose all others in less than half a turn: false when the faces leave no
// gap of half a turn and kSmallestTurnRad, and so hide the edge from wherever one looks.
bool OutermostWings(Double3 edge, std::span<const Double3> wings, Vec3 (&outermost)[2]) {
  if (wings.empty()) return false;
  const Double3 x = wings[0];
  const Double3 y = Cross(edge, x) * (1 / Length(edge));
  std::vector<std::pair<double, std::size_t>> by_angle;
  for (std::size_t i = 0; i < wings.size(); ++i) {
    by_angle.emplace_back(std::atan2(Dot(wings[i], y), Dot(wings[i], x)), i);
  }
  std::sort(by_angle.begin(), by_angle.end());
  double widest = -1;
  for (std::size_t i = 0; i < by_angle.size(); ++i) {
    const bool is_last = i + 1 == by_angle.size();
    const auto& next = by_angle[is_last ? 0 : i + 1];
    const double gap = next.first - by_angle[i].first + (is_last ? 2 * std::numbers::pi : 0);
    if (gap <= widest) continue;
    widest = gap;
    outermost[0] = ToFloat(wings[next.second]);
    outermost[1] = ToFloat(wings[by_angle[i].second]);
  }
  return widest > std::numbers::pi + static_cast<double>(kSmallestTurnRad);
}

}  // namespace

// What one query has found so far: the nearest kKept, so that the result does not depend on the
// order in which Embree shows them.
struct SilhouetteEdges::Search {
  // Without initial values: 64 of them are made for every segment, and few are used.
  struct Found {
    double across;
    double along;
    std::uint32_t edge;
    int nearest_end;  // of the edge: 0 or 1 when the nearest place is that end, else -1
    // The segment passes on the side where the faces are: no border of its light, but one that may
    // lead on to a nearer place of the outline.
    bool is_covered;

    // Order of nearness. At a pointed corner one edge may be covered and the other a border, both
    // nearest at their shared end: the border comes first.
    [[nodiscard]] bool operator<(const Found& o) const {
      return std::tie(across, is_covered, edge) < std::tie(o.across, o.is_covered, o.edge);
    }
  };
  static constexpr std::size_t kKept = 64;

  RTCIntersectContext context;  // first, because Embree hands back its address
  const SilhouetteEdges* edges = nullptr;
  Double3 origin, direction;
  Vec3 direction_f;
  double length = 0;
  std::array<Found, kKept> found;
  std::size_t count = 0;

  void Keep(const Found& candidate) {
    if (count < kKept) {
      found[count++] = candidate;
      return;
    }
    Found& farthest = *std::max_element(found.begin(), found.end());
    if (candidate < farthest) farthest = candidate;
  }

  [[nodiscard]] bool IsContact(double t) const {
    return !(t > kContact * length && t < (1 - kContact) * length);
  }

  void Visit(std::uint32_t number) {
    const Edge& edge = edges->edges_[number];
    // The same in float first, for what is far from the limit: nearly all edges end here.
    const Vec3 along_f = edge.ends[1] - edge.ends[0];
    const Vec3 sideways_f = Cross(along_f, direction_f);
    const float one_f = Dot(edge.wings[0], sideways_f);
    const float other_f = Dot(edge.wings[1], sideways_f);
    const float limit = 1e-5F * MaxAbs(along_f);
    if ((one_f > limit && other_f < -limit) || (one_f < -limit && other_f > limit)) return;
    // Sides of the plane through the edge along the segment's direction; first, because that
    // rejects nearly all. A face seen edge-on (0) lies on neither: light that falls straight along
    // the wall of a box still passes its edges.
    const Double3 along = Double3(edge.ends[1]) - Double3(edge.ends[0]);
    const Double3 sideways = Cross(along, direction);
    const double one = Dot(Double3(edge.wings[0]), sideways);
    const double other = Dot(Double3(edge.wings[1]), sideways);
    if (one * other < 0 || (one == 0 && other == 0)) return;
    double t = 0;
    Double3 place;
    const int nearest_end = NearestPlaces(origin, direction, length, edge.ends, t, place);
    if (IsContact(t)) return;
    const Double3 across = origin + direction * t - place;
    const double distance = Length(across);
    if (!(distance < static_cast<double>(edges->reach_))) return;
    const double passing = Dot(across, sideways);
    const bool is_covered = one * passing > 0 || other * passing > 0;
    Keep({distance, t, number, nearest_end, is_covered});
  }

  template <typename Shape>
  void VisitOutline(const Shape& shape, std::uint32_t number) {
    if (!CastsShadow(edges->scene_, shape.traits)) return;
    const OutlinePlace place = NearestOutline(shape, origin, direction);
    if (IsContact(place.along)) return;
    if (!(place.distance > 0 && place.distance < static_cast<double>(edges->reach_))) return;
    Keep({place.distance, place.along, number, -1, false});
  }

  // True when another edge leads on to a nearer place: from the end at which `one` is nearest, or
  // as a part of the same outline.
  [[nodiscard]] bool IsContinuedNearer(const Found& one) const {
    if (one.edge >= edges->edges_.size()) return false;
    const Edge& edge = edges->edges_[one.edge];
    for (std::size_t i = 0; i < count; ++i) {
      const Found& other = found[i];
      if (!(other < one) || other.edge >= edges->edges_.size()) continue;
      const Edge& next = edges->edges_[other.edge];
      for (const int end : {0, 1}) {
        for (const int next_end : {0, 1}) {
          if (!(edge.ends[end] == next.ends[next_end])) continue;
          if (one.nearest_end == end) return true;
          const Double3 shared(edge.ends[end]);
          const Double3 back = Double3(edge.ends[1 - end]) - shared;
          const Double3 on = Double3(next.ends[1 - next_end]) - shared;
          if (Dot(back, on) < -kSameOutline * Length(back) * Length(on)) return true;
        }
      }
    }
    return false;
  }
};

struct SilhouetteEdges::EmbreeScene {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;

  ~EmbreeScene() {
    if (scene != nullptr) rtcReleaseScene(scene);
  }

  static void EdgeBounds(const RTCBoundsFunctionArguments* arguments) {
    const auto* owner = static_cast<const SilhouetteEdges*>(arguments->geometryUserPtr);
    const Edge& edge = owner->edges_[arguments->primID];
    Bounds bounds;
    bounds.Add(edge.ends[0]);
    bounds.Add(edge.ends[1]);
    SetBounds(arguments->bounds_o, bounds.low, bounds.high, owner->reach_);
  }
  template <typename Shape, std::vector<Shape> Scene::*kShapes>
  static void OutlineBounds(const RTCBoundsFunctionArguments* arguments) {
    const auto* owner = static_cast<const SilhouetteEdges*>(arguments->geometryUserPtr);
    const Shape& shape = (owner->scene_.*kShapes)[arguments->primID];
    SetBounds(arguments->bounds_o, shape.center, shape.center, shape.Reach() + owner->reach_);
  }
  // Neither ever ends the ray, so Embree shows every candidate.
  static void VisitEdge(const RTCOccludedFunctionNArguments* arguments) {
    if (arguments->valid[0] == 0) return;
    reinterpret_cast<Search*>(arguments->context)->Visit(arguments->primID);
  }
  template <typename Shape, std::vector<Shape> Scene::*kShapes, ShapeKind kKind>
  static void VisitOutline(const RTCOccludedFunctionNArguments* arguments) {
    if (arguments->valid[0] == 0) return;
    auto* search = reinterpret_cast<Search*>(arguments->context);
    const SilhouetteEdges& owner = *search->edges;
    search->VisitOutline((owner.scene_.*kShapes)[arguments->primID],
                         owner.first_outline_[static_cast<std::size_t>(kKind)] + arguments->primID);
  }
};

SilhouetteEdges::SilhouetteEdges(const Scene& scene, float reach)
    : scene_(scene), reach_(reach), embree_(std::make_unique<EmbreeScene>()) {}

SilhouetteEdges::~SilhouetteEdges() = default;

Status SilhouetteEdges::AddMeshes() {
  std::size_t vertex_count = 0;
  std::size_t corner_count = 0;
  for (const TriangleMesh& mesh : scene_.meshes) {
    vertex_count += mesh.positions.size();
    corner_count += mesh.indices.size();
  }
  if (std::max(vertex_count, corner_count) >= std::numeric_limits<std::uint32_t>::max()) {
    return absl::ResourceExhaustedError(
        "the scene has too many triangles for a search of their edges");
  }
  std::vector<Vec3> positions;
  positions.reserve(vertex_count);
  std::vector<std::uint32_t> corners;
  corners.reserve(corner_count);
  for (const TriangleMesh& mesh : scene_.meshes) {
    if (!CastsShadow(scene_, mesh.traits)) continue;
    const auto first = static_cast<std::uint32_t>(positions.size());
    positions.insert(positions.end(), mesh.positions.begin(), mesh.positions.end());
    for (const std::uint32_t index : mesh.indices)
      corners.push_back(first + index);
  }
  {
    const std::vector<std::uint32_t> welded = WeldVertices(positions, {});
    for (std::uint32_t& corner : corners)
      corner = welded[corner];
  }
  std::vector<Double3> wings;
  ForEachEdge(SidesByEdge(corners, positions.size()), [&](std::span<const TriangleSide> sides) {
    Edge edge = {{positions[sides[0].low], positions[sides[0].high]}, {}};
    const Double3 end(edge.ends[0]);
    const Double3 along = Double3(edge.ends[1]) - end;
    const double squared = Dot(along, along);
    if (!(squared > 0)) return;
    wings.clear();
    for (const TriangleSide& side : sides) {
      const Double3 to_corner = Double3(positions[corners[side.opposite]]) - end;
      const Double3 wing = to_corner - along * (Dot(to_corner, along) / squared);
      const double length = Length(wing);
      // A triangle without area has no side on which it lies.
      if (length > 1e-7 * Length(to_corner)) wings.push_back(wing * (1 / length));
    }
    if (OutermostWings(along, wings, edge.wings)) edges_.push_back(edge);
  });
  return absl::OkStatus();
}

void SilhouetteEdges::AddRims() {
  ForEachAnalyticShape(scene_, [&](const auto& shape) {
    if constexpr (!std::decay_t<decltype(shape)>::kIsClosed) {
      if (CastsShadow(scene_, shape.traits)) AddRimSilhouettes(shape, edges_);
    }
  });
}

StatusOr<std::unique_ptr<SilhouetteEdges>> SilhouetteEdges::Create(const Scene& scene,
                                                                   float reach) {
  LUCERNA_CHECK(reach > 0 && std::isfinite(reach));
  auto silhouettes = std::unique_ptr<SilhouetteEdges>(new SilhouetteEdges(scene, reach));
  LUCERNA_RETURN_IF_ERROR(silhouettes->AddMeshes());
  silhouettes->AddRims();
  silhouettes->edges_.shrink_to_fit();

  EmbreeScene& embree = *silhouettes->embree_;
  LUCERNA_ASSIGN_OR_RETURN(embree.device, SharedEmbreeDevice());
  embree.scene = rtcNewScene(embree.device);
  rtcSetSceneFlags(embree.scene, RTC_SCENE_FLAG_ROBUST);
  const auto attach = [&](std::size_t count, RTCBoundsFunction bounds_of,
                          RTCOccludedFunctionN visit) {
    if (count == 0) return;
    RTCGeometry geometry = rtcNewGeometry(embree.device, RTC_GEOMETRY_TYPE_USER);
    rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned int>(count));
    rtcSetGeometryUserData(geometry, silhouettes.get());
    rtcSetGeometryBoundsFunction(geometry, bounds_of, nullptr);
    rtcSetGeometryOccludedFunction(geometry, visit);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(embree.scene, geometry);
    rtcReleaseGeometry(geometry);
  };
  attach(silhouettes->edges_.size(), EmbreeScene::EdgeBounds, EmbreeScene::VisitEdge);
  auto number = static_cast<std::uint32_t>(silhouettes->edges_.size());
#define LUCERNA_ATTACH(Name, list, name)                                              \
  silhouettes->first_outline_[static_cast<std::size_t>(ShapeKind::k##Name)] = number; \
  number += static_cast<std::uint32_t>(scene.list.size());                            \
  if constexpr (!Name::kIsFlat) {                                                     \
    attach(scene.list.size(), EmbreeScene::OutlineBounds<Name, &Scene::list>,         \
           EmbreeScene::VisitOutline<Name, &Scene::list, ShapeKind::k##Name>);        \
  }
  LUCERNA_ANALYTIC_SHAPES(LUCERNA_ATTACH)
#undef LUCERNA_ATTACH
  rtcCommitScene(embree.scene);
  LUCERNA_RETURN_IF_ERROR(EmbreeStatus(embree.device));
  return silhouettes;
}

NearbyEdges SilhouetteEdges::Find(Vec3 origin, Vec3 direction, float length) const {
  Search search;
  if (!IsInEmbreesRange(origin, direction)) return {};
  rtcInitIntersectContext(&search.context);
  search.edges = this;
  search.origin = Double3(origin);
  search.direction = Double3(direction);
  search.direction_f = direction;
  search.length = static_cast<double>(length);
  RTCRay ray{};
  ray.org_x = origin.x;
  ray.org_y = origin.y;
  ray.org_z = origin.z;
  ray.dir_x = direction.x;
  ray.dir_y = direction.y;
  ray.dir_z = direction.z;
  ray.tfar = length;
  ray.mask = 0xFFFFFFFFU;
  rtcOccluded1(embree_->scene, &search.context, &ray);

  NearbyEdges passed;
  std::sort(search.found.begin(), search.found.begin() + static_cast<std::ptrdiff_t>(search.count));
  for (std::size_t i = 0; i < search.count && passed.count_ < NearbyEdges::kCapacity; ++i) {
    const Search::Found& found = search.found[i];
    if (found.is_covered || search.IsContinuedNearer(found)) continue;
    passed.edges_[passed.count_++] = {static_cast<float>(found.along),
                                      static_cast<float>(found.across), found.edge};
  }
  std::sort(passed.edges_.begin(),
            passed.edges_.begin() + static_cast<std::ptrdiff_t>(passed.count_),
            [](const NearbyEdge& a, const NearbyEdge& b) {
              return std::tie(a.distance_along, a.distance_across, a.edge) <
                     std::tie(b.distance_along, b.distance_across, b.edge);
            });
  return passed;
}

}  // namespace lucerna
