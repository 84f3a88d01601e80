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
  std::shared_ptr<const EyePathCounts> eye_paths = nullptr;  // nullptr: one for each pixel

  [[nodiscard]] int EyePathsOf(std::size_t pixel) const {
    return eye_paths == nullptr ? 1 : static_cast<int>((*eye_paths)[pixel]);
  }
};

// Of a radius [units of the settings] whose unit has this length there [scene units].
[[nodiscard]] float HitpointRadius(float radius, float unit_radius);

// The radius of every hitpoint of a pass [scene units]. By the threads of `team`, or by the
// caller's alone.
[[nodiscard]] RadiusColumn HitpointRadii(const EyePass& pass, const RoundPlan& plan,
                                         ThreadTeam* team = nullptr);
// The same in the memory of the pass's unit radii, which it has no more.
[[nodiscard]] RadiusColumn TakeHitpointRadii(EyePass& pass, const RoundPlan& plan,
                                             ThreadTeam* team = nullptr);

// The slice of one pass is made of two parts, one after the other, each of which frees in `pass`
// what is its alone, as soon as it can. Of a job that carries wavelengths (`needs`) they have their
// colour, in the working space as any other.

// The slice of a pass without either part: its columns are empty.
[[nodiscard]] SliceSums BeginSlice(const EyePass& pass, const RenderSettings& settings);
// Direct light, and the features of surfaces in passes that have them. Needs the unit radii.
void AddEyePaths(SliceSums& slice, EyePass& pass, const RenderSettings& settings,
                 const SceneNeeds& needs, ThreadTeam& team);
// What photons brought. `sums` are those of all photons of the pass, gathered with these radii of
// hitpoints.
void AddPhotons(SliceSums& slice, EyePass& pass, const RoundPlan& plan, RadiusColumn radii,
                PassSums sums, const RenderSettings& settings, const SceneNeeds& needs,
                const FluxScale& scale, ThreadTeam& team);

// Both parts of the slice of a pass, which is used up.
[[nodiscard]] SliceSums SliceOfPass(EyePass pass, const RoundPlan& plan, PassSums sums,
                                    const RenderSettings& settings, const SceneNeeds& needs,
                                    const FluxScale& scale, ThreadTeam& team);

}  // namespace lucerna
