// Where does one photon land?
//
// A photon leaves a light, scatters, and leaves a deposit wherever it lands on a surface that
// gathers, except at its first landing: that light is direct, and sampled at the coordinator.
// Russian roulette keeps its flux near that of its emission, so that the density of photons, not
// their flux, carries the signal.
#pragma once

#include <cstdint>
#include <vector>

#include "render/geometry/intersector.h"
#include "render/math/rgb.h"
#include "render/math/vector.h"
#include "render/scene/render_settings.h"
#include "render/scene/scene.h"
#include "render/transport/bsdf.h"
#include "render/transport/light.h"
#include "worker/photon_spectrum.h"

namespace lucerna {

// One photon landing on one surface.
struct Deposit {
  Vec3 position;
  Rgb flux;                   // [W] of all photons of a pass together
  Vec3 normal;                // geometric, on the side that the photon came from
  std::uint32_t arrival_oct;  // direction back to where it came from, octahedral
  std::uint32_t key;          // random bits that belong to this deposit
};

class PhotonPathTracer {
 public:
  // Keeps references to all. Deposits outside `region` are not kept.
  // `spectra`: for jobs with frequency photons, else nullptr.
  PhotonPathTracer(const Scene& scene, const Intersector& intersector, const LightSet& lights,
                   const RenderSettings& settings, const SpectrumTracer* spectra,
                   const Bounds& region);

  // What the photons of a range left.
  struct Landed {
    std::vector<Deposit> deposits;
    // [deposits] the spectral trace of each [1/length²], below 0 for photons without a spectrum;
    // empty unless the job traces frequency photons.
    std::vector<float> traces;
    std::uint64_t rays = 0;
    // Photons given up because a number was not finite.
    std::uint64_t dropped = 0;
  };

  // Traces photon `index` of `pass`. Threads: any, each with its own `landed`.
  void Trace(std::uint64_t pass, std::uint64_t index, Landed& landed) const;

 private:
  // The walk of one photon; with a spectrum only where the job and the photon have one, so that
  // other photons pay nothing for it.
  template <bool kHasSpectrum>
  void Walk(std::uint64_t number, std::uint64_t job_key, Landed& landed) const;

  const Scene& scene_;
  const Intersector& intersector_;
  const LightSet& lights_;
  const RenderSettings& settings_;
  const SpectrumTracer* spectra_;  // nullptr: no frequency photons
  Bounds region_;
  std::vector<std::uint8_t> gathers_;  // [materials]
};

}  // namespace lucerna
