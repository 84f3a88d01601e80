// Column densities are exact integrals of trilinear densities, and free paths their inverse.
#include "render/scene/density_grid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "gtest/gtest.h"

#include "render/math/rng.h"
#include "render/math/transform.h"
#include "render/math/vector.h"

namespace lucerna {
namespace {

struct RandomGrid {
  std::array<int, 3> size;
  std::vector<float> values;
  Vec3 low, high;
  Transform to_world, from_world;

  [[nodiscard]] DensityGrid Make() const { return {size, values, low, high, from_world}; }

  // Written out from the definition: eight points with their weights, none beyond the last.
  [[nodiscard]] double DensityAt(const std::array<double, 3>& world) const {
    const auto& rows = from_world.rows();
    const std::array<float, 3> lows = {low.x, low.y, low.z};
    const std::array<float, 3> highs = {high.x, high.y, high.z};
    std::array<double, 3> at{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double place = rows[axis][0] * world[0] + rows[axis][1] * world[1] +
                           rows[axis][2] * world[2] + rows[axis][3];
      const auto from = static_cast<double>(lows[axis]);
      const double share = (place - from) / (static_cast<double>(highs[axis]) - from);
      if (share < 0 || share > 1) return 0;
      at[axis] = share * size[axis] - 0.5;
    }
    double density = 0;
    for (int k = 0; k < size[2]; ++k) {
      for (int j = 0; j < size[1]; ++j) {
        for (int i = 0; i < size[0]; ++i) {
          const double weight = std::max(0.0, 1 - std::abs(at[0] - i)) *
                                std::max(0.0, 1 - std::abs(at[1] - j)) *
                                std::max(0.0, 1 - std::abs(at[2] - k));
          const auto index = static_cast<std::size_t>((k * size[1] + j) * size[0] + i);
          density += weight * static_cast<double>(values[index]);
        }
      }
    }
    return density;
  }
};

RandomGrid GridOf(std::uint64_t seed) {
  KeyedRng rng(seed);
  RandomGrid grid;
  std::size_t points = 1;
  for (int& n : grid.size) {
    n = 1 + static_cast<int>(rng.Uniform() * 5);
    points *= static_cast<std::size_t>(n);
  }
  for (std::size_t i = 0; i < points; ++i)
    grid.values.push_back(std::max(0.0F, 3 * rng.Uniform() - 1));
  grid.low = {-rng.Uniform(), -1 - rng.Uniform(), rng.Uniform() - 2};
  grid.high = {rng.Uniform() + 0.2F, 0.5F + rng.Uniform(), rng.Uniform()};
  grid.to_world = Transform::Translate(0.3, -0.2, 0.1) *
                  *Transform::Rotate(40 + 100 * static_cast<double>(rng.Uniform()), 1, 0.3, -0.4) *
                  Transform::Scale(1.5, 0.7, -1.2);
  grid.from_world = *grid.to_world.Inverse();
  return grid;
}

struct UnitRay {
  Vec3 origin, direction;
};

// Some of them along an axis, or begin within.
UnitRay RayOf(KeyedRng& rng, int number) {
  const auto random = [&] {
    return Vec3{rng.Uniform() - 0.5F, rng.Uniform() - 0.5F, rng.Uniform() - 0.5F};
  };
  const Vec3 origin = random() * (number % 3 == 0 ? 1.0F : 6.0F);
  if (number % 4 == 0) return {origin, {0, number % 8 == 0 ? 1.0F : -1.0F, 0}};
  return {origin, Normalize(random() - origin)};
}

TEST(DensityGridTest, ColumnsAreIntegralsOfTheTrilinearDensity) {
  int with_density = 0;
  for (std::uint64_t seed = 0; seed < 12; ++seed) {
    const RandomGrid given = GridOf(seed);
    const DensityGrid grid = given.Make();
    KeyedRng rng(seed + 100);
    for (int number = 0; number < 20; ++number) {
      SCOPED_TRACE(testing::Message() << "grid " << seed << ", ray " << number);
      const UnitRay ray = RayOf(rng, number);
      const double length = number % 5 == 0 ? 1 : 12;
      constexpr int kSteps = 20000;
      double expected = 0;
      for (int i = 0; i < kSteps; ++i) {
        const double t = length * (i + 0.5) / kSteps;
        const auto at = [&](float from, float along) {
          return static_cast<double>(from) + t * static_cast<double>(along);
        };
        expected +=
            given.DensityAt({at(ray.origin.x, ray.direction.x), at(ray.origin.y, ray.direction.y),
                             at(ray.origin.z, ray.direction.z)}) *
            length / kSteps;
      }
      const DensityGrid::Way way = grid.Travel(ray.origin, ray.direction, length, HUGE_VAL);
      EXPECT_TRUE(way.is_through);
      EXPECT_EQ(way.length, length);
      // Twice, the density ends within a step.
      EXPECT_NEAR(way.column, expected, 1e-4 * expected + 2 * 2 * length / kSteps);
      with_density += expected > 0.1 ? 1 : 0;
    }
  }
  EXPECT_GT(with_density, 100);
}

TEST(DensityGridTest, AFreePathEndsWhereItsColumnIsReached) {
  int reached = 0;
  for (std::uint64_t seed = 0; seed < 12; ++seed) {
    const DensityGrid grid = GridOf(seed).Make();
    KeyedRng rng(seed + 200);
    for (int number = 0; number < 50; ++number) {
      SCOPED_TRACE(testing::Message() << "grid " << seed << ", ray " << number);
      const UnitRay ray = RayOf(rng, number);
      const double whole = grid.Travel(ray.origin, ray.direction, HUGE_VAL, HUGE_VAL).column;
      const double wanted = 1.2 * whole * static_cast<double>(rng.Uniform());
      const DensityGrid::Way way = grid.Travel(ray.origin, ray.direction, HUGE_VAL, wanted);
      if (!(wanted < whole)) {
        EXPECT_TRUE(way.is_through);
        EXPECT_DOUBLE_EQ(way.column, whole);
        continue;
      }
      EXPECT_FALSE(way.is_through);
      EXPECT_EQ(way.column, wanted);
      const double again = grid.Travel(ray.origin, ray.direction, way.length, HUGE_VAL).column;
      EXPECT_NEAR(again, wanted, 1e-9 * whole);
      ++reached;
    }
  }
  EXPECT_GT(reached, 200);
}

TEST(DensityGridTest, ATableHasTheColumnsOfItsRay) {
  for (std::uint64_t seed = 0; seed < 12; ++seed) {
    const DensityGrid grid = GridOf(seed).Make();
    KeyedRng rng(seed + 300);
    ColumnTable table;
    for (int number = 0; number < 20; ++number) {
      const UnitRay ray = RayOf(rng, number);
      constexpr double kLength = 8;
      table.Make(grid, ray.origin, ray.direction, kLength);
      for (int i = 0; i <= 30; ++i) {
        const double t = kLength * i / 30;
        const double expected = grid.Travel(ray.origin, ray.direction, t, HUGE_VAL).column;
        EXPECT_NEAR(table.At(t), expected, 1e-12 + 1e-9 * expected) << seed << ' ' << number;
      }
    }
  }
}

// Blocks of cells without any density are passed in one step.
TEST(DensityGridTest, EmptySpaceIsPassed) {
  const std::array<int, 3> size = {40, 33, 25};
  RandomGrid given = GridOf(1);
  given.size = size;
  given.values.assign(40 * 33 * 25, 0);
  KeyedRng rng(9);
  for (int i = 0; i < 150; ++i)
    given.values[static_cast<std::size_t>(rng.Uniform() * 40 * 33 * 25)] = 1 + rng.Uniform();
  // On borders of blocks and of the grid.
  for (const int index : {0, 7, 8 * 40 + 15, (24 * 33 + 32) * 40 + 39})
    given.values[static_cast<std::size_t>(index)] = 5;
  const DensityGrid grid = given.Make();
  int found = 0;
  for (int number = 0; number < 400; ++number) {
    const UnitRay ray = RayOf(rng, number);
    constexpr int kSteps = 4000;
    constexpr double kLength = 8;
    double expected = 0;
    for (int i = 0; i < kSteps; ++i) {
      const auto t = static_cast<float>(kLength * (i + 0.5) / kSteps);
      expected += grid.At(ray.origin + ray.direction * t) * kLength / kSteps;
    }
    const double column = grid.Travel(ray.origin, ray.direction, kLength, HUGE_VAL).column;
    EXPECT_NEAR(column, expected, 1e-3 * expected + 5 * 2 * kLength / kSteps) << number;
    found += expected > 0.01 ? 1 : 0;
  }
  EXPECT_GT(found, 30);
}

// One point: a density that falls by half on both sides, up to the border of the box.
TEST(DensityGridTest, FallsTowardsTheBorderOfItsBox) {
  const DensityGrid grid({1, 1, 1}, std::vector<float>{2}, {0, 0, 0}, {4, 1, 1}, Transform());
  EXPECT_DOUBLE_EQ(grid.At({2, 0.5F, 0.5F}), 2);
  EXPECT_DOUBLE_EQ(grid.At({1, 0.5F, 0.5F}), 1.5);
  EXPECT_DOUBLE_EQ(grid.At({0.5F, 0.25F, 0.5F}), 2 * 0.625 * 0.75);
  EXPECT_DOUBLE_EQ(grid.At({-0.001F, 0.5F, 0.5F}), 0);
  EXPECT_DOUBLE_EQ(grid.At({2, 0.5F, 1.001F}), 0);
  const DensityGrid::Way way = grid.Travel({-3, 0.5F, 0.5F}, {1, 0, 0}, HUGE_VAL, HUGE_VAL);
  EXPECT_DOUBLE_EQ(way.column, 2 * 0.75 * 4);
  // Half of it lies before the middle.
  EXPECT_DOUBLE_EQ(grid.Travel({-3, 0.5F, 0.5F}, {1, 0, 0}, HUGE_VAL, 3).length, 5);
}

// Densities that grow by 1 from point to point, 1 apart: x²/2 between them.
TEST(DensityGridTest, IsLinearBetweenPoints) {
  const DensityGrid grid({6, 1, 1}, std::vector<float>{0, 1, 2, 3, 4, 5}, {-0.5F, -1, -1},
                         {5.5F, 1, 1}, Transform());
  for (const double x : {0.5, 1.0, 2.7, 5.0}) {
    EXPECT_NEAR(grid.Travel({0, 0, 0}, {1, 0, 0}, x, HUGE_VAL).column, x * x / 2, 1e-12) << x;
    EXPECT_NEAR(grid.Travel({0, 0, 0}, {1, 0, 0}, HUGE_VAL, x * x / 2).length, x, 1e-9) << x;
  }
}

TEST(DensityGridTest, KeepsItsPlaceInAnotherUnit) {
  const DensityGrid grid = GridOf(3).Make();
  const DensityGrid in_millimetres = grid.ScaledBy(1000);
  KeyedRng rng(5);
  for (int number = 0; number < 20; ++number) {
    const UnitRay ray = RayOf(rng, number);
    EXPECT_NEAR(in_millimetres.Travel(ray.origin * 1000, ray.direction, 5000, HUGE_VAL).column,
                1000 * grid.Travel(ray.origin, ray.direction, 5, HUGE_VAL).column, 1e-2);
  }
}

// Photons may carry what is no number, and rays begin far away.
TEST(DensityGridTest, ExtremeRaysFindWhatIsThere) {
  const DensityGrid grid({2, 2, 2}, std::vector<float>(8, 1), {-1, -1, -1}, {1, 1, 1}, Transform());
  constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
  for (const UnitRay& ray : {UnitRay{{kNone, 0, 0}, {1, 0, 0}}, UnitRay{{0, 0, 0}, {kNone, 1, 0}},
                             UnitRay{{HUGE_VALF, 0, 0}, {-1, 0, 0}}}) {
    EXPECT_EQ(grid.Travel(ray.origin, ray.direction, HUGE_VAL, 1).column, 0);
  }
  EXPECT_NEAR(grid.Travel({-1e7F, 0, 0}, {1, 0, 0}, HUGE_VAL, HUGE_VAL).column, 1.75, 1e-6);
  // Along a face between cells, and past a corner.
  EXPECT_NEAR(grid.Travel({-3, -0.5F, -0.5F}, {1, 0, 0}, HUGE_VAL, HUGE_VAL).column, 1.75, 1e-12);
  EXPECT_EQ(grid.Travel({-3, -1, -1}, {1, 0, 0}, HUGE_VAL, HUGE_VAL).column, 0);
}

}  // namespace
}  // namespace lucerna
