#include "render/scene/shape_disk.h"

#include "render/scene/shape_moves.h"

namespace lucerna {

Status MoveDisk(Disk& shape, const Transform& to_world) {
  const Similarity similarity = SimilarityOf(to_world);
  shape.center = to_world.Point(shape.center);
  shape.normal = Normalize(to_world.Normal(shape.normal));
  shape.radius *= similarity.factor;
  shape.axes = similarity.Axes(shape.axes);
  shape.inner_radius *= similarity.factor;
  return IsInRange(shape.center, shape.radius) ? absl::OkStatus() : MovedAway();
}

}  // namespace lucerna
