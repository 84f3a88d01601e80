#include "render/tracing/facet_sides.h"

namespace lucerna {

bool SidesAgree(const SurfacePoint& surface, Vec3 wo, Vec3 wi, bool transmits) {
  if (!surface.has_shading_normal) return true;
  const bool same_side = Dot(wo, surface.geometric_normal) * Dot(wi, surface.geometric_normal) > 0;
  return same_side != transmits;
}

bool FacetSides::IsInside(const SurfacePoint& surface, const Material& material) const {
  return surface.geometry == geometry_ && surface.instance == instance_ &&
         GoesOnByReflectionAlone(material);
}

bool FacetSides::Scatter(const SurfacePoint& surface, const Material& material, Vec3 wo, Vec3 wi,
                         bool transmits) {
  if (SidesAgree(surface, wo, wi, transmits)) return true;
  if (!GoesOnByReflectionAlone(material)) return false;
  is_behind_ = !is_behind_;
  geometry_ = surface.geometry;
  instance_ = surface.instance;
  return true;
}

bool FacetSides::MayBeLit(const SurfacePoint& surface, Vec3 wo, Vec3 wi, bool transmits) const {
  // From behind it must come out; from the front, a ray to a light behind ends at a wall.
  return SidesAgree(surface, wo, wi, transmits) != is_behind_;
}

}  // namespace lucerna
