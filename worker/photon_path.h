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
  PhotonPathTracer(const Scene& scene, const Intersector& intersector, const LightSet& lights,
                   const RenderSettings& settings, const Bounds& region);

  // Traces photon `index` of `pass` and appends its deposits. Returns the rays traced; `dropped`
  // counts photons given up because a number was not finite. Threads: any.
  int Trace(std::uint64_t pass, std::uint64_t index, std::vector<Deposit>& deposits,
            std::uint64_t& dropped) const;

 private:
  const Scene& scene_;
  const Intersector& intersector_;
  const LightSet& lights_;
  const RenderSettings& settings_;
  Bounds region_;
  std::vector<std::uint8_t> gathers_;  // [materials]
};

}  // namespace lucerna
