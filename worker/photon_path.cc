#include "worker/photon_path.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <type_traits>
#include <utility>

#include "render/estimate/evidence.h"
#include "render/math/double3.h"
#include "render/math/octahedral.h"
#include "render/math/rng.h"
#include "render/math/sobol.h"
#include "render/tracing/facet_sides.h"
#include "render/transport/material_at.h"
#include "render/transport/subsurface.h"

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

// A photon of more power than 2^16 times the scene's is counted as that: then the counters of 2^20
// photons of the greatest depth fit in 62 bits.
constexpr float kLargestEnergy = 0x1p28F;

// Halves go up: faster than to the even number, and the counters are as exact.
std::int64_t WholeUnits(float energy) {
  return static_cast<std::int64_t>(std::min(kLargestEnergy, energy + 0.5F));
}

template <bool kNormals, bool kDirections>
void KeepColumns(Deposits& deposits, const SurfacePoint& surface, Vec3 wo) {
  if constexpr (kNormals) deposits.normals.push_back(FaceForward(surface.geometric_normal, wo));
  if constexpr (kDirections) deposits.arrivals_oct.push_back(EncodeOctahedral(wo));
}

// What a photon's emission is drawn with, by an even guide: the next number of `rng` is used.
PrimaryNumbers EvenNumbers(const SobolPoint& u, KeyedRng& rng) {
  return {static_cast<double>(u[0]), static_cast<double>(u[1]), static_cast<double>(u[2]),
          static_cast<double>(u[3]), FineChoice(u[4], rng.Uniform())};
}

// Draws the direction of a diffuse scattering by a guide, with its share of probability. Returns
// the factor of the flux; 0 where it leads into the surface.
float GuideScattering(const ScatterGuide& guide, ScatterGuide::Cell cell, const Frame& frame,
                      float wo_z, float u_choice, float u1, float u2, BsdfSample& sample) {
  Vec3 wi = frame.ToWorld(sample.wi);
  if (static_cast<double>(u_choice) < kGuidedScatterings) {
    wi = guide.Draw(cell, u1, u2);
    sample.wi = frame.ToLocal(wi);
  }
  if (!(sample.wi.z * wo_z > 0)) return 0;
  sample.pdf = std::abs(sample.wi.z) * kInversePi;
  return static_cast<float>(guide.FluxFactor(cell, wi, static_cast<double>(sample.pdf)));
}

// Records nothing: for photons that are not replayed.
struct NoWatcher {
  void Emitted(const Emission& /*emission*/) const {}
  void TookWavelength(float /*nm*/) const {}
  void Landed(const Hit& /*hit*/, const SurfacePoint& /*surface*/, const Material& /*material*/,
              Rgb /*arriving*/) const {}
  void ScatteredByMedium(Vec3 /*position*/, std::int32_t /*medium*/, float /*length*/,
                         Rgb /*arriving*/, bool /*leaves_deposit*/) const {}
  void SentOn(Vec3 /*wi*/, Rgb /*scattered*/) const {}
  void Received(Rgb /*landed*/, bool /*gathers*/, bool /*is_indirect*/,
                bool /*leaves_deposit*/) const {}
  void Scattered(const BsdfSample& /*sample*/, float /*wo_z*/, Vec3 /*wi*/,
                 Rgb /*scattered*/) const {}
  void Played(Rgb /*scattered*/, float /*survival*/) const {}
  void Left(Rgb /*flux*/) const {}
};

class HistoryWatcher {
 public:
  explicit HistoryWatcher(PhotonHistory& history) : history_(history) {}

  void Emitted(const Emission& emission) { history_.emission = emission; }
  void TookWavelength(float nm) { history_.wavelength_nm = nm; }
  void Landed(const Hit& hit, const SurfacePoint& surface, const Material& material, Rgb arriving) {
    PhotonLanding& landing = history_.landings.emplace_back();
    landing.surface = surface;
    landing.material_kind = material.kind;
    landing.has_narrow_lobes = HasNarrowLobes(material);
    landing.distance = hit.t;
    landing.arriving = arriving;
  }
  void ScatteredByMedium(Vec3 position, std::int32_t medium, float length, Rgb arriving,
                         bool leaves_deposit) {
    PhotonLanding& landing = history_.landings.emplace_back();
    landing.surface.position = position;
    landing.medium = medium;
    landing.distance = length;
    landing.arriving = arriving;
    Received(arriving, true, true, leaves_deposit);
  }
  void SentOn(Vec3 wi, Rgb scattered) {
    PhotonLanding& landing = history_.landings.back();
    landing.was_scattered = true;
    landing.transmits = true;
    landing.leaving = wi;
    landing.scattered = scattered;
  }
  void Received(Rgb landed, bool gathers, bool is_indirect, bool leaves_deposit) {
    PhotonLanding& landing = history_.landings.back();
    landing.was_received = true;
    landing.landed = landed;
    landing.gathers = gathers;
    landing.is_indirect = is_indirect;
    landing.leaves_deposit = leaves_deposit;
  }
  void Scattered(const BsdfSample& sample, float wo_z, Vec3 wi, Rgb scattered) {
    PhotonLanding& landing = history_.landings.back();
    landing.was_scattered = true;
    landing.transmits = wo_z * sample.wi.z < 0;
    landing.is_smooth = sample.is_delta;
    landing.leaving = wi;
    landing.scattered = scattered;
  }
  void Played(Rgb scattered, float survival) {
    PhotonLanding& landing = history_.landings.back();
    landing.scattered = scattered;
    landing.survival = survival;
  }
  void Left(Rgb flux) {
    PhotonLanding& landing = history_.landings.back();
    landing.went_on = true;
    landing.leaving_flux = flux;
  }

 private:
  PhotonHistory& history_;
};

}  // namespace

PhotonPathTracer::PhotonPathTracer(const Scene& scene, const Intersector& intersector,
                                   const LightSet& lights, const RenderSettings& settings,
                                   const SceneNeeds& needs, const SpectrumTracer* spectra,
                                   const Bounds& region, std::uint64_t photons_per_pass,
                                   const Bounds& media_region, const PhotonGuide* guide)
    : photons_per_pass_(photons_per_pass > 0
                            ? photons_per_pass
                            : static_cast<std::uint64_t>(settings.photons_per_pass)),
      scene_(scene),
      intersector_(intersector),
      lights_(lights),
      settings_(settings),
      spectra_(spectra),
      guide_(guide),
      scatterings_(guide != nullptr ? guide->scatterings().get() : nullptr),
      region_(region),
      media_region_(media_region),
      media_(scene, intersector),
      scale_(FluxScale::ForPower(lights.TotalPower())),
      properties_(PropertiesOf(scene.materials)),
      has_textures_(needs.Uses(Part::kTextures)),
      parts_{needs.Uses(Part::kShadingNormals),
             needs.Uses(Part::kSpecular) || needs.Uses(Part::kGlossy) ||
                 needs.Uses(Part::kCausticHitpoints),
             needs.Uses(Part::kCausticHitpoints), needs.Uses(Part::kMedia),
             needs.Uses(Part::kDispersion)},
      keep_(needs.Uses(Part::kPhotonDirections) ? KeepColumns<true, true>
            : needs.Uses(Part::kPhotonNormals)  ? KeepColumns<true, false>
                                                : KeepColumns<false, false>) {
  const double power = static_cast<double>(Luminance(lights.TotalPower()));
  // At the ends of the float range the scale is held where it is a normal number.
  if (power > 0) {
    energy_per_watt_ =
        static_cast<float>(std::clamp((1 << kEnergyBits) / power, 0x1p-126, 0x1p126));
  }
  if (parts_.media) FindLightMedia();
  ForEachShapeTraits(
      scene, [&](const ShapeTraits& traits) { parts_.alpha = parts_.alpha || !IsWhole(traits); });
}

void PhotonPathTracer::FindLightMedia() {
  const auto at_shape = [&](const ShapeTraits& traits, Vec3 place, Vec3 normal) {
    if (traits.SeparatesMedia()) return traits.medium_outside;
    const float off = kClearance * (MaxAbs(place) + intersector_.bounds().Diagonal());
    return media_.AtLight(place + normal * off, traits.medium_outside);
  };
  const auto at_analytic = [&](const auto& shape) {
    if constexpr (std::decay_t<decltype(shape)>::kIsFlat) {
      return at_shape(shape.traits, shape.center, shape.normal);
    } else {
      const Vec3 up = {0, 0, 1};
      return at_shape(shape.traits, shape.center + up * shape.Reach(), up);
    }
  };
  std::vector<std::optional<std::int32_t>> of_meshes(scene_.meshes.size());
  for (std::uint32_t number = 0; number < lights_.size(); ++number) {
    const Emitter& emitter = lights_.emitter(number);
    std::int32_t medium = kNoMedium;
    switch (emitter.kind) {
      case EmitterKind::kTriangle: {
        const TriangleMesh& mesh = scene_.meshes[emitter.geometry];
        std::optional<std::int32_t>& of_mesh = of_meshes[emitter.geometry];
        if (!of_mesh) {
          const Vec3 a = mesh.positions[mesh.indices[3 * emitter.primitive]];
          const Vec3 b = mesh.positions[mesh.indices[3 * emitter.primitive + 1]];
          const Vec3 c = mesh.positions[mesh.indices[3 * emitter.primitive + 2]];
          of_mesh = at_shape(mesh.traits, (a + b + c) / 3, TriangleNormal(a, b, c));
        }
        medium = *of_mesh;
        break;
      }
#define LUCERNA_CASE(Name, list, name)                    \
  case EmitterKind::k##Name: {                            \
    medium = at_analytic(scene_.list[emitter.primitive]); \
    break;                                                \
  }
        LUCERNA_ANALYTIC_SHAPES(LUCERNA_CASE)
#undef LUCERNA_CASE
#define LUCERNA_CASE(Name, list, name)                                                           \
  case EmitterKind::k##Name:                                                                     \
    medium = Name##Light::kIsAtInfinity ? scene_.list[emitter.primitive].medium                  \
                                        : media_.AtLight(scene_.list[emitter.primitive].Place(), \
                                                         scene_.list[emitter.primitive].medium); \
    break;
        LUCERNA_DELTA_LIGHTS(LUCERNA_CASE)
#undef LUCERNA_CASE
      default:
        break;  // infinite lights are in no medium
    }
    light_media_.push_back(medium);
  }
}

PhotonPathTracer::Flight PhotonPathTracer::Fly(Ray& ray, std::int32_t& medium, KeyedRng& rng,
                                               std::uint64_t& rays) const {
  Flight flight;
  const auto mean = [](Rgb channels) { return (channels.r + channels.g + channels.b) / 3; };
  for (int i = 0; i < kMostInterfaces; ++i) {
    Hit hit;
    ++rays;
    const bool is_met = intersector_.Intersect(ray, hit);
    const float length = is_met ? hit.t : HUGE_VALF;
    if (medium != kNoMedium) {
      const Medium& through = media_[medium];
      if (through.Scatters()) {
        // A free path of one of the channels, weighed as if drawn from all three together (the
        // balance heuristic over channels).
        const Rgb extinction = through.Extinction();
        const int channel = std::min(static_cast<int>(rng.Uniform() * 3), 2);
        const float u = rng.Uniform();
        const float of_channel = extinction[channel];
        const float free_column = of_channel > 0 ? -std::log1p(-u) / of_channel : HUGE_VALF;
        const Medium::Way way = through.Travel(ray.origin, ray.direction, length, free_column);
        const Rgb transmittance = through.Transmittance(way.column);
        if (!way.is_through) {
          // The density there is in both, what is scattered and what the place was drawn by.
          flight.end = Flight::End::kScattered;
          flight.factor *=
              through.scattering * transmittance * (1 / mean(extinction * transmittance));
          flight.position = ray.origin + ray.direction * way.length;
          flight.length += way.length;
          return flight;
        }
        if (const float passed = mean(transmittance); passed > 0)
          flight.factor *= transmittance * (1 / passed);
      } else {
        flight.factor *= media_.TransmittanceOf(medium, ray, length);
      }
    }
    if (!is_met) return flight;
    flight.length += hit.t;
    const SurfacePoint surface = intersector_.SurfaceAt(ray, hit);
    if (!media_.IsInterface(surface)) {
      flight.end = Flight::End::kLanded;
      flight.hit = hit;
      return flight;
    }
    medium = media_.Beyond(surface, ray.direction, medium);
    ray = {LeavingPoint(surface, ray.direction), ray.direction, HUGE_VALF};
  }
  return flight;
}

float PhotonPathTracer::EnergyOf(Rgb flux) const {
  return Luminance(flux) * energy_per_watt_;
}

PhotonPathTracer::Key PhotonPathTracer::KeyOf(std::uint64_t pass, std::uint64_t index) const {
  constexpr std::uint64_t kPhotonKey = 0x50484F544F4E5321ULL;
  // One sequence over all even passes and one over all odd ones: each shares its photons out
  // evenly, and the two halves are independent of each other (see estimate/error_estimate.h). Where
  // passes get more photons, a part of the sequences is skipped and none is used twice.
  return {pass / 2 * photons_per_pass_ + index,
          CombineKeys(CombineKeys(settings_.seed, kPhotonKey), pass % 2)};
}

std::uint64_t PhotonPathTracer::IndexOf(std::uint64_t pass, std::uint64_t first,
                                        std::uint32_t number) const {
  constexpr std::uint64_t kNumbers = (1U << DepositSource::kNumberBits) - 1;
  return first + ((number - KeyOf(pass, first).number) & kNumbers);
}

std::optional<std::array<std::uint16_t, kEmissionDimensions>> PhotonPathTracer::ReportOf(
    std::uint64_t pass, std::uint64_t index) const {
  if (guide_ == nullptr) return std::nullopt;
  const Key key = KeyOf(pass, index);
  constexpr std::uint64_t kReportKey = 0x5245504F52544544ULL;
  const std::uint64_t bits = CombineKeys(key.job_key ^ kReportKey, key.number) >> 32;
  if (bits >= guide_->reported()) return std::nullopt;
  KeyedRng rng(CombineKeys(key.job_key, key.number));
  PrimaryNumbers numbers = EvenNumbers(OwenSobol(key.number, key.job_key), rng);
  guide_->Draw(numbers);
  const double reported = guide_->reported() * ReportFactor(EvenFlux(lights_, numbers));
  if (static_cast<double>(bits) >= reported) return std::nullopt;
  std::array<std::uint16_t, kEmissionDimensions> steps{};
  for (std::size_t d = 0; d < kEmissionDimensions; ++d)
    steps[d] = static_cast<std::uint16_t>(numbers[d] * 0x1p16);
  return steps;
}

void PhotonPathTracer::Trace(std::uint64_t pass, std::uint64_t index, Landed& landed) const {
  const Key key = KeyOf(pass, index);
  const auto name_if_dropped = [&](PhotonEnd end) {
    if (end != PhotonEnd::kNotFinite) return;
    ++landed.dropped;
    if (landed.dropped_photons.size() < kDroppedNamed) landed.dropped_photons.push_back(index);
  };
  if (spectra_ == nullptr) return name_if_dropped(WalkUnseen<false>(key, landed));
  constexpr std::uint64_t kShareKey = 0x4652455155454E43ULL;
  const auto bits =
      static_cast<std::uint32_t>(CombineKeys(key.job_key ^ kShareKey, key.number) >> 32);
  if (static_cast<double>(UnitFloat(bits)) < FrequencyShareInPass(settings_)) {
    return name_if_dropped(WalkUnseen<true>(key, landed));
  }
  name_if_dropped(WalkUnseen<false>(key, landed));
  landed.deposits.traces.resize(landed.deposits.size(), -1.0F);
}

PhotonHistory PhotonPathTracer::Replay(std::uint64_t pass, std::uint64_t index) const {
  PhotonHistory history;
  HistoryWatcher watcher(history);
  Landed landed;
  // A spectrum follows the walk and never changes it; nor does a part that the scene does not have.
  history.end = Walk<true, false>(KeyOf(pass, index),
                                  {true, true, parts_.caustics, parts_.media, parts_.dispersion},
                                  landed, watcher);
  return history;
}

template <bool kSpectrum>
PhotonEnd PhotonPathTracer::WalkUnseen(const Key& key, Landed& landed) const {
  NoWatcher none;
  return has_textures_ ? Walk<true, kSpectrum>(key, parts_, landed, none)
                       : Walk<false, kSpectrum>(key, parts_, landed, none);
}

template <bool kTextures, bool kSpectrum, typename Watcher>
PhotonEnd PhotonPathTracer::Walk(const Key& key, const WalkParts parts, Landed& landed,
                                 Watcher& watcher) const {
  const SobolPoint u = OwenSobol(key.number, key.job_key);
  KeyedRng rng(CombineKeys(key.job_key, key.number));

  if (lights_.empty()) return PhotonEnd::kNotEmitted;
  Emission emission;
  PrimaryNumbers numbers = EvenNumbers(u, rng);
  float weight = 1;
  // The densities of guides are in part those that photons have without a guide: of the photons
  // drawn here, those of that part have this share, and are distributed as all would be.
  double unguided_share = 1;
  bool is_unguided = true;
  bool is_reportable = true;
  const auto mark = [&](double flux_factor) {
    constexpr std::uint64_t kPartKey = 0x554E475549444544ULL;
    const std::uint64_t bits = CombineKeys(key.job_key ^ kPartKey, key.number);
    is_unguided = static_cast<double>(bits >> 32) < unguided_share * flux_factor * 0x1p32;
    const double reportable = guide_->ReportableShare(flux_factor);
    is_reportable = static_cast<double>(bits & UINT32_MAX) < reportable * 0x1p32;
  };
  if (guide_ != nullptr && (!guide_->is_even() || scatterings_ != nullptr)) {
    const double factor = guide_->Draw(numbers);
    weight = static_cast<float>(factor);
    unguided_share = guide_->UnguidedShare(factor);
    mark(/*flux_factor=*/1);
  }
  const auto single = [](double number) {
    return std::min(static_cast<float>(number), 0x1.fffffep-1F);
  };
  const bool is_emitted = lights_.SampleEmission(numbers[4], single(numbers[0]), single(numbers[1]),
                                                 single(numbers[2]), single(numbers[3]), emission);
  emission.flux *= weight;
  const std::uint8_t light = lights_.emitter(emission.emitter).light;
  if (is_unguided) ++landed.sent[light];
  if (!is_emitted) return PhotonEnd::kNotEmitted;
  bool met_smooth_only = true;
  const auto source_of = [&](PathClass path) {
    constexpr std::uint32_t kNumbers = (1U << DepositSource::kNumberBits) - 1;
    return DepositSource{static_cast<std::uint32_t>(key.number) & kNumbers, light, path,
                         is_unguided, is_reportable}
        .Packed();
  };
  watcher.Emitted(emission);
  Ray ray = emission.ray;
  Rgb flux = emission.flux;
  if (!IsFinite(flux)) return PhotonEnd::kNotFinite;
  EnergyCounters& energy = landed.energy;
  std::int64_t carried = WholeUnits(EnergyOf(flux));
  energy.emitted += carried;
  // What the photon has more before than after goes to an account.
  const auto book = [&](float after, std::int64_t& account) {
    const std::int64_t units = WholeUnits(after);
    account += carried - units;
    carried = units;
  };
  // As with a roulette, some photons get more energy and others less.
  const auto rebook = [&](float after) {
    const std::int64_t units = WholeUnits(after);
    (units > carried ? energy.roulette_gain : energy.roulette_loss) += std::abs(units - carried);
    carried = units;
  };
  const auto end = [&](PhotonEnd why, std::int64_t& account) {
    account += carried;
    return why;
  };
  // Russian roulette: survives with the share of flux that is left, and then has the flux it came
  // with. How the walk ends, if it does.
  const auto play = [&](float before, Rgb& scattered) -> std::optional<PhotonEnd> {
    const float survival = MaxChannel(scattered) / before;
    watcher.Played(scattered, survival);
    if (!(survival > 0)) return end(PhotonEnd::kAbsorbed, energy.absorbed);
    if (survival < 1) {
      if (!(rng.Uniform() < survival)) return end(PhotonEnd::kRoulette, energy.roulette_loss);
      const float heavier_by = 1 / survival;
      const float left = EnergyOf(scattered);
      scattered *= heavier_by;
      const std::int64_t heavier = WholeUnits(left * heavier_by);
      energy.roulette_gain += heavier - carried;
      carried = heavier;
    }
    watcher.Left(scattered);
    return std::nullopt;
  };
  [[maybe_unused]] SpectrumTracer::Carried spectrum;
  if constexpr (kSpectrum) spectrum = spectra_->Leave(emission);
  // A photon that a medium has scattered, or that went below a surface, has no spectrum any more.
  [[maybe_unused]] bool has_spectrum = true;
  PathWavelength wavelength;
  if (parts.dispersion) {
    constexpr std::uint64_t kWavelengthKey = 0x574156454C454E47ULL;
    wavelength = PathWavelength(
        KeyedRng(CombineKeys(key.job_key ^ kWavelengthKey, key.number)).Uniform(), scene_.uplift);
  }
  std::int32_t medium = parts.media ? light_media_[emission.emitter] : kNoMedium;
  FacetSides sides;
  for (int landing = 0; landing < settings_.max_depth; ++landing) {
    Hit hit;
    bool is_met = false;
    Rgb before_flight = flux;
    if (parts.media) {
      const Flight flight = Fly(ray, medium, rng, landed.rays);
      flux *= flight.factor;
      if (!IsFinite(flux)) return end(PhotonEnd::kNotFinite, energy.dropped);
      book(EnergyOf(flux), energy.absorbed);
      if (IsBlack(flux)) return end(PhotonEnd::kAbsorbed, energy.absorbed);
      if (flight.end == Flight::End::kScattered) {
        if (sides.is_behind()) return end(PhotonEnd::kSmoothing, energy.smoothing);
        if (!IsFinite(flight.position)) return end(PhotonEnd::kNotFinite, energy.dropped);
        if (landing == 0 && !lights_.Lights(emission.emitter, flight.position))
          return end(PhotonEnd::kAbsorbed, energy.absorbed);
        const bool has_room = scale_.HasRoomFor(flux);
        if (!has_room) ++landed.excess;
        watcher.ScatteredByMedium(flight.position, medium, flight.length, flux, has_room);
        const auto deposit_key = static_cast<std::uint32_t>(rng.Bits() >> 32);
        if (has_room && Inside(media_region_, flight.position)) {
          landed.scattered.rows.push_back(
              {flight.position, flux, deposit_key,
               source_of(met_smooth_only ? PathClass::kCaustic : PathClass::kOther)});
          landed.scattered.arrivals_oct.push_back(EncodeOctahedral(-ray.direction));
        }
        met_smooth_only = false;
        has_spectrum = false;
        if (landing + 1 == settings_.max_depth) break;
        const float u1 = rng.Uniform();
        const Vec3 wi = SamplePhase(ray.direction, media_[medium].g, u1, rng.Uniform());
        watcher.SentOn(wi, flux);
        const std::optional<PhotonEnd> over = play(MaxChannel(before_flight), flux);
        if (over) return *over;
        ray = {flight.position, wi, HUGE_VALF};
        continue;
      }
      is_met = flight.end == Flight::End::kLanded;
      hit = flight.hit;
    } else {
      ++landed.rays;
      is_met = intersector_.Intersect(ray, hit);
    }
    if (!is_met) {
      if (sides.is_behind()) return end(PhotonEnd::kSmoothing, energy.smoothing);
      // A ray that is not a number meets nothing either.
      if (IsFinite(ray.origin) && IsFinite(ray.direction)) {
        return end(PhotonEnd::kEscaped, energy.escaped);
      }
      return end(PhotonEnd::kNotFinite, energy.dropped);
    }
    [[maybe_unused]] const float after_flight = parts.media ? MaxChannel(flux) : 1;
    SurfacePoint surface = intersector_.SurfaceAt(ray, hit);
    Vec3 wo = -ray.direction;
    // Of a mix those of all its materials: which one this photon meets says nothing of the
    // hitpoints nearby.
    const MaterialProperties& properties = properties_[surface.material];
    [[maybe_unused]] std::optional<Material> textured;
    const Material& material = [&]() -> const Material& {
      if constexpr (kTextures) return MaterialAt(scene_, surface, wo, textured, wavelength);
      return scene_.materials[surface.material];
    }();
    if (parts.dispersion && wavelength.IsFirstUsedAt(material)) {
      flux *= wavelength.color();
      rebook(EnergyOf(flux));
      watcher.TookWavelength(wavelength.nm());
    }
    watcher.Landed(hit, surface, material, flux);
    if (landing == 0 && !lights_.Lights(emission.emitter, surface.position))
      return end(PhotonEnd::kAbsorbed, energy.absorbed);
    if (parts.shading_normals && !sides.MayMeet(surface, material))
      return end(PhotonEnd::kSmoothing, energy.smoothing);
    bool is_smoothed = parts.shading_normals && surface.has_shading_normal;
    if (is_smoothed) {
      const float shading = Dot(wo, surface.shading_normal);
      const float geometric = Dot(wo, surface.geometric_normal);
      // Below the smoothed surface's horizon: that surface would not have been met here.
      if (!(shading * geometric > 0) && !GoesOnByReflectionAlone(material))
        return end(PhotonEnd::kSmoothing, energy.smoothing);
      flux *= CosineRatio(shading, geometric);
    }
    if (!IsFinite(flux) || !IsFinite(surface.position)) {
      return end(PhotonEnd::kNotFinite, energy.dropped);
    }
    if (is_smoothed) book(EnergyOf(flux), energy.smoothing);
    const bool gathers = landing > 0 && properties.gathers;
    bool gathers_caustic = false;
    if (parts.caustics) {
      gathers_caustic =
          met_smooth_only && landing > 0 && properties.gathers_caustics() && !sides.is_behind();
    }
    // Of what falls on a surface that lets rays through, deposits are what did not pass; eye paths
    // that find it lack their share already.
    Rgb received = flux;
    if (parts.alpha && (gathers || gathers_caustic)) received *= 1 / AlphaAt(scene_, surface);
    const bool leaves_deposit = (gathers || gathers_caustic) && scale_.HasRoomFor(received);
    if ((gathers || gathers_caustic) && !leaves_deposit) ++landed.excess;
    const bool is_kept = leaves_deposit && Inside(region_, surface.position);
    const bool is_found = is_kept && gathers;
    watcher.Received(flux, properties.gathers || gathers_caustic, landing > 0, leaves_deposit);
    if (parts.caustics) {
      if (is_kept && gathers_caustic) {
        // A key that is not drawn: the rest of the walk is that of a job without such hitpoints.
        constexpr std::uint64_t kCausticKey = 0x434155535449434BULL;
        const auto caustic_key =
            static_cast<std::uint32_t>(CombineKeys(key.job_key ^ kCausticKey, key.number) >> 32);
        landed.caustics.rows.push_back(
            {surface.position, received, caustic_key, source_of(PathClass::kCaustic)});
        KeepColumns<true, true>(landed.caustics, surface, wo);
        landed.caustics.emission_densities.push_back(emission.density);
      }
    }
    if constexpr (kSpectrum) {
      // A surface that scatters light broadly blurs the shadows on it: after a leg of length d at
      // most 4/d² of any detail is left, of none at all 3/d² (see LeaveDiffuse).
      const bool shadows_count = is_found || properties.has_narrow_lobes();
      spectra_->Fly(
          spectrum, ray, hit.t,
          shadows_count ? SpectrumTracer::Shadows::kFound : SpectrumTracer::Shadows::kLeftOut);
    }
    if (gathers) {
      // Drawn wherever it lands: the walk must not depend on where hitpoints are, or nobody could
      // replay it without them.
      const auto deposit_key = static_cast<std::uint32_t>(rng.Bits() >> 32);
      if (is_found) {
        Rgb deposited = received;
        if (properties.weighs_photons) {
          deposited *= PhotonFactor(material, ShadingFrame(surface).ToLocal(wo));
        }
        landed.deposits.rows.push_back(
            {surface.position, deposited, deposit_key,
             source_of(met_smooth_only ? PathClass::kCaustic : PathClass::kOther)});
        keep_(landed.deposits, surface, wo);
        if constexpr (kSpectrum) {
          landed.deposits.traces.push_back(
              has_spectrum ? spectra_->Received(spectrum, surface, material, wo) : -1.0F);
        }
      }
    }
    if (landing + 1 == settings_.max_depth) break;

    float u_lobe = u[7];
    float u1 = u[5];
    float u2 = u[6];
    if (landing > 0) {
      u_lobe = rng.Uniform();
      u1 = rng.Uniform();
      u2 = rng.Uniform();
    }
    Frame frame = ShadingFrame(surface);
    BsdfSample sample;
    const Vec3 wo_local = frame.ToLocal(wo);
    const bool is_scattered = [&] {
      if (parts.lobes) {
        return SampleBsdf(material, wo_local, u_lobe, u1, u2, Carried::kFlux, sample);
      }
      return SampleDiffuse(material, wo_local, u1, u2, sample);
    }();
    if (!is_scattered) return end(PhotonEnd::kAbsorbed, energy.absorbed);
    met_smooth_only = met_smooth_only && sample.is_delta;
    float guided = 1;
    if (scatterings_ != nullptr && landing == 0 && material.kind == Material::Kind::kDiffuse) {
      const ScatterGuide::Cell cell = scatterings_->CellAt(surface.position);
      if (cell != ScatterGuide::kNoCell) {
        guided = GuideScattering(*scatterings_, cell, frame, wo_local.z, u_lobe, u1, u2, sample);
        if (!(guided > 0)) return end(PhotonEnd::kRoulette, energy.roulette_loss);
        mark(static_cast<double>(guided));
      }
    }
    Rgb scattered = flux * sample.weight;
    if (sample.part == Parts::kSecond && material.ScattersBelow()) {
      const float u_axis = rng.Uniform();
      const float u_radius = rng.Uniform();
      const float u_turn = rng.Uniform();
      LeftBelow left;
      int rays = 0;
      const bool has_left = SampleBelow(scene_, intersector_, material, surface, wo, u_axis,
                                        u_radius, u_turn, rng.Uniform(), left, rays);
      landed.rays += static_cast<std::uint64_t>(rays);
      if (!has_left) return end(PhotonEnd::kAbsorbed, energy.absorbed);
      scattered *= left.weight;
      surface = left.surface;
      wo = left.up;
      frame = ShadingFrame(surface);
      is_smoothed = parts.shading_normals && surface.has_shading_normal;
      // Light from far around it comes out at a point.
      has_spectrum = false;
    }
    const Vec3 wi = frame.ToWorld(sample.wi);
    watcher.Scattered(sample, wo_local.z, wi, scattered);
    if (!IsFinite(scattered)) return end(PhotonEnd::kNotFinite, energy.dropped);
    book(EnergyOf(scattered), energy.absorbed);
    if (is_smoothed) {
      const float geometric = Dot(wi, surface.geometric_normal);
      const bool transmits = Dot(wo, frame.n) * sample.wi.z < 0;
      if (!sides.Scatter(surface, material, wo, wi, transmits))
        return end(PhotonEnd::kSmoothing, energy.smoothing);
      scattered *= 1 / std::max(CosineRatio(sample.wi.z, geometric), 1 / kMaxCosineRatio);
      book(EnergyOf(scattered), energy.smoothing);
    }
    // What media took on the way counts as lost here.
    const float before = parts.media ? MaxChannel(flux) * (MaxChannel(before_flight) / after_flight)
                                     : MaxChannel(flux);
    if (const std::optional<PhotonEnd> over = play(before, scattered)) return *over;
    flux = scattered;
    if (guided != 1) {
      flux *= guided;
      rebook(EnergyOf(flux));
      watcher.Left(flux);
    }
    if constexpr (kSpectrum) spectra_->Scatter(spectrum, surface, material, wo, wi, sample.part);
    if (parts.media) medium = media_.After(surface, wo, wi, medium);
    ray = {LeavingPoint(surface, wi), wi, HUGE_VALF};
  }
  return end(PhotonEnd::kDepth, energy.cut_off);
}

}  // namespace lucerna
