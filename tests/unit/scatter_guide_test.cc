// A scatter guide must be a density over directions in every cell, draw by it, and weigh what it
// drew so that nothing is gained or lost.
#include "render/transport/scatter_guide.h"

#include <cmath>
#include <map>
#include <vector>

#include "gtest/gtest.h"

#include "render/math/equal_area_square.h"
#include "render/math/rng.h"
#include "render/math/sobol.h"

namespace lucerna {
namespace {

using Node = ScatterGuide::Node;
using Kind = Node::Kind;

Node Space(Kind axis, float place) {
  return {.kind = axis, .place = place};
}
Node Directions(Kind along, std::uint8_t low_share) {
  return {.kind = along, .low_share = low_share};
}

// Below x = 1 directions are halved along u (3/4 below), and the lower half along v (1/4 below);
// above it directions are not guided.
std::vector<Node> SomeNodes() {
  return {Space(Kind::kX, 1), Directions(Kind::kU, 192), Directions(Kind::kV, 64), {}, {}, {}, {}};
}

int BoxOf(Vec3 direction) {
  const Vec2 place = EqualAreaPlace(direction);
  if (place.x >= 0.5F) return 2;
  return place.y < 0.5F ? 0 : 1;
}

TEST(ScatterGuideTest, KnowsWhereItHasCells) {
  EXPECT_TRUE(ScatterGuide().empty());
  EXPECT_EQ(ScatterGuide().CellAt({0, 0, 0}), ScatterGuide::kNoCell);
  EXPECT_TRUE(ScatterGuide::Create({Node{}}).value().empty());
  const ScatterGuide guide = ScatterGuide::Create(SomeNodes()).value();
  EXPECT_FALSE(guide.empty());
  EXPECT_EQ(guide.CellAt({0.999F, 5, -5}), 1U);
  EXPECT_EQ(guide.CellAt({1, 5, -5}), ScatterGuide::kNoCell);
}

TEST(ScatterGuideTest, DrawsByItsSharesEvenly) {
  const ScatterGuide guide = ScatterGuide::Create(SomeNodes()).value();
  const double share_of_box[] = {0.1875, 0.5625, 0.25};
  const double volume_of_box[] = {0.25, 0.25, 0.5};
  constexpr int kDraws = 1 << 14;
  std::map<int, int> drawn;
  for (std::uint64_t i = 0; i < kDraws; ++i) {
    const SobolPoint u = OwenSobol(i, 17);
    const Vec3 wi = guide.Draw(1, u[0], u[1]);
    EXPECT_NEAR(Length(wi), 1, 1e-5F);
    const int box = BoxOf(wi);
    ++drawn[box];
    EXPECT_NEAR(guide.DensityAt(1, wi), share_of_box[box] / volume_of_box[box] / (4 * kPi64), 1e-9);
  }
  // Evenly spaced numbers stay so: to the number, but for those at the edges.
  for (int box = 0; box < 3; ++box)
    EXPECT_NEAR(drawn[box], share_of_box[box] * kDraws, 0.01 * kDraws) << box;
  for (const float u : {0.0F, 0x1.fffffep-1F})
    EXPECT_NEAR(Length(guide.Draw(1, u, u)), 1, 1e-5F);
}

// The factor of flux, of directions that are drawn by guide and BSDF together, has the mean 1, and
// is at most 2.
TEST(ScatterGuideTest, FactorsOfFluxNeitherGainNorLose) {
  const ScatterGuide guide = ScatterGuide::Create(SomeNodes()).value();
  constexpr int kDraws = 100000;
  KeyedRng rng(5);
  double sum = 0;
  double squares = 0;
  for (int i = 0; i < kDraws; ++i) {
    const float choice = rng.Uniform();
    const float u1 = rng.Uniform();
    const float u2 = rng.Uniform();
    const Vec3 wi = static_cast<double>(choice) < kGuidedScatterings
                        ? guide.Draw(1, u1, u2)
                        : SquareToCosineHemisphere(u1, u2);
    const double bsdf = wi.z > 0 ? static_cast<double>(wi.z) / kPi64 : 0;
    const double factor = guide.FluxFactor(1, wi, bsdf);
    ASSERT_LE(factor, 1 / (1 - kGuidedScatterings) * (1 + 1e-12));
    sum += factor;
    squares += factor * factor;
  }
  const double mean = sum / kDraws;
  EXPECT_NEAR(mean, 1, 5 * std::sqrt((squares / kDraws - mean * mean) / kDraws));
}

TEST(ScatterGuideTest, RefusesWhatIsNoTree) {
  const auto refuses = [](std::vector<Node> nodes) {
    return absl::IsInvalidArgument(ScatterGuide::Create(std::move(nodes)).status());
  };
  EXPECT_FALSE(refuses(SomeNodes()));
  std::vector<Node> nodes = SomeNodes();
  nodes.pop_back();
  EXPECT_TRUE(refuses(nodes)) << "too few";
  nodes = SomeNodes();
  nodes.emplace_back();
  EXPECT_TRUE(refuses(nodes)) << "too many";
  EXPECT_TRUE(refuses({Directions(Kind::kU, 128)})) << "no halves";
  EXPECT_TRUE(refuses({Directions(Kind::kU, 0), {}, {}})) << "nothing for a half";
  EXPECT_TRUE(refuses({Space(Kind::kY, NAN), {}, {}})) << "nowhere";
  EXPECT_TRUE(refuses({Directions(static_cast<Kind>(6), 128), {}, {}})) << "dimension";
  EXPECT_TRUE(refuses({Directions(Kind::kU, 128), Space(Kind::kX, 0), {}, {}, {}}))
      << "space below directions";
  EXPECT_TRUE(refuses({Directions(Kind::kU, 128), {}, Space(Kind::kX, 0), {}, {}}))
      << "space below directions";
  std::vector<Node> deep;
  for (std::size_t i = 0; i <= kMostScatterHalvings; ++i)
    deep.push_back(Directions(Kind::kU, 128));
  deep.resize(2 * deep.size() + 1);
  EXPECT_TRUE(refuses(deep));
  std::vector<Node> large;
  for (std::size_t i = 0; i < kMostScatterNodes / 2 + 1; ++i) {
    large.push_back(Directions(Kind::kU, 128));
    large.emplace_back();
  }
  large.emplace_back();
  EXPECT_TRUE(refuses(large));
}

}  // namespace
}  // namespace lucerna
