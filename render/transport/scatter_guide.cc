#include "render/transport/scatter_guide.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "render/math/equal_area_square.h"
#include "render/math/warp.h"
#include "render/transport/primary_numbers.h"

namespace lucerna {
namespace {

using Node = ScatterGuide::Node;

constexpr double kSphere = 4 * kPi64;  // [sr]

double LowShare(const Node& node) {
  return static_cast<double>(node.low_share) / 256;
}

std::size_t Axis(const Node& node, Node::Kind first) {
  return static_cast<std::size_t>(node.kind) - static_cast<std::size_t>(first);
}

}  // namespace

StatusOr<ScatterGuide> ScatterGuide::Create(std::vector<Node> nodes) {
  const auto malformed = [](std::string_view what) {
    return absl::InvalidArgumentError(absl::StrCat("malformed scatter guide: ", std::string(what)));
  };
  if (nodes.size() > kMostScatterNodes) return malformed("it has too many nodes");
  ScatterGuide guide;
  guide.high_.resize(nodes.size());
  std::vector<std::size_t> open;  // whose upper halves are still to come, from the root down
  std::vector<std::size_t> depths(nodes.size());
  std::vector<bool> is_below_directions(nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const Node& node = nodes[i];
    if (node.kind > Node::Kind::kV) return malformed("it halves an unknown dimension");
    if (node.kind == Node::Kind::kLeaf) {
      if (open.empty()) {
        if (i + 1 != nodes.size()) return malformed("nodes are left over");
        break;
      }
      if (i + 1 == nodes.size()) return malformed("it ends too soon");
      const std::size_t parent = open.back();
      open.pop_back();
      guide.high_[parent] = static_cast<std::uint32_t>(i + 1);
      depths[i + 1] = depths[parent] + 1;
      is_below_directions[i + 1] = nodes[parent].HalvesDirections();
      continue;
    }
    if (i + 1 == nodes.size()) return malformed("it ends too soon");
    if (depths[i] >= kMostScatterHalvings) return malformed("it is too deep");
    if (node.HalvesSpace()) {
      if (is_below_directions[i]) return malformed("it halves space below directions");
      if (!std::isfinite(node.place)) return malformed("it halves space nowhere");
    } else if (node.low_share == 0) {
      return malformed("a half gets no photons");
    }
    open.push_back(i);
    depths[i + 1] = depths[i] + 1;
    is_below_directions[i + 1] = node.HalvesDirections();
  }
  guide.nodes_ = std::move(nodes);
  return guide;
}

ScatterGuide::Cell ScatterGuide::CellAt(Vec3 position) const {
  if (empty()) return kNoCell;
  const std::array<float, 3> coordinates = {position.x, position.y, position.z};
  Cell at = 0;
  while (nodes_[at].HalvesSpace())
    at = coordinates[Axis(nodes_[at], Node::Kind::kX)] < nodes_[at].place ? at + 1 : high_[at];
  return nodes_[at].HalvesDirections() ? at : kNoCell;
}

Vec3 ScatterGuide::Draw(Cell cell, float u1, float u2) const {
  std::array<double, 2> low{};
  std::array<double, 2> size = {1, 1};
  std::array<double, 2> u = {static_cast<double>(u1), static_cast<double>(u2)};
  for (std::size_t at = cell; nodes_[at].HalvesDirections();) {
    const std::size_t d = Axis(nodes_[at], Node::Kind::kU);
    const double share = LowShare(nodes_[at]);
    size[d] *= 0.5;
    const bool is_low = u[d] < share;
    const double part = is_low ? share : 1 - share;
    // A quotient may be rounded to 1.
    u[d] = std::min((u[d] - (is_low ? 0 : share)) / part, kBelowOneInBox);
    low[d] += is_low ? 0 : size[d];
    at = is_low ? at + 1 : high_[at];
  }
  return EqualAreaDirection(
      {static_cast<float>(low[0] + size[0] * u[0]), static_cast<float>(low[1] + size[1] * u[1])});
}

double ScatterGuide::DensityAt(Cell cell, Vec3 direction) const {
  const Vec2 place = EqualAreaPlace(direction);
  std::array<double, 2> u = {std::min(static_cast<double>(place.x), kBelowOneInBox),
                             std::min(static_cast<double>(place.y), kBelowOneInBox)};
  double density = 1 / kSphere;
  for (std::size_t at = cell; nodes_[at].HalvesDirections();) {
    const std::size_t d = Axis(nodes_[at], Node::Kind::kU);
    const double share = LowShare(nodes_[at]);
    u[d] *= 2;
    if (u[d] < 1) {
      density *= 2 * share;
      ++at;
    } else {
      u[d] -= 1;
      density *= 2 * (1 - share);
      at = high_[at];
    }
  }
  return density;
}

double ScatterGuide::FluxFactor(Cell cell, Vec3 direction, double bsdf_density) const {
  return bsdf_density / (kGuidedScatterings * DensityAt(cell, direction) +
                         (1 - kGuidedScatterings) * bsdf_density);
}

}  // namespace lucerna
