// Sizes are read as people type them, and nothing else is.
#include "render/base/byte_size.h"

#include "gtest/gtest.h"

namespace lucerna {
namespace {

TEST(ByteSizeTest, ReadsNumbersWithDecimalAndBinaryUnits) {
  EXPECT_EQ(ParseByteSize("0"), 0U);
  EXPECT_EQ(ParseByteSize("8589934592"), 8'589'934'592U);
  EXPECT_EQ(ParseByteSize("500k"), 500'000U);
  EXPECT_EQ(ParseByteSize("1G"), 1'000'000'000U);
  EXPECT_EQ(ParseByteSize("1.5GB"), 1'500'000'000U);
  EXPECT_EQ(ParseByteSize("8GiB"), std::uint64_t{8} << 30);
  EXPECT_EQ(ParseByteSize("1Ki"), 1024U);
  EXPECT_EQ(ParseByteSize("2TiB"), std::uint64_t{2} << 40);
  EXPECT_EQ(ParseByteSize("12B"), 12U);
  EXPECT_EQ(ParseByteSize("0.0001k"), 0U);
  EXPECT_EQ(ParseByteSize("9007199254740992"), std::uint64_t{1} << 53);
}

TEST(ByteSizeTest, RefusesWhatIsNone) {
  for (const char* text : {"", "-1", "G", "1 G", "12x", "1Gib", "1GiBB", "1e3", "nan", "inf",
                           "1,5G", "+1", "1G1", "9007199254740994", "99999T", "0x10"})
    EXPECT_FALSE(ParseByteSize(text).has_value()) << text;
}

}  // namespace
}  // namespace lucerna
