// On which side of a mesh is a path whose shading normal sends it to the other side of a triangle?
//
// About a shading normal a direction may be reflected to behind the triangle that was met. In
// general no light comes from there and the path ends, or light would leak through walls. But on
// coarse round metal that costs a few percent of the light, most near its outline. So at metals
// where paths go on they do so behind the triangle too, as long as they meet the same shape from
// behind: through the inside of a bar or ball, until another triangle sends them out. A path that
// meets anything else while it is behind has come through a wall, and ends. Crossings are those of
// the reversed path, so that eye paths and photons see the same light.
#pragma once

#include <cstdint>

#include "render/geometry/intersector.h"
#include "render/math/vector.h"
#include "render/scene/material.h"

namespace lucerna {

// True when wi leaves on the side of the surface that the BSDF means: reflection on wo's side of
// the geometric normal too, transmission on the other.
[[nodiscard]] bool SidesAgree(const SurfacePoint& surface, Vec3 wo, Vec3 wi, bool transmits);

// The state of one path.
class FacetSides {
 public:
  [[nodiscard]] bool is_behind() const { return is_behind_; }
  // Whether the path may be at a point that it met.
  [[nodiscard]] bool MayMeet(const SurfacePoint& surface, const Material& material) const {
    return !is_behind_ || IsInside(surface, material);
  }
  // Whether the path may be scattered there from wo to wi; from then on it may be on another side.
  // Requires MayMeet.
  [[nodiscard]] bool Scatter(const SurfacePoint& surface, const Material& material, Vec3 wo,
                             Vec3 wi, bool transmits);
  // Whether light from wi, which nothing blocks, may be scattered there to wo. Requires MayMeet.
  [[nodiscard]] bool MayBeLit(const SurfacePoint& surface, Vec3 wo, Vec3 wi, bool transmits) const;

 private:
  [[nodiscard]] bool IsInside(const SurfacePoint& surface, const Material& material) const;

  bool is_behind_ = false;
  // The shape behind whose triangles it is.
  std::uint32_t geometry_ = 0, instance_ = 0;
};

}  // namespace lucerna
