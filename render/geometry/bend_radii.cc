#include "render/geometry/bend_radii.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>

#include "render/base/parallel.h"
#include "render/geometry/feature_edges.h"
#include "render/geometry/shape_geometry.h"
#include "render/math/double3.h"
#include "render/scene/mesh_edges.h"
#include "render/scene/shape_lists.h"

namespace lucerna {
namespace {

// By how much of its distance from the origin a vertex may be off: files write six digits.
constexpr double kPlaceRounding = 1e-6;
// No more facets around a corner are looked at than this, or up to twice as many: the tip of a cone
// may have any number.
constexpr std::size_t kFacetsAround = 32;

// Of turns by more than `rounding`. In double, so that squares do not leave its range.
template <typename Point, typename Normal>
float RadiusOf(const std::array<Point, 3>& corners, const std::array<Normal, 3>& normals,
               double rounding = 0) {
  double most = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t next = (i + 1) % 3;
    const Double3 side = Double3(corners[next]) - Double3(corners[i]);
    const Double3 turn = Double3(normals[next]) - Double3(normals[i]);
    const double squared = Dot(side, side);
    const double squared_turn = Dot(turn, turn);
    if (squared > 0 && squared_turn > rounding * rounding)
      most = std::max(most, squared_turn / squared);
  }
  return most > 0 ? static_cast<float>(1 / std::sqrt(most)) : HUGE_VALF;
}

struct Facet {
  Vec3 normal;  // unit, or 0 of a triangle without area
  std::array<float, 3> angles{};
  float rounding = 0;  // by which the normal may be off
};

Facet FacetOf(const std::array<Double3, 3>& corners) {
  Facet facet;
  const Double3 cross = Cross(corners[1] - corners[0], corners[2] - corners[0]);
  const double twice_area = Length(cross);
  if (!(twice_area > 0)) return facet;
  facet.normal = ToFloat(cross * (1 / twice_area));
  double longest = 0;
  double farthest = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const Double3 to_next = corners[(i + 1) % 3] - corners[i];
    longest = std::max(longest, Length(to_next));
    farthest = std::max(farthest, Length(corners[i]));
    const Double3 to_last = corners[(i + 2) % 3] - corners[i];
    facet.angles[i] = static_cast<float>(std::atan2(twice_area, Dot(to_next, to_last)));
  }
  facet.rounding = static_cast<float>(kPlaceRounding * farthest * longest / twice_area);
  return facet;
}

// Of pieces that threads share.
constexpr std::size_t kTrianglesPerPiece = std::size_t{1} << 14;

std::vector<float> RadiiOfFacets(const TriangleMesh& mesh, ThreadTeam& team) {
  const std::size_t triangles = mesh.indices.size() / 3;
  // Scenes beyond that are refused elsewhere.
  if (mesh.indices.size() >= std::numeric_limits<std::uint32_t>::max()) return {};
  std::vector<std::uint32_t> corners = WeldVertices(mesh.positions, {});
  std::vector<std::uint32_t> first(corners.size() + 1, 0);
  {
    const std::vector<std::uint32_t> welded = std::move(corners);
    corners.resize(mesh.indices.size());
    for (std::size_t i = 0; i < corners.size(); ++i)
      corners[i] = welded[mesh.indices[i]];
  }
  const auto corners_of = [&](std::size_t triangle) {
    const std::uint32_t* const corner = &corners[3 * triangle];
    return std::array{Double3(mesh.positions[corner[0]]), Double3(mesh.positions[corner[1]]),
                      Double3(mesh.positions[corner[2]])};
  };
  std::vector<Facet> facets(triangles);
  team.For(triangles, kTrianglesPerPiece, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      facets[i] = FacetOf(corners_of(i));
  });
  // The corners of triangles at each vertex.
  for (const std::uint32_t vertex : corners)
    ++first[vertex + 1];
  for (std::size_t i = 1; i < first.size(); ++i)
    first[i] += first[i - 1];
  std::vector<std::uint32_t> around(corners.size());
  for (std::size_t i = corners.size(); i-- > 0;)
    around[--first[corners[i] + 1]] = static_cast<std::uint32_t>(i);
  // Now those of a vertex begin at the entry behind its own.
  const auto around_of = [&](std::uint32_t vertex) {
    const std::size_t begin = first[vertex + 1];
    const std::size_t end = vertex + 2 < first.size() ? first[vertex + 2] : around.size();
    return std::span<const std::uint32_t>(around).subspan(begin, end - begin);
  };

  const auto radius_of = [&](std::size_t i) {
    const Double3 own(facets[i].normal);
    if (!(Dot(own, own) > 0)) return HUGE_VALF;
    std::array<Double3, 3> normals;
    float rounding = facets[i].rounding;
    for (std::size_t c = 0; c < 3; ++c) {
      const auto here = around_of(corners[3 * i + c]);
      // Of itself at least.
      normals[c] = own * static_cast<double>(facets[i].angles[c]);
      const std::size_t step = 1 + here.size() / (2 * kFacetsAround);
      for (std::size_t k = 0; k < here.size(); k += step) {
        const Facet& other = facets[here[k] / 3];
        const Double3 normal(other.normal);
        if (here[k] / 3 == i || Dot(normal, own) < static_cast<double>(kSameSurfaceCosine))
          continue;
        normals[c] = normals[c] + normal * static_cast<double>(other.angles[here[k] % 3]);
        rounding = std::max(rounding, other.rounding);
      }
      normals[c] = normals[c] * (1 / Length(normals[c]));
    }
    return RadiusOf(corners_of(i), normals, 2 * static_cast<double>(rounding));
  };
  std::vector<float> radii(triangles);
  team.For(triangles, kTrianglesPerPiece, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      radii[i] = radius_of(i);
  });
  const bool is_flat = std::ranges::all_of(radii, [](float r) { return r == HUGE_VALF; });
  return is_flat ? std::vector<float>() : radii;
}

std::vector<std::vector<float>> RadiiOfAll(const std::vector<TriangleMesh>& meshes, int threads) {
  ThreadTeam team(threads);
  std::vector<std::vector<float>> radii(meshes.size());
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    if (HasFacets(meshes[i])) radii[i] = RadiiOfFacets(meshes[i], team);
  }
  return radii;
}

bool IsFacet(const TriangleMesh& mesh, std::size_t triangle) {
  if (mesh.normals.empty()) return true;
  const std::uint32_t* const corner = &mesh.indices[3 * triangle];
  const Vec3 normal = mesh.normals[corner[0]];
  return normal == mesh.normals[corner[1]] && normal == mesh.normals[corner[2]];
}

}  // namespace

bool HasFacets(const TriangleMesh& mesh) {
  const std::size_t triangles = mesh.indices.size() / 3;
  for (std::size_t i = 0; i < triangles; ++i) {
    if (IsFacet(mesh, i)) return true;
  }
  return false;
}

BendRadii::BendRadii(const Scene& scene, int threads)
    : scene_(scene),
      of_meshes_(RadiiOfAll(scene.meshes, threads)),
      of_object_meshes_(RadiiOfAll(scene.object_meshes, threads)) {}

float BendRadii::AtFacet(const OfFacets& facets, const TriangleMesh& mesh,
                         const SurfacePoint& point) const {
  if (facets.empty()) return HUGE_VALF;
  const float radius = facets[point.primitive];
  if (point.instance == kNoInstance || radius == HUGE_VALF) return radius;
  // As much smaller as the side that becomes smallest.
  const std::array<Vec3, 3> own = CornersOf(scene_, mesh, point.primitive, kNoInstance);
  const std::array<Vec3, 3> world = CornersOf(scene_, mesh, point.primitive, point.instance);
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t next = (i + 1) % 3;
    const double before = Length(Double3(own[next]) - Double3(own[i]));
    if (before > 0)
      least = std::min(least, Length(Double3(world[next]) - Double3(world[i])) / before);
  }
  return static_cast<float>(static_cast<double>(radius) * least);
}

float BendRadii::At(const SurfacePoint& point) const {
  const TriangleMesh* mesh = MeshOf(scene_, point.geometry);
  if (mesh == nullptr) {
    return VisitShape(scene_, KindOf(scene_, point.geometry), point.primitive,
                      [&](const auto& shape) {
                        if constexpr (std::decay_t<decltype(shape)>::kIsFlat) {
                          return HUGE_VALF;
                        } else {
                          const PrincipalCurvatures k = CurvatureOf(shape, point.position);
                          const float most = std::max(std::abs(k.first), std::abs(k.second));
                          return most > 0 ? 1 / most : HUGE_VALF;
                        }
                      });
  }
  if (IsFacet(*mesh, point.primitive)) {
    const std::size_t number = point.geometry;
    return number < of_meshes_.size() ? AtFacet(of_meshes_[number], *mesh, point)
                                      : AtFacet(of_object_meshes_[static_cast<std::size_t>(
                                                    mesh - scene_.object_meshes.data())],
                                                *mesh, point);
  }
  const std::uint32_t* corner = &mesh->indices[std::size_t{3} * point.primitive];
  std::array<Vec3, 3> normals = {mesh->normals[corner[0]], mesh->normals[corner[1]],
                                 mesh->normals[corner[2]]};
  for (Vec3& normal : normals) {
    if (point.instance != kNoInstance && normal != Vec3())
      normal = scene_.instances[point.instance].to_world.Normal(normal);
    if (normal == Vec3()) return HUGE_VALF;
    normal = Normalize(normal);
  }
  return RadiusOf(CornersOf(scene_, *mesh, point.primitive, point.instance), normals);
}

}  // namespace lucerna
