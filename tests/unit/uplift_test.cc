// Has the spectrum of a colour that colour, and no value that a surface cannot have?
#include "render/math/uplift.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "gtest/gtest.h"

#include "render/math/color_matching.h"
#include "render/math/color_space.h"

namespace lucerna {
namespace {

using Triple = std::array<double, 3>;

// A step of an 8-bit picture.
constexpr double kStep = 1.0 / 256;

// Seen in daylight, each nanometre.
Triple SeenAs(const SigmoidPolynomial& polynomial) {
  Triple seen{};
  Triple white{};
  for (double nm = kFirstObservedNm; nm <= kLastObservedNm; nm += 1) {
    const Triple rec709 = Rec709(CieObserver(nm));
    const auto value = static_cast<double>(polynomial.At(static_cast<float>(PolynomialPlace(nm))));
    for (std::size_t c = 0; c < 3; ++c) {
      seen[c] += rec709[c] * D65At(nm) * value;
      white[c] += rec709[c] * D65At(nm);
    }
  }
  for (std::size_t c = 0; c < 3; ++c)
    seen[c] /= white[c];
  return seen;
}

double LargestError(const Triple& seen, Rgb color) {
  double error = 0;
  for (std::size_t c = 0; c < 3; ++c)
    error = std::max(error, std::abs(seen[c] - static_cast<double>(color[static_cast<int>(c)])));
  return error;
}

TEST(UpliftTest, TheSpectrumOfAColorLooksLikeIt) {
  for (int r = 0; r <= 8; ++r) {
    for (int g = 0; g <= 8; ++g) {
      for (int b = 0; b <= 8; ++b) {
        const Rgb color = {static_cast<float>(r) / 8, static_cast<float>(g) / 8,
                           static_cast<float>(b) / 8};
        if (IsGray(color)) continue;
        EXPECT_LT(LargestError(SeenAs(FitReflectance(color)), color), kStep)
            << r << " " << g << " " << b;
      }
    }
  }
}

TEST(UpliftTest, ASpectrumIsSmoothAndBelowOne) {
  // The body of a coffee maker, of which red is 1.
  const SigmoidPolynomial red = FitReflectance({1, 0.378676F, 0.013473F});
  float before = red.At(-1);
  for (int i = 0; i <= 400; ++i) {
    const float value = red.At(-1 + static_cast<float>(i) / 200);
    ASSERT_GE(value, 0);
    ASSERT_LE(value, 1);
    ASSERT_LT(std::abs(value - before), 0.1F) << i;
    before = value;
  }
}

// Looked up between the entries of the table, over the wavelengths of many passes.
TEST(UpliftTest, ColorsOfPicturesLookLikeTheirSpectra) {
  constexpr int kPasses = 64;
  int off = 0;
  int all = 0;
  for (int r = 0; r < 7; ++r) {
    for (int g = 0; g < 7; ++g) {
      for (int b = 0; b < 7; ++b) {
        const Rgb color = {0.03F + 0.15F * static_cast<float>(r),
                           0.03F + 0.15F * static_cast<float>(g),
                           0.03F + 0.15F * static_cast<float>(b)};
        Triple mean{};
        for (int i = 0; i < kPasses; ++i) {
          const Uplift uplift(WavelengthsAt((i + 0.5) / kPasses));
          const Rgb values = uplift.Reflectance(color);
          const Triple seen = uplift.wavelengths().ToWorking({static_cast<double>(values.r),
                                                              static_cast<double>(values.g),
                                                              static_cast<double>(values.b)});
          for (std::size_t c = 0; c < 3; ++c)
            mean[c] += seen[c] / kPasses;
        }
        const double error = LargestError(ToRec709(mean), color);
        // Near the corners of the cube polynomials are steep, and what lies between two of them is
        // neither.
        EXPECT_LT(error, 3 * kStep) << r << " " << g << " " << b;
        off += error > kStep ? 1 : 0;
        ++all;
      }
    }
  }
  EXPECT_LT(off, all / 50);
}

TEST(UpliftTest, GreyIsTheSameAtAllWavelengths) {
  const Uplift uplift(WavelengthsAt(0.3));
  for (const float value : {0.0F, 0.2F, 0.5F, 1.0F}) {
    EXPECT_EQ(uplift.Reflectance(Gray(value)), Gray(value));
    EXPECT_EQ(uplift.Unbounded(Gray(8 * value)), Gray(8 * value));
  }
}

TEST(UpliftTest, WhatMayExceedOneIsAReflectanceTimesTwiceItsLargestChannel) {
  const Uplift uplift(WavelengthsAt(0.6));
  EXPECT_EQ(uplift.Unbounded({8, 4, 2}), uplift.Reflectance({0.5F, 0.25F, 0.125F}) * 16);
}

}  // namespace
}  // namespace lucerna
