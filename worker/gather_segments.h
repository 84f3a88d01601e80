// What do segments of eye paths find among the photons that media scattered?
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "render/base/parallel.h"
#include "render/estimate/accumulation.h"
#include "render/estimate/evidence.h"
#include "render/estimate/hitpoint_block.h"
#include "render/math/fixed_point.h"
#include "render/math/octahedral.h"
#include "render/scene/density_grid.h"
#include "render/scene/medium.h"
#include "render/transport/media.h"
#include "worker/gather.h"
#include "worker/gather_piece.h"
#include "worker/photon_tree.h"

namespace lucerna {

// Where the photons of a segment are looked for, and how far below the border they lie.
//
// A medium often begins at a surface that the eye sees at a slant. There the kernel, a disc across
// the segment, reaches beyond the segment's beginning on one side, and on the other one the border
// is deeper than that. So the distance of a photon counts from the border, as if that were flat:
// with distances from the disc through the segment's beginning a medium whose free path is short
// beside the radius would be black.
struct SegmentReach {
  SegmentReach(const HitpointBlock& block, std::size_t number, float last_radius) {
    const MediumSegment& segment = block.segments[number];
    const std::size_t row = block.first_segment() + number;
    from = block.positions[row];
    border = DecodeOctahedral(block.normals_oct[row]);
    const Vec3 way = segment.end - from;
    const float length = Length(way);
    if (!(length > 0)) return;
    const Vec3 direction = way / length;
    const float first_radius = segment.narrowing * last_radius;
    constexpr float kLeastFacing = 1e-3F;
    facing = std::clamp(-Dot(border, direction), kLeastFacing, 1.0F);
    // Along outlines the disc would reach very far before the beginning.
    constexpr float kSteepest = 5;
    const float slope = std::min(std::sqrt(1 - facing * facing) / facing, kSteepest);
    before = first_radius * slope;
    cone = {from - direction * before, direction, length + before, first_radius, last_radius};
  }
  // Of a photon `along` the cone, in the segment's direction; below 0: it does not count. Behind
  // the plane there is nothing of a medium that begins there. Beside a convex object in a medium
  // there is: what lies along the segment counts, as at the border.
  [[nodiscard]] float Depth(Vec3 photon, float along) const {
    const float depth = Dot(from - photon, border) / facing;
    return depth < 0 && along >= before ? 0 : depth;
  }

  Vec3 from, border;
  float facing = 1;
  float before = 0;  // what of the cone lies before the segment's beginning
  PhotonTree::Cone cone;
};

// The beam radiance estimate (Jarosz, Zwicker & Jensen 2008) with radii that grow along the segment
// as the width of a pixel does: a photon of flux Φ, scattered at distance t from the border and d
// from the segment, adds
//
//   Φ p(θ) T(t) K(d² / r(t)²) r² / r(t)²
//
// where p is the phase function, T the transmittance from the border (of the column density up to
// t), K the kernel's shape and r the radius at the end, by whose square all sums are divided later.
// Photons carry the flux that was scattered. Rows as in Gather, with zeros for the radius
// controller's evidence: radii of segments follow a schedule (Knaus & Zwicker 2011, "Progressive
// Photon Mapping: A Probabilistic Approach"), with the exponent of surfaces, because the kernel has
// two dimensions too. Adds to `sums` as Gather does.
template <typename GatherKernel>
std::vector<GatherPiece> GatherSegments(const HitpointBlock& block, const RadiusColumn& radii,
                                        const PhotonTree& photons,
                                        std::span<std::uint32_t> found_by,
                                        const std::vector<Medium>& media, const FluxScale& scale,
                                        ThreadTeam& team, const std::atomic<bool>& stop,
                                        PassSums& sums) {
  const std::size_t first_row = block.first_segment();
  const std::size_t count = block.segments.size();
  // Pieces of rows as in Gather, of which the first may be shared with surfaces.
  const std::size_t first_piece = first_row / kRowsPerPiece;
  const std::size_t end_row = first_row + count;
  std::vector<GatherPiece> pieces((end_row + kRowsPerPiece - 1) / kRowsPerPiece - first_piece);
  const float quanta_per_luminance = 1 / Luminance(scale.watts_per_quantum);
  constexpr float kInnerArea = kInnerShare * kInnerShare;

  // `column_table` is for media of uneven density, made where a photon is found.
  const auto gather_row = [&](std::size_t segment_number, ColumnTable& column_table,
                              GatherPiece& piece) {
    const MediumSegment& segment = block.segments[segment_number];
    const std::size_t row = first_row + segment_number;
    const auto hitpoint = static_cast<std::uint32_t>(row);
    const Medium& medium = media[segment.medium];
    const SegmentReach reach(block, segment_number, radii[row]);
    if (!(reach.cone.length > 0)) return;
    const Vec3 direction = reach.cone.direction;
    bool has_table = false;
    std::uint32_t found = 0;
    std::int64_t sum_r = 0;
    std::int64_t sum_g = 0;
    std::int64_t sum_b = 0;
    std::int64_t blur = 0;
    photons.ForEachWithin(reach.cone, [&](std::size_t i, const ScatteredPhoton& photon, float along,
                                          float t2, float radius) {
      const float t = reach.Depth(photons.position(i), along);
      if (t < 0) return;
      const float cosine = Dot(photon.arrival, direction);
      const float widening = radii[row] / radius;
      if (medium.density != nullptr && !has_table) {
        column_table.Make(*medium.density, reach.from, direction,
                          static_cast<double>(reach.cone.length));
        has_table = true;
      }
      const float column =
          has_table ? static_cast<float>(column_table.At(static_cast<double>(t))) : t;
      const Rgb flux = photon.flux * medium.Transmittance(column) *
                       (PhaseHenyeyGreenstein(cosine, medium.g) * widening * widening);
      if (!scale.HasRoomFor(flux)) {
        ++piece.excess;
        return;
      }
      MarkFound(found_by[i], hitpoint);
      const float whole = GatherKernel::Shape(t2);
      const float inner_t2 = t2 / kInnerArea;
      const float inner = inner_t2 < 1 ? GatherKernel::Shape(inner_t2) / kInnerArea : 0;
      const std::uint64_t bits = PairBits(photon.key, hitpoint);
      const Rgb quanta = flux * scale.quanta_per_watt * whole;
      sum_r += RoundDithered(quanta.r, DitherOf(bits, 0));
      sum_g += RoundDithered(quanta.g, DitherOf(bits, 1));
      sum_b += RoundDithered(quanta.b, DitherOf(bits, 2));
      blur += std::llrint(Luminance(flux) * quanta_per_luminance * (whole - inner));
      ++found;
    });
    if (found == 0) return;
    std::array<std::int64_t, kCommonColumns + kMostControllerColumns> columns{};
    columns[kBlurColumn] = blur;
    piece.fits = sums.AddRow(row, found, {sum_r, sum_g, sum_b}, columns) && piece.fits;
    piece.pairs += found;
  };

  team.For(pieces.size(), 1, [&](std::size_t begin, std::size_t end) {
    ColumnTable column_table;
    for (std::size_t p = begin; p < end; ++p) {
      const std::size_t begin_of_piece = (first_piece + p) * kRowsPerPiece;
      const std::size_t first = std::max(first_row, begin_of_piece);
      const std::size_t last = std::min(end_row, begin_of_piece + kRowsPerPiece);
      for (std::size_t row = first; row < last && !stop.load(std::memory_order_relaxed); ++row)
        gather_row(row - first_row, column_table, pieces[p]);
    }
  });
  return pieces;
}

}  // namespace lucerna
