#include "worker/photon_grid.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <type_traits>
#include <utility>

#include "render/base/memory.h"

namespace lucerna {
namespace {

// More cells than this per deposit are mostly empty and only cost memory.
constexpr double kCellsPerDeposit = 4;
constexpr double kFewestCells = 4096;
// Buckets so many that the cells of one fit in the nearest cache, and that what a thread counts
// does too.
constexpr std::size_t kMostBuckets = 1024;
constexpr std::size_t kFewestCellsOfBucket = 64;

}  // namespace

PhotonGrid::PhotonGrid(const std::vector<Deposits>& deposits, const Bounds& region,
                       float cell_width, ThreadTeam& team)
    : low_(region.low) {
  std::size_t count = 0;
  for (const Deposits& chunk : deposits)
    count += chunk.size();
  if (count == 0) return;

  const Vec3 extent = region.high - region.low;
  const double most_cells = std::max(kFewestCells, kCellsPerDeposit * static_cast<double>(count));
  double width =
      std::max(static_cast<double>(cell_width), static_cast<double>(MaxAbs(extent)) * 1e-6);
  if (!(width > 0)) width = 1;
  const auto cells_at = [&](double w) {
    return (std::floor(static_cast<double>(extent.x) / w) + 1) *
           (std::floor(static_cast<double>(extent.y) / w) + 1) *
           (std::floor(static_cast<double>(extent.z) / w) + 1);
  };
  while (cells_at(width) > most_cells)
    width *= 1.25;
  inverse_cell_ = static_cast<float>(1 / width);
  nx_ = static_cast<int>(static_cast<double>(extent.x) / width) + 1;
  ny_ = static_cast<int>(static_cast<double>(extent.y) / width) + 1;
  nz_ = static_cast<int>(static_cast<double>(extent.z) / width) + 1;
  const std::size_t cells =
      static_cast<std::size_t>(nx_) * static_cast<std::size_t>(ny_) * static_cast<std::size_t>(nz_);

  // First by buckets of neighbouring cells, of which groups of chunks count and place their
  // deposits apart, then each bucket by its cells: in parallel, in the order of the input, and
  // without an array of all cells for each thread.
  const std::size_t cells_of_bucket =
      std::max(kFewestCellsOfBucket, (cells + kMostBuckets - 1) / kMostBuckets);
  const std::size_t buckets = (cells + cells_of_bucket - 1) / cells_of_bucket;
  const std::size_t groups =
      std::min(deposits.size(), static_cast<std::size_t>(std::max(1, team.threads())));
  // Calls visit(cell, chunk, row, group) for all deposits, those of a group in
  // their order.
  const auto for_each_of_groups = [&](const auto& visit) {
    team.For(groups, 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t group = begin; group < end; ++group) {
        for (std::size_t c = group * deposits.size() / groups;
             c < (group + 1) * deposits.size() / groups; ++c) {
          const std::vector<Deposit>& rows = deposits[c].rows;
          for (std::size_t i = 0; i < rows.size(); ++i) {
            const Vec3 offset = rows[i].position - low_;
            const std::size_t cell =
                (static_cast<std::size_t>(CellOf(offset.z, nz_)) * static_cast<std::size_t>(ny_) +
                 static_cast<std::size_t>(CellOf(offset.y, ny_))) *
                    static_cast<std::size_t>(nx_) +
                static_cast<std::size_t>(CellOf(offset.x, nx_));
            visit(cell, c, i, group);
          }
        }
      }
    });
  };
  std::vector<std::vector<std::uint32_t>> next(groups, std::vector<std::uint32_t>(buckets, 0));
  for_each_of_groups([&](std::size_t cell, std::size_t, std::size_t, std::size_t group) {
    ++next[group][cell / cells_of_bucket];
  });
  std::vector<std::uint32_t> first_of_bucket(buckets + 1);
  std::uint32_t sum = 0;
  for (std::size_t bucket = 0; bucket < buckets; ++bucket) {
    first_of_bucket[bucket] = sum;
    for (std::vector<std::uint32_t>& of_group : next)
      sum += std::exchange(of_group[bucket], sum);
  }
  first_of_bucket[buckets] = sum;
  // A deposit's cell within its bucket, and where it comes from.
  struct Entry {
    std::uint32_t cell, chunk, row;
  };
  std::vector<Entry> entries(count);
  for_each_of_groups([&](std::size_t cell, std::size_t chunk, std::size_t row, std::size_t group) {
    entries[next[group][cell / cells_of_bucket]++] = {
        static_cast<std::uint32_t>(cell % cells_of_bucket), static_cast<std::uint32_t>(chunk),
        static_cast<std::uint32_t>(row)};
  });
  FreeMemoryOf(next);
  first_.resize(cells + 1);
  first_[cells] = sum;

  x_.assign(count + 8, HUGE_VALF);
  y_.assign(count + 8, HUGE_VALF);
  z_.assign(count + 8, HUGE_VALF);
  size_ = count;
  sources_.resize(count);
  const auto has = [&](auto Deposits::*column) {
    return std::ranges::any_of(deposits, [&](const Deposits& d) { return !(d.*column).empty(); });
  };
  const bool has_densities = has(&Deposits::emission_densities);
  if (has_densities) emission_densities_.resize(count);
  const auto place_all = [&](auto with_normals, auto with_traces) {
    team.For(buckets, 1, [&](std::size_t begin, std::size_t end) {
      std::vector<std::uint32_t> next_of_cell;
      for (std::size_t bucket = begin; bucket < end; ++bucket) {
        const std::span here = std::span(entries).subspan(
            first_of_bucket[bucket], first_of_bucket[bucket + 1] - first_of_bucket[bucket]);
        const std::size_t first_cell = bucket * cells_of_bucket;
        next_of_cell.assign(std::min(cells_of_bucket, cells - first_cell), 0);
        for (const Entry& entry : here)
          ++next_of_cell[entry.cell];
        std::uint32_t before = first_of_bucket[bucket];
        for (std::size_t cell = 0; cell < next_of_cell.size(); ++cell) {
          first_[first_cell + cell] = before;
          before += std::exchange(next_of_cell[cell], before);
        }
        for (const Entry& entry : here) {
          const Deposits& chunk = deposits[entry.chunk];
          const std::size_t i = entry.row;
          const Deposit& deposit = chunk.rows[i];
          const std::size_t out = next_of_cell[entry.cell]++;
          x_[out] = deposit.position.x;
          y_[out] = deposit.position.y;
          z_[out] = deposit.position.z;
          sources_[out] = deposit.source;
          if constexpr (with_normals) {
            facing_[out] = {{deposit.flux, deposit.key},
                            chunk.normals[i],
                            chunk.arrivals_oct.empty() ? 0 : chunk.arrivals_oct[i]};
          } else {
            records_[out] = {deposit.flux, deposit.key};
          }
          if constexpr (with_traces) traces_[out] = chunk.traces[i];
          if (has_densities) emission_densities_[out] = chunk.emission_densities[i];
        }
      }
    });
  };
  const auto place = [&](auto with_normals) {
    if (has(&Deposits::traces)) {
      traces_.resize(count);
      place_all(with_normals, std::true_type{});
    } else {
      place_all(with_normals, std::false_type{});
    }
  };
  if (has(&Deposits::normals)) {
    facing_.resize(count);
    place(std::true_type{});
  } else {
    records_.resize(count);
    place(std::false_type{});
  }
}

}  // namespace lucerna
