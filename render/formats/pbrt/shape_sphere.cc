// Shape "sphere": whole spheres; parts of spheres and ellipsoids as meshes.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "render/formats/parametric_mesh.h"
#include "render/formats/pbrt/shape_readers.h"

namespace lucerna {

void ReadSphere(const ShapeInput& input, ShapeSet& shapes) {
  ParameterList& parameters = input.parameters;
  const ShapePlacement placement = PlacementOfQuadric(input.placement);
  const double radius = parameters.Float("radius", 1, kAboveZero);
  const double one_end = std::clamp(parameters.Float("zmin", -radius), -radius, radius);
  const double other_end = std::clamp(parameters.Float("zmax", radius), -radius, radius);
  const double z_min = std::min(one_end, other_end);
  const double z_max = std::max(one_end, other_end);
  const double phi_max_rad = ReadPhiMax(parameters);
  if (IsFlattened(parameters, placement.to_world)) return;
  if (z_min == z_max) {
    parameters.Error("zmin", "and zmax leave nothing of the sphere");
    return;
  }
  const bool is_whole = z_min == -radius && z_max == radius && phi_max_rad >= 2 * std::numbers::pi;
  const StatusOr<double> scale = placement.to_world.UniformScale();
  if (!is_whole || !scale.ok() || !placement.stays_similar) {
    PlaceMesh(SphereMesh(radius, z_min, z_max, phi_max_rad), parameters, placement, shapes);
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
  shapes.spheres.push_back(sphere);
}

TriangleMesh MeshSphere(const Sphere& shape) {
  const auto radius = static_cast<double>(shape.radius);
  TriangleMesh mesh = SphereMesh(radius, -radius, radius, 2 * std::numbers::pi);
  PutOnAxes(shape.center, shape.axes, shape.inward, mesh);
  return mesh;
}

}  // namespace lucerna
