// The readers of each kind of analytic shape, defined in shape_NAME.cc, and what they share.
//
// Read  Adds a shape to `list`, or reports what is wrong.
// Move  Puts a shape of an object where an instance of the object stands. Errors: INVALID_ARGUMENT
//       when the shape would then be of another kind or is moved out of single precision.
#pragma once

#include <string_view>
#include <vector>

#include "render/base/status.h"
#include "render/formats/asset_reader.h"
#include "render/formats/pbrt/parameter_list.h"
#include "render/formats/pbrt/shapes.h"
#include "render/math/transform.h"
#include "render/scene/scene.h"

namespace lucerna {

// What the readers of all kinds of shape are given.
struct ShapeInput {
  ParameterList& parameters;
  const ShapePlacement& placement;
  AssetReader& assets;
};

#define LUCERNA_DECLARE(Name, list, name)                            \
  void Read##Name(const ShapeInput& input, std::vector<Name>& list); \
  [[nodiscard]] Status Move##Name(Name& shape, const Transform& to_world);
LUCERNA_ANALYTIC_SHAPES(LUCERNA_DECLARE)
#undef LUCERNA_DECLARE

// A transform that keeps angles.
struct Similarity {
  float factor = 1;  // by which lengths grow
  ShapeAxes turned;  // the world's axes, moved

  [[nodiscard]] ShapeAxes Axes(const ShapeAxes& axes) const;
};
// Of the transform of an instance that holds a `name`, such as "sphere". Errors: INVALID_ARGUMENT
// when it does not scale all axes alike.
[[nodiscard]] StatusOr<Similarity> SimilarityOf(const Transform& to_world, std::string_view name);

// INVALID_ARGUMENT: an instance is moved out of single precision.
[[nodiscard]] Status MovedAway();
// Whether single precision holds a shape around `center` with this radius.
[[nodiscard]] bool IsInRange(Vec3 center, float radius);

}  // namespace lucerna
