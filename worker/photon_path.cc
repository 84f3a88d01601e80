#include "worker/photon_path.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "render/estimate/evidence.h"
#include "render/math/octahedral.h"
#include "render/math/rng.h"
#include "render/math/sobol.h"
#include "render/transport/material_at.h"

namespace lucerna {
namespace {

// Flux is per true surface area, while the BSDF is meant for the smoothed surface: their ratio of
// cosines keeps light and eye paths on equal terms (Veach 1997, section 5.3.2). It is bounded,
// because a facet seen edge-on from one side only would carry it without end.
constexpr float kMaxCosineRatio = 16;

float CosineRatio(float shading_cosine, float geometric_cosine) {
  return std::min(kMaxCosineRatio,
                  std::abs(shading_cosine) / std::max(std::abs(geometric_cosine), 1e-12F));
}

bool Inside(const Bounds& region, Vec3 p) {
  return p.x >= region.low.x && p.x <= region.high.x && p.y >= region.low.y &&
         p.y <= region.high.y && p.z >= region.low.z && p.z <= region.high.z;
}

}  // namespace

PhotonPathTracer::PhotonPathTracer(const Scene& scene, const Intersector& intersector,
                                   const LightSet& lights, const RenderSettings& settings,
                                   const SpectrumTracer* spectra, const Bounds& region)
    : scene_(scene),
      intersector_(intersector),
      lights_(lights),
      settings_(settings),
      spectra_(spectra),
      region_(region) {
  for (const Material& material : scene.materials) {
    gathers_.push_back(Gathers(material) ? 1 : 0);
  }
}

void PhotonPathTracer::Trace(std::uint64_t pass, std::uint64_t index, Landed& landed) const {
  constexpr std::uint64_t kPhotonKey = 0x50484F544F4E5321ULL;
  // One sequence over all even passes and one over all odd ones: each shares its photons out evenly,
  // and the two halves are independent of each other (see estimate/error_estimate.h).
  const std::uint64_t job_key = CombineKeys(CombineKeys(settings_.seed, kPhotonKey), pass % 2);
  const std::uint64_t number =
      pass / 2 * static_cast<std::uint64_t>(settings_.photons_per_pass) + index;
  if (spectra_ == nullptr) return Walk<false>(number, job_key, landed);
  constexpr std::uint64_t kShareKey = 0x4652455155454E43ULL;
  const auto bits = static_cast<std::uint32_t>(CombineKeys(job_key ^ kShareKey, number) >> 32);
  if (static_cast<double>(UnitFloat(bits)) < FrequencyShareInPass(settings_)) {
    return Walk<true>(number, job_key, landed);
  }
  Walk<false>(number, job_key, landed);
  landed.traces.resize(landed.deposits.size(), -1.0F);
}

template <bool kHasSpectrum>
void PhotonPathTracer::Walk(std::uint64_t number, std::uint64_t job_key, Landed& landed) const {
  const SobolPoint u = OwenSobol(number, job_key);
  KeyedRng rng(CombineKeys(job_key, number));

  Emission emission;
  if (!lights_.SampleEmission(FineChoice(u[4], rng.Uniform()), u[0], u[1], u[2], u[3], emission))
    return;
  Ray ray = emission.ray;
  Rgb flux = emission.flux;
  [[maybe_unused]] SpectrumTracer::Carried carried;
  if constexpr (kHasSpectrum) carried = spectra_->Leave(emission);
  for (int landing = 0; landing < settings_.max_depth; ++landing) {
    Hit hit;
    ++landed.rays;
    if (!intersector_.Intersect(ray, hit)) return;
    const SurfacePoint surface = intersector_.SurfaceAt(ray, hit);
    std::optional<Material> textured;
    const Material& material = MaterialAt(scene_, surface, textured);
    const Vec3 wo = -ray.direction;
    if (surface.has_shading_normal) {
      const float shading = Dot(wo, surface.shading_normal);
      const float geometric = Dot(wo, surface.geometric_normal);
      // Below the smoothed surface's horizon: that surface would not have been met here.
      if (!(shading * geometric > 0)) return;
      flux *= CosineRatio(shading, geometric);
    }
    if (!IsFinite(flux) || !IsFinite(surface.position)) {
      ++landed.dropped;
      return;
    }
    const bool is_found =
        landing > 0 && gathers_[surface.material] != 0 && Inside(region_, surface.position);
    if constexpr (kHasSpectrum) {
      // A surface that scatters light broadly forgets the shadows on it: after a leg of length d at
      // most 4/d² of any detail is left, of none at all 3/d² (see LeaveDiffuse).
      const bool shadows_count = is_found || material.kind != Material::Kind::kDiffuse;
      spectra_->Fly(
          carried, ray, hit.t,
          shadows_count ? SpectrumTracer::Shadows::kFound : SpectrumTracer::Shadows::kLeftOut);
    }
    if (is_found) {
      landed.deposits.push_back({surface.position, flux, FaceForward(surface.geometric_normal, wo),
                                 EncodeOctahedral(wo),
                                 static_cast<std::uint32_t>(rng.Bits() >> 32)});
      if constexpr (kHasSpectrum) {
        landed.traces.push_back(spectra_->Received(carried, surface, material, wo));
      }
    }
    if (landing + 1 == settings_.max_depth) return;

    float u_lobe = u[7];
    float u1 = u[5];
    float u2 = u[6];
    if (landing > 0) {
      u_lobe = rng.Uniform();
      u1 = rng.Uniform();
      u2 = rng.Uniform();
    }
    const Frame frame(surface.shading_normal);
    BsdfSample sample;
    if (!SampleBsdf(material, frame.ToLocal(wo), u_lobe, u1, u2, Carried::kFlux, sample)) {
      return;
    }
    const Vec3 wi = frame.ToWorld(sample.wi);
    Rgb scattered = flux * sample.weight;
    if (surface.has_shading_normal) {
      const float geometric = Dot(wi, surface.geometric_normal);
      const bool transmits = Dot(wo, frame.n) * sample.wi.z < 0;
      const bool crosses = Dot(wo, surface.geometric_normal) * geometric < 0;
      if (transmits != crosses) return;
      scattered *= 1 / std::max(CosineRatio(sample.wi.z, geometric), 1 / kMaxCosineRatio);
    }
    // Survives with the share of flux that is left, and then has the flux it came with.
    const float before = MaxChannel(flux);
    const float survival = MaxChannel(scattered) / before;
    if (!(survival > 0)) return;
    if (survival < 1) {
      if (!(rng.Uniform() < survival)) return;
      scattered *= 1 / survival;
    }
    flux = scattered;
    if constexpr (kHasSpectrum) spectra_->Scatter(carried, surface, material, wo, wi);
    ray = {LeavingPoint(surface, wi), wi, HUGE_VALF};
  }
  return;
}

}  // namespace lucerna
