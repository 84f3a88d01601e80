// Shape "disk": whole disks and rings; parts of them and ellipses as meshes.
#include <numbers>

#include "render/formats/parametric_mesh.h"
#include "render/formats/pbrt/shape_readers.h"

namespace lucerna {

void ReadDisk(const ShapeInput& input, ShapeSet& shapes) {
  ParameterList& parameters = input.parameters;
  const ShapePlacement placement = PlacementOfQuadric(input.placement);
  const double radius = parameters.Float("radius", 1, kAboveZero);
  const double inner_radius = parameters.Float("innerradius", 0, kZeroOrMore);
  const double height = parameters.Float("height", 0);
  const double phi_max_rad = ReadPhiMax(parameters);
  if (inner_radius >= radius) {
    parameters.Error("innerradius", "must be smaller than radius");
    return;
  }
  const StatusOr<double> scale = placement.to_world.UniformScale();
  if (phi_max_rad < 2 * std::numbers::pi || !scale.ok() || !placement.stays_similar) {
    PlaceMesh(DiskMesh(radius, inner_radius, height, phi_max_rad), parameters, placement, shapes);
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
  shapes.disks.push_back(disk);
}

TriangleMesh MeshDisk(const Disk& shape) {
  TriangleMesh mesh = DiskMesh(static_cast<double>(shape.radius),
                               static_cast<double>(shape.inner_radius), 0, 2 * std::numbers::pi);
  PutOnAxes(shape.center, shape.axes, Dot(shape.normal, shape.axes.z) < 0, mesh);
  return mesh;
}

}  // namespace lucerna
