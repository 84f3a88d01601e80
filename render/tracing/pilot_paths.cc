#include "render/tracing/pilot_paths.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "render/math/rng.h"
#include "render/math/warp.h"
#include "render/tracing/direct_light.h"
#include "render/transport/bsdf.h"
#include "render/transport/material_at.h"

namespace lucerna {
namespace {

// Paths are traced so many at a time, until there are enough reports of them.
constexpr std::uint64_t kPathsAtOnce = 1024;
constexpr std::uint64_t kMostPaths = 16384;
constexpr std::size_t kEnoughReports = 2048;
// So many take 6 MB.
constexpr std::size_t kMostPilotReports = std::size_t{1} << 16;
// Weaker paths, over their weight at first, end by roulette, and all after so many vertices: what
// is scattered more often adds little that others have not found.
constexpr float kRouletteShare = 0.5F;
constexpr int kMostVertices = 16;

constexpr std::uint64_t kPilotKey = 0x50494C4F54532121ULL;

class PilotPath {
 public:
  PilotPath(const EyePathTracer& tracer, bool is_direct_sampled, KeyedRng rng)
      : tracer_(tracer),
        scene_(tracer.scene()),
        intersector_(tracer.intersector()),
        lights_(tracer.lights()),
        is_direct_sampled_(is_direct_sampled),
        rng_(rng) {}

  // From a hitpoint of the pixel.
  void Trace(const EyeHitpoint& hitpoint, std::uint32_t pixel, std::vector<PilotReport>& reports) {
    pixel_ = pixel;
    reports_ = &reports;
    SurfacePoint surface;
    surface.position = hitpoint.position;
    surface.geometric_normal = hitpoint.normal;
    surface.clearance = kClearance * (MaxAbs(hitpoint.position) + intersector_.bounds().Diagonal());
    const float u1 = rng_.Uniform();
    const float u2 = rng_.Uniform();
    Vec3 wi = Frame(hitpoint.normal).ToWorld(SquareToCosineHemisphere(u1, u2));
    // Drawn with the density cosθ/π. A glossy hitpoint's weight lacks the BSDF, of about 1/π.
    Rgb weight = hitpoint.weight * (hitpoint.is_glossy ? 1.0F : kPi);
    const float first_strength = MaxChannel(weight);
    float scatter_pdf = 0;
    LitPoint scatter_point = {surface.position};
    // The photon's last landing is at the hitpoint, where it is not scattered.
    const int most = std::min(kMostVertices, tracer_.settings().max_depth - 1);
    for (int vertex = 0;; ++vertex) {
      const Ray ray = {LeavingPoint(surface, wi), wi, HUGE_VALF};
      const LitPoint from = scatter_point;
      // Light that comes straight to the hitpoint needs no photons.
      const bool counts = vertex > 0 || !is_direct_sampled_;
      Hit hit;
      if (!intersector_.Intersect(ray, hit)) {
        if (!counts) return;
        const float mis =
            scatter_pdf > 0 ? PowerHeuristic(scatter_pdf, lights_.PdfDirectInfinite(from, wi)) : 1;
        Report(lights_.InfiniteEmitter(from.position, wi), {ray.origin, -wi, HUGE_VALF},
               weight * lights_.InfiniteRadiance(from.position, wi) * mis);
        return;
      }
      surface = intersector_.SurfaceAt(ray, hit);
      const Vec3 wo = -wi;
      const Rgb emitted = lights_.EmittedRadiance(surface, wo);
      if (counts && !IsBlack(emitted)) {
        const float mis =
            scatter_pdf > 0 ? PowerHeuristic(scatter_pdf, lights_.PdfDirect(from, surface)) : 1;
        Report(lights_.EmitterAt(surface), {surface.position, wo, HUGE_VALF},
               weight * emitted * mis);
      }
      if (vertex >= most) return;
      std::optional<Material> storage;
      const Material& material = MaterialAt(scene_, surface, wo, storage);
      const Frame frame = ShadingFrame(surface);
      const Vec3 wo_local = frame.ToLocal(wo);
      scattering_ = {surface.position, wo, 0};
      if (material.kind == Material::Kind::kDiffuse)
        scattering_.density = std::abs(wo_local.z) * kInversePi;
      AddLight(surface, material, frame, wo, weight);
      BsdfSample sample;
      const float u_lobe = rng_.Uniform();
      const float v1 = rng_.Uniform();
      const float v2 = rng_.Uniform();
      if (!SampleBsdf(material, wo_local, u_lobe, v1, v2, Carried::kRadiance, sample)) return;
      wi = frame.ToWorld(sample.wi);
      const bool transmits = sample.wi.z * Dot(frame.n, wo) < 0;
      if (!SidesAgree(surface, wo, wi, transmits)) return;
      weight *= sample.weight;
      scatter_pdf = sample.is_delta ? 0 : sample.pdf;
      scatter_point = LitPointOf(surface, material, wo);
      const float strength = MaxChannel(weight) / first_strength;
      if (!(strength > 0)) return;
      if (strength < kRouletteShare) {
        const float survival = strength / kRouletteShare;
        if (!(rng_.Uniform() < survival)) return;
        weight *= 1 / survival;
      }
    }
  }

 private:
  // Light drawn from the lights.
  void AddLight(const SurfacePoint& surface, const Material& material, const Frame& frame, Vec3 wo,
                Rgb weight) {
    LightSample light;
    const float u_choice = rng_.Uniform();
    const float u_fine = rng_.Uniform();
    const float u1 = rng_.Uniform();
    const float u2 = rng_.Uniform();
    if (!lights_.SampleDirect(LitPointOf(surface, material, wo), FineChoice(u_choice, u_fine), u1,
                              u2, light))
      return;
    const Vec3 wo_local = frame.ToLocal(wo);
    const Vec3 wi_local = frame.ToLocal(light.wi);
    const Rgb bsdf = EvaluateBsdf(material, wo_local, wi_local, Carried::kRadiance);
    if (IsBlack(bsdf)) return;
    Rgb brought = weight * bsdf * light.radiance_over_pdf * std::abs(wi_local.z);
    if (light.pdf > 0) brought *= PowerHeuristic(light.pdf, PdfBsdf(material, wo_local, wi_local));
    if (!SidesAgree(surface, wo, light.wi, wo_local.z * wi_local.z < 0)) return;
    const Ray shadow = ShadowRay(surface, light);
    if (intersector_.Occluded(shadow)) return;
    Report(light.emitter, {light.is_distant ? shadow.origin : light.target, -light.wi, HUGE_VALF},
           brought);
  }

  // `photon`: as it leaves the light.
  void Report(std::optional<std::uint32_t> emitter, const Ray& photon, Rgb brought) {
    const auto luminance = static_cast<double>(Luminance(brought));
    if (!emitter || !(luminance > 0) || !std::isfinite(luminance)) return;
    const auto numbers = lights_.NumbersOf(*emitter, photon, rng_);
    if (numbers) reports_->push_back({*numbers, pixel_, luminance, scattering_});
  }

  const EyePathTracer& tracer_;
  const Scene& scene_;
  const Intersector& intersector_;
  const LightSet& lights_;
  const bool is_direct_sampled_;
  KeyedRng rng_;
  std::uint32_t pixel_ = 0;
  FirstScattering scattering_;  // of a photon that arrives where the path is now
  std::vector<PilotReport>* reports_ = nullptr;
};

}  // namespace

PilotReports TracePilotPaths(const EyePathTracer& tracer, const SceneNeeds& needs,
                             ThreadTeam& team) {
  PilotReports all;
  if (needs.Uses(Part::kMedia)) return all;
  while (all.paths < kMostPaths && all.reports.size() < kEnoughReports)
    AddPilotPaths(tracer, needs, all.paths + 1, team, all);
  return all;
}

void AddPilotPaths(const EyePathTracer& tracer, const SceneNeeds& needs, std::uint64_t paths,
                   ThreadTeam& team, PilotReports& all) {
  const bool is_direct_sampled = needs.Uses(Part::kDirectSampling);
  const RenderSettings& settings = tracer.settings();
  const auto width = static_cast<std::uint64_t>(settings.crop_width());
  const std::uint64_t pixels = width * static_cast<std::uint64_t>(settings.crop_height());
  while (all.paths < paths && all.reports.size() < kMostPilotReports) {
    std::vector<std::vector<PilotReport>> of_paths(kPathsAtOnce);
    team.For(kPathsAtOnce, 32, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        // Each path in a piece of the image of its own.
        KeyedRng rng(CombineKeys(CombineKeys(settings.seed, kPilotKey), all.paths + i));
        const double place = (static_cast<double>(i) + static_cast<double>(rng.Uniform())) /
                             static_cast<double>(kPathsAtOnce) * static_cast<double>(pixels);
        const std::uint64_t pixel = std::min(static_cast<std::uint64_t>(place), pixels - 1);
        const EyePath path = tracer.Trace(static_cast<int>(pixel % width),
                                          static_cast<int>(pixel / width), /*pass=*/0, {});
        if (IsBlack(path.hitpoint.weight)) continue;
        PilotPath(tracer, is_direct_sampled, rng)
            .Trace(path.hitpoint, static_cast<std::uint32_t>(pixel), of_paths[i]);
      }
    });
    all.paths += kPathsAtOnce;
    for (const std::vector<PilotReport>& of_path : of_paths)
      all.reports.insert(all.reports.end(), of_path.begin(), of_path.end());
  }
}

}  // namespace lucerna
