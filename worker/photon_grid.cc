#include "worker/photon_grid.h"

#include <algorithm>
#include <cmath>
#include <type_traits>

namespace lucerna {
namespace {

// More cells than this per deposit are mostly empty and only cost memory.
constexpr double kCellsPerDeposit = 4;
constexpr double kFewestCells = 4096;

}  // namespace

PhotonGrid::PhotonGrid(const std::vector<Deposits>& deposits, const Bounds& region, float cell,
                       ThreadTeam& team)
    : low_(region.low) {
  std::size_t count = 0;
  std::vector<std::size_t> start;  // of each chunk in the input order
  for (const auto& chunk : deposits) {
    start.push_back(count);
    count += chunk.size();
  }
  start.push_back(count);
  if (count == 0) return;

  const Vec3 extent = region.high - region.low;
  const double most_cells = std::max(kFewestCells, kCellsPerDeposit * static_cast<double>(count));
  double width = std::max(static_cast<double>(cell), static_cast<double>(MaxAbs(extent)) * 1e-6);
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

  // Groups of chunks count their cells apart, so that the sort runs in parallel and is stable.
  const std::size_t groups =
      std::min(deposits.size(), static_cast<std::size_t>(std::max(1, team.threads())));
  const auto chunk_of_group = [&](std::size_t group) { return group * deposits.size() / groups; };
  std::vector<std::uint32_t> cell_of(count);
  std::vector<std::vector<std::uint32_t>> counts(groups);
  team.For(groups, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t group = begin; group < end; ++group) {
      counts[group].assign(cells, 0);
      for (std::size_t c = chunk_of_group(group); c < chunk_of_group(group + 1); ++c) {
        std::size_t out = start[c];
        for (const Deposit& deposit : deposits[c].rows) {
          const Vec3 offset = deposit.position - low_;
          const std::size_t number =
              (static_cast<std::size_t>(CellOf(offset.z, nz_)) * static_cast<std::size_t>(ny_) +
               static_cast<std::size_t>(CellOf(offset.y, ny_))) *
                  static_cast<std::size_t>(nx_) +
              static_cast<std::size_t>(CellOf(offset.x, nx_));
          cell_of[out++] = static_cast<std::uint32_t>(number);
          ++counts[group][number];
        }
      }
    }
  });
  first_.resize(cells + 1);
  std::uint32_t sum = 0;
  for (std::size_t number = 0; number < cells; ++number) {
    first_[number] = sum;
    for (std::size_t group = 0; group < groups; ++group) {
      const std::uint32_t here = counts[group][number];
      counts[group][number] = sum;
      sum += here;
    }
  }
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
    team.For(groups, 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t group = begin; group < end; ++group) {
        for (std::size_t c = chunk_of_group(group); c < chunk_of_group(group + 1); ++c) {
          const Deposits& chunk = deposits[c];
          for (std::size_t i = 0; i < chunk.size(); ++i) {
            const Deposit& deposit = chunk.rows[i];
            const std::size_t out = counts[group][cell_of[start[c] + i]]++;
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
