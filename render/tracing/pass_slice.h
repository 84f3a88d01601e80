// What does one pass bring to every pixel?
//
// From a pass's hitpoints and what they gathered to the pass's slice (estimate/slice_sums.h). The
// same function wherever the pass was traced: by a worker that traced all of it, or by the
// coordinator from the batches of several workers.
#pragma once

#include <cstdint>
#include <memory>

#include "render/analysis/needs.h"
#include "render/base/parallel.h"
#include "render/estimate/accumulation.h"
#include "render/estimate/hitpoint_block.h"
#include "render/estimate/slice_sums.h"
#include "render/math/fixed_point.h"
#include "render/scene/render_settings.h"
#include "render/tracing/hitpoint_pass.h"
#include "render/transport/photon_guide.h"

namespace lucerna {

// What the passes of a round share.
struct RoundPlan {
  std::uint64_t photons_per_pass = 0;
  std::shared_ptr<const RadiusColumn> radii;  // [pixels of the crop window] in unit radii
  float caustic_radius = 1;  // of all caustic hitpoints and segments, in unit radii
  // By which photons are drawn; nullptr: evenly, and none is reported.
  std::shared_ptr<const PhotonGuide> guide = nullptr;
};

// Of a radius [units of the settings] whose unit has this length there [scene units].
[[nodiscard]] float HitpointRadius(float radius, float unit_radius);

// The radius of every hitpoint of a pass [scene units]. By the threads of `team`, or by the
// caller's alone.
[[nodiscard]] RadiusColumn HitpointRadii(const EyePass& pass, const RoundPlan& plan,
                                         ThreadTeam* team = nullptr);

// The slice of one pass, which is used up. `sums` are those of all its photons, gathered with
// HitpointRadii. Of a job that carries wavelengths (`needs`) it has their colour, in the working
// space as any other.
[[nodiscard]] SliceSums SliceOfPass(EyePass pass, const RoundPlan& plan, PassSums sums,
                                    const RenderSettings& settings, const SceneNeeds& needs,
                                    const FluxScale& scale, ThreadTeam& team);

}  // namespace lucerna
