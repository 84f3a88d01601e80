#include "render/base/shared_values.h"

#include <memory>

#include "gtest/gtest.h"

namespace lucerna {
namespace {

TEST(SharedValuesTest, AValueIsFoundAsLongAsSomebodyHasIt) {
  SharedValues<int, double> shared;
  EXPECT_EQ(shared.Find(1), nullptr);
  auto one = std::make_shared<const double>(1.5);
  const auto two = std::make_shared<const double>(2.5);
  shared.Share(1, one);
  shared.Share(2, two);
  EXPECT_EQ(shared.Find(1), one);
  one.reset();
  EXPECT_EQ(shared.Find(1), nullptr) << "it keeps nothing in memory";
  EXPECT_EQ(shared.Find(2), two);
}

TEST(SharedValuesTest, TheLastOfTwoThatWereMadeAtOnceIsFound) {
  SharedValues<int, double> shared;
  const auto first = std::make_shared<const double>(1.5);
  const auto second = std::make_shared<const double>(1.5);
  shared.Share(1, first);
  shared.Share(1, second);
  EXPECT_EQ(shared.Find(1), second);
}

}  // namespace
}  // namespace lucerna
