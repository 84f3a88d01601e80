#include "worker/photon_tree.h"

#include <bit>
#include <tuple>

#include "render/math/octahedral.h"

namespace lucerna {
namespace {

// Every third bit of the result, from the 10 bits of `value`.
std::uint32_t SpreadBits(std::uint32_t value) {
  value &= 0x3FF;
  value = (value | value << 16) & 0x030000FF;
  value = (value | value << 8) & 0x0300F00F;
  value = (value | value << 4) & 0x030C30C3;
  value = (value | value << 2) & 0x09249249;
  return value;
}

// Place along a Morton curve through the box.
std::uint32_t MortonCode(Vec3 position, const Bounds& box) {
  std::uint32_t code = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const float size = box.high[axis] - box.low[axis];
    const float place = size > 0 ? (position[axis] - box.low[axis]) / size : 0;
    const auto cell = static_cast<std::uint32_t>(std::clamp(place * 1024, 0.0F, 1023.0F));
    code |= SpreadBits(cell) << axis;
  }
  return code;
}

}  // namespace

PhotonTree::PhotonTree(const std::vector<Deposits>& deposits, ThreadTeam& team) {
  std::size_t count = 0;
  Bounds box;
  for (const Deposits& chunk : deposits) {
    count += chunk.size();
    for (const Deposit& row : chunk.rows)
      box.Add(row.position);
  }
  if (count == 0) return;
  // Equal codes stay in the order of the input.
  struct Entry {
    std::uint32_t code, chunk, row;
  };
  std::vector<Entry> order;
  order.reserve(count);
  for (std::uint32_t c = 0; c < deposits.size(); ++c) {
    for (std::uint32_t r = 0; r < deposits[c].size(); ++r)
      order.push_back({MortonCode(deposits[c].rows[r].position, box), c, r});
  }
  std::ranges::sort(order, [](const Entry& a, const Entry& b) {
    return std::tie(a.code, a.chunk, a.row) < std::tie(b.code, b.chunk, b.row);
  });
  photons_.resize(count);
  positions_.resize(count);
  groups_ = std::bit_ceil((count + kGroup - 1) / kGroup);
  std::vector<Bounds> boxes(2 * groups_);
  team.For(groups_, 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t group = begin; group < end; ++group) {
      for (std::size_t i = group * kGroup; i < std::min((group + 1) * kGroup, count); ++i) {
        const Deposits& chunk = deposits[order[i].chunk];
        const Deposit& row = chunk.rows[order[i].row];
        photons_[i] = {row.flux, row.key, DecodeOctahedral(chunk.arrivals_oct[order[i].row]),
                       row.source};
        positions_[i] = row.position;
        boxes[groups_ + group].Add(row.position);
      }
    }
  });
  for (std::size_t node = groups_ - 1; node > 0; --node) {
    for (const Bounds& child : {boxes[2 * node], boxes[2 * node + 1]}) {
      if (child.empty()) continue;
      boxes[node].Add(child.low);
      boxes[node].Add(child.high);
    }
  }
  nodes_.resize(2 * groups_);
  for (std::size_t node = 1; node < nodes_.size(); ++node) {
    if (boxes[node].empty()) continue;
    // A little more, for rounding.
    nodes_[node] = {boxes[node].Center(), 0.5F * boxes[node].Diagonal() * (1 + 0x1p-18F) +
                                              0x1p-20F * MaxAbs(boxes[node].Center())};
  }
}

}  // namespace lucerna
