// What bumps and normal maps make of the shading normal.
//
// Source: Pharr, Jakob & Humphreys 2023, "Physically Based Rendering", 4th edition, section 10.5.3;
// bumps after Blinn 1978, "Simulation of Wrinkled Surfaces".
#pragma once

#include "render/geometry/intersector.h"
#include "render/scene/scene.h"

namespace lucerna {

// Turns the shading normal by the displacement or normal map of `material`, which has one, and sets
// the tangent. Leaves both as they are where that gives no direction.
void TurnShadingNormal(const Scene& scene, const Material& material, const TexturePlace& place,
                       SurfacePoint& point);

// Sets the tangent alone.
void FindTangent(const Scene& scene, SurfacePoint& point);

}  // namespace lucerna
