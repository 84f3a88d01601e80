// Moves shapes by a transform: those of an object to where an instance of it stands, and those that
// move to where they are at a time.
#pragma once

#include "render/base/status.h"
#include "render/math/transform.h"
#include "render/math/vector.h"
#include "render/scene/analytic_shapes.h"
#include "render/scene/scene.h"

namespace lucerna {

// Moves positions and normals; the winding is not touched. Returns false when a position leaves the
// finite numbers.
[[nodiscard]] bool MoveMesh(const Transform& to_world, TriangleMesh& mesh);

// Of each kind of analytic shape, defined in shape_NAME.cc. Requires a transform that scales all
// axes about alike, but for thin shapes. Errors: INVALID_ARGUMENT when the shape is moved out of
// single precision.
#define LUCERNA_DECLARE(Name, list, name) \
  [[nodiscard]] Status Move##Name(Name& shape, const Transform& to_world);
LUCERNA_ANALYTIC_SHAPES(LUCERNA_DECLARE)
#undef LUCERNA_DECLARE

// Where the axes of a space point. Errors: INVALID_ARGUMENT when it is stretched.
[[nodiscard]] StatusOr<ShapeAxes> AxesOf(const Transform& to_world);

// A transform that keeps angles.
struct Similarity {
  float factor = 1;  // by which lengths grow
  ShapeAxes turned;  // the world's axes, moved

  [[nodiscard]] ShapeAxes Axes(const ShapeAxes& axes) const;
};
// The nearest to a transform that scales all axes about alike.
[[nodiscard]] Similarity SimilarityOf(const Transform& to_world);

// The factor of lengths, on average over all directions.
[[nodiscard]] double MeanScale(const Transform& transform);

// INVALID_ARGUMENT: an instance is moved out of single precision.
[[nodiscard]] Status MovedAway();
// Whether single precision holds a shape around `center` with this radius.
[[nodiscard]] bool IsInRange(Vec3 center, float radius);

}  // namespace lucerna
