// What is learned must be what the photons say, and no more.
#include "render/estimate/guide_learning.h"

#include <cmath>
#include <utility>
#include <vector>

#include "gtest/gtest.h"

#include "render/math/rng.h"

namespace lucerna {
namespace {

// Of an image that has as many reports as any.
constexpr std::size_t kGuidedPixels = 1 << 14;

double SameScore(std::uint32_t /*pixel*/) {
  return 1;
}

double OneFlux(const PrimaryNumbers& /*numbers*/) {
  return 1;
}

// A job whose photons are found where `is_found` says so.
class Simulated {
 public:
  explicit Simulated(std::uint64_t photons_per_pass, FluxAt flux_at = OneFlux)
      : photons_(photons_per_pass), flux_at_(std::move(flux_at)) {
    guide_ = std::make_shared<const PhotonGuide>(learner_.First(photons_));
  }

  // Draws the photons of `passes` passes, and learns from them.
  template <typename IsFound>
  void Draw(int passes, const IsFound& is_found, std::uint32_t pixel = 0) {
    std::vector<EmissionReport> reports;
    found_ = 0;
    for (std::uint64_t i = 0; i < photons_ * static_cast<std::uint64_t>(passes); ++i) {
      PrimaryNumbers numbers;
      for (double& number : numbers)
        number = static_cast<double>(rng_.Uniform());
      guide_->Draw(numbers);
      const bool is_reported = static_cast<double>(rng_.Uniform()) * 0x1p32 <
                               guide_->reported() * ReportFactor(flux_at_(numbers));
      if (!is_found(numbers)) continue;
      ++found_;
      if (!is_reported) continue;
      EmissionReport report = {.pixel = pixel};
      for (std::size_t d = 0; d < kEmissionDimensions; ++d)
        report.numbers[d] = static_cast<std::uint16_t>(numbers[d] * 0x1p16);
      reports.push_back(report);
    }
    learner_.Add(reports, guide_, photons_ * static_cast<std::uint64_t>(passes));
    passes_ += static_cast<std::uint64_t>(passes);
  }
  const PhotonGuide& Learn() {
    guide_ =
        std::make_shared<const PhotonGuide>(learner_.Next(passes_, photons_, SameScore, flux_at_));
    return *guide_;
  }
  [[nodiscard]] const GuideLearner& learner() const { return learner_; }
  [[nodiscard]] const PhotonGuide& guide() const { return *guide_; }
  // Of the last passes drawn.
  [[nodiscard]] int found() const { return found_; }

 private:
  std::uint64_t photons_;
  FluxAt flux_at_;
  KeyedRng rng_{7};
  GuideLearner learner_{kGuidedPixels};
  std::shared_ptr<const PhotonGuide> guide_;
  std::uint64_t passes_ = 0;
  int found_ = 0;
};

// A small box in the middle of one dimension, where halves alone show nothing, and beside it in
// another: 1/64 of all.
bool InSmallBox(const PrimaryNumbers& u) {
  return u[1] >= 0.4375 && u[1] < 0.5625 && u[3] >= 0.875;
}

TEST(GuideLearningTest, FindsASmallBoxAndSendsPhotonsThere) {
  Simulated job(16384);
  job.Draw(1, InSmallBox);
  EXPECT_NEAR(job.found(), 256, 64);
  EXPECT_FALSE(job.Learn().is_even());
  job.Draw(8, InSmallBox);
  const PhotonGuide& guide = job.Learn();
  // With n reports the box has a share of sqrt(n / 64) against at most sqrt(volume) of every empty
  // box, whose volumes are 1/2, 1/4, ...: of 2000 reports 5.6 against 2.4.
  EXPECT_GT(job.learner().numbers().reports.size(), 2000U);
  PrimaryNumbers inside;
  inside.fill(0.5);
  inside[3] = 0.95;
  const double share = (1 - kUnguidedShare) * 5.6 / (5.6 + 2.4);
  EXPECT_LT(guide.WeightAt(inside), 1 / (64 * share));
  PrimaryNumbers outside = inside;
  outside[3] = 0.2;
  EXPECT_GT(guide.WeightAt(outside), 2);
  EXPECT_LE(guide.WeightAt(outside), 1.001 / kUnguidedShare);
  job.Draw(1, InSmallBox);
  EXPECT_GT(job.found(), share * 16384);
}

// Before any photon was found, pilot paths say where to send some.
TEST(GuideLearningTest, LearnsFromPilotPathsAlone) {
  constexpr std::uint64_t kPhotons = 16384;
  GuideLearner learner(kGuidedPixels);
  learner.Add({}, std::make_shared<const PhotonGuide>(learner.First(kPhotons)), kPhotons);
  KeyedRng rng(23);
  PilotEmissions pilots = {.emissions = {}, .brought = 1};
  while (pilots.emissions.size() < 1000) {
    PrimaryNumbers u;
    for (double& number : u)
      number = static_cast<double>(rng.Uniform());
    u[1] = 0.4375 + 0.125 * u[1];
    u[3] = 0.875 + 0.125 * u[3];
    pilots.emissions.push_back({.numbers = u, .pixel = 0, .found = 1.0 / 64 / 1000});
  }
  const PhotonGuide guide = learner.Next(1, kPhotons, SameScore, OneFlux, pilots);
  PrimaryNumbers inside;
  inside.fill(0.5);
  inside[3] = 0.95;
  EXPECT_LT(guide.WeightAt(inside), 1.0 / 32);
  // Of the photons that it will draw a part will be found, and of these so many are asked for.
  const double found = kUnguidedShare / 64 + (1 - kUnguidedShare);
  EXPECT_NEAR(guide.reported() * 0x1p-32 * kPhotons * found, 4096, 2000);
  EXPECT_TRUE(learner.Next(1, kPhotons, SameScore, OneFlux).is_even());
}

// Two boxes of 1/128 of all numbers each, along the first.
constexpr double kBoxA = 0.25;
constexpr double kBoxB = 0.75;
PrimaryNumbers InBox(double low, KeyedRng& rng) {
  PrimaryNumbers u;
  for (double& number : u)
    number = static_cast<double>(rng.Uniform());
  u[0] = low + u[0] / 128;
  return u;
}
double WeightIn(const PhotonGuide& guide, double low) {
  PrimaryNumbers at;
  at.fill(0.5);
  at[0] = low + 0.5 / 128;
  return guide.WeightAt(at);
}

// Photons went to one of two boxes that are worth the same. Pilot paths, though far fewer, know
// more of the other.
TEST(GuideLearningTest, PilotPathsCountWherePhotonsAreRare) {
  constexpr int kPilots = 100;  // in each box
  KeyedRng rng(29);
  const auto draw = [&rng](double low, int count) {
    std::vector<EmissionReport> reports;
    for (int i = 0; i < count; ++i)
      reports.push_back({.numbers = InSteps(InBox(low, rng))});
    return reports;
  };
  const std::vector<EmissionReport> first = draw(kBoxA, 4000);
  const std::vector<double> masses(first.size(), 1.0);
  const auto to_a = std::make_shared<const PhotonGuide>(
      PhotonGuide::Create(
          GrowGuide(first, masses, [](const PrimaryNumbers& /*numbers*/) { return 1e-9; }).nodes,
          UINT32_MAX)
          .value());
  const double in_a = WeightIn(*to_a, kBoxA);
  EXPECT_LT(in_a, 0.012);
  EXPECT_GT(WeightIn(*to_a, kBoxB), 3.9);
  // Of so many photons all are reported that are found: of box B ten are to be expected, and by
  // chance there is none.
  constexpr std::uint64_t kPhotons = 5120;
  GuideLearner learner(kGuidedPixels);
  learner.Add(draw(kBoxA, static_cast<int>(kPhotons / 128 / in_a)), to_a, kPhotons);
  PilotEmissions pilots = {.emissions = {}, .brought = 1};
  for (int i = 0; i < kPilots; ++i) {
    for (const double low : {kBoxA, kBoxB}) {
      pilots.emissions.push_back({.numbers = InBox(low, rng), .found = 1.0 / 128 / kPilots});
    }
  }
  const PhotonGuide guide = learner.Next(1, kPhotons, SameScore, OneFlux, pilots);
  // Pilot paths have found in B what 12,800 even photons would, and photons what 1,280 would: ten
  // elevenths of its mass are left, and the density follows the root.
  EXPECT_LT(WeightIn(guide, kBoxA), 0.045);
  EXPECT_NEAR(WeightIn(guide, kBoxB) / WeightIn(guide, kBoxA), std::sqrt(11.0 / 10), 0.1);
}

// Photons find light in two boxes, pilot paths in one of them alone. Where they bring no more than
// a half of the light, they are not believed of the other.
TEST(GuideLearningTest, PhotonsCountForLightThatPilotPathsDoNotFind) {
  constexpr std::uint64_t kPhotons = 1 << 16;
  constexpr int kPilots = 2000;
  KeyedRng rng(31);
  GuideLearner learner(kGuidedPixels);
  const auto even =
      std::make_shared<const PhotonGuide>(PhotonGuide::Create({}, UINT32_MAX).value());
  std::vector<EmissionReport> reports;
  for (std::uint64_t i = 0; i < kPhotons / 128; ++i) {
    for (const double low : {kBoxA, kBoxB})
      reports.push_back({.numbers = InSteps(InBox(low, rng))});
  }
  learner.Add(reports, even, kPhotons);
  PilotEmissions pilots;
  for (int i = 0; i < kPilots; ++i)
    pilots.emissions.push_back({.numbers = InBox(kBoxA, rng), .found = 1.0 / 128 / kPilots});
  const auto ratio_of = [&](double brought) {
    pilots.brought = brought;
    const PhotonGuide guide = learner.Next(1, kPhotons, SameScore, OneFlux, pilots);
    return WeightIn(guide, kBoxB) / WeightIn(guide, kBoxA);
  };
  // Pilot paths are worth p photons, and there were n. A share k of what photons say counts for
  // n / (n + p) of itself, the rest wholly; in box A pilot paths add p / (n + p).
  constexpr double kWorth = 128 * kPilots;
  const auto expected = [](double known) {
    const double of_photons = known * kPhotons / (kPhotons + kWorth) + (1 - known);
    return std::sqrt((of_photons + kWorth / (kPhotons + kWorth)) / of_photons);
  };
  EXPECT_NEAR(ratio_of(1), expected(1), 0.15);
  // With the two standard deviations that are granted to both.
  const double known = 0.5 * (1 + 2 / std::sqrt(kPilots)) / (1 - 2 / std::sqrt(kPhotons / 64));
  EXPECT_NEAR(ratio_of(0.5), expected(known), 0.15);
  EXPECT_GT(ratio_of(1), ratio_of(0.5) + 0.5);
}

// A pixel with a score of a million times that of the others must not decide alone where photons
// go.
TEST(GuideLearningTest, ASingleHugeScoreDoesNotDecide) {
  constexpr std::uint64_t kPhotons = 1 << 16;
  KeyedRng rng(37);
  GuideLearner learner(kGuidedPixels);
  const auto even =
      std::make_shared<const PhotonGuide>(PhotonGuide::Create({}, UINT32_MAX).value());
  std::vector<EmissionReport> reports;
  for (std::uint64_t i = 0; i < kPhotons / 128; ++i)
    reports.push_back({.numbers = InSteps(InBox(kBoxA, rng)), .pixel = i == 0 ? 1U : 0U});
  learner.Add(reports, even, kPhotons);
  const PhotonGuide guide = learner.Next(
      1, kPhotons, [](std::uint32_t pixel) { return pixel == 1 ? 1e6 : 1.0; }, OneFlux);
  EXPECT_LT(WeightIn(guide, kBoxA), 0.1);
}

// A weak light in view, which gets its even share of the photons, and a strong one whose photons
// are hardly ever found: reports of the weak one must not be all there is room for.
TEST(GuideLearningTest, FindsASeldomSeenStrongLightBesideAWeakOneInView) {
  const auto is_weak = [](const PrimaryNumbers& u) { return u[4] < 0.05; };
  const auto is_seen = [](const PrimaryNumbers& u) {
    return u[2] >= 0.5 && u[2] < 0.5 + 0x1p-9 && u[3] >= 0.25 && u[3] < 0.25 + 0x1p-10;
  };
  Simulated job(16384, [&](const PrimaryNumbers& u) { return is_weak(u) ? 1e-6 : 1 / 0.95; });
  int passes = 0;
  for (const int until : {1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256, 384, 512}) {
    job.Draw(until - passes, [&](const PrimaryNumbers& u) { return is_weak(u) || is_seen(u); });
    job.Learn();
    passes = until;
  }
  // Some 15 were found without a guide.
  const double step = 0x1p-11;
  EXPECT_LT(job.guide().WeightAt({0.5, 0.5, 0.5 + step, 0.25 + step, 0.5}), 0.01);
  EXPECT_GT(job.guide().reported(), 0U) << "reports of the weak light are enough";
}

// Of photons with the mean score m, a box of volume V should have a share of V sqrt(m).
TEST(GuideLearningTest, SharesFollowTheRootOfTheScore) {
  std::vector<EmissionReport> reports;
  std::vector<double> mass;
  KeyedRng rng(3);
  for (int i = 0; i < 20000; ++i) {
    EmissionReport report;
    for (std::uint16_t& number : report.numbers)
      number = static_cast<std::uint16_t>(rng.Bits());
    const bool is_low = report.numbers[4] < 0x8000;
    // Equal masses, nine times as many of them in the lower half.
    if (!is_low && i % 9 != 0) continue;
    reports.push_back(report);
    mass.push_back(1);
  }
  const std::vector<PhotonGuide::Node> nodes = GrowGuide(reports, mass, OneFlux).nodes;
  ASSERT_EQ(nodes.size(), 3U);
  EXPECT_EQ(nodes[0].dimension, 4);
  // Three to one, beside the even part.
  const double expected = kUnguidedShare * 0.5 + (1 - kUnguidedShare) * 0.75;
  EXPECT_NEAR(static_cast<double>(nodes[0].low_share) * 0x1p-32, expected, 0.01);
}

TEST(GuideLearningTest, ChanceIsNoReasonToHalve) {
  for (std::uint64_t key = 0; key < 20; ++key) {
    std::vector<EmissionReport> reports(5000);
    KeyedRng rng(key);
    for (EmissionReport& report : reports) {
      for (std::uint16_t& number : report.numbers)
        number = static_cast<std::uint16_t>(rng.Bits());
    }
    EXPECT_TRUE(GrowGuide(reports, std::vector<double>(reports.size(), 1), OneFlux).nodes.size() <=
                1)
        << key;
  }
}

TEST(GuideLearningTest, WhereNothingIsFoundAllThatWillBeIsReported) {
  Simulated job(1000);
  job.Draw(1, [](const PrimaryNumbers&) { return false; });
  const PhotonGuide& guide = job.Learn();
  EXPECT_TRUE(guide.is_even());
  EXPECT_EQ(guide.reported(), UINT32_MAX);
}

// However many photons a pass has, and however few were found so far.
TEST(GuideLearningTest, NeverAsksForMoreThanMessagesHold) {
  for (const std::uint64_t photons : {std::uint64_t{1} << 20, std::uint64_t{1} << 40}) {
    GuideLearner learner(kGuidedPixels);
    learner.Add({}, std::make_shared<const PhotonGuide>(learner.First(photons)), photons);
    const PhotonGuide guide = learner.Next(1, photons, SameScore, OneFlux);
    EXPECT_LE(static_cast<double>(guide.reported()) * 0x1p-32 * static_cast<double>(photons),
              1.001 * static_cast<double>(kMostReports));
    EXPECT_GT(guide.reported(), 0U);
  }
}

TEST(GuideLearningTest, SmallImagesAskForFewReports) {
  EXPECT_EQ(GuideLearner(1).First(1 << 20).reported(), std::uint32_t{1024} << 12);
  EXPECT_EQ(GuideLearner(4096).First(1 << 20).reported(), std::uint32_t{2048} << 12);
  EXPECT_EQ(GuideLearner(1 << 20).First(1 << 20).reported(), std::uint32_t{8192} << 12);
}

TEST(GuideLearningTest, AsksForFewReportsAndThenForNone) {
  Simulated job(1 << 20);
  const auto all = [](const PrimaryNumbers&) { return true; };
  EXPECT_NEAR(static_cast<double>(job.guide().reported()) * 0x1p-32 * (1 << 20), 8192, 1);
  job.Draw(1, all);
  job.Learn();
  // Of the next pass, about 4096.
  EXPECT_NEAR(static_cast<double>(job.guide().reported()) * 0x1p-32 * (1 << 20), 4096, 100);
  Simulated late(64);
  late.Draw(static_cast<int>(kLastGuidePass), all);
  EXPECT_EQ(late.Learn().reported(), 0U);
}

// Photons of all guides together must stand for the even density: where everything is found, an
// even guide is best, whatever drew them.
TEST(GuideLearningTest, PhotonsOfSeveralGuidesStandForTheEvenDensity) {
  const auto low_share = static_cast<std::uint32_t>(0.85 * 0x1p32);
  const auto skewed = std::make_shared<const PhotonGuide>(
      PhotonGuide::Create({{0, low_share}, {}, {}}, UINT32_MAX).value());
  const auto even =
      std::make_shared<const PhotonGuide>(PhotonGuide::Create({}, UINT32_MAX / 2).value());
  constexpr std::uint64_t kPhotons = 8192;
  GuideLearner learner(kGuidedPixels);
  KeyedRng rng(11);
  for (const auto& guide : {even, skewed, even, skewed}) {
    std::vector<EmissionReport> reports;
    for (std::uint64_t i = 0; i < kPhotons; ++i) {
      if (guide == even && i % 2 == 1) continue;  // not reported
      PrimaryNumbers numbers;
      for (double& number : numbers)
        number = static_cast<double>(rng.Uniform());
      guide->Draw(numbers);
      EmissionReport& report = reports.emplace_back();
      for (std::size_t d = 0; d < kEmissionDimensions; ++d)
        report.numbers[d] = static_cast<std::uint16_t>(numbers[d] * 0x1p16);
    }
    learner.Add(reports, guide, kPhotons);
  }
  EXPECT_TRUE(learner.Next(4, kPhotons, SameScore, OneFlux).is_even());
  // As they were drawn, most lie in the lower half: without weights that would be seen.
  const std::vector<EmissionReport>& reports = learner.numbers().reports;
  EXPECT_GT(GrowGuide(reports, std::vector<double>(reports.size(), 1), OneFlux).nodes.size(), 1U);
}

// Where directions are drawn by a guide too, flux is up to twice as large, and a photon of factor 1
// is reported a quarter as often.
TEST(GuideLearningTest, ReportsAreRarerWhereDirectionsAreGuided) {
  using Node = ScatterGuide::Node;
  const auto scatterings = std::make_shared<const ScatterGuide>(
      ScatterGuide::Create({{.kind = Node::Kind::kU, .low_share = 128}, {}, {}}).value());
  GuideLearner learner(kGuidedPixels);
  learner.Add({}, std::make_shared<const PhotonGuide>(PhotonGuide::Create({}, UINT32_MAX).value()),
              1000);
  learner.Add(
      {},
      std::make_shared<const PhotonGuide>(PhotonGuide::Create({}, UINT32_MAX, scatterings).value()),
      1000);
  const std::vector<GuideLearner::Drawn>& drawn = learner.numbers().drawn;
  ASSERT_EQ(drawn.size(), 2U);
  EXPECT_NEAR(drawn[0].trials, 1000, 1e-3);
  EXPECT_NEAR(drawn[1].trials, 250, 1e-3);
}

}  // namespace
}  // namespace lucerna
