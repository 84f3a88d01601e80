// Which edges does light pass closely on its way, so that their shadow borders on it?
//
// Candidates are, over all shapes of the scene together that are not dielectric (light goes on
// through those):
//   * open edges of meshes, and edges at which the faces turn by more than kSmallestTurnRad. Faces
//     meet where their vertices have equal positions, whatever mesh or index they come from;
//   * rims of open analytic shapes; a circle is a polygon of kRimSides sides that leave it by at
//     most 1.6e-4 of the radius to either side;
//   * curved analytic shapes, exactly: their outline as seen along the segment.
//
// An edge borders on the light of a segment when, looking along the segment, all faces that meet
// in it lie on the side that is turned away from the segment. So the edges of a hollow corner, the
// rim of the surface that is lit and that of the light are none; neither is what the segment passes
// within a tenth of a percent of its length from either end.
//
// Of a chain of edges only the place that comes nearest is reported: an edge is left out when it
// shares an end with an edge that comes nearer, and either is itself nearest at that end or turns
// into the other by less than 30 degrees there.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "render/base/status.h"
#include "render/geometry/shape_geometry.h"
#include "render/math/vector.h"
#include "render/scene/scene.h"
#include "render/scene/shape_lists.h"

namespace lucerna {

// 0.1 degrees: the outline of a smooth shape runs along edges of its mesh as long as it has fewer
// than about 3600 around, and triangles of one plane stay clear of it, for rounding turns them by
// less.
inline constexpr float kSmallestTurnRad = 0.00175F;
inline constexpr int kRimSides = 128;

// An edge that a segment passes.
struct NearbyEdge {
  float distance_along = 0;   // from the segment's origin to where the edge is nearest
  float distance_across = 0;  // between the two there; may be 0
  std::uint32_t edge = 0;     // its number; curved shapes are numbered after all edges
};

// The nearest edges of one segment, by (distance_along, distance_across, edge).
class NearbyEdges {
 public:
  static constexpr std::size_t kCapacity = 16;

  [[nodiscard]] std::span<const NearbyEdge> all() const { return {edges_.data(), count_}; }

 private:
  friend class SilhouetteEdges;

  std::array<NearbyEdge, kCapacity> edges_;
  std::size_t count_ = 0;
};

// Memory: 48 bytes per edge, about 100 more in Embree's hierarchy, and while it is built 40 per
// vertex and 50 per triangle of the scene.
class SilhouetteEdges {
 public:
  // `reach` is how far from a segment edges are looked for [scene units]: > 0 and finite. Keeps a
  // reference to `scene`, which must outlive it and not change.
  // Errors: RESOURCE_EXHAUSTED or INTERNAL with Embree's words.
  [[nodiscard]] static StatusOr<std::unique_ptr<SilhouetteEdges>> Create(const Scene& scene,
                                                                         float reach);
  ~SilhouetteEdges();
  SilhouetteEdges(const SilhouetteEdges&) = delete;
  SilhouetteEdges& operator=(const SilhouetteEdges&) = delete;

  // The edges that the segment passes at less than `reach`; when there are many, the nearest
  // kCapacity of the nearest 64. Depends on nothing but the arguments and the scene, not on the
  // order in which edges are met. Requires a unit direction, length > 0. Threads: any.
  [[nodiscard]] NearbyEdges Find(Vec3 origin, Vec3 direction, float length) const;

  [[nodiscard]] float reach() const { return reach_; }
  [[nodiscard]] std::size_t edge_count() const { return edges_.size(); }

 private:
  using Edge = SilhouetteEdge;  // a candidate
  struct EmbreeScene;
  struct Search;

  SilhouetteEdges(const Scene& scene, float reach);

  Status AddMeshes();
  void AddRims();

  const Scene& scene_;
  float reach_;
  std::vector<Edge> edges_;
  std::array<std::uint32_t, kShapeKinds> first_outline_{};  // number of the first shape of a kind
  std::unique_ptr<EmbreeScene> embree_;
};

}  // namespace lucerna
