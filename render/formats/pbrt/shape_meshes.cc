// Shapes "cylinder", "bilinearmesh" and "loopsubdiv", which are always meshes here.
#include <algorithm>
#include <cmath>
#include <utility>

#include "render/base/text.h"
#include "render/formats/loop_subdivision.h"
#include "render/formats/parametric_mesh.h"
#include "render/formats/pbrt/shape_readers.h"

namespace lucerna {

void ReadCylinder(const ShapeInput& input, ShapeSet& shapes) {
  ParameterList& parameters = input.parameters;
  const double radius = parameters.Float("radius", 1, kAboveZero);
  const double one_end = parameters.Float("zmin", -1);
  const double other_end = parameters.Float("zmax", 1);
  const double phi_max_rad = ReadPhiMax(parameters);
  if (IsFlattened(parameters, input.placement.to_world)) return;
  PlaceMesh(
      CylinderMesh(radius, std::min(one_end, other_end), std::max(one_end, other_end), phi_max_rad),
      parameters, PlacementOfQuadric(input.placement), shapes);
}

void ReadBilinearMesh(const ShapeInput& input, ShapeSet& shapes) {
  ParameterList& parameters = input.parameters;
  TriangleMesh control;
  for (const std::string_view name : {"faceIndices", "emissionfilename"})
    parameters.Ignore(name);
  const bool has_positions = ReadPositions(parameters, 4, control);
  ReadNormals(parameters, control);
  ReadUvs(parameters, control);
  if (!has_positions) return;
  shapes.parts = control.indices.size() / 4;
  // Before they take the memory.
  constexpr std::uint64_t kBytesPerPatch = 16'384;
  if (control.indices.size() / 4 > input.assets.limits().max_shape_bytes / kBytesPerPatch) {
    parameters.Error("indices",
                     Concat("make ", control.indices.size() / 4,
                            " patches, which are more than the memory for shapes holds"));
    return;
  }
  TriangleMesh mesh;
  for (std::size_t i = 0; i + 3 < control.indices.size(); i += 4) {
    BilinearPatch patch;
    std::array<Vec3, 4> normals;
    for (std::size_t corner = 0; corner < 4; ++corner) {
      const std::uint32_t vertex = control.indices[i + corner];
      patch.corners[corner] = control.positions[vertex];
      if (!control.uvs.empty()) patch.uvs[corner] = control.uvs[vertex];
      if (!control.normals.empty()) normals[corner] = control.normals[vertex];
    }
    AddBilinearPatch(patch, control.normals.empty() ? nullptr : &normals, mesh);
  }
  PlaceMesh(std::move(mesh), parameters, input.placement, shapes);
}

void ReadLoopSubdivision(const ShapeInput& input, ShapeSet& shapes) {
  ParameterList& parameters = input.parameters;
  const auto levels = static_cast<int>(parameters.FindInteger("levels", {0, 16}).value_or(3));
  parameters.Ignore("scheme");
  TriangleMesh control;
  if (!ReadPositions(parameters, 3, control)) return;
  shapes.parts = control.indices.size() / 3;
  const double triangles = std::ldexp(static_cast<double>(control.indices.size()) / 3, 2 * levels);
  if (triangles > static_cast<double>(MostTriangles(input.assets))) {
    parameters.Error("levels", Concat("splits it into ", triangles,
                                      " triangles, more than the memory for shapes holds"));
    return;
  }
  StatusOr<TriangleMesh> mesh = LoopSubdivide(control, levels);
  if (!mesh.ok()) {
    parameters.Error(std::string(mesh.status().message()));
    return;
  }
  // pbrt-v4 goes around a vertex the other way: its normals are on the other side.
  for (Vec3& normal : mesh->normals)
    normal = -normal;
  PlaceMesh(*std::move(mesh), parameters, input.placement, shapes);
}

}  // namespace lucerna
