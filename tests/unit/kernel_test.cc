// A kernel is a density: over the disc of its radius it integrates to one.
#include "render/math/kernel.h"

#include <numbers>

#include "gtest/gtest.h"

namespace lucerna {
namespace {

constexpr KernelKind kKinds[] = {KernelKind::kConstant, KernelKind::kEpanechnikov,
                                 KernelKind::kBiweight, KernelKind::kGaussian};

// The second moment per axis and the integral of the square decide the radius: by quadrature.
TEST(KernelTest, HasTheMomentsThatItsBiasAndNoiseAreComputedFrom) {
  for (const KernelKind kind : kKinds) {
    const Kernel kernel{kind};
    constexpr int kSteps = 100000;
    double moment = 0;
    double squared = 0;
    for (int i = 0; i < kSteps; ++i) {
      const double t2 = (i + 0.5) / kSteps;
      const double value =
          kernel.Norm() * static_cast<double>(kernel.Shape(static_cast<float>(t2)));
      moment += 0.5 * t2 * value * std::numbers::pi / kSteps;
      squared += value * value * std::numbers::pi / kSteps;
    }
    EXPECT_NEAR(kernel.Moments().mu2, moment, 1e-6);
    EXPECT_NEAR(kernel.Moments().roughness, squared, 1e-5);
  }
}

TEST(KernelTest, IntegratesToOneOverItsDisc) {
  for (const KernelKind kind : kKinds) {
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
