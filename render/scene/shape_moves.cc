#include "render/scene/shape_moves.h"

#include <cfloat>
#include <cmath>

namespace lucerna {

bool MoveMesh(const Transform& to_world, TriangleMesh& mesh) {
  for (Vec3& position : mesh.positions) {
    position = to_world.Point(position);
    if (!IsFinite(position)) return false;
  }
  for (Vec3& normal : mesh.normals) {
    const float size = MaxAbs(normal);
    normal = size > 0 ? to_world.Normal(normal / size) : Vec3();
    // Normal() leaves zero when there is no direction left: S3 lets that stand.
    if (normal != Vec3()) normal = Normalize(normal);
  }
  return true;
}

namespace {

ShapeAxes AxesAt(const Transform& to_world, double scale) {
  const auto axis = [&](Vec3 local) {
    const Vec3 world = to_world.Vector(local * static_cast<float>(1 / scale));
    const float size = MaxAbs(world);
    return size > 0 && std::isfinite(size) ? Normalize(world / size) : local;
  };
  return {axis({1, 0, 0}), axis({0, 1, 0}), axis({0, 0, 1})};
}

}  // namespace

StatusOr<ShapeAxes> AxesOf(const Transform& to_world) {
  LUCERNA_ASSIGN_OR_RETURN(const double scale, to_world.UniformScale());
  return AxesAt(to_world, scale);
}

ShapeAxes Similarity::Axes(const ShapeAxes& axes) const {
  const auto in_world = [&](Vec3 v) { return turned.x * v.x + turned.y * v.y + turned.z * v.z; };
  return {in_world(axes.x), in_world(axes.y), in_world(axes.z)};
}

Similarity SimilarityOf(const Transform& to_world) {
  const double scale = MeanScale(to_world);
  return {static_cast<float>(scale), AxesAt(to_world, scale)};
}

Status MovedAway() {
  return absl::InvalidArgumentError(
      "the instance is moved or scaled out of single precision by its transform");
}

bool IsInRange(Vec3 center, float radius) {
  return IsFinite(center) && radius >= FLT_MIN && std::isfinite(radius);
}

double MeanScale(const Transform& transform) {
  double squared = 0;
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t column = 0; column < 3; ++column)
      squared += transform.rows()[row][column] * transform.rows()[row][column] / 3;
  }
  return std::sqrt(squared);
}

}  // namespace lucerna
