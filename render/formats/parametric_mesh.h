// Which triangles stand for a curved surface that has no shape of its own?
//
// Parts of spheres, of disks and of cylinders, ellipsoids, and bilinear patches are read as meshes
// with the exact normals and texture coordinates of the surface at their vertices. Vertices lie on
// the surface, and a full turn has kTurnSides sides: no point is farther than 0.06 % of the radius
// from the surface, and the area is 0.1 % too small.
//
// All are in the shape's own space, as pbrt-v4 places them, and wound so that the outward side is
// that of the normals.
#pragma once

#include <array>

#include "render/math/double3.h"
#include "render/scene/scene.h"

namespace lucerna {

inline constexpr int kTurnSides = 96;

// The part of a sphere around the origin between the heights `z_min` < `z_max`, within [-radius,
// radius], over the angles [0, phi_max_rad] from x to y. u grows with the angle, v with z.
[[nodiscard]] TriangleMesh SphereMesh(double radius, double z_min, double z_max,
                                      double phi_max_rad);

// The part of a ring at height `height` over these angles; outward is +z.
[[nodiscard]] TriangleMesh DiskMesh(double radius, double inner_radius, double height,
                                    double phi_max_rad);

// The part of an open cylinder around z between two heights; outward is away from the axis.
[[nodiscard]] TriangleMesh CylinderMesh(double radius, double z_min, double z_max,
                                        double phi_max_rad);

// A bilinear patch (1-u)(1-v) p00 + u (1-v) p10 + (1-u) v p01 + u v p11. `normals` of the corners,
// in the same order, or null: those of the surface. Flat parallelograms are two triangles, others
// 2 × 16 × 16.
struct BilinearPatch {
  std::array<Vec3, 4> corners;  // p00, p10, p01, p11
  std::array<Vec2, 4> uvs = {Vec2{0, 0}, Vec2{1, 0}, Vec2{0, 1}, Vec2{1, 1}};
};
// Appends it to a mesh with normals and texture coordinates.
void AddBilinearPatch(const BilinearPatch& patch, const std::array<Vec3, 4>* normals,
                      TriangleMesh& mesh);
// The same as 2 × sides × sides triangles.
void AddBilinearPatch(const BilinearPatch& patch, const std::array<Vec3, 4>* normals, int sides,
                      TriangleMesh& mesh);
// The fewest `sides`, 16 at most, with which triangles leave the surface by 0.5 % of its mean
// diagonal at most; 1 where it lies in a plane, whatever its texture coordinates do.
[[nodiscard]] int FewestPatchSides(const BilinearPatch& patch);

}  // namespace lucerna
