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
// Over the mean score: single photons must not stand for a box.
constexpr double kLargestScore = 8;
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

// Two estimates of the same masses become parts of one, each in proportion to its EqualsOf. Returns
// the share of `a`.
double BalanceMasses(std::span<double> a, std::span<double> b) {
  const double of_a = EqualsOf(a);
  const double of_b = EqualsOf(b);
  const double share = of_b > 0 ? of_a / (of_a + of_b) : 1;
  for (double& mass : a)
    mass *= share;
  for (double& mass : b)
    mass *= 1 - share;
  return share;
}

}  // namespace

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
  const double trials = static_cast<double>(photons) * ShareOf(guide->reported());
  // Rounds are added in order, and so are their guides.
  if (drawn.empty() || *drawn.back().guide != *guide) drawn.push_back({std::move(guide), 0});
  drawn.back().trials += trials;
  numbers_.reports.insert(numbers_.reports.end(), reports.begin(), reports.end());
}

double GuideLearner::WeightAt(const PrimaryNumbers& numbers, double flux) const {
  double trials = 0;
  double density = 0;
  for (const Drawn& drawn : numbers_.drawn) {
    trials += drawn.trials;
    density += drawn.trials / drawn.guide->WeightAt(numbers);
  }
  const double factor = ReportFactor(flux);
  return factor > 0 ? trials / (density * factor) : 0;
}

PhotonGuide GuideLearner::Next(std::uint64_t passes, std::uint64_t photons_per_pass,
                               const ScoreAt& score_at, const FluxAt& flux_at,
                               std::span<const PilotEmission> pilots) const {
  // What photons reported, then what pilot paths did.
  std::vector<EmissionReport> reports = numbers_.reports;
  const std::size_t by_photons = reports.size();
  for (const PilotEmission& pilot : pilots)
    reports.push_back({InSteps(pilot.numbers), pilot.pixel});
  const double count = std::max(1.0, static_cast<double>(reports.size()));
  double trials = 0;
  for (const Drawn& drawn : numbers_.drawn)
    trials += drawn.trials;
  std::vector<double> scores;
  scores.reserve(reports.size());
  for (const EmissionReport& report : reports)
    scores.push_back(score_at(report.pixel));
  const double largest = kLargestScore * std::accumulate(scores.begin(), scores.end(), 0.0) / count;
  double mean_score = 0;
  for (double& score : scores) {
    score = std::min(score, largest);
    mean_score += score / count;
  }
  // Each weight takes a walk down every guide so far.
  std::vector<double> weights(reports.size());
  std::vector<double> fluxes(reports.size());
  std::vector<double> mass(reports.size());
  const auto mass_of = [](double weight, double flux, double score) {
    return weight * flux * flux * score;
  };
  for (std::size_t i = 0; i < reports.size(); ++i) {
    const PrimaryNumbers numbers = NumbersOf(reports[i].numbers);
    fluxes[i] = flux_at(numbers);
    weights[i] =
        i < by_photons ? WeightAt(numbers, fluxes[i]) : trials * pilots[i - by_photons].found;
    mass[i] = mass_of(weights[i], fluxes[i], scores[i]);
  }
  const std::span of_pilots = std::span(mass).subspan(by_photons);
  const double share = BalanceMasses(std::span(mass).first(by_photons), of_pilots);
  const double of_pilot = std::accumulate(of_pilots.begin(), of_pilots.end(), 0.0) /
                          std::max(1.0, static_cast<double>(of_pilots.size()));
  GrownGuide grown = GrowGuide(reports, mass, [&](const PrimaryNumbers& numbers) {
    const double flux = flux_at(numbers);
    return share * mass_of(WeightAt(numbers, flux), flux, mean_score) + of_pilot;
  });
  PhotonGuide guide;
  if (grown.gain >= kLeastGain) {
    StatusOr<PhotonGuide> created = PhotonGuide::Create(std::move(grown.nodes), 0);
    if (created.ok()) guide = *std::move(created);
  }
  if (passes >= kLastGuidePass || static_cast<double>(by_photons) >= enough_reports_) return guide;
  // Of the photons that the guide draws; where none was found, all are reported that are.
  double found = 1;
  double found_by_pilots = 0;
  for (std::size_t i = 0; i < reports.size(); ++i) {
    (i < by_photons ? found : found_by_pilots) +=
        weights[i] * ReportFactor(fluxes[i]) / guide.WeightAt(NumbersOf(reports[i].numbers));
  }
  const double found_share =
      std::min(1.0, std::max(found, found_by_pilots) / std::max(1.0, trials));
  const auto photons = static_cast<double>(photons_per_pass);
  const double asked = std::min(
      kSharePerGuide * enough_reports_ / (static_cast<double>(passes) * photons * found_share),
      static_cast<double>(kMostReports) / photons);  // even if all are found
  return PhotonGuide::Create(guide.nodes(), ReportedShare(asked)).value();
}

}  // namespace lucerna
