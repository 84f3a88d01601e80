#include "render/scene/shape_sphere.h"

#include "render/scene/shape_moves.h"

namespace lucerna {

Status MoveSphere(Sphere& shape, const Transform& to_world) {
  const Similarity similarity = SimilarityOf(to_world);
  shape.center = to_world.Point(shape.center);
  shape.radius *= similarity.factor;
  shape.axes = similarity.Axes(shape.axes);
  return IsInRange(shape.center, shape.radius) ? absl::OkStatus() : MovedAway();
}

}  // namespace lucerna
