// How does a surface scatter?
//
// All directions are in the shading frame: unit, away from the surface, z along the shading
// normal. `wo` goes to where radiance is asked for (the eye) or where a photon came from; Sample
// returns `wi` for both. z > 0 is the outside of a dielectric.
// Each kind of material has a file of its own, bsdf_NAME.cc (transport/bsdf_kinds.h).
#pragma once

#include "render/math/rgb.h"
#include "render/math/vector.h"
#include "render/math/warp.h"
#include "render/scene/material.h"

namespace lucerna {

// Whether a path carries radiance (from the eye) or flux (from a light). Refraction into a denser
// medium compresses radiance and leaves flux alone.
enum class Carried : bool { kRadiance, kFlux };

struct BsdfSample {
  Vec3 wi;
  Rgb weight;     // f·|cosθi| / pdf; includes the choice of lobe
  float pdf = 0;  // pdf_solid_angle [sr⁻¹]; meaningless when is_delta
  bool is_delta = false;
  Parts part = Parts::kAll;  // which one scattered, where that is known
};

// The same as SampleBsdf, for a material that is known to be diffuse.
[[nodiscard]] inline bool SampleDiffuse(const Material& material, Vec3 wo, float u1, float u2,
                                        BsdfSample& sample) {
  if (wo.z == 0) return false;
  sample.wi = SquareToCosineHemisphere(u1, u2);
  sample.pdf = sample.wi.z * kInversePi;
  if (wo.z < 0) sample.wi.z = -sample.wi.z;
  sample.weight = material.reflectance;
  sample.is_delta = false;
  return sample.pdf > 0;
}

// False when nothing is scattered. u_lobe, u1, u2 in [0, 1).
[[nodiscard]] bool SampleBsdf(const Material& material, Vec3 wo, float u_lobe, float u1, float u2,
                              Carried carried, BsdfSample& sample);

// f(wo, wi) [sr⁻¹] without the cosine; zero for smooth lobes.
[[nodiscard]] Rgb EvaluateBsdf(const Material& material, Vec3 wo, Vec3 wi, Carried carried);

// The density with which SampleBsdf draws `wi` [sr⁻¹]; zero for smooth lobes.
[[nodiscard]] float PdfBsdf(const Material& material, Vec3 wo, Vec3 wi);

// The reflectance that feature layers show.
[[nodiscard]] Rgb AlbedoOf(const Material& material);

// Of a material with two parts: the probability with which SampleBsdf and eye paths choose the
// first one, in [0, 1].
[[nodiscard]] float ShareOfFirst(const Material& material, Vec3 wo);
// Of a material, or one of its parts, that is separable: f(wo, wi) = EyeFactor(wo) [sr⁻¹] ·
// PhotonFactor(wi), of radiance, where wi is on the side that light comes from.
[[nodiscard]] Rgb EyeFactor(const Material& material, Vec3 wo);
[[nodiscard]] float PhotonFactor(const Material& material, Vec3 wi);
// `material` with one of its parts alone, in `storage`, without its name.
[[nodiscard]] const Material& PartOf(const Material& material, Parts part, Material& storage);

// Of a smooth material: the share of reflection in what it scatters, in [0, 1]; the rest is
// refracted. cos_o: of wo, negative from inside.
[[nodiscard]] float ReflectedShare(const Material& material, float cos_o);

// Fresnel reflectance of unpolarised light. cos_i in [-1, 1], negative from inside; `eta` =
// inside over outside. cos_t: of the refracted direction, in [0, 1]; 0 with total reflection.
[[nodiscard]] float FresnelDielectric(float cos_i, float eta, float& cos_t);
// For a metal with index eta + i·k, cos_i in [0, 1]; in the space of the indices (Rec. 709), while
// all other colours here are in the working space.
[[nodiscard]] Rgb FresnelConductor(float cos_i, Rgb eta, Rgb k);

}  // namespace lucerna
