// Numbers must be those that were set, wherever they fit, at every border of a tile.
#include "render/math/packed_integers.h"

#include <array>
#include <limits>
#include <vector>

#include "gtest/gtest.h"

#include "render/math/rng.h"

namespace lucerna {
namespace {

constexpr std::size_t kTile = PackedIntegers::kTileSize;

TEST(PackedIntegersTest, AreTheNumbersThatWereSet) {
  constexpr std::int64_t kNarrow = std::numeric_limits<std::int32_t>::max();
  constexpr std::array<std::int64_t, 9> kNumbers = {
      0, -1, kNarrow, -kNarrow - 1, kNarrow + 1, -kNarrow - 2, INT64_MAX, INT64_MIN, 7};
  for (const std::size_t size :
       {std::size_t{1}, kTile - 1, kTile, kTile + 1, 3 * kTile, 3 * kTile + 5}) {
    PackedIntegers packed(size);
    std::vector<std::int64_t> expected(size);
    EXPECT_EQ(packed.ToVector(), expected);
    KeyedRng rng(size);
    for (int i = 0; i < 2000; ++i) {
      const std::size_t at = rng.Bits() % size;
      // Most tiles stay narrow for a while.
      const std::int64_t value =
          i < 1000 ? static_cast<std::int32_t>(rng.Bits()) : kNumbers[rng.Bits() % kNumbers.size()];
      packed.Set(at, value);
      expected[at] = value;
      ASSERT_EQ(packed[at], value);
    }
    EXPECT_EQ(packed.size(), size);
    EXPECT_EQ(packed.ToVector(), expected);
  }
}

TEST(PackedIntegersTest, AreEqualWhenTheirNumbersAre) {
  PackedIntegers once_large(kTile + 1);
  once_large.Set(kTile, INT64_MAX);
  once_large.Set(kTile, 5);
  PackedIntegers small(kTile + 1);
  EXPECT_FALSE(once_large == small);
  small.Set(kTile, 5);
  EXPECT_TRUE(once_large == small);
  EXPECT_FALSE(small == PackedIntegers(kTile));
}

TEST(PackedIntegersTest, HoldNothingWithoutNumbers) {
  const PackedIntegers none;
  EXPECT_TRUE(none.empty());
  EXPECT_EQ(none.size(), 0U);
  EXPECT_TRUE(none.ToVector().empty());
}

}  // namespace
}  // namespace lucerna
