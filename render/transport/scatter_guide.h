// Into which directions do photons go on from where they first land?
//
// Of the light that falls on the ground outside a room hardly any is scattered through its window,
// however its emission was drawn. A scatter guide knows for cells of space into which directions
// photons that land there are needed, as pilot paths saw it (estimate/scatter_learning.h). It is a
// binary tree: at the top, nodes halve space at a coordinate; below them, nodes halve a cell's
// directions, laid out on a square (math/equal_area_square.h), and say which share goes to the
// lower half. Source: Müller, Gross & Novák 2017, "Practical Path Guiding for Efficient
// Light-Transport Simulation", from where the two levels come.
//
// At a photon's first landing, on a diffuse surface in such a cell, kGuidedScatterings of the
// directions are drawn by the guide and the others by the BSDF, and the flux is multiplied by the
// BSDF's density over that of both together: nothing is lost, and no flux is more than doubled.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "render/base/status.h"
#include "render/math/vector.h"

namespace lucerna {

inline constexpr double kGuidedScatterings = 0.5;
// At most so many nodes, and so many halvings on the way to a leaf.
inline constexpr std::size_t kMostScatterNodes = 16383;
inline constexpr std::size_t kMostScatterHalvings = 64;

class ScatterGuide {
 public:
  struct Node {
    enum class Kind : std::uint8_t {
      kLeaf,
      // Space: the lower half lies below `place` [scene units].
      kX,
      kY,
      kZ,
      // Directions, in halves of the square; the lower half gets low_share/256 of them.
      kU,
      kV,
    };
    Kind kind = Kind::kLeaf;
    float place = 0;
    std::uint8_t low_share = 0;

    [[nodiscard]] bool HalvesSpace() const { return kind >= Kind::kX && kind <= Kind::kZ; }
    [[nodiscard]] bool HalvesDirections() const { return kind >= Kind::kU; }
    bool operator==(const Node&) const = default;
  };
  using Cell = std::uint32_t;
  // Where directions are drawn by the BSDF alone.
  static constexpr Cell kNoCell = UINT32_MAX;

  // Of no cells.
  ScatterGuide() = default;
  // `nodes` in preorder, the lower half first; none or a single leaf: of no cells.
  // Errors: INVALID_ARGUMENT for nodes that make no tree, or too large or deep a one, or halve
  // space below directions, or give a half of the directions nothing.
  [[nodiscard]] static StatusOr<ScatterGuide> Create(std::vector<Node> nodes);

  [[nodiscard]] bool empty() const { return nodes_.size() <= 1; }
  [[nodiscard]] const std::vector<Node>& nodes() const { return nodes_; }

  [[nodiscard]] Cell CellAt(Vec3 position) const;
  // A direction, of numbers in [0, 1). Evenly spaced numbers stay so in every box of directions.
  [[nodiscard]] Vec3 Draw(Cell cell, float u1, float u2) const;
  // [1/sr]
  [[nodiscard]] double DensityAt(Cell cell, Vec3 direction) const;
  // What a photon's flux is multiplied by where the BSDF has this density [1/sr]: at most
  // 1 / (1 - kGuidedScatterings).
  [[nodiscard]] double FluxFactor(Cell cell, Vec3 direction, double bsdf_density) const;

  bool operator==(const ScatterGuide& other) const { return nodes_ == other.nodes_; }

 private:
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> high_;  // [nodes] the upper half's
};

}  // namespace lucerna
