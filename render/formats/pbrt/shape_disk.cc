// Shape "disk": whole disks and rings.
#include "render/formats/pbrt/shape_readers.h"

namespace lucerna {

void ReadDisk(const ShapeInput& input, std::vector<Disk>& disks) {
  ParameterList& parameters = input.parameters;
  const ShapePlacement& placement = input.placement;
  const double radius = parameters.Float("radius", 1, kAboveZero);
  const double inner_radius = parameters.Float("innerradius", 0, kZeroOrMore);
  const double height = parameters.Float("height", 0);
  if (parameters.Float("phimax", 360) < 360) {
    parameters.Error("phimax", "makes it a part of a disk, which is not supported");
    return;
  }
  if (inner_radius >= radius) {
    parameters.Error("innerradius", "must be smaller than radius");
    return;
  }
  const StatusOr<double> scale = placement.to_world.UniformScale();
  if (!scale.ok()) {
    parameters.Error(
        "is made an ellipse by its transform, which is not supported; scale all axes "
        "alike, or give a mesh");
    return;
  }
  Disk disk;
  disk.center = placement.to_world.Point({0, 0, static_cast<float>(height)});
  disk.normal = Normalize(placement.to_world.Normal({0, 0, 1}));
  if (placement.reverse_orientation) disk.normal = -disk.normal;
  disk.radius = static_cast<float>(radius * *scale);
  disk.inner_radius = static_cast<float>(inner_radius * *scale);
  disk.traits = placement.traits;
  disk.axes = AxesOf(placement.to_world).value_or(ShapeAxes());
  if (!IsInRange(disk.center, disk.radius)) {
    parameters.Error("is moved or scaled out of single precision by its transform");
    return;
  }
  disks.push_back(disk);
}

Status MoveDisk(Disk& shape, const Transform& to_world) {
  LUCERNA_ASSIGN_OR_RETURN(const Similarity similarity, SimilarityOf(to_world, "disk"));
  shape.center = to_world.Point(shape.center);
  shape.normal = Normalize(to_world.Normal(shape.normal));
  shape.radius *= similarity.factor;
  shape.axes = similarity.Axes(shape.axes);
  shape.inner_radius *= similarity.factor;
  return IsInRange(shape.center, shape.radius) ? absl::OkStatus() : MovedAway();
}

}  // namespace lucerna
