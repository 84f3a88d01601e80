// Which emissions does a job draw more often than others?
//
// A photon's emission follows from five numbers in [0, 1): which emitter, where on it and into
// which direction. Drawn evenly, they send photons in proportion to power, most of which may land
// out of view. A guide is a piecewise constant density over these numbers, learned from the
// photons that hitpoints found in earlier passes (estimate/guide_learning.h). It is a binary tree:
// each node halves its box along one of the numbers and says which share of the photons goes to
// the lower half. Numbers are warped on the way down, so that evenly spaced ones stay evenly spaced
// in every box (Clarberg, Jarosz, Akenine-Möller & Jensen 2005, "Wavelet Importance Sampling").
//
// At least kUnguidedShare of the density is even, so that no emission is lost, and no photon has
// more than 1/kUnguidedShare times the flux that it would have without a guide. Source: Hachisuka &
// Jensen 2011, "Robust Adaptive Photon Tracing using Photon Path Visibility", from where the even
// share and learning from visible photons come.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "render/base/status.h"
#include "render/transport/primary_numbers.h"
#include "render/transport/scatter_guide.h"

namespace lucerna {

class LightSet;

inline constexpr double kUnguidedShare = 0.25;
// At most so many nodes, and so many halvings along one dimension.
inline constexpr std::size_t kMostGuideNodes = 2047;
inline constexpr int kMostHalvings = 16;

class PhotonGuide {
 public:
  struct Node {
    std::uint8_t dimension = kEmissionDimensions;  // along which it is halved; of leaves: none
    std::uint32_t low_share = 0;                   // of its photons, times 2^32
    bool operator==(const Node&) const = default;
  };

  // Even.
  PhotonGuide() = default;
  // `nodes` in preorder, the lower half first; none or a single leaf: even. `reported` times 2^-32
  // is the share of the found photons that workers name to the coordinator. `scatterings`: by which
  // directions are drawn where photons first land; nullptr or empty: by BSDFs alone.
  // Errors: INVALID_ARGUMENT for nodes that make no tree, or too large a one, or give a half too
  // little.
  [[nodiscard]] static StatusOr<PhotonGuide> Create(
      std::vector<Node> nodes, std::uint32_t reported,
      std::shared_ptr<const ScatterGuide> scatterings = nullptr);

  // Of emissions.
  [[nodiscard]] bool is_even() const { return nodes_.size() <= 1; }
  [[nodiscard]] std::uint32_t reported() const { return reported_; }
  [[nodiscard]] const std::vector<Node>& nodes() const { return nodes_; }
  // nullptr, or with cells.
  [[nodiscard]] const std::shared_ptr<const ScatterGuide>& scatterings() const {
    return scatterings_;
  }
  // Of the photons that are drawn with numbers of this factor (Draw), the share that stands for all
  // photons as they would be without a guide, times the same of its scattering (ScatterGuide).
  [[nodiscard]] double UnguidedShare(double weight) const {
    return (is_even() ? 1 : weight * kUnguidedShare) *
           (scatterings_ != nullptr ? 1 - kGuidedScatterings : 1);
  }
  // The mean of this share over all photons, at least kUnguidedShare (1 - kGuidedScatterings).
  [[nodiscard]] double UnguidedShare() const { return UnguidedShare(/*weight=*/1); }
  // Of found photons whose flux a guided scattering has multiplied by `flux_factor` (1: of all
  // others), the share that may be reported: in proportion to its square, as what they add to the
  // variance. With the strong ones left out of it, so that more of the others may be reported,
  // guides of emissions lose the light that the scatter guide does not know.
  [[nodiscard]] double ReportableShare(double flux_factor) const {
    if (scatterings_ == nullptr) return 1;
    const double of_largest = flux_factor * (1 - kGuidedScatterings);
    return of_largest * of_largest;
  }

  // Makes evenly distributed numbers those of this guide. Returns the even density over the guide's
  // there: the factor of the photon's flux, at most about 1 / kUnguidedShare.
  double Draw(PrimaryNumbers& numbers) const;
  // The same factor for numbers that were drawn.
  [[nodiscard]] double WeightAt(PrimaryNumbers numbers) const;

  bool operator==(const PhotonGuide& other) const {
    const bool is_equal = nodes_ == other.nodes_ && reported_ == other.reported_;
    if (scatterings_ == nullptr || other.scatterings_ == nullptr)
      return is_equal && scatterings_ == other.scatterings_;
    return is_equal && *scatterings_ == *other.scatterings_;
  }

 private:
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> high_;  // [nodes] the upper half's
  std::uint32_t reported_ = 0;
  std::shared_ptr<const ScatterGuide> scatterings_;
};

// Luminance of the flux of a photon that is drawn evenly with these numbers, over the power of all
// lights; 0 where none is emitted.
[[nodiscard]] double EvenFlux(const LightSet& lights, const PrimaryNumbers& numbers);
// How much less often a found photon of this EvenFlux is reported than PhotonGuide::reported says:
// at most 1, and in proportion to the flux of weak ones. Else a weak light in view would leave no
// room for the few photons that are found of a strong one.
[[nodiscard]] double ReportFactor(double flux);

}  // namespace lucerna
