// How strongly is a surface bent at a point, and how fast does that change along it?
//
// Curvature is positive where the surface is convex towards the side that its outward normal
// points to: a sphere of radius R has 1/R, one that is turned inside out -1/R. For light that
// comes from the other side the caller changes the sign; gradients are magnitudes and stay.
//
// Analytic shapes are exact. A mesh has the curvature of its vertex normals, which is what mirrors
// and lenses made of it show: one tensor per triangle, fitted to the differences of the normals
// along its sides. Its gradients do not grow with the fineness of the mesh (see
// curvature_change.h). Meshes without vertex normals and triangles without area or with a normal
// missing are flat.
//
// Promises: no result is NaN or infinite; a scene scaled by 2^n has curvatures scaled by 2^-n
// exactly (within the range of float).
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <vector>

#include "render/geometry/intersector.h"
#include "render/geometry/shape_geometry.h"
#include "render/scene/scene.h"

namespace lucerna {

// Along one direction on the surface.
struct NormalCurvature {
  float curvature = 0;        // [1/unit]
  float gradient = 0;         // bound of its first derivative by arc length, any way [1/unit²]
  float second_gradient = 0;  // and of its second [1/unit³]
};

class SurfaceCurvature {
 public:
  // Selects materials.
  using Choice = std::function<bool(const Material&)>;
  // Prepares the meshes with vertex normals whose material is one that `is_wanted`; others count
  // as flat. Gradients, by far the most work, are 0 on meshes whose `is_change_wanted` is not.
  // 32 bytes per triangle prepared. Keeps a reference to `scene`, which must outlive it and not
  // change.
  SurfaceCurvature(
      const Scene& scene, const Choice& is_wanted,
      const Choice& is_change_wanted = [](const Material&) { return true; });

  // `tangent` is unit and about perpendicular to the surface; only its part in the surface's plane
  // counts. Without one the mean curvature is returned. Threads: any.
  [[nodiscard]] NormalCurvature Along(const SurfacePoint& point, Vec3 tangent) const;

  // The sum of the squares of the two principal curvatures [1/unit²]. Threads: any.
  [[nodiscard]] float SquaredPrincipals(const SurfacePoint& point) const;

 private:
  // Of a triangle: the symmetric tensor in world space, which is 0 along the triangle's normal,
  // and the bounds of the gradients.
  struct Bending {
    float xx = 0, yy = 0, zz = 0, xy = 0, xz = 0, yz = 0;
    float gradient = 0, second_gradient = 0;
  };

  void AddMesh(const TriangleMesh& mesh, bool with_change);
  [[nodiscard]] const Bending* BendingAt(const SurfacePoint& point) const;
  // Of an analytic shape, held below what rounding leaves of the surface.
  [[nodiscard]] PrincipalCurvatures AnalyticAt(const SurfacePoint& point) const;

  const Scene& scene_;
  std::vector<std::int64_t> first_;  // [meshes] into bendings_; negative: flat
  std::vector<Bending> bendings_;
};

}  // namespace lucerna
