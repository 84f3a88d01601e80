// Shape "sphere": whole spheres.
#include "render/formats/pbrt/shape_readers.h"

namespace lucerna {

void ReadSphere(const ShapeInput& input, std::vector<Sphere>& spheres) {
  ParameterList& parameters = input.parameters;
  const ShapePlacement& placement = input.placement;
  const double radius = parameters.Float("radius", 1, kAboveZero);
  if (parameters.Float("zmin", -radius) > -radius || parameters.Float("zmax", radius) < radius ||
      parameters.Float("phimax", 360) < 360) {
    parameters.Error("is only a part of a sphere (zmin, zmax, phimax), which is not supported");
    return;
  }
  const StatusOr<double> scale = placement.to_world.UniformScale();
  if (!scale.ok()) {
    parameters.Error(
        "is made an ellipsoid by its transform, which is not supported; scale all "
        "axes alike, or give a mesh");
    return;
  }
  Sphere sphere;
  sphere.center = placement.to_world.Point({0, 0, 0});
  sphere.radius = static_cast<float>(radius * *scale);
  sphere.inward = placement.reverse_orientation;
  sphere.traits = placement.traits;
  sphere.axes = AxesOf(placement.to_world).value_or(ShapeAxes());
  if (!IsInRange(sphere.center, sphere.radius)) {
    parameters.Error("is moved or scaled out of single precision by its transform");
    return;
  }
  spheres.push_back(sphere);
}

Status MoveSphere(Sphere& shape, const Transform& to_world) {
  LUCERNA_ASSIGN_OR_RETURN(const Similarity similarity, SimilarityOf(to_world, "sphere"));
  shape.center = to_world.Point(shape.center);
  shape.radius *= similarity.factor;
  shape.axes = similarity.Axes(shape.axes);
  return IsInRange(shape.center, shape.radius) ? absl::OkStatus() : MovedAway();
}

}  // namespace lucerna
