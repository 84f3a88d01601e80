// A kernel is a density: over the disc of its radius it integrates to one.
#include "render/estimate/kernel.h"

#include <numbers>

#include "gtest/gtest.h"

namespace lucerna {
namespace {

TEST(KernelTest, IntegratesToOneOverItsDisc) {
  for (const KernelKind kind : {KernelKind::kConstant, KernelKind::kEpanechnikov}) {
    const Kernel kernel{kind};
    constexpr int kSteps = 100000;
    double sum = 0;
    // The area between t² and t² + dt² of a disc of radius 1 is π dt².
    for (int i = 0; i < kSteps; ++i) {
      const float shape = kernel.Shape(static_cast<float>((i + 0.5) / kSteps));
      ASSERT_GE(shape, 0);
      ASSERT_LE(shape, 1);
      sum += static_cast<double>(shape) / kSteps;
    }
    EXPECT_NEAR(sum * std::numbers::pi * kernel.Norm(), 1, 1e-5);
  }
  EXPECT_EQ(Kernel{KernelKind::kEpanechnikov}.Shape(1), 0);
}

}  // namespace
}  // namespace lucerna
