#include "render/transport/photon_guide.h"

#include <algorithm>
#include <cmath>

#include "render/transport/light.h"

namespace lucerna {
namespace {

// A factor of flux beyond this would come of bytes that no coordinator has made.
constexpr double kLargestWeight = 1.01 / kUnguidedShare;

double ShareOf(std::uint32_t times_2_32) {
  return static_cast<double>(times_2_32) * 0x1p-32;
}

}  // namespace

StatusOr<PhotonGuide> PhotonGuide::Create(std::vector<Node> nodes, std::uint32_t reported,
                                          std::shared_ptr<const ScatterGuide> scatterings) {
  const auto malformed = [](std::string_view what) {
    return absl::InvalidArgumentError(absl::StrCat("malformed photon guide: ", std::string(what)));
  };
  if (nodes.size() > kMostGuideNodes) return malformed("it has too many nodes");
  PhotonGuide guide;
  guide.high_.resize(nodes.size());
  // Boxes whose upper halves are still to come.
  struct Open {
    std::size_t node;
    std::array<std::uint8_t, kEmissionDimensions> halvings;
    double weight;
  };
  std::vector<Open> open;
  Open here = {0, {}, 1};
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const Node& node = nodes[i];
    if (node.dimension > kEmissionDimensions) return malformed("it halves an unknown dimension");
    if (node.dimension < kEmissionDimensions) {
      if (node.low_share == 0) return malformed("a half gets no photons");
      if (++here.halvings[node.dimension] > kMostHalvings) return malformed("it is too deep");
      open.push_back({i, here.halvings, here.weight});
      here.weight *= 0.5 / ShareOf(node.low_share);
      if (i + 1 == nodes.size()) return malformed("it ends too soon");
      continue;
    }
    if (node.low_share != 0) return malformed("a leaf has halves");
    if (!(here.weight <= kLargestWeight)) return malformed("a box gets too few photons");
    if (open.empty()) {
      if (i + 1 != nodes.size()) return malformed("nodes are left over");
      break;
    }
    if (i + 1 == nodes.size()) return malformed("it ends too soon");
    const Open parent = open.back();
    open.pop_back();
    guide.high_[parent.node] = static_cast<std::uint32_t>(i + 1);
    here.halvings = parent.halvings;
    here.weight = parent.weight * 0.5 / (1 - ShareOf(nodes[parent.node].low_share));
  }
  guide.nodes_ = std::move(nodes);
  guide.reported_ = reported;
  if (scatterings != nullptr && !scatterings->empty()) guide.scatterings_ = std::move(scatterings);
  return guide;
}

double PhotonGuide::Draw(PrimaryNumbers& numbers) const {
  if (is_even()) return 1;
  PrimaryNumbers low{};
  PrimaryNumbers size = {1, 1, 1, 1, 1};
  double weight = 1;
  std::size_t at = 0;
  while (nodes_[at].dimension < kEmissionDimensions) {
    const std::size_t d = nodes_[at].dimension;
    const double share = ShareOf(nodes_[at].low_share);
    size[d] *= 0.5;
    // Selections, not a branch: no processor could predict which half it is.
    const bool is_low = numbers[d] < share;
    const double part = is_low ? share : 1 - share;
    // A quotient may be rounded to 1.
    numbers[d] = std::min((numbers[d] - (is_low ? 0 : share)) / part, kBelowOneInBox);
    low[d] += is_low ? 0 : size[d];
    weight *= 0.5 / part;
    at = is_low ? at + 1 : high_[at];
  }
  for (std::size_t d = 0; d < kEmissionDimensions; ++d)
    numbers[d] = low[d] + size[d] * numbers[d];
  return weight;
}

double PhotonGuide::WeightAt(PrimaryNumbers numbers) const {
  if (is_even()) return 1;
  double weight = 1;
  std::size_t at = 0;
  while (nodes_[at].dimension < kEmissionDimensions) {
    const std::size_t d = nodes_[at].dimension;
    const double share = ShareOf(nodes_[at].low_share);
    numbers[d] *= 2;
    if (numbers[d] < 1) {
      weight *= 0.5 / share;
      ++at;
    } else {
      numbers[d] -= 1;
      weight *= 0.5 / (1 - share);
      at = high_[at];
    }
  }
  return weight;
}

double EvenFlux(const LightSet& lights, const PrimaryNumbers& numbers) {
  const auto single = [&](std::size_t d) { return static_cast<float>(numbers[d]); };
  Emission emission;
  if (!lights.SampleEmission(numbers[4], single(0), single(1), single(2), single(3), emission))
    return 0;
  return static_cast<double>(Luminance(emission.flux)) /
         static_cast<double>(Luminance(lights.TotalPower()));
}

double ReportFactor(double flux) {
  if (!(flux > 0)) return 0;
  if (flux >= 1) return 1;
  // The power of two nearest in its logarithm: the same for numbers that were rounded for a report,
  // and on every machine.
  constexpr double kRootOfHalf = 0.70710678118654752;
  int exponent = 0;
  const double fraction = std::frexp(flux, &exponent);
  return std::ldexp(1.0, fraction < kRootOfHalf ? exponent - 1 : exponent);
}

}  // namespace lucerna
