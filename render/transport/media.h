// What does light lose on its way through participating media?
//
// A path knows the medium that it is in: that of its light or camera at first, then what lies
// beyond each surface that separates media and that it passes. Surfaces of the material "interface"
// are passed without scattering.
#pragma once

#include <cstdint>
#include <vector>

#include "render/geometry/intersector.h"
#include "render/math/rgb.h"
#include "render/math/vector.h"
#include "render/scene/scene.h"

namespace lucerna {

// Density over solid angle [sr⁻¹] of scattering by an angle whose cosine is `cosine`, between the
// directions before and after (Henyey & Greenstein 1941, "Diffuse radiation in the galaxy").
[[nodiscard]] float PhaseHenyeyGreenstein(float cosine, float g);
// Draws the direction after scattering of light that travels along `direction` (both unit).
[[nodiscard]] Vec3 SamplePhase(Vec3 direction, float g, float u1, float u2);

class Media {
 public:
  // Keeps references to both.
  Media(const Scene& scene, const Intersector& intersector);

  // Whether there are any; without, nothing else here is needed.
  [[nodiscard]] bool empty() const { return scene_.media.empty(); }
  [[nodiscard]] const Medium& operator[](std::int32_t medium) const {
    return scene_.media[static_cast<std::size_t>(medium)];
  }

  // Whether paths pass the surface unchanged.
  [[nodiscard]] bool IsInterface(const SurfacePoint& surface) const {
    return is_interface_[surface.material] != 0;
  }
  // The medium of a path that passes through the surface in `direction`, before it in `medium`.
  [[nodiscard]] std::int32_t Beyond(const SurfacePoint& surface, Vec3 direction,
                                    std::int32_t medium) const;
  // The medium of a path that was scattered from wo to wi, before it in `medium`: another one when
  // the two are on different sides of the surface.
  [[nodiscard]] std::int32_t After(const SurfacePoint& surface, Vec3 wo, Vec3 wi,
                                   std::int32_t medium) const {
    const bool crosses = Dot(wo, surface.geometric_normal) * Dot(wi, surface.geometric_normal) < 0;
    return crosses ? Beyond(surface, wi, medium) : medium;
  }
  // The medium at the camera, and where a light without extent or a shape that emits is.
  [[nodiscard]] std::int32_t AtCamera() const { return at_camera_; }
  // Of a light that names `named` where the file defines it; where that is none, the medium that
  // surfaces around the point show.
  [[nodiscard]] std::int32_t AtLight(Vec3 position, std::int32_t named) const;

  // Follows a ray through interfaces to the first surface that is none; false when there is none.
  // `is_met`, `hit`: what the ray meets first, found already; `hit` and `ray` become those of that
  // surface, `medium` the one before it. Calls on_leg(ray, t, medium, entered) for the way through
  // each medium or empty space, t infinite where nothing is met; `entered` is the interface at
  // which it begins, nullptr for the first.
  template <typename OnLeg>
  [[nodiscard]] bool Follow(Ray& ray, bool is_met, Hit& hit, std::int32_t& medium, int& rays,
                            const OnLeg& on_leg) const;

  // What is left of light after `length` of the ray, all of it in one medium.
  [[nodiscard]] Rgb TransmittanceOf(std::int32_t medium, const Ray& ray, float length) const {
    const Medium& through = (*this)[medium];
    return through.Transmittance(through.Column(ray.origin, ray.direction, length));
  }
  // The share of light that passes along the ray, whose direction need not be unit, up to t_max;
  // black when a surface that is no interface is in the way. `rays` counts what was traced.
  [[nodiscard]] Rgb Transmittance(const Ray& ray, std::int32_t medium, int& rays) const;

 private:
  // The medium on this side of the first surface along the ray that light passes and that separates
  // media; kNoMedium without one.
  [[nodiscard]] bool FindAlong(Ray ray, std::int32_t& medium) const;

  const Scene& scene_;
  const Intersector& intersector_;
  std::vector<std::uint8_t> is_interface_;  // [materials]
  std::vector<std::uint8_t> transmits_;     // [materials]
  bool has_interfaces_ = false;
  std::int32_t at_camera_ = kNoMedium;
};

// Interfaces in a row that a path passes: more are a fault of the scene.
inline constexpr int kMostInterfaces = 1000;

template <typename OnLeg>
bool Media::Follow(Ray& ray, bool is_met, Hit& hit, std::int32_t& medium, int& rays,
                   const OnLeg& on_leg) const {
  SurfacePoint surface;
  for (int i = 0; i < kMostInterfaces; ++i) {
    on_leg(ray, is_met ? hit.t : HUGE_VALF, medium, i == 0 ? nullptr : &surface);
    if (!is_met) return false;
    if (!has_interfaces_) return true;
    surface = intersector_.SurfaceAt(ray, hit);
    if (!IsInterface(surface)) return true;
    medium = Beyond(surface, ray.direction, medium);
    ray = {LeavingPoint(surface, ray.direction), ray.direction, HUGE_VALF};
    ++rays;
    is_met = intersector_.Intersect(ray, hit);
  }
  return false;
}

}  // namespace lucerna
