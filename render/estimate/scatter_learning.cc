#include "render/estimate/scatter_learning.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

#include "render/estimate/guide_learning.h"
#include "render/math/equal_area_square.h"
#include "render/math/warp.h"

namespace lucerna {
namespace {

using Node = ScatterGuide::Node;

// A cell of space with more reports is halved.
constexpr std::size_t kMostInCell = 128;
// A box of directions with fewer, or with less than this share of its cell's mass, is not halved,
// nor one of so many halvings.
constexpr std::size_t kFewestInBox = 8;
constexpr double kLeastShare = 0.01;
constexpr std::size_t kMostBoxHalvings = 16;
// As if every box had so many more mean reports than it has: what was not found yet may still be
// there.
constexpr double kMoreReports = 0.25;
// A cell's tree must promise so many times less variance: it was grown from the same reports.
constexpr double kLeastGain = 2;
// Cells of further reports have no tree once so many nodes are used. A tree has fewer than
// kMostInCell leaves, and space that cannot be halved any more is the only larger cell.
constexpr std::size_t kNodesInUse = kMostScatterNodes / 2;

class Learner {
 public:
  explicit Learner(std::span<const ScatterReport> reports)
      : reports_(reports), order_(reports.size()), places_(reports.size()) {
    std::iota(order_.begin(), order_.end(), 0U);
    mass_.reserve(reports.size());
    for (const ScatterReport& report : reports)
      mass_.push_back(report.mass);
    LimitScores(mass_);
    for (std::size_t i = 0; i < reports.size(); ++i) {
      const Vec2 place = EqualAreaPlace(reports[i].direction);
      places_[i] = {place.x, place.y};
    }
  }

  [[nodiscard]] std::vector<Node> Learn() {
    if (!reports_.empty()) HalveSpace(0, order_.size(), 0);
    return std::move(nodes_);
  }

 private:
  [[nodiscard]] std::array<float, 3> At(std::uint32_t report) const {
    const Vec3 p = reports_[report].position;
    return {p.x, p.y, p.z};
  }

  // Reports in order_[begin, end).
  void HalveSpace(std::size_t begin, std::size_t end, std::size_t depth) {
    const std::size_t at = nodes_.size();
    nodes_.emplace_back();
    if (end - begin > kMostInCell && depth + kMostBoxHalvings < kMostScatterHalvings) {
      std::array<float, 3> low = At(order_[begin]);
      std::array<float, 3> high = low;
      for (std::size_t i = begin; i < end; ++i) {
        const std::array<float, 3> p = At(order_[i]);
        for (std::size_t d = 0; d < 3; ++d) {
          low[d] = std::min(low[d], p[d]);
          high[d] = std::max(high[d], p[d]);
        }
      }
      std::size_t axis = 0;
      for (std::size_t d = 1; d < 3; ++d) {
        if (high[d] - low[d] > high[axis] - low[axis]) axis = d;
      }
      const auto first = order_.begin() + static_cast<std::ptrdiff_t>(begin);
      const auto last = order_.begin() + static_cast<std::ptrdiff_t>(end);
      const auto middle = first + (last - first) / 2;
      std::nth_element(first, middle, last,
                       [&](std::uint32_t a, std::uint32_t b) { return At(a)[axis] < At(b)[axis]; });
      const float place = At(*middle)[axis];
      // In an order that does not depend on how the middle was found.
      std::sort(first, last);
      const auto upper = std::stable_partition(
          first, last, [&](std::uint32_t report) { return At(report)[axis] < place; });
      if (upper != first) {
        const auto split = static_cast<std::size_t>(upper - order_.begin());
        HalveSpace(begin, split, depth + 1);
        HalveSpace(split, end, depth + 1);
        // Halves of which neither has a guided cell are one.
        if (nodes_.size() == at + 3 && nodes_[at + 1].kind == Node::Kind::kLeaf &&
            nodes_[at + 2].kind == Node::Kind::kLeaf) {
          nodes_.resize(at + 1);
        } else {
          nodes_[at].kind =
              static_cast<Node::Kind>(static_cast<std::size_t>(Node::Kind::kX) + axis);
          nodes_[at].place = place;
        }
        return;
      }
    }
    GuideCell(begin, end);
  }

  // A box of directions, with its share of the guided ones but for a common factor.
  struct Box {
    std::size_t begin = 0, end = 0;  // of its reports
    std::array<float, 2> low{};      // its lowest corner on the square
    std::size_t halvings = 0;        // along each in turn
    double share = 0;

    [[nodiscard]] double Volume() const { return std::ldexp(1.0, -static_cast<int>(halvings)); }
  };

  // In place of the last node.
  void GuideCell(std::size_t begin, std::size_t end) {
    nodes_.pop_back();
    const std::size_t at = nodes_.size();
    cell_mass_ = 0;
    double spread = 0;
    for (std::size_t i = begin; i < end; ++i) {
      cell_mass_ += mass_[order_[i]];
      spread += Spread(order_[i]);
    }
    more_ = kMoreReports * spread / static_cast<double>(end - begin);
    boxes_.clear();
    const double sum = HalveDirections({.begin = begin, .end = end});
    double guided = 0;
    for (const Box& box : boxes_) {
      const double density = box.share / sum / box.Volume() / (4 * kPi64);
      for (std::size_t i = box.begin; i < box.end; ++i) {
        const auto p = static_cast<double>(reports_[order_[i]].density);
        guided +=
            mass_[order_[i]] * p / (kGuidedScatterings * density + (1 - kGuidedScatterings) * p);
      }
    }
    if (sum > 0 && cell_mass_ > kLeastGain * guided && nodes_.size() < kNodesInUse) return;
    nodes_.resize(at);
    nodes_.emplace_back();
  }

  // What a report's photons add to the variance, over what they would in a box with all directions.
  [[nodiscard]] double Spread(std::uint32_t report) const {
    return mass_[report] * static_cast<double>(reports_[report].density);
  }

  // Returns the sum of shares over its leaves.
  double HalveDirections(Box box) {
    const std::size_t at = nodes_.size();
    nodes_.emplace_back();
    double mass = 0;
    double spread = 0;
    for (std::size_t i = box.begin; i < box.end; ++i) {
      mass += mass_[order_[i]];
      spread += Spread(order_[i]);
    }
    if (box.end - box.begin < kFewestInBox || box.halvings == kMostBoxHalvings ||
        mass < kLeastShare * cell_mass_) {
      box.share = std::sqrt((spread + more_) * box.Volume());
      boxes_.push_back(box);
      return box.share;
    }
    const std::size_t d = box.halvings % 2;
    ++box.halvings;
    const float middle = box.low[d] + std::ldexp(1.0F, -static_cast<int>((box.halvings + 1) / 2));
    const auto first = order_.begin();
    const auto split =
        std::stable_partition(first + static_cast<std::ptrdiff_t>(box.begin),
                              first + static_cast<std::ptrdiff_t>(box.end),
                              [&](std::uint32_t report) { return places_[report][d] < middle; });
    Box half = box;
    half.end = static_cast<std::size_t>(split - first);
    const double lower = HalveDirections(half);
    half = box;
    half.begin = static_cast<std::size_t>(split - first);
    half.low[d] = middle;
    const double higher = HalveDirections(half);
    nodes_[at].kind = d == 0 ? Node::Kind::kU : Node::Kind::kV;
    nodes_[at].low_share = static_cast<std::uint8_t>(
        std::clamp(std::rint(256 * lower / (lower + higher)), 1.0, 255.0));
    return lower + higher;
  }

  std::span<const ScatterReport> reports_;
  std::vector<std::uint32_t> order_;
  std::vector<double> mass_;
  std::vector<std::array<float, 2>> places_;
  std::vector<Node> nodes_;
  // Of the cell in work: leaves, mass, and what each box has more (kMoreReports).
  std::vector<Box> boxes_;
  double cell_mass_ = 0;
  double more_ = 0;
};

}  // namespace

ScatterGuide LearnScatterGuide(std::span<const ScatterReport> reports) {
  StatusOr<ScatterGuide> guide = ScatterGuide::Create(Learner(reports).Learn());
  return guide.ok() ? *std::move(guide) : ScatterGuide();
}

}  // namespace lucerna
