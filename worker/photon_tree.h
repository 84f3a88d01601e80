// Which photons are near a straight line?
//
// Photons in the order of a space-filling curve (Morton 1966), in groups of a few, with a ball
// around each group and around each pair of balls: a segment finds the photons around it by
// descending where a ball comes near.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "render/base/parallel.h"
#include "render/math/rgb.h"
#include "render/math/vector.h"
#include "worker/photon_path.h"

namespace lucerna {

// A photon that a medium scattered.
struct ScatteredPhoton {
  Rgb flux;  // [W] scattered, of all photons of a pass together
  std::uint32_t key = 0;
  Vec3 arrival;  // direction back to where it came from, unit
  std::uint32_t source = 0;
};

class PhotonTree {
 public:
  // Deposits in chunks, with arrivals. The order depends on positions and chunks alone.
  PhotonTree(const std::vector<Deposits>& deposits, ThreadTeam& team);

  [[nodiscard]] std::size_t size() const { return photons_.size(); }
  [[nodiscard]] Vec3 position(std::size_t photon) const { return positions_[photon]; }
  [[nodiscard]] DepositSource source(std::size_t photon) const {
    return DepositSource::Unpacked(photons_[photon].source);
  }

  // Around a segment from `origin` in `direction` (unit); the radius grows evenly along it.
  struct Cone {
    Vec3 origin, direction;
    float length = 0;
    float first_radius = 0, last_radius = 0;
  };
  // Calls visit(number, photon, t, squared distance from the segment over the squared radius there,
  // radius) for every photon within, t along the segment.
  template <typename Visit>
  void ForEachWithin(const Cone& cone, const Visit& visit) const;

 private:
  static constexpr std::size_t kGroup = 8;  // photons

  struct Ball {
    Vec3 center;
    float radius = -1;  // below 0: empty
  };

  std::vector<ScatteredPhoton> photons_;
  std::vector<Vec3> positions_;  // [photons] theirs, without what those that are near need
  // A heap: node 1 is the root, the children of n are 2n and 2n + 1, and node groups_ + g is group
  // g.
  std::vector<Ball> nodes_;
  std::size_t groups_ = 0;  // a power of two, 0 without photons
};

template <typename Visit>
void PhotonTree::ForEachWithin(const Cone& cone, const Visit& visit) const {
  if (groups_ == 0) return;
  const float growth = (cone.last_radius - cone.first_radius) / cone.length;
  const auto is_near = [&](const Ball& ball) {
    const Vec3 to_centre = ball.center - cone.origin;
    const float along = Dot(to_centre, cone.direction);
    if (!(ball.radius >= 0 && along >= -ball.radius && along <= cone.length + ball.radius)) {
      return false;
    }
    const float reach = ball.radius + cone.first_radius +
                        growth * std::clamp(along + ball.radius, 0.0F, cone.length);
    return LengthSquared(to_centre - cone.direction * along) <= reach * reach;
  };
  // Two entries a level at most.
  std::array<std::uint32_t, 128> stack;
  std::size_t depth = 0;
  stack[depth++] = 1;
  while (depth > 0) {
    const std::size_t node = stack[--depth];
    if (!is_near(nodes_[node])) continue;
    if (node < groups_) {
      stack[depth++] = static_cast<std::uint32_t>(2 * node + 1);
      stack[depth++] = static_cast<std::uint32_t>(2 * node);
      continue;
    }
    const std::size_t first = (node - groups_) * kGroup;
    const std::size_t last = std::min(first + kGroup, photons_.size());
    for (std::size_t i = first; i < last; ++i) {
      const Vec3 to_photon = positions_[i] - cone.origin;
      const float t = Dot(to_photon, cone.direction);
      if (!(t >= 0 && t <= cone.length)) continue;
      const float radius = cone.first_radius + growth * t;
      const float t2 = LengthSquared(to_photon - cone.direction * t) / (radius * radius);
      if (t2 < 1) visit(i, photons_[i], t, t2, radius);
    }
  }
}

}  // namespace lucerna
