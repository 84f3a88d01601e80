// How do position and normal of a surface change with its texture coordinates?
//
// As pbrt-v4 has it for shading: on a mesh with vertex normals both tangents are at right angles to
// the shading normal and to each other, and as long as the derivative by u.
#pragma once

#include "render/geometry/intersector.h"
#include "render/math/vector.h"
#include "render/scene/scene.h"

namespace lucerna {

struct SurfaceTangents {
  Vec3 dpdu, dpdv;           // world [scene units per 1 of u, v]; not parallel
  Vec3 dndu, dndv;           // of the shading normal
  bool v_is_turned = false;  // v grows against dpdv, which is at right angles to dpdu as above
};

[[nodiscard]] SurfaceTangents TangentsAt(const Scene& scene, const SurfacePoint& point);

}  // namespace lucerna
