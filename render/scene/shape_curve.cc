#include "render/scene/shape_curve.h"

#include "render/scene/shape_moves.h"

namespace lucerna {

// Under a transform that stretches, the tube stays round and gets the mean width.
Status MoveCurvePiece(CurvePiece& shape, const Transform& to_world) {
  const auto scale = static_cast<float>(MeanScale(to_world));
  shape.from = to_world.Point(shape.from);
  shape.to = to_world.Point(shape.to);
  shape.from_radius *= scale;
  shape.to_radius *= scale;
  shape.center = shape.from * 0.5F + shape.to * 0.5F;
  return IsFinite(shape.from) && IsFinite(shape.to) && IsInRange(shape.center, shape.Reach())
             ? absl::OkStatus()
             : MovedAway();
}

}  // namespace lucerna
