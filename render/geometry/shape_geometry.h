// Intersection, sampling, texture coordinates, curvature and edges of each kind of analytic shape,
// defined in shape_NAME.cc. Functions that only flat, only curved or only open shapes have are
// defined for those alone (scene/analytic_shapes.h).
//
//   BoxOf           Holds all points of the shape, rounding included.
//   IntersectShape  True and `t`, in (t_near, t_far), where origin + t·direction first meets it.
//   FaceAt          Of the place origin + t·direction at which the ray meets the shape.
//   SampleFace      Draws a place evenly by area. u1, u2 in [0, 1).
//   FaceNumbers     With which u1, u2 SampleFace draws this place, about.
//   SampleSeen      Draws a direction from `from` to the shape otherwise than by area; false when
//                   area is as good.
//   SeenInversePdf  The inverse of the density [sr] with which SampleSeen draws a direction to the
//                   shape, 0 where it returns false.
//   UvOf            Texture coordinates as in pbrt-v4; UvSlopesOf: see UvSlopesAt (surface_uv.h);
//                   TangentsOf: see surface_tangents.h, of zero length where there are none.
//   SpectrumOf      The spectrum of light that the shape emits along `direction`.
//   Curved:         CurvatureOf, at a point of the surface.
//                   NearestOutline: of all lines of sight parallel to a line, those that graze
//                   the shape are its outline; where the line comes nearest to it.
//                   CutByPlane: the curve in which a plane crosses the surface, as a polygon.
//   Flat:           ClipToShape: narrows [begin, end] to the part of from + t·along, which lies in
//                   the shape's plane, that is within the shape's outer rim; false: nothing is.
//   Open:           AddRim: its rim, as segments at which the disc of a hitpoint is cut.
//                   AddRimSilhouettes: as edges at which a shadow may end.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "render/frequency/spectrum.h"
#include "render/geometry/intersector.h"
#include "render/geometry/surface_tangents.h"
#include "render/geometry/surface_uv.h"
#include "render/math/double3.h"
#include "render/scene/scene.h"

namespace lucerna {

struct ShapeFace {
  Vec3 position;
  Vec3 normal;  // unit, outward
};

struct SeenPlace {
  Vec3 wi;                // towards the shape, unit
  Vec3 target;            // just off the surface
  float inverse_pdf = 0;  // [sr]
};

struct PrincipalCurvatures {
  Vec3 direction;      // unit, in which the first is; any one when the two are equal
  float first = 0;     // [1/unit]
  float second = 0;    // at right angles to it
  float gradient = 0;  // as in NormalCurvature
  float second_gradient = 0;
};

// A straight piece, from + t·along for t in [0, 1].
struct LinePiece {
  Double3 from, along;
};

// A place on the way along a line.
struct OutlinePlace {
  double along = 0;     // on the line, in units of its direction's length
  double distance = 0;  // between line and shape there; not positive: the line meets the shape
};

// A segment at which the disc of a hitpoint is cut (feature_edges.h).
struct FeatureSegment {
  std::array<Vec3, 2> ends;
};

// An edge that may border on a shadow (silhouette.h). A wing is the direction, perpendicular to the
// edge, in which a face leaves it. Of more than two faces, the two that enclose all others; of one
// face, the same twice.
struct SilhouetteEdge {
  Vec3 ends[2];
  Vec3 wings[2];
};

#define LUCERNA_DECLARE(Name, list, name)                                                          \
  [[nodiscard]] Bounds BoxOf(const Name& shape);                                                   \
  [[nodiscard]] bool IntersectShape(const Name& shape, Vec3 origin, Vec3 direction, float t_near,  \
                                    float t_far, float& t);                                        \
  [[nodiscard]] ShapeFace FaceAt(const Name& shape, const Ray& ray, float t);                      \
  [[nodiscard]] ShapeFace SampleFace(const Name& shape, float u1, float u2);                       \
  [[nodiscard]] Vec2 FaceNumbers(const Name& shape, Vec3 position);                                \
  [[nodiscard]] bool SampleSeen(const Name& shape, Vec3 from, float u1, float u2,                  \
                                SeenPlace& seen);                                                  \
  [[nodiscard]] float SeenInversePdf(const Name& shape, Vec3 from);                                \
  [[nodiscard]] Vec2 UvOf(const Name& shape, Vec3 position);                                       \
  [[nodiscard]] UvSlopes UvSlopesOf(const Name& shape, Vec3 position);                             \
  [[nodiscard]] SurfaceTangents TangentsOf(const Name& shape, Vec3 position);                      \
  [[nodiscard]] Spectrum SpectrumOf(const Name& shape, Vec3 direction,                             \
                                    const SpectrumLimits& limits);                                 \
  [[nodiscard]] PrincipalCurvatures CurvatureOf(const Name& shape, Vec3 position);                 \
  [[nodiscard]] OutlinePlace NearestOutline(const Name& shape, Double3 origin, Double3 direction); \
  [[nodiscard]] std::vector<LinePiece> CutByPlane(const Name& shape, Double3 origin,               \
                                                  Double3 normal);                                 \
  [[nodiscard]] bool ClipToShape(const Name& shape, Double3 from, Double3 along, double& begin,    \
                                 double& end);                                                     \
  void AddRim(const Name& shape, std::vector<FeatureSegment>& segments);                           \
  void AddRimSilhouettes(const Name& shape, std::vector<SilhouetteEdge>& edges);
LUCERNA_ANALYTIC_SHAPES(LUCERNA_DECLARE)
#undef LUCERNA_DECLARE

// How far off the surface its points may lie from rounding [scene units].
template <typename Shape>
[[nodiscard]] float ClearanceOf(const Shape& shape) {
  return kClearance * (MaxAbs(shape.center) + shape.Reach());
}

// Whether a ray that enters a piece of a tube here has come through a piece next to it, and so was
// within the tube before. Pieces are next to each other when one begins where the one before it in
// `pieces` ends.
[[nodiscard]] bool IsWithinNextPiece(const std::vector<CurvePiece>& pieces, std::size_t index,
                                     const Ray& ray, float t);

// The squared slope of the texture coordinate around an axis (TurnOf) at this distance from it
// [1/length²].
[[nodiscard]] double TurnSlope(double distance);

}  // namespace lucerna
