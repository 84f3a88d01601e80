// A tree of lights draws by what lights bring, says with what probability, and forgets none.
#include "render/transport/light_tree.h"

#include <cmath>
#include <cstdint>
#include <numeric>
#include <vector>

#include "gtest/gtest.h"

#include "render/math/rng.h"
#include "render/math/warp.h"
#include "tests/support/chi_square.h"

namespace lucerna {
namespace {

TreeLight PointAt(Vec3 position, double intensity) {
  TreeLight light;
  light.intensity = intensity;
  light.center = position;
  return light;
}

TreeLight AtInfinity(double irradiance) {
  TreeLight light;
  light.intensity = irradiance;
  light.is_at_infinity = true;
  return light;
}

float Between(KeyedRng& rng, float low, float high) {
  return low + (high - low) * rng.Uniform();
}

Vec3 PointIn(KeyedRng& rng, float half) {
  const float x = Between(rng, -half, half);
  const float y = Between(rng, -half, half);
  return {x, y, Between(rng, -half, half)};
}

Vec3 Direction(KeyedRng& rng) {
  const float u = rng.Uniform();
  return SquareToSphere(u, rng.Uniform());
}

// Points, balls, panels, spots and two lights at infinity, of powers that differ by 10^4.
std::vector<TreeLight> MixedLights(std::size_t count, KeyedRng& rng) {
  std::vector<TreeLight> lights;
  for (std::size_t i = 0; i < count; ++i) {
    TreeLight light =
        PointAt(PointIn(rng, 5), std::pow(10.0, static_cast<double>(Between(rng, -2, 2))));
    if (i % 3 != 0) light.radius = Between(rng, 0, 0.5F);
    if (i % 3 == 1) {
      light.axis = Direction(rng);
      light.cos_facing = 1;
    }
    if (i % 7 == 2) {
      light.axis = Direction(rng);
      light.cos_facing = 0.7F;
      light.cos_reach = 0.9F;
    }
    if (i % 11 == 5) light = AtInfinity(0.1);
    lights.push_back(light);
  }
  return lights;
}

TEST(LightTreeTest, JudgesFewLightsByWhatEachBrings) {
  const std::vector<TreeLight> lights = {PointAt({0, 0, 1}, 3), PointAt({0, 2, 0}, 8),
                                         PointAt({-1, 1, 1}, 0.5), PointAt({9, 0, 0}, 100),
                                         AtInfinity(2)};
  const LightTree tree(lights);
  const std::vector<double> brings = {3, 2, 0.5 / 3, 100.0 / 81, 2};
  const double sum = std::accumulate(brings.begin(), brings.end(), 0.0);
  for (std::uint32_t i = 0; i < lights.size(); ++i)
    EXPECT_NEAR(static_cast<double>(tree.Probability({{0, 0, 0}}, i)), brings[i] / sum, 1e-6) << i;
  // On a surface that faces +z, what is behind brings nothing and the rest its cosine.
  const LitPoint floor = {{0, 0, 0}, {0, 0, 1}};
  const double front = 3 + 0.5 / 3 / std::sqrt(3.0) + 2;
  EXPECT_NEAR(static_cast<double>(tree.Probability(floor, 0)), 3 / front, 1e-6);
  EXPECT_NEAR(static_cast<double>(tree.Probability(floor, 1)), 0, 1e-6);
  EXPECT_NEAR(static_cast<double>(tree.Probability(floor, 4)), 2 / front, 1e-6);
}

TEST(LightTreeTest, DrawsWithTheProbabilityThatItSays) {
  KeyedRng rng(1);
  constexpr int kTests = 12;
  for (int test = 0; test < kTests; ++test) {
    const std::vector<TreeLight> lights =
        MixedLights(2 + static_cast<std::size_t>(test * test), rng);
    const LightTree tree(lights);
    LitPoint from = {PointIn(rng, 6)};
    if (test % 2 == 1) from.normal = Direction(rng);
    constexpr int kSamples = 20000;
    // A node may promise light of which no child brings any.
    int nothing = 0;
    std::vector<double> counts(lights.size());
    std::vector<double> expected(lights.size());
    for (int i = 0; i < kSamples; ++i) {
      const auto drawn = tree.Draw(from, (i + 0.5) / kSamples);
      if (!drawn) {
        ++nothing;
        continue;
      }
      ++counts[drawn->light];
      ASSERT_FLOAT_EQ(drawn->probability, tree.Probability(from, drawn->light)) << drawn->light;
    }
    double sum = 0;
    for (std::uint32_t i = 0; i < lights.size(); ++i) {
      const auto probability = static_cast<double>(tree.Probability(from, i));
      sum += probability;
      expected[i] = probability * kSamples;
      // Of evenly spaced numbers each light has its share, but for the ends.
      EXPECT_NEAR(counts[i], expected[i], 1.01 + 1e-5 * kSamples) << test << ' ' << i;
    }
    EXPECT_NEAR(sum, 1 - static_cast<double>(nothing) / kSamples, 1e-3) << test;
  }
}

// Nodes know bounds: a light that lights a point is never left out.
TEST(LightTreeTest, LeavesOutNothingThatBringsLight) {
  KeyedRng rng(2);
  for (int test = 0; test < 40; ++test) {
    const std::vector<TreeLight> lights = MixedLights(100, rng);
    const LightTree tree(lights);
    for (int i = 0; i < 20; ++i) {
      const LitPoint from = {PointIn(rng, 6), Direction(rng)};
      for (std::uint32_t number = 0; number < lights.size(); ++number) {
        const TreeLight& light = lights[number];
        if (light.is_at_infinity) continue;
        // Light from a point of the ball along a direction that its normals allow.
        const Vec3 at = light.center + Direction(rng) * (light.radius * rng.Uniform());
        const Vec3 to_point = Normalize(from.position - at);
        const double from_axis = std::acos(
            static_cast<double>(std::min(1.0F, std::max(-1.0F, Dot(to_point, light.axis)))));
        const double facing = std::acos(static_cast<double>(light.cos_facing));
        const double reach = std::acos(static_cast<double>(light.cos_reach));
        const bool leaves = from_axis < facing + reach - 1e-3;
        const bool arrives = Dot(to_point, from.normal) < -1e-3F;
        if (!leaves || !arrives) continue;
        EXPECT_GT(tree.Probability(from, number), 0) << number;
      }
    }
  }
}

TEST(LightTreeTest, ChoosesWellAmongThousands) {
  KeyedRng rng(3);
  std::vector<TreeLight> lights;
  for (int i = 0; i < 5000; ++i)
    lights.push_back(PointAt(PointIn(rng, 5), 1));
  const LightTree tree(lights);
  // Squared deviation of one sample of the irradiance, relative: by even choice several hundred.
  double even = 0;
  double by_tree = 0;
  constexpr int kPoints = 100;
  for (int i = 0; i < kPoints; ++i) {
    const LitPoint from = {PointIn(rng, 5)};
    double sum = 0;
    double squares = 0;
    double even_squares = 0;
    for (std::uint32_t number = 0; number < lights.size(); ++number) {
      const double brings =
          1 / static_cast<double>(LengthSquared(lights[number].center - from.position));
      sum += brings;
      squares += brings * brings / static_cast<double>(tree.Probability(from, number));
      even_squares += brings * brings * static_cast<double>(lights.size());
    }
    by_tree += squares / (sum * sum) - 1;
    even += even_squares / (sum * sum) - 1;
  }
  EXPECT_LT(by_tree, even / 40);
}

// Clusters in clusters, and lights at one place, are deeper than a tree by place may be.
TEST(LightTreeTest, EndsHoweverLightsLie) {
  std::vector<TreeLight> lights;
  for (int i = 0; i < 120; ++i)
    lights.push_back(PointAt({std::ldexp(1.0F, -i), 0, 0}, 1));
  for (int i = 0; i < 1000; ++i)
    lights.push_back(PointAt({1, 1, 1}, 1));
  const LightTree tree(lights);
  double sum = 0;
  for (std::uint32_t i = 0; i < lights.size(); ++i)
    sum += static_cast<double>(tree.Probability({{0.5F, 1, 0}}, i));
  EXPECT_NEAR(sum, 1, 1e-4);
}

TEST(LightTreeTest, HasNumbersForAllPlacesAndPowers) {
  for (const float scale : {1e-18F, 1.0F, 1e17F}) {
    for (const double power : {1e-30, 1.0, 1e30}) {
      const std::vector<TreeLight> lights = {PointAt({0, 0, 0}, power),
                                             PointAt({scale, 0, 0}, 2 * power),
                                             PointAt({0, scale, 0}, power)};
      const LightTree tree(lights);
      const LitPoint between = {{scale / 2, 0, 0}};
      EXPECT_NEAR(static_cast<double>(tree.Probability(between, 1)), 8 / 12.8, 1e-5)
          << scale << ' ' << power;
      // At a light itself it is all there is.
      const auto at_light = tree.Draw({{0, 0, 0}}, 0.5);
      ASSERT_TRUE(at_light.has_value());
      EXPECT_TRUE(std::isfinite(at_light->probability));
    }
  }
  // Where nothing arrives nothing is drawn.
  const std::vector<TreeLight> dark = {PointAt({0, 0, 0}, 0), PointAt({1, 0, 0}, 0)};
  EXPECT_FALSE(LightTree(dark).Draw({{0, 1, 0}}, 0.5).has_value());
}

}  // namespace
}  // namespace lucerna
