// Is the energy that a result says its photons were emitted with what the lights emit?
//
// Photons of one light carry the same flux when they leave it, or at most a known multiple of the
// mean (spots). How many photons each light has sent is in the counters of a result, so the energy
// emitted is known within rounding, without tracing anything.
#pragma once

#include <vector>

#include "render/base/status.h"
#include "render/estimate/accumulation.h"
#include "render/transport/light.h"

namespace lucerna {

class EmissionCheck {
 public:
  // Of nothing: every tally passes.
  EmissionCheck() = default;
  // `largest_power`: how many times its power a light has in any pass, at least; 1: the same in
  // all.
  explicit EmissionCheck(const LightSet& lights, double largest_power = 1);

  // Errors: INVALID_ARGUMENT when photons were sent by other lights than there are, not all were
  // sent by some light, or the energy emitted is not that of so many photons; of photons that are
  // drawn by a guide, whose flux differs and of which `unguided_share` or more count for their
  // lights (PhotonGuide::UnguidedShare; 1: there is no guide), not what so many could have by
  // chance in one result of a million million. Takes a time that grows with the number of lights,
  // of which there are at most kMaxLightTallies.
  [[nodiscard]] Status Check(const BatchTally& tally, double unguided_share = 1) const;

 private:
  // Of one photon [units of EnergyCounters].
  struct Range {
    double least = 0, most = 0;
  };
  [[nodiscard]] Status CheckGuided(const BatchTally& tally, double unguided_share) const;

  std::vector<Range> lights_;
  bool may_emit_less_ = false;  // spots, lights that are counted together, other colours
  double largest_power_ = 1;
};

}  // namespace lucerna
