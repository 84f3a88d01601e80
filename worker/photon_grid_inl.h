// The inner loop of photon_grid.h: eight photons at a time.
#pragma once

#include <bit>

#include <immintrin.h>

#include "render/math/float_lanes.h"
#include "worker/photon_grid.h"

namespace lucerna {

template <typename Visit>
void PhotonGrid::ForEachEight(Vec3 center, float radius, const Visit& visit) const {
  if (size_ == 0) return;
  const float squared_radius = radius * radius;
  const int x0 = CellOf(center.x - radius - low_.x, nx_);
  const int x1 = CellOf(center.x + radius - low_.x, nx_);
  const int y0 = CellOf(center.y - radius - low_.y, ny_);
  const int y1 = CellOf(center.y + radius - low_.y, ny_);
  const int z0 = CellOf(center.z - radius - low_.z, nz_);
  const int z1 = CellOf(center.z + radius - low_.z, nz_);
  const __m256 cx = _mm256_set1_ps(center.x);
  const __m256 cy = _mm256_set1_ps(center.y);
  const __m256 cz = _mm256_set1_ps(center.z);
  const __m256 limit = _mm256_set1_ps(squared_radius);
  for (int z = z0; z <= z1; ++z) {
    for (int y = y0; y <= y1; ++y) {
      const std::size_t row = (static_cast<std::size_t>(z) * static_cast<std::size_t>(ny_) +
                               static_cast<std::size_t>(y)) *
                              static_cast<std::size_t>(nx_);
      const std::size_t begin = first_[row + static_cast<std::size_t>(x0)];
      const std::size_t end = first_[row + static_cast<std::size_t>(x1) + 1];
      for (std::size_t i = begin; i < end; i += 8) {
        const __m256 dx = _mm256_sub_ps(_mm256_loadu_ps(&x_[i]), cx);
        const __m256 dy = _mm256_sub_ps(_mm256_loadu_ps(&y_[i]), cy);
        const __m256 dz = _mm256_sub_ps(_mm256_loadu_ps(&z_[i]), cz);
        const __m256 squared = _mm256_add_ps(
            _mm256_add_ps(_mm256_mul_ps(dx, dx), _mm256_mul_ps(dy, dy)), _mm256_mul_ps(dz, dz));
        auto mask = static_cast<unsigned int>(
            _mm256_movemask_ps(_mm256_cmp_ps(squared, limit, _CMP_LT_OQ)));
        // Lanes beyond the run belong to the next cells.
        if (end - i < 8) mask &= (1U << (end - i)) - 1U;
        if (mask == 0) continue;
        if (visit(i, squared, mask)) return;
      }
    }
  }
}

template <typename Visit>
void PhotonGrid::ForEachWithin(Vec3 center, float radius, const Visit& visit) const {
  ForEachEight(center, radius, [&](std::size_t first, __m256 squared, unsigned int mask) {
    VisitLanes(first, squared, mask, visit);
    return false;
  });
}

template <typename Near, typename Far>
void PhotonGrid::ForEachWithin(Vec3 center, float radius, float reach, const Near& visit_near,
                               const Far& visit_far) const {
  const float inverse_squared = 1 / (radius * radius);
  ForEachEight(center, reach, [&](std::size_t first, __m256 squared, unsigned int mask) {
    const unsigned int is_near = LaneBits(squared * inverse_squared < 1);
    VisitLanes(first, squared, mask & is_near, visit_near);
    VisitLanes(first, squared, mask & ~is_near, visit_far);
    return false;
  });
}

template <typename Visit>
void PhotonGrid::VisitLanes(std::size_t first, __m256 squared, unsigned int mask,
                            const Visit& visit) {
  alignas(32) float distances[8];
  _mm256_store_ps(distances, squared);
  while (mask != 0) {
    const auto lane = static_cast<std::size_t>(std::countr_zero(mask));
    mask &= mask - 1;
    visit(first + lane, distances[lane]);
  }
}

inline bool PhotonGrid::HasAnyWithin(Vec3 center, float radius) const {
  bool has_any = false;
  ForEachEight(center, radius,
               [&](std::size_t /*first*/, __m256 /*squared*/, unsigned int /*mask*/) {
                 return has_any = true;
               });
  return has_any;
}

}  // namespace lucerna
