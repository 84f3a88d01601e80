// Which emissions should later passes draw more often?
//
// Of the photons that hitpoints find, some are reported with the numbers that their emission was
// drawn with and the pixel that found them. A photon of the flux Φ adds to the squared relative
// error of its pixels what the score of its pixel says. Where the mean score of the photons drawn
// in a box of emissions, found or not, is m, and the box has the volume V, the fewest photons are
// needed when it gets a share in proportion to V sqrt(m): the least sum of V² m / share. The tree
// of boxes is grown where that gains most, best first, as long as what photons say is significant.
//
// Where few photons come into view there is little to learn from. So emissions that pilot paths
// found from the eye (tracing/pilot_paths.h) count beside those of found photons, by the balance
// heuristic: photons where many were sent, pilot paths where few were. Pilot paths find hardly any
// light that smooth surfaces focus; for the share of the light that they miss, photons count alone.
//
// All follows from sums of whole rounds in order, with correctly rounded operations: the same
// guides on every machine.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "render/estimate/emission_report.h"
#include "render/transport/photon_guide.h"

namespace lucerna {

// From `first_pass` on, photons are drawn by this guide.
struct GuideStep {
  std::uint64_t first_pass = 0;
  std::shared_ptr<const PhotonGuide> guide;
};
// In order of passes.
using GuideSteps = std::vector<GuideStep>;

// A new guide follows from the passes before each of these, all of which end rounds: powers of two
// and the middles between them.
inline constexpr std::uint64_t kLastGuidePass = 1 << 16;
[[nodiscard]] constexpr bool IsGuidePass(std::uint64_t passes) {
  const bool is_middle = passes % 3 == 0 && std::has_single_bit(passes / 3);
  return passes <= kLastGuidePass && (std::has_single_bit(passes) || is_middle);
}

// What a photon found by a pixel adds to the squared relative error, over its squared flux, in any
// unit, at least 0.
using ScoreAt = std::function<double(std::uint32_t pixel)>;
// Of a photon drawn with these numbers without a guide (transport/photon_guide.h, EvenFlux).
using FluxAt = std::function<double(const PrimaryNumbers& numbers)>;

// An emission that a pilot path found, as the image sees it.
struct PilotEmission {
  PrimaryNumbers numbers{};
  std::uint32_t pixel = 0;
  // Stands for so many found photons of one photon that is drawn evenly: the sum over all pilots is
  // the share of such photons that hitpoints find.
  double found = 0;
};

struct PilotEmissions {
  std::vector<PilotEmission> emissions;
  // What pilot paths bring to the image over what photons have brought so far: where it is below 1,
  // photons find light that they do not.
  double brought = 0;
};

class GuideLearner {
 public:
  // Of an image of so many pixels: small ones need fewer reports.
  explicit GuideLearner(std::size_t pixels);

  // What first passes of so many photons are drawn by: an even guide with reports.
  [[nodiscard]] PhotonGuide First(std::uint64_t photons_per_pass) const;

  // Adds what a round reported whose `photons` were drawn by `guide`.
  void Add(std::span<const EmissionReport> reports, std::shared_ptr<const PhotonGuide> guide,
           std::uint64_t photons);

  // The guide after `passes`, of `photons_per_pass` from now on, which draws by `scatterings`.
  [[nodiscard]] PhotonGuide Next(std::uint64_t passes, std::uint64_t photons_per_pass,
                                 const ScoreAt& score_at, const FluxAt& flux_at,
                                 const PilotEmissions& pilots = {},
                                 std::shared_ptr<const ScatterGuide> scatterings = nullptr) const;

  // Photons drawn by one guide.
  struct Drawn {
    std::shared_ptr<const PhotonGuide> guide;
    double trials = 0;  // how many would have been reported if found, at the largest ReportFactor
  };
  // All that is kept, for checkpoints.
  struct Numbers {
    std::vector<EmissionReport> reports;
    std::vector<Drawn> drawn;  // in order of passes
  };
  [[nodiscard]] const Numbers& numbers() const { return numbers_; }
  void Restore(Numbers numbers) { numbers_ = std::move(numbers); }

 private:
  // Of a photon with these numbers and this flux: how many photons that are drawn evenly, and are
  // reported when they are found, would have had its numbers as often as all photons so far did.
  [[nodiscard]] double TrialsAt(const PrimaryNumbers& numbers, double flux) const;

  double enough_reports_;
  Numbers numbers_;
};

// Limits scores to a multiple of their mean, which is that of limited scores. Returns it.
double LimitScores(std::span<double> scores);

// The mass of a report of a photon with these numbers.
using MassAt = std::function<double(const PrimaryNumbers& numbers)>;
struct GrownGuide {
  std::vector<PhotonGuide::Node> nodes;  // empty: an even guide
  double gain = 1;                       // so many times less variance
};
// The guide with the least variance for photons like `reports`, each of which stands for a `mass`
// of the even density times its score. `mass_at` says what a report that was not made yet would
// have.
[[nodiscard]] GrownGuide GrowGuide(std::span<const EmissionReport> reports,
                                   std::span<const double> mass, const MassAt& mass_at);

}  // namespace lucerna
