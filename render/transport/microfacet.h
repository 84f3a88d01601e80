// The microfacet model of rough surfaces: GGX (Trowbridge-Reitz) with the height-correlated
// shadowing of Smith. Directions and units as in transport/bsdf.h.
//
// Sources: Walter et al. 2007, "Microfacet Models for Refraction through Rough Surfaces" (W07);
// Heitz 2018, "Sampling the GGX Distribution of Visible Normals" (H18).
#pragma once

#include <algorithm>
#include <cmath>

#include "render/math/vector.h"
#include "render/math/warp.h"
#include "render/scene/material.h"

namespace lucerna {

[[nodiscard]] constexpr float Square(float v) {
  return v * v;
}

// `wo` reflected at a facet with normal `m`.
[[nodiscard]] inline Vec3 ReflectAt(Vec3 wo, Vec3 m) {
  return m * (2 * Dot(wo, m)) - wo;
}

// Whether a microfacet surface is perfectly smooth.
[[nodiscard]] inline bool HasNoFacets(const MaterialNumbers& material) {
  return material.alpha_u == 0 && material.alpha_v == 0;
}

// The GGX distribution with widths alpha_u, alpha_v along local x and y.
struct Ggx {
  float au, av;

  Ggx(float alpha_u, float alpha_v) : au(std::max(alpha_u, 1e-4F)), av(std::max(alpha_v, 1e-4F)) {}
  explicit Ggx(const MaterialNumbers& material) : Ggx(material.alpha_u, material.alpha_v) {}

  // D(m) [sr⁻¹], W07 eq. (33) stretched to two widths.
  [[nodiscard]] float D(Vec3 m) const {
    const float e = Square(m.x / au) + Square(m.y / av) + Square(m.z);
    return 1 / (kPi * au * av * e * e);
  }
  // Smith's Λ(w).
  [[nodiscard]] float Lambda(Vec3 w) const {
    const float z2 = Square(w.z);
    if (z2 == 0) return HUGE_VALF;
    return (std::sqrt(1 + (Square(au * w.x) + Square(av * w.y)) / z2) - 1) * 0.5F;
  }
  [[nodiscard]] float G1(Vec3 w) const { return 1 / (1 + Lambda(w)); }
  [[nodiscard]] float G2(Vec3 wo, Vec3 wi) const { return 1 / (1 + Lambda(wo) + Lambda(wi)); }

  // The density of SampleVisible [sr⁻¹], H18 eq. (3). Requires w.z > 0.
  [[nodiscard]] float PdfVisible(Vec3 w, Vec3 m) const {
    return G1(w) / w.z * D(m) * std::max(0.0F, Dot(w, m));
  }
  // A normal as seen from w (w.z > 0), H18 appendix A.
  [[nodiscard]] Vec3 SampleVisible(Vec3 w, float u1, float u2) const {
    const Vec3 v = Normalize(Vec3{au * w.x, av * w.y, w.z});
    const float squared = v.x * v.x + v.y * v.y;
    const Vec3 t1 = squared > 0 ? Vec3{-v.y, v.x, 0} / std::sqrt(squared) : Vec3{1, 0, 0};
    const Vec3 t2 = Cross(v, t1);
    const float radius = std::sqrt(u1);
    const float angle = 2 * kPi * u2;
    const float p1 = radius * std::cos(angle);
    const float s = 0.5F * (1 + v.z);
    const float p2 =
        (1 - s) * std::sqrt(std::max(0.0F, 1 - p1 * p1)) + s * (radius * std::sin(angle));
    const float p3 = std::sqrt(std::max(0.0F, 1 - p1 * p1 - p2 * p2));
    const Vec3 m = t1 * p1 + t2 * p2 + v * p3;
    return Normalize(Vec3{au * m.x, av * m.y, std::max(1e-6F, m.z)});
  }
};

}  // namespace lucerna
