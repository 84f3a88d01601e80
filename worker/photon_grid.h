// Which photons are near a point?
//
// Deposits are sorted into the cells of a uniform grid (a counting sort in two steps), so that a
// hitpoint finds its neighbours as a few runs of consecutive photons: cells along x are neighbours
// in memory. The order inside a cell is that of the input.
#pragma once

#include <cstdint>
#include <vector>

#include <immintrin.h>

#include "render/base/parallel.h"
#include "render/math/rgb.h"
#include "render/math/vector.h"
#include "worker/photon_path.h"

namespace lucerna {

// What every photon brings once it is known to be near.
struct alignas(16) PhotonRecord {
  Rgb flux;
  std::uint32_t key = 0;
};

// A photon of jobs that compare normals or directions: half a cache line, in one place, because
// every photon that is near needs all of it. Columns of their own took a fifth longer to gather.
struct alignas(32) FacingRecord : PhotonRecord {
  Vec3 normal;
  std::uint32_t arrival_oct = 0;  // 0 in jobs that have no such column
};

static_assert(sizeof(PhotonRecord) == 16 && sizeof(FacingRecord) == 32);

class PhotonGrid {
 public:
  // `region` holds all deposits, which come in chunks that have the same columns. Cells are about
  // `cell_width` wide [scene units], wider when there would be far more of them than deposits.
  PhotonGrid(const std::vector<Deposits>& deposits, const Bounds& region, float cell_width,
             ThreadTeam& team);

  [[nodiscard]] std::size_t size() const { return size_; }
  // Whether deposits had normals, and so photons FacingRecords; never without photons.
  [[nodiscard]] bool has_normals() const { return !facing_.empty(); }
  // kNormals as has_normals().
  template <bool kNormals>
  [[nodiscard]] const auto& record(std::size_t photon) const {
    if constexpr (kNormals) {
      return facing_[photon];
    } else {
      return records_[photon];
    }
  }
  // See Deposits. Requires that there is such a column.
  [[nodiscard]] float trace(std::size_t photon) const { return traces_[photon]; }
  [[nodiscard]] bool has_traces() const { return !traces_.empty(); }
  [[nodiscard]] float emission_density(std::size_t photon) const {
    return emission_densities_[photon];
  }
  [[nodiscard]] DepositSource source(std::size_t photon) const {
    return DepositSource::Unpacked(sources_[photon]);
  }
  [[nodiscard]] Vec3 position(std::size_t photon) const {
    return {x_[photon], y_[photon], z_[photon]};
  }

  // Calls visit(photon, squared distance) for every photon closer to `center` than `radius`.
  template <typename Visit>
  void ForEachWithin(Vec3 center, float radius, const Visit& visit) const;
  // The same within `reach`, by visit_near where squared distance · (1 / radius²) < 1 and by
  // visit_far elsewhere, in an order of its own.
  template <typename Near, typename Far>
  void ForEachWithin(Vec3 center, float radius, float reach, const Near& visit_near,
                     const Far& visit_far) const;
  // Whether there is any such photon.
  [[nodiscard]] bool HasAnyWithin(Vec3 center, float radius) const;

 private:
  // Calls visit(first photon, their distances, mask) for up to eight photons at a time, where the
  // mask has a bit for each of them that is closer than `radius`, at least one, until it returns
  // true.
  template <typename Visit>
  void ForEachEight(Vec3 center, float radius, const Visit& visit) const;
  // Calls visit(photon, squared distance) for each photon of such a mask.
  template <typename Visit>
  static void VisitLanes(std::size_t first, __m256 squared, unsigned int mask, const Visit& visit);
  [[nodiscard]] int CellOf(float offset, int cells) const {
    const float cell = offset * inverse_cell_;
    return cell > 0 ? std::min(static_cast<int>(std::min(cell, 1e9F)), cells - 1) : 0;
  }

  Vec3 low_;
  float inverse_cell_ = 1;
  int nx_ = 1, ny_ = 1, nz_ = 1;
  std::vector<std::uint32_t> first_;  // [cells + 1] photon of each cell
  std::vector<float> x_, y_, z_;      // [photons + 8], the rest far away
  std::size_t size_ = 0;
  // [photons], one of them, the other empty.
  std::vector<PhotonRecord> records_;
  std::vector<FacingRecord> facing_;
  std::vector<float> traces_;              // [photons] or empty
  std::vector<float> emission_densities_;  // [photons] or empty
  std::vector<std::uint32_t> sources_;     // [photons]
};

}  // namespace lucerna

#include "worker/photon_grid_inl.h"
