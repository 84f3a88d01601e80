#include "render/estimate/guide_learning.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <queue>

#include "render/base/status.h"

namespace lucerna {
namespace {

// With so many reports for each pixel, within these bounds, a guide is as good as it will be.
constexpr double kReportsPerPixel = 2;
constexpr double kFewestEnough = 4096, kMostEnough = 32768;
// So many of them are asked for of the first pass, and between one guide and the next.
constexpr double kShareOfFirst = 0.25, kSharePerGuide = 0.125;
// Photons are looked at in so many bins along each dimension of a box: in halves alone, what lies
// in the middle would not be seen.
constexpr std::size_t kBins = 8;
// A box with fewer is not halved.
constexpr std::size_t kFewestReports = 8;
// Of bins of equals the sum of squared deviations has the mean 7 and the deviation sqrt(14): by
// chance one box in a million exceeds this in one of five dimensions.
constexpr double kSignificant = 40;
// Over the mean score: single photons must not stand for a box. The mean is that of limited scores,
// or one score that is a million times the others would be the mean; so many rounds find it.
constexpr double kLargestScore = 8;
constexpr int kScoreRounds = 8;
// A guide must promise so many times less variance, or passes stay as they are: photons that are
// drawn evenly are spaced evenly over many passes, which is worth as much where a guide says
// little.
constexpr double kLeastGain = 1.5;
// As if every box had so many more reports than it has: what was not found yet may still be there.
constexpr double kMoreReports = 0.25;

struct Box {
  std::size_t begin = 0, end = 0;  // of its reports
  std::array<std::uint8_t, kEmissionDimensions> halvings{};
  PrimaryNumbers low{};  // its lowest corner
  double volume = 1;
  double mass = 0;  // of its reports and of kMoreReports
  // Of leaves, where halving pays: along which dimension, and by how much.
  std::size_t dimension = kEmissionDimensions;
  double gain = 0;
  std::size_t lower = 0, upper = 0;  // of others: the numbers of the halves

  [[nodiscard]] bool is_leaf() const { return lower == 0; }
  [[nodiscard]] double Size(std::size_t d) const { return std::ldexp(1.0, -halvings[d]); }
  [[nodiscard]] PrimaryNumbers Center() const {
    PrimaryNumbers center = low;
    for (std::size_t d = 0; d < kEmissionDimensions; ++d)
      center[d] += Size(d) / 2;
    return center;
  }
};

class Grower {
 public:
  Grower(std::span<const EmissionReport> reports, std::span<const double> mass,
         const MassAt& mass_at)
      : reports_(reports), mass_(mass), mass_at_(mass_at), order_(reports.size()) {
    std::iota(order_.begin(), order_.end(), 0);
  }

  GrownGuide Grow() {
    boxes_.push_back(Measured({.end = order_.size()}));
    const auto less = [this](std::size_t a, std::size_t b) {
      return boxes_[a].gain < boxes_[b].gain || (boxes_[a].gain == boxes_[b].gain && a > b);
    };
    std::priority_queue<std::size_t, std::vector<std::size_t>, decltype(less)> best(less);
    const auto offer = [&](std::size_t number) {
      if (boxes_[number].gain > 0) best.push(number);
    };
    offer(0);
    while (!best.empty() && boxes_.size() + 2 <= kMostGuideNodes) {
      const std::size_t number = best.top();
      best.pop();
      Halve(number);
      offer(boxes_[number].lower);
      offer(boxes_[number].upper);
    }
    double sum = 0;
    for (const Box& box : boxes_) {
      if (box.is_leaf()) sum += std::sqrt(box.volume * box.mass);
    }
    GrownGuide grown;
    if (!(sum > 0) || !std::isfinite(sum)) return grown;
    double even = 0;
    double guided = 0;
    for (const Box& box : boxes_) {
      if (!box.is_leaf()) continue;
      even += box.mass;
      guided += box.mass * box.volume / ShareOf(box, sum);
    }
    grown.gain = even / guided;
    Emit(0, sum, grown.nodes);
    return grown;
  }

 private:
  [[nodiscard]] unsigned int NumberOf(std::size_t at, std::size_t dimension) const {
    return reports_[order_[at]].numbers[dimension];
  }

  // Of all photons, in a leaf; `sum` is that of sqrt(volume mass) over all leaves.
  [[nodiscard]] static double ShareOf(const Box& leaf, double sum) {
    return kUnguidedShare * leaf.volume +
           (1 - kUnguidedShare) * std::sqrt(leaf.volume * leaf.mass) / sum;
  }

  // Sets mass, and along which dimension to halve.
  [[nodiscard]] Box Measured(Box box) const {
    double mass = 0;
    double squares = 0;
    std::array<std::array<double, kBins>, kEmissionDimensions> bins{};
    for (std::size_t at = box.begin; at < box.end; ++at) {
      const double of_report = mass_[order_[at]];
      mass += of_report;
      squares += of_report * of_report;
      for (std::size_t d = 0; d < kEmissionDimensions; ++d) {
        const unsigned int within = (NumberOf(at, d) << box.halvings[d]) & 0xFFFFU;
        bins[d][within * kBins >> 16] += of_report;
      }
    }
    const double more = kMoreReports * mass_at_(box.Center());
    box.mass = mass + more;
    if (box.end - box.begin < kFewestReports || !(squares > 0)) return box;
    const double equals = mass * mass / squares;  // so many of equal mass would say as much
    for (std::size_t d = 0; d < kEmissionDimensions; ++d) {
      // Three more halvings are seen in the bins.
      if (box.halvings[d] + 3 > kMostHalvings) continue;
      double deviation = 0;
      double roots = 0;
      const double even = mass / kBins;
      for (const double bin : bins[d]) {
        deviation += (bin - even) * (bin - even);
        roots += std::sqrt((bin + more / kBins) / kBins);
      }
      if (deviation * equals < kSignificant * even * mass) continue;
      // Of the sum over boxes of sqrt(volume mass), if the bins were boxes.
      const double gain = std::sqrt(box.volume) * (std::sqrt(box.mass) - roots);
      if (gain > box.gain) {
        box.gain = gain;
        box.dimension = d;
      }
    }
    return box;
  }

  void Halve(std::size_t number) {
    const Box box = boxes_[number];
    const std::size_t d = box.dimension;
    const unsigned int bit = 0x8000U >> box.halvings[d];
    const auto begin = order_.begin();
    const auto middle = std::stable_partition(
        begin + static_cast<std::ptrdiff_t>(box.begin),
        begin + static_cast<std::ptrdiff_t>(box.end),
        [&](std::uint32_t report) { return (reports_[report].numbers[d] & bit) == 0; });
    Box lower = {.begin = box.begin,
                 .end = static_cast<std::size_t>(middle - begin),
                 .halvings = box.halvings,
                 .low = box.low,
                 .volume = box.volume / 2};
    ++lower.halvings[d];
    Box upper = lower;
    upper.begin = lower.end;
    upper.end = box.end;
    upper.low[d] += lower.Size(d);
    boxes_[number].lower = boxes_.size();
    boxes_[number].upper = boxes_.size() + 1;
    boxes_.push_back(Measured(lower));
    boxes_.push_back(Measured(upper));
  }

  // Appends the nodes of a box in preorder. Returns its share of the photons.
  double Emit(std::size_t number, double sum, std::vector<PhotonGuide::Node>& nodes) const {
    const Box& box = boxes_[number];
    const std::size_t at = nodes.size();
    nodes.emplace_back();
    if (box.is_leaf()) return ShareOf(box, sum);
    const double low = Emit(box.lower, sum, nodes);
    const double high = Emit(box.upper, sum, nodes);
    nodes[at] = {.dimension = static_cast<std::uint8_t>(box.dimension),
                 .low_share = static_cast<std::uint32_t>(
                     std::clamp(std::rint(low / (low + high) * 0x1p32), 1.0, 0x1p32 - 1))};
    return low + high;
  }

  std::span<const EmissionReport> reports_;
  std::span<const double> mass_;
  const MassAt& mass_at_;
  std::vector<std::uint32_t> order_;
  std::vector<Box> boxes_;
};

double ShareOf(std::uint32_t times_2_32) {
  return static_cast<double>(times_2_32) * 0x1p-32;
}

std::uint32_t ReportedShare(double share) {
  return static_cast<std::uint32_t>(std::clamp(std::rint(share * 0x1p32), 0.0, 0x1p32 - 1));
}

// As many equal masses as would say as much.
double EqualsOf(std::span<const double> masses) {
  double sum = 0;
  double squares = 0;
  for (const double mass : masses) {
    sum += mass;
    squares += mass * mass;
  }
  return squares > 0 ? sum * sum / squares : 0;
}

double Inverse(double positive) {
  return positive > 0 ? 1 / positive : 0;
}

// How pilot paths compare with photons.
struct PilotWord {
  double known = 0;   // the share of the photons' light that pilot paths find at all
  double trials = 0;  // so many photons that are drawn evenly would say as much
};
// Given what both found, and what pilot paths bring to the image over what photons do.
PilotWord WordOf(std::span<const double> photons, std::span<const double> pilots, double brought) {
  const double of_pilots = std::accumulate(pilots.begin(), pilots.end(), 0.0);
  if (!(of_pilots > 0)) return {};
  // Each is known up to chance: two standard deviations are granted to both.
  const auto granted = [](std::span<const double> found) { return 2 / std::sqrt(EqualsOf(found)); };
  const double most = brought * (1 + granted(pilots));
  const double least = 1 - granted(photons);
  return {.known = least > most ? most / least : 1, .trials = EqualsOf(pilots) / of_pilots};
}

}  // namespace

double LimitScores(std::span<double> scores) {
  double mean = 0;
  for (int round = 0; round < kScoreRounds; ++round) {
    const double largest = round == 0 ? HUGE_VAL : kLargestScore * mean;
    mean = 0;
    for (double& score : scores) {
      score = std::min(score, largest);
      mean += score / static_cast<double>(scores.size());
    }
  }
  return mean;
}

GrownGuide GrowGuide(std::span<const EmissionReport> reports, std::span<const double> mass,
                     const MassAt& mass_at) {
  return Grower(reports, mass, mass_at).Grow();
}

GuideLearner::GuideLearner(std::size_t pixels)
    : enough_reports_(
          std::clamp(kReportsPerPixel * static_cast<double>(pixels), kFewestEnough, kMostEnough)) {}

PhotonGuide GuideLearner::First(std::uint64_t photons_per_pass) const {
  const auto photons = static_cast<double>(std::max<std::uint64_t>(photons_per_pass, 1));
  return PhotonGuide::Create({}, ReportedShare(kShareOfFirst * enough_reports_ / photons)).value();
}

void GuideLearner::Add(std::span<const EmissionReport> reports,
                       std::shared_ptr<const PhotonGuide> guide, std::uint64_t photons) {
  if (guide->reported() == 0 || photons == 0) return;
  std::vector<Drawn>& drawn = numbers_.drawn;
  const double trials = static_cast<double>(photons) * ShareOf(guide->reported()) *
                        guide->ReportableShare(/*flux_factor=*/1);
  // Rounds are added in order, and so are their guides.
  if (drawn.empty() || *drawn.back().guide != *guide) drawn.push_back({std::move(guide), 0});
  drawn.back().trials += trials;
  numbers_.reports.insert(numbers_.reports.end(), reports.begin(), reports.end());
}

double GuideLearner::TrialsAt(const PrimaryNumbers& numbers, double flux) const {
  double trials = 0;
  for (const Drawn& drawn : numbers_.drawn)
    trials += drawn.trials / drawn.guide->WeightAt(numbers);
  return trials * ReportFactor(flux);
}

PhotonGuide GuideLearner::Next(std::uint64_t passes, std::uint64_t photons_per_pass,
                               const ScoreAt& score_at, const FluxAt& flux_at,
                               const PilotEmissions& pilots,
                               std::shared_ptr<const ScatterGuide> scatterings) const {
  // What photons reported, then what pilot paths did.
  std::vector<EmissionReport> reports = numbers_.reports;
  const std::size_t by_photons = reports.size();
  for (const PilotEmission& pilot : pilots.emissions)
    reports.push_back({InSteps(pilot.numbers), pilot.pixel});
  double all_trials = 0;
  for (const Drawn& drawn : numbers_.drawn)
    all_trials += drawn.trials;
  std::vector<double> scores;
  scores.reserve(reports.size());
  for (const EmissionReport& report : reports)
    scores.push_back(score_at(report.pixel));
  const double mean_score = LimitScores(scores);
  // Photons of all guides and pilot paths are so many ways to find an emission, and each finding
  // counts by the balance heuristic of Veach & Guibas 1995: by one over the findings that were to
  // be expected there, in all ways together.
  std::vector<double> fluxes(reports.size());
  std::vector<double> trials(reports.size());
  std::vector<double> found(reports.size());
  for (std::size_t i = 0; i < reports.size(); ++i) {
    // Each takes a walk down every guide so far.
    const PrimaryNumbers numbers = NumbersOf(reports[i].numbers);
    fluxes[i] = flux_at(numbers);
    trials[i] = TrialsAt(numbers, fluxes[i]);
    found[i] = i < by_photons ? Inverse(trials[i]) : pilots.emissions[i - by_photons].found;
  }
  const std::span<double> of_photons = std::span(found).first(by_photons);
  const std::span<double> of_pilots = std::span(found).subspan(by_photons);
  const PilotWord word = WordOf(of_photons, of_pilots, pilots.brought);
  const auto found_by_photon = [&word](double t) {
    return word.known * Inverse(t + word.trials) + (1 - word.known) * Inverse(t);
  };
  for (std::size_t i = 0; i < reports.size(); ++i) {
    found[i] = i < by_photons ? found_by_photon(trials[i])
                              : found[i] * word.trials / (trials[i] + word.trials);
  }
  const auto mass_of = [](double of_found, double flux, double score) {
    return of_found * flux * flux * score;
  };
  std::vector<double> mass(reports.size());
  for (std::size_t i = 0; i < reports.size(); ++i)
    mass[i] = mass_of(found[i], fluxes[i], scores[i]);
  GrownGuide grown = GrowGuide(reports, mass, [&](const PrimaryNumbers& numbers) {
    const double flux = flux_at(numbers);
    return mass_of(found_by_photon(TrialsAt(numbers, flux)), flux, mean_score);
  });
  PhotonGuide guide;
  if (grown.gain >= kLeastGain) {
    StatusOr<PhotonGuide> created = PhotonGuide::Create(std::move(grown.nodes), 0);
    if (created.ok()) guide = *std::move(created);
  }
  guide = PhotonGuide::Create(guide.nodes(), 0, scatterings).value();
  if (passes >= kLastGuidePass || static_cast<double>(by_photons) >= enough_reports_) return guide;
  // Of the photons that the guide draws; where none was found, all are reported that are.
  double found_share = Inverse(all_trials);
  for (std::size_t i = 0; i < reports.size(); ++i)
    found_share +=
        found[i] * ReportFactor(fluxes[i]) / guide.WeightAt(NumbersOf(reports[i].numbers));
  found_share = std::min(1.0, found_share);
  const auto photons = static_cast<double>(photons_per_pass);
  const double asked = std::min(
      kSharePerGuide * enough_reports_ / (static_cast<double>(passes) * photons * found_share),
      static_cast<double>(kMostReports) / photons);  // even if all are found
  return PhotonGuide::Create(guide.nodes(), ReportedShare(asked), guide.scatterings()).value();
}

}  // namespace lucerna
