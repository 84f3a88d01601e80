// What hitpoints gather of some photons, as an accumulation.
#pragma once

#include <atomic>
#include <vector>

#include "render/base/parallel.h"
#include "worker/gather.h"

namespace lucerna {

[[nodiscard]] inline Accumulation GatherSums(const HitpointBlock& block, const RadiusColumn& radii,
                                             const GatheredPhotons& photons,
                                             const std::vector<Material>& materials,
                                             const Kernel& kernel, const FluxScale& scale,
                                             ThreadTeam& team,
                                             Evidence evidence = Evidence::kNone) {
  const std::atomic<bool> stop = false;
  PassSums sums(block.size(), EvidenceColumns(evidence));
  BatchTally tally =
      Gather(block, radii, photons, materials, kernel, scale, team, stop, evidence, sums).value();
  Accumulation accumulation = sums.ToAccumulation().value();
  accumulation.tally = std::move(tally);
  return accumulation;
}

}  // namespace lucerna
