// Do packed floats keep every number of as few bits, and nothing below?
#include "render/math/packed_floats.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "gtest/gtest.h"

#include "render/math/rng.h"

namespace lucerna {
namespace {

std::uint32_t BitsOf(float value) {
  return std::bit_cast<std::uint32_t>(value);
}

TEST(PackedFloatsTest, KeepEveryNumberOfTheirBits) {
  for (const unsigned int significant_bits : {8U, 16U}) {
    const std::uint32_t below = (std::uint32_t{1} << (24 - significant_bits)) - 1;
    std::vector<float> numbers = {0.0F,
                                  -0.0F,
                                  1.0F,
                                  -1.5F,
                                  std::numeric_limits<float>::infinity(),
                                  std::bit_cast<float>(below + 1)};  // the smallest there is
    KeyedRng rng(5);
    while (numbers.size() < 1000)
      numbers.push_back(std::bit_cast<float>(static_cast<std::uint32_t>(rng.Bits()) & ~below));
    PackedFloats one_by_one(numbers.size(), significant_bits);
    EXPECT_EQ(one_by_one.bytes(), significant_bits == 8 ? 2U : 3U);
    EXPECT_EQ(BitsOf(one_by_one[7]), 0U) << "all are zero at first";
    for (std::size_t i = 0; i < numbers.size(); ++i)
      one_by_one.Set(i, numbers[i]);
    PackedFloats at_once(numbers.size(), significant_bits);
    at_once.Write(0, std::span(numbers).first(300));
    at_once.Write(300, std::span(numbers).subspan(300));
    EXPECT_EQ(one_by_one, at_once);
    std::vector<float> read(numbers.size());
    at_once.Read(0, std::span(read).first(300));
    at_once.Read(300, std::span(read).subspan(300));
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      ASSERT_EQ(BitsOf(read[i]), BitsOf(numbers[i])) << i;
      ASSERT_EQ(BitsOf(at_once[i]), BitsOf(numbers[i])) << i;
    }
  }
}

TEST(PackedFloatsTest, CutOffWhatLiesBelow) {
  const float number = std::bit_cast<float>(std::uint32_t{0x3F812345});
  PackedFloats of_16(1, 16);
  of_16.Set(0, number);
  EXPECT_EQ(BitsOf(of_16[0]), 0x3F812300U);
  PackedFloats of_8(1, 8);
  of_8.Write(0, std::array{number});
  EXPECT_EQ(BitsOf(of_8[0]), 0x3F810000U);
}

}  // namespace
}  // namespace lucerna
