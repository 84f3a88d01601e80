// What do the hitpoints find among the photons?
#pragma once

#include <atomic>
#include <cstdint>
#include <span>

#include "render/base/parallel.h"
#include "render/base/status.h"
#include "render/estimate/accumulation.h"
#include "render/estimate/evidence.h"
#include "render/estimate/hitpoint_block.h"
#include "render/geometry/feature_edges.h"
#include "render/math/fixed_point.h"
#include "render/math/kernel.h"
#include "render/scene/scene.h"
#include "render/transport/caustic_weight.h"
#include "worker/photon_grid.h"
#include "worker/photon_tree.h"

namespace lucerna {

inline constexpr std::uint32_t kNotFound = UINT32_MAX;

// Several threads may find a photon. Most have been found before, and are only read.
inline void MarkFound(std::uint32_t& found_by, std::uint32_t row) {
  const std::atomic_ref<std::uint32_t> first(found_by);
  std::uint32_t before = first.load(std::memory_order_relaxed);
  while (row < before && !first.compare_exchange_weak(before, row, std::memory_order_relaxed)) {
  }
}

// What the hitpoints gather from.
struct GatheredPhotons {
  const PhotonGrid& grid;
  // Caustic photons with normals, arrivals and emission densities, and the share of light that is
  // theirs; for the block's caustic rows, nullptr where there are none.
  const PhotonGrid* caustics = nullptr;
  const CausticWeight* caustic_weight = nullptr;
  // Edges at which discs end, or nullptr.
  const FeatureEdges* features = nullptr;
  // [photons of either grid] or empty, kNotFound at first: become the first row of the block where
  // the photon counted.
  std::span<std::uint32_t> found_by = {};
  std::span<std::uint32_t> caustic_found_by = {};
  // Photons that media scattered, for the block's segments, or nullptr.
  const PhotonTree* scattered = nullptr;
  const std::vector<Medium>* media = nullptr;
  std::span<std::uint32_t> scattered_found_by = {};
};

// Every hitpoint adds up the photons within its radius that landed on its side of its surface (all
// of them where photons have no normals), and of those the ones that no edge of `features`, where
// there are any, separates from it (worker/cut_disc.h):
// kernel-weighted flux for diffuse ones, times the BSDF for glossy ones, and what `evidence` names.
// Counts are of the photons within reach, flux of those within the radius.
// Adds to `sums` (block.size() rows, EvidenceColumns(evidence)) all but the tally, of which it
// returns `pairs` and `excess`.
// Requires normals and arrivals of photons where there are glossy hitpoints, and at most kMostTerms
// photons that `scale` has room for each: then no sum of theirs wraps. Pairs are independent of
// each other, so neither threads nor the order of photons can be seen in the result. Once `stop` is
// true it ends soon, with sums of no use. Errors: OUT_OF_RANGE when a sum would not fit beside what
// `sums` held before; then they are of no use either.
[[nodiscard]] StatusOr<BatchTally> Gather(const HitpointBlock& block, const RadiusColumn& radii,
                                          const GatheredPhotons& photons,
                                          const std::vector<Material>& materials,
                                          const Kernel& kernel, const FluxScale& scale,
                                          ThreadTeam& team, const std::atomic<bool>& stop,
                                          Evidence evidence, PassSums& sums);

}  // namespace lucerna
