// How narrow is the bend of a surface at a point?
//
// Analytic shapes are exact. A mesh is bent as far as its vertex normals turn along the sides of a
// triangle. Triangles without vertex normals, or with the same at all three corners, are facets:
// they are bent as if they had, at the corners of each, the mean of the normals of the facets
// around that are one surface with it (kSameSurfaceCosine), weighted by their angles at the corner.
// So a bar of twelve flat sides is as round as one of twelve sides with round normals, and a box is
// flat. What the rounding of vertices may have turned does not count.
#pragma once

#include <vector>

#include "render/geometry/intersector.h"
#include "render/scene/scene.h"

namespace lucerna {

// Whether any triangle of the mesh is a facet.
[[nodiscard]] bool HasFacets(const TriangleMesh& mesh);

class BendRadii {
 public:
  // Prepares the meshes that have facets: 4 bytes a triangle are kept of those that are not flat,
  // and some 50 taken meanwhile. Keeps a reference to `scene`, which must not change. Threads as
  // ThreadTeam has them; the result does not depend on them.
  explicit BendRadii(const Scene& scene, int threads = 1);

  // The least radius of curvature of the surface at the point, of any direction and either side.
  // HUGE_VALF where the surface is flat. Threads: any.
  [[nodiscard]] float At(const SurfacePoint& point) const;

 private:
  // Of a mesh in the world, or in its object, by triangles; empty: flat, or without facets.
  using OfFacets = std::vector<float>;
  [[nodiscard]] float AtFacet(const OfFacets& facets, const TriangleMesh& mesh,
                              const SurfacePoint& point) const;

  const Scene& scene_;
  std::vector<OfFacets> of_meshes_;
  std::vector<OfFacets> of_object_meshes_;
};

}  // namespace lucerna
