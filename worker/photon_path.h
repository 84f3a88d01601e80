// Where does one photon land?
//
// A photon leaves a light, scatters, and leaves a deposit wherever it lands on a surface that
// gathers, except at its first landing: that light is direct, and sampled at the coordinator.
// Russian roulette keeps its flux near that of its emission, so that the density of photons, not
// their flux, carries the signal.
//
// What becomes of a photon's power is counted at every change, and a photon that is not finite any
// more is given up and named, so that it can be replayed: the walk of a photon is a function of
// scene, settings, pass and index alone.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "render/analysis/needs.h"
#include "render/estimate/accumulation.h"
#include "render/estimate/emission_report.h"
#include "render/geometry/intersector.h"
#include "render/math/fixed_point.h"
#include "render/math/rgb.h"
#include "render/math/rng.h"
#include "render/math/vector.h"
#include "render/scene/render_settings.h"
#include "render/scene/scene.h"
#include "render/transport/bsdf.h"
#include "render/transport/light.h"
#include "render/transport/media.h"
#include "render/transport/photon_guide.h"
#include "worker/photon_spectrum.h"

namespace lucerna {

// Which photon left a deposit, of which light, and what its path had met before.
struct DepositSource {
  // So many consecutive photons of a pass have different numbers.
  static constexpr int kNumberBits = 20;

  std::uint32_t number = 0;  // the lowest bits of what numbers the photon
  std::uint8_t light = 0;    // index into LightSet::lights()
  PathClass path = PathClass::kOther;
  // Whether it is one of those that stand for all photons drawn without a guide.
  bool is_unguided = true;
  bool is_reportable = true;  // where the guide asks for reports (PhotonGuide::ReportableShare)

  [[nodiscard]] std::uint32_t Packed() const {
    return static_cast<std::uint32_t>(is_unguided) << 31U |
           static_cast<std::uint32_t>(is_reportable) << 30U | number << 7U |
           static_cast<std::uint32_t>(light) << 1U | static_cast<std::uint32_t>(path);
  }
  [[nodiscard]] static DepositSource Unpacked(std::uint32_t bits) {
    return {bits >> 7U & ((1U << kNumberBits) - 1),
            static_cast<std::uint8_t>(bits >> 1U & (kMaxLightGroups - 1)),
            static_cast<PathClass>(bits & 1U), bits >> 31U != 0, (bits >> 30U & 1U) != 0};
  }
};
static_assert(kMaxLightGroups == 64 && kMaxLightTallies == kMaxLightGroups);

// One photon landing on one surface.
struct Deposit {
  Vec3 position;
  Rgb flux;                  // [W] of all photons of a pass together
  std::uint32_t key;         // random bits that belong to this deposit
  std::uint32_t source = 0;  // a DepositSource, packed
};

// Deposits as columns, of which a job has those that it needs.
struct Deposits {
  std::vector<Deposit> rows;
  // Each [rows] or empty.
  std::vector<Vec3> normals;                // geometric, on the side that the photon came from
  std::vector<std::uint32_t> arrivals_oct;  // directions back to where it came from, octahedral
  // Spectral traces [1/length²], below 0 for photons without a spectrum.
  std::vector<float> traces;
  // See Emission::density; of caustic photons only.
  std::vector<float> emission_densities;

  [[nodiscard]] std::size_t size() const { return rows.size(); }
};

// Why a photon's walk is over.
enum class PhotonEnd : std::uint8_t {
  kNotEmitted,  // its numbers fell where the light sends nothing
  kEscaped,     // met nothing
  kAbsorbed,
  kSmoothing,  // came or left below the horizon of the smoothed surface
  kRoulette,
  kDepth,
  kNotFinite,
};

// One landing of a replayed photon, or a scattering by a medium. What lies behind the end of its
// walk is not set.
struct PhotonLanding {
  SurfacePoint surface;             // of a scattering by a medium, its position alone
  std::int32_t medium = kNoMedium;  // that scattered it
  Material::Kind material_kind = Material::Kind::kDiffuse;
  bool has_narrow_lobes = false;  // the material
  float distance = 0;             // flown [scene units]
  Rgb arriving;                   // flux [W]
  Rgb landed;                     // the same after the ratio of cosines of shading normals
  bool was_received = false;      // not below the horizon, and finite
  bool gathers = false;           // the material
  bool is_indirect = false;       // not the first landing
  bool leaves_deposit = false;
  bool was_scattered = false;
  bool transmits = false;
  bool is_smooth = false;  // scattered into a single direction
  Vec3 leaving;            // direction
  Rgb scattered;           // flux, before the roulette
  float survival = 0;      // probability; 1 and above: no roulette
  bool went_on = false;
  Rgb leaving_flux;  // after the roulette, and times a guide's factor
};

// All that a photon did.
struct PhotonHistory {
  Emission emission;        // meaningless when it was not emitted
  float wavelength_nm = 0;  // of one that met glass that disperses
  std::vector<PhotonLanding> landings;
  PhotonEnd end = PhotonEnd::kNotEmitted;
};

class PhotonPathTracer {
 public:
  // Keeps references to all but `needs`. Deposits outside `region` are not kept.
  // `spectra`: for jobs with frequency photons, else nullptr. `media_region` is for photons that
  // media scattered. `photons_per_pass`: of the passes to
  // be traced; 0: as `settings` have it. Photons are drawn by `guide`; nullptr: evenly.
  PhotonPathTracer(const Scene& scene, const Intersector& intersector, const LightSet& lights,
                   const RenderSettings& settings, const SceneNeeds& needs,
                   const SpectrumTracer* spectra, const Bounds& region,
                   std::uint64_t photons_per_pass = 0, const Bounds& media_region = {},
                   const PhotonGuide* guide = nullptr);

  // What the photons of a range left.
  struct Landed {
    Deposits deposits;
    // Photons that have met only smooth surfaces, on surfaces where eye paths go on.
    Deposits caustics;
    // Photons where media scattered them, with the flux that was scattered.
    Deposits scattered;
    std::uint64_t rays = 0;
    // Photons given up because a number was not finite, and the first kDroppedNamed of them by
    // index, when photons are traced in order of their indices.
    std::uint64_t dropped = 0;
    std::vector<std::uint64_t> dropped_photons;
    // Landings of photons that are too bright to be a deposit (FluxScale::HasRoomFor).
    std::uint64_t excess = 0;
    EnergyCounters energy;
    // Photons by light, of those that stand for photons drawn without a guide.
    std::array<std::uint64_t, kMaxLightGroups> sent{};
  };

  // Traces photon `index` of `pass`. Threads: any, each with its own `landed`.
  void Trace(std::uint64_t pass, std::uint64_t index, Landed& landed) const;

  // What Trace does with that photon, step by step. Threads: any.
  [[nodiscard]] PhotonHistory Replay(std::uint64_t pass, std::uint64_t index) const;

  // The index of the photon of `pass` that `number` names (DepositSource), of those from `first`
  // on.
  [[nodiscard]] std::uint64_t IndexOf(std::uint64_t pass, std::uint64_t first,
                                      std::uint32_t number) const;
  // The numbers of a photon's emission, times 2^16, where the guide asks for a report of it if it
  // is found.
  [[nodiscard]] std::optional<std::array<std::uint16_t, kEmissionDimensions>> ReportOf(
      std::uint64_t pass, std::uint64_t index) const;

 private:
  // What names a photon's random numbers.
  struct Key {
    std::uint64_t number = 0;
    std::uint64_t job_key = 0;
  };
  [[nodiscard]] Key KeyOf(std::uint64_t pass, std::uint64_t index) const;
  // What the walks of a job may meet, tested at run time: none of these gains 3 % alone when walks
  // are compiled without it. Textures and spectra are parameters of the template (docs/lean.md).
  struct WalkParts {
    bool shading_normals = false;
    bool lobes = false;     // other scattering than diffuse
    bool caustics = false;  // deposits for hitpoints of caustic photons
    bool media = false;
    bool dispersion = false;
    bool alpha = false;  // some shapes let rays through
  };
  // What becomes of a photon on its way to the next surface that is no interface.
  struct Flight {
    enum class End : std::uint8_t { kLanded, kScattered, kNothingMet };
    End end = End::kNothingMet;
    Hit hit;           // kLanded
    Vec3 position;     // kScattered
    float length = 0;  // [scene units]
    // Of the flux: what is left, per channel, over the probability of this end.
    Rgb factor = Gray(1);
  };
  [[nodiscard]] Flight Fly(Ray& ray, std::int32_t& medium, KeyedRng& rng,
                           std::uint64_t& rays) const;
  // The media where the lights are.
  void FindLightMedia();
  // The walk of one photon; with a watcher only for a replay.
  template <bool kTextures, bool kSpectrum, typename Watcher>
  PhotonEnd Walk(const Key& key, WalkParts parts, Landed& landed, Watcher& watcher) const;
  // The walk without a watcher that suits the job.
  template <bool kSpectrum>
  PhotonEnd WalkUnseen(const Key& key, Landed& landed) const;
  // In units of EnergyCounters.
  [[nodiscard]] float EnergyOf(Rgb flux) const;

  const std::uint64_t photons_per_pass_;
  const Scene& scene_;
  const Intersector& intersector_;
  const LightSet& lights_;
  const RenderSettings& settings_;
  const SpectrumTracer* spectra_;    // nullptr: no frequency photons
  const PhotonGuide* guide_;         // nullptr: an even one
  const ScatterGuide* scatterings_;  // nullptr: directions are drawn by BSDFs alone
  Bounds region_;
  Bounds media_region_;
  const Media media_;
  std::vector<std::int32_t> light_media_;  // [emitters], or empty: there are no media
  FluxScale scale_;
  float energy_per_watt_ = 1;
  std::vector<MaterialProperties> properties_;  // [materials]
  bool has_textures_;
  WalkParts parts_;
  // Adds to the columns that the job has beside those of every job.
  using KeepFunction = void (*)(Deposits& deposits, const SurfacePoint& surface, Vec3 wo);
  KeepFunction keep_;
};

}  // namespace lucerna
