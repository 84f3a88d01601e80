// A guide must be a density, draw by it, and weigh what it drew by it.
#include "render/transport/photon_guide.h"

#include <cmath>
#include <map>
#include <tuple>
#include <vector>

#include "gtest/gtest.h"

#include "render/math/sobol.h"
#include "render/transport/light.h"
#include "render/wire/photon_guide_codec.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

using Node = PhotonGuide::Node;

std::uint32_t Share(double share) {
  return static_cast<std::uint32_t>(share * 0x1p32);
}

// Halves along direction 1 (0.8 below), the lower half along the choice (0.25 below), and its upper
// half along direction 1 again (0.5): volumes 1/4, 1/8, 1/8, 1/2 and shares 0.2, 0.3, 0.3, 0.2.
std::vector<Node> SomeNodes() {
  return {{2, Share(0.8)}, {4, Share(0.25)}, {}, {2, Share(0.5)}, {}, {}, {}};
}

PrimaryNumbers Evenly(std::uint64_t i) {
  const SobolPoint u = OwenSobol(i, 17);
  PrimaryNumbers numbers;
  for (std::size_t d = 0; d < kEmissionDimensions; ++d)
    numbers[d] = static_cast<double>(u[d]);
  return numbers;
}

TEST(PhotonGuideTest, AnEvenGuideChangesNothing) {
  const PhotonGuide none;
  const PhotonGuide leaf = PhotonGuide::Create({Node{}}, 5).value();
  for (const PhotonGuide* guide : {&none, &leaf}) {
    EXPECT_TRUE(guide->is_even());
    for (std::uint64_t i = 0; i < 100; ++i) {
      PrimaryNumbers numbers = Evenly(i);
      const PrimaryNumbers before = numbers;
      EXPECT_EQ(guide->Draw(numbers), 1);
      EXPECT_EQ(numbers, before);
      EXPECT_EQ(guide->WeightAt(numbers), 1);
    }
  }
  EXPECT_EQ(leaf.reported(), 5U);
}

// Evenly spaced numbers must stay so: 2^14 of them fill every box with its share of them to the
// number, but for those at its edges.
TEST(PhotonGuideTest, DrawsByItsSharesAndWeighsByThem) {
  const PhotonGuide guide = PhotonGuide::Create(SomeNodes(), 0).value();
  const auto box_of = [](const PrimaryNumbers& u) {
    if (u[2] >= 0.5) return 3;
    if (u[4] < 0.5) return 0;
    return u[2] < 0.25 ? 1 : 2;
  };
  const double share_of_box[] = {0.2, 0.3, 0.3, 0.2};
  const double volume_of_box[] = {0.25, 0.125, 0.125, 0.5};
  constexpr int kDraws = 1 << 14;
  std::map<int, int> drawn;
  double sum = 0;
  std::vector<double> in_first;  // direction 1 within box 1, scaled to [0, 1)
  for (std::uint64_t i = 0; i < kDraws; ++i) {
    PrimaryNumbers numbers = Evenly(i);
    const double weight = guide.Draw(numbers);
    for (const double number : numbers) {
      ASSERT_GE(number, 0);
      ASSERT_LT(number, 1);
    }
    const int box = box_of(numbers);
    ++drawn[box];
    sum += weight;
    EXPECT_NEAR(weight, volume_of_box[box] / share_of_box[box], 1e-8);
    EXPECT_EQ(weight, guide.WeightAt(numbers));
    if (box == 1) in_first.push_back(numbers[2] * 4);
  }
  for (int box = 0; box < 4; ++box)
    EXPECT_NEAR(drawn[box], share_of_box[box] * kDraws, 0.01 * kDraws) << box;
  // The mean weight is the integral of the even density.
  EXPECT_NEAR(sum / kDraws, 1, 0.02);
  double mean = 0;
  for (const double number : in_first)
    mean += number / static_cast<double>(in_first.size());
  EXPECT_NEAR(mean, 0.5, 0.01);
}

// Where numbers end next to 1 they must stay below it.
TEST(PhotonGuideTest, NumbersStayBelowOne) {
  std::vector<Node> nodes;
  for (int i = 0; i < kMostHalvings; ++i)
    nodes.push_back({0, Share(0.4)});
  for (int i = 0; i <= kMostHalvings; ++i)
    nodes.push_back({});
  // The uppermost box is a half with 0.6 of the photons, the lowest a small one with 0.4^16.
  EXPECT_FALSE(PhotonGuide::Create(nodes, 0).ok()) << "a weight of 0.5^16 / 0.4^16 = 35";
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (nodes[i].low_share > 0) nodes[i].low_share = Share(0.55);
  }
  const PhotonGuide guide = PhotonGuide::Create(nodes, 0).value();
  PrimaryNumbers most;
  most.fill(std::nextafter(1.0, 0.0));
  guide.Draw(most);
  for (const double number : most)
    EXPECT_LT(number, 1);
  PrimaryNumbers least{};
  guide.Draw(least);
  for (const double number : least)
    EXPECT_EQ(number, 0);
}

TEST(PhotonGuideTest, RefusesWhatIsNoTreeOrStarvesABox) {
  const auto refuses = [](std::vector<Node> nodes) {
    return absl::IsInvalidArgument(PhotonGuide::Create(std::move(nodes), 0).status());
  };
  EXPECT_FALSE(refuses(SomeNodes()));
  std::vector<Node> nodes = SomeNodes();
  nodes.pop_back();
  EXPECT_TRUE(refuses(nodes)) << "too few";
  nodes = SomeNodes();
  nodes.emplace_back();
  EXPECT_TRUE(refuses(nodes)) << "too many";
  EXPECT_TRUE(refuses({{6, Share(0.5)}, {}, {}})) << "dimension";
  EXPECT_TRUE(refuses({{0, 0}, {}, {}})) << "nothing for a half";
  EXPECT_TRUE(refuses({{0, Share(0.1)}, {}, {}})) << "a weight of 5";
  EXPECT_TRUE(refuses({{0, Share(0.9)}, {}, {}})) << "a weight of 5";
  EXPECT_FALSE(refuses({{0, Share(0.13)}, {}, {}}));
  EXPECT_TRUE(refuses({{0, Share(0.5)}, {}, {5, 1}})) << "a leaf with a share";
  std::vector<Node> deep;
  for (int i = 0; i <= kMostHalvings; ++i)
    deep.push_back({0, Share(0.5)});
  for (int i = 0; i <= kMostHalvings + 1; ++i)
    deep.push_back({});
  EXPECT_TRUE(refuses(deep));
  // A full tree of one node more than is allowed.
  std::vector<Node> large;
  for (std::size_t i = 0; i < kMostGuideNodes; ++i)
    large.push_back({static_cast<std::uint8_t>(i % 5), Share(0.5)});
  large.resize(2 * large.size() + 1);
  EXPECT_TRUE(refuses(large));
}

TEST(PhotonGuideTest, TravelsAsItIs) {
  for (const auto& nodes : {std::vector<Node>{}, SomeNodes()}) {
    const PhotonGuide guide = PhotonGuide::Create(nodes, 123456789).value();
    const std::string bytes = EncodePhotonGuide(guide);
    EXPECT_EQ(DecodePhotonGuide(bytes).value(), guide);
    EXPECT_FALSE(DecodePhotonGuide(bytes + 'x').ok());
    EXPECT_FALSE(DecodePhotonGuide(bytes.substr(0, bytes.size() - 1)).ok());
  }
  EXPECT_FALSE(DecodePhotonGuide("LPG3").ok());
  using Kind = ScatterGuide::Node::Kind;
  const auto scatterings = std::make_shared<const ScatterGuide>(
      ScatterGuide::Create(
          {{.kind = Kind::kY, .place = -0.1F}, {.kind = Kind::kV, .low_share = 200}, {}, {}, {}})
          .value());
  const PhotonGuide guide = PhotonGuide::Create(SomeNodes(), 7, scatterings).value();
  const std::string bytes = EncodePhotonGuide(guide);
  EXPECT_EQ(DecodePhotonGuide(bytes).value(), guide);
  EXPECT_EQ(*DecodePhotonGuide(bytes).value().scatterings(), *scatterings);
  EXPECT_NE(guide, PhotonGuide::Create(SomeNodes(), 7).value());
  for (std::size_t size = 0; size < bytes.size(); ++size)
    EXPECT_FALSE(DecodePhotonGuide(bytes.substr(0, size)).ok()) << size;
}

TEST(PhotonGuideTest, WeakPhotonsAreReportedInProportionToTheirFlux) {
  EXPECT_EQ(ReportFactor(0), 0);
  EXPECT_EQ(ReportFactor(1), 1);
  EXPECT_EQ(ReportFactor(1.3), 1);
  EXPECT_EQ(ReportFactor(1e30), 1);
  EXPECT_EQ(ReportFactor(0.75), 1);
  EXPECT_EQ(ReportFactor(0.26), 0.25);
  for (double flux = 1e-12; flux < 0.7; flux *= 1.7) {
    EXPECT_GT(ReportFactor(flux), 0.7 * flux);
    EXPECT_LT(ReportFactor(flux), 1.42 * flux);
  }
}

// One light of a thousandth of the power has half of the even share.
TEST(PhotonGuideTest, EvenFluxIsPowerOverTheShareOfThePhotons) {
  Scene scene;
  AddQuad(scene, {-1, -1, 0}, {2, 0, 0}, {0, 2, 0}, AddMaterial(scene, DiffuseMaterial(0.5F)));
  scene.point_lights.push_back({{0, 0, 1}, Gray(1)});
  scene.point_lights.push_back({{1, 0, 1}, Gray(999)});
  const auto intersector = Intersector::Create(scene).value();
  const LightSet lights(scene, *intersector);
  const double share = 0.001 * (1 - kEvenPhotonShare) + 0.5 * kEvenPhotonShare;
  EXPECT_NEAR(EvenFlux(lights, {0.5, 0.5, 0.5, 0.5, share / 2}), 0.001 / share, 1e-5);
  EXPECT_NEAR(EvenFlux(lights, {0.5, 0.5, 0.5, 0.5, 0.9}), 0.999 / (1 - share), 1e-5);
}

}  // namespace
}  // namespace lucerna
