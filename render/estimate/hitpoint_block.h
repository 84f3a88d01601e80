// Where do the eye paths of one pass wait for photons?
//
// A HitpointBlock is what the workers need to know of one pass's hitpoints, as columns: position
// and normal for all, and for glossy ones the direction to the eye and the material. A diffuse
// hitpoint travels without a BSDF: the worker adds up irradiance and the coordinator multiplies
// by albedo/π and the path's weight. Radii are a column of their own (RadiusColumn), because they
// become known later than the hitpoints do.
//
// Which pixel a hitpoint belongs to is the coordinator's secret; a worker does not need it.
//
// Invariants
//   H1  All columns that are present have `size()` rows; glossy columns have glossy.size() rows.
//   H2  Positions are finite; normals are unit length up to the 2 × 16 bit octahedral rounding.
//   H3  Glossy rows are in increasing order of hitpoint.
//   H4  The last segments.size() rows are segments: `positions` is where they begin, and their
//       normals mean nothing. The `caustic_rows` rows before them are glossy ones: they gather
//       caustic photons, and all rows before those the other ones.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "render/math/rgb.h"
#include "render/math/vector.h"

namespace lucerna {

// One glossy hitpoint: photons count by the BSDF towards `to_eye`.
struct GlossyHitpoint {
  std::uint32_t hitpoint = 0;    // row in the block
  std::uint32_t material = 0;    // index into Scene::materials
  std::uint32_t to_eye_oct = 0;  // direction to the eye, octahedral
  std::uint32_t shading_normal_oct = 0;

  bool operator==(const GlossyHitpoint&) const = default;
};

// In place of a tangent: none is needed.
inline constexpr std::uint32_t kNoTangent = UINT32_MAX;

// What depends on the place of a glossy hitpoint, where its material does
// (transport/material_at.h).
struct GlossyPlace {
  Rgb color;                               // what SetTexturedParameter sets: >= 0
  std::array<float, 4> numbers = {};       // what SetNumbers sets: in [0, 1e4]
  std::uint32_t tangent_oct = kNoTangent;  // octahedral

  bool operator==(const GlossyPlace&) const = default;
};

// A straight part of an eye path through a medium that scatters. Photons that the medium scattered
// count when they are nearer to it than a radius that grows evenly along it: the beam radiance
// estimate (Jarosz, Zwicker & Jensen 2008, "The Beam Radiance Estimate for Volumetric Photon
// Mapping").
struct MediumSegment {
  Vec3 end;
  std::uint32_t medium = 0;  // index into Scene::media
  float narrowing = 1;       // the radius at the beginning over that at the end, in (0, 1]

  bool operator==(const MediumSegment&) const = default;
};

struct HitpointBlock {
  std::vector<Vec3> positions;  // [hitpoints]
  // [hitpoints] geometric, on the eye's side; of segments, of the surface at which they begin.
  std::vector<std::uint32_t> normals_oct;
  std::vector<GlossyHitpoint> glossy;  // [glossy hitpoints]
  // [glossy hitpoints] or empty: of materials that do not depend on the place, no more than default
  // values.
  std::vector<GlossyPlace> places;
  std::size_t caustic_rows = 0;
  std::vector<MediumSegment> segments;

  [[nodiscard]] std::size_t size() const { return positions.size(); }
  [[nodiscard]] std::size_t first_segment() const { return size() - segments.size(); }
  [[nodiscard]] std::size_t first_caustic() const { return first_segment() - caustic_rows; }
  bool operator==(const HitpointBlock&) const = default;
};

// The radius of every hitpoint of a pass [scene units]: finite and > 0. Of a segment, at its end.
using RadiusColumn = std::vector<float>;

// How many eye paths each pixel has in a pass (eye_path_counts.h): [pixels of the crop window] from
// 1 to kMostEyePaths.
using EyePathCounts = std::vector<std::uint8_t>;
inline constexpr int kMostEyePaths = 9;
// Of all pixels beside their first ones, and pixels of the images that may have more than one.
inline constexpr std::uint64_t kMostMoreEyePaths = std::uint64_t{1} << 21;
inline constexpr std::uint64_t kMostPixelsWithMore = 2 * kMostMoreEyePaths;

}  // namespace lucerna
